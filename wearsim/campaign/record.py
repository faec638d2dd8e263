"""Records of single wear steps, from which the result file is written.

The result file is appended in place and may be damaged when the process ends during a
write. Each step is first written as a record: under another name, synchronised with the
disk, and renamed. A record is therefore complete or absent; its digest detects later
changes. After the digest it has a line of JSON, its label, which names type and shape
of each array, and the bytes of the arrays.
"""

from __future__ import annotations

import functools
import hashlib
import json
import math
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.campaign.state import State, flattened, rebuilt
from wearsim.errors import ResultError
from wearsim.quantities import QUANTITIES
from wearsim.results import (
    Header,
    append,
    attribute_of,
    create,
    open_whole,
    row_count,
    stored_rows,
    verify,
)
from wearsim.results.checks import new_row, step_limits
from wearsim.results.limits import ending_limits, first_met, limits_of, met_attributes
from wearsim.results.schema import CHANGES
from wearsim.whole_files import signals_wait, write_whole

_LARGEST = 1_000_000_000  # bytes of a record
# errors of reading a file of another format
_OTHER_FORMAT = (
    ValueError,
    KeyError,
    TypeError,
    AttributeError,
    ArithmeticError,
    RecursionError,
)


@contextmanager
def readable_errors(what: str, advice: str = "choose another --out") -> Iterator[None]:
    """Convert errors of the operating system to `ResultError` with advice."""
    try:
        yield
    except OSError as error:
        raise ResultError(f"{what}: {error.strerror}; {advice}") from error


def write_atomically(path: Path, content: bytes, *, durable: bool = True) -> None:
    """Write a file of a run directory atomically.

    At any time the file has its complete old or complete new content.
    """
    advice = (
        "finished steps are safe, make room or give write access and run the same "
        "command again"
    )
    write_whole(path, content, advice, durable=durable)


@dataclass(frozen=True)
class Records:
    """Records of one campaign: rows of its result file and their full states."""

    folder: Path
    campaign: str  # digest of all its input
    shapes: Mapping[str, tuple[int, ...]]  # of the variables of a row

    def path(self, index: int) -> Path:
        """Return the file of step `index`."""
        return self.folder / f"{index:08d}.record"

    def write(self, state: State, row: Mapping[str, np.ndarray], source: str) -> None:
        """Write the record of a step: its row, full state and program versions."""
        self._write(state.step, row, flattened(state), source)

    def write_row(self, index: int, row: Mapping[str, np.ndarray], source: str) -> None:
        """Write the record of a step whose full state is no longer available."""
        self._write(index, row, {}, source)

    def _write(
        self,
        index: int,
        row: Mapping[str, np.ndarray],
        parts: Mapping[str, np.ndarray],
        source: str,
    ) -> None:
        arrays = {name: np.asarray(row[name]) for name in self.shapes} | {**parts}
        label = {
            "campaign": self.campaign,
            "index": index,
            "source": source,
            "arrays": {
                name: (array.dtype.str, array.shape) for name, array in arrays.items()
            },
        }
        values = [array.tobytes() for array in arrays.values()]
        content = b"".join([json.dumps(label).encode(), b"\n", *values])
        with readable_errors(f"{self.folder} cannot be made"):
            self.folder.mkdir(exist_ok=True)
        write_atomically(self.path(index), hashlib.sha256(content).digest() + content)

    def label(self, index: int) -> dict[str, Any] | None:
        """Return the label that identifies the record of a step.

        None if the record is missing or damaged.
        """
        record = self._load(index)
        return None if record is None else record[0]

    def sources(self) -> list[str]:
        """Program versions of the intact records from step 0 on, without a gap.

        The last of them has a state, from which a campaign continues.

        Raises
        ------
        ResultError
            If the first record is one of another campaign, or of other variables.
        """
        first = self.label(0)
        if first is not None and first["campaign"] != self.campaign:
            raise ResultError(
                f"{self.folder} holds another campaign; nothing was changed, choose "
                "another --out"
            )
        older = first is None and any(self.folder.glob("*.npz"))
        if older or (first is not None and not self._is_of_campaign(first, 0)):
            raise self._other_version()
        sources: list[str] = []
        sound = 0
        while (label := self.label(len(sources))) is not None and self._is_of_campaign(
            label, len(sources)
        ):
            sources.append(label["source"])
            if any(map(_is_of_state, label["arrays"])):
                sound = len(sources)
        return sources[:sound]

    def row(self, index: int) -> dict[str, np.ndarray]:
        """Read the row of a step, whose record must exist."""
        arrays = self._arrays(index)
        return {name: arrays[name] for name in self.shapes}

    def state(self, index: int) -> State:
        """Read the state of a step bit by bit; its record must exist."""
        try:
            state: State = rebuilt(State, self._arrays(index))
        except KeyError:
            raise self._other_version() from None
        return state

    def remove(self) -> None:
        """Delete all records of the campaign."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _other_version(self) -> ResultError:
        return ResultError(
            f"{self.folder} holds steps of another version of wearsim; nothing was "
            "changed, choose another --out"
        )

    def _is_of_campaign(self, label: Mapping[str, Any], index: int) -> bool:
        shapes = {
            name: tuple(shape)
            for name, (_, shape) in label.get("arrays", {}).items()
            if not _is_of_state(name)
        }
        stated = label["campaign"], label.get("index"), shapes
        return stated == (self.campaign, index, self.shapes)

    def _arrays(self, index: int) -> dict[str, np.ndarray]:
        """Arrays of the row by name and of the state by path; the record must exist."""
        record = self._load(index)
        if record is None or not self._is_of_campaign(record[0], index):
            raise ResultError(
                f"{self.path(index)} was changed while the campaign ran; run the same "
                "command again"
            )
        return record[1]

    def _load(self, index: int) -> tuple[dict[str, Any], dict[str, np.ndarray]] | None:
        """Label and arrays of a record with the right digest.

        A record of another format has the label of no step.
        """
        try:
            if self.path(index).stat().st_size > _LARGEST:
                return None
            content = self.path(index).read_bytes()
        except OSError:
            return None
        if hashlib.sha256(content[32:]).digest() != content[:32]:
            return None
        text, _, values = content[32:].partition(b"\n")
        arrays, begin = dict[str, np.ndarray](), 0
        try:
            label = json.loads(text)
            for name, (kind, shape) in label["arrays"].items():
                flat = np.frombuffer(values, kind, math.prod(shape), begin)
                arrays[name] = flat.reshape(shape).copy()  # aligned, as kernels need it
                begin += flat.nbytes
        except _OTHER_FORMAT:
            begin = -1
        if begin != len(values):
            return {"campaign": self.campaign}, {}
        return label, arrays


def _is_of_state(name: str) -> bool:
    """Return True for the path of an array of the state, False for one of the row."""
    return name.startswith("/")


APPEND_INTERVAL = 5.0
"""Duration of steps below which their rows are appended together [s]."""

APPEND_AT_MOST = 64
"""Largest number of rows appended at a time."""


class Writer:
    """Records and result file of one campaign: `<name>.nc` and `.<name>.records`.

    `digest` is that of all input. A finished campaign keeps the record of its last
    step, `.<name>.last.record`, from which a longer campaign continues.
    """

    def __init__(self, header: Header, directory: Path, name: str, digest: str) -> None:
        self.header = header
        self.path = directory / f"{name}.nc"
        self.records = Records(
            directory / f".{name}.records", digest, header.row_shapes
        )
        self.rebuilt = False
        self._mark = mark_of(directory, name)
        self._last = directory / f".{name}.last.record"
        self._laws = header.static.get("fatigue_name", ())
        self._rows_in_file = 0
        self._patience: float | None = None
        self._failed = False
        self._sources: list[str] = []  # program versions behind each record
        # last rows written, which need not be read
        self._latest: dict[int, Mapping[str, np.ndarray]] = {}
        self._appended = 0.0

    def finished(self) -> bool:
        """Return True if the campaign was finished at the distance of the header.

        Raises
        ------
        ResultError
            If its file was changed since, or is that of another campaign.
        """
        mark = read_mark(self._mark)
        if mark is None:
            return False
        if mark["campaign"] != self.records.campaign:
            raise ResultError(
                f"{self.path} is the result of another campaign; nothing was changed, "
                "choose another --out"
            )
        if not self.path.exists():
            self._mark.unlink()  # the result file was removed: compute it again
            return False
        require_unchanged(self.path, mark)
        target = self.header.attributes.get("target_distance")
        if target != mark.get("distance", target):
            return False  # the distance was increased since
        self.records.remove()
        return True

    def recorded(self) -> int:
        """Return the number of steps recorded.

        Those of a finished campaign with an increased distance are included.
        """
        if (mark := read_mark(self._mark)) is not None:
            self._reopen(mark)
        self._sources = self.records.sources()
        return len(self._sources)

    def recover(self) -> int:
        """Restore the result file from the records; return the number of steps.

        These are the steps recorded.
        """
        count = self.recorded()
        if count == 0:
            if self.path.exists() and not self.records.folder.is_dir():
                raise ResultError(
                    f"{self.path} exists, but no steps of this campaign do; nothing "
                    "was changed, move it away or choose another --out"
                )
            return 0
        rows = verify(self.path, self._readers())
        self.rebuilt = rows is None and self.path.exists()
        if rows is None or attribute_of(
            self.path, CHANGES
        ) != self.header.attributes.get(CHANGES, ""):
            self._rebuild()
            rows = count
        self._rows_in_file = rows
        self.flush()
        return count

    def write(self, state: State, row: Mapping[str, np.ndarray]) -> bool:
        """Write record and row of a step; return True if the row waits for a reader."""
        source = str(self.header.attributes.get("source", ""))
        self.records.write(state, row, source)
        self._sources.append(source)
        self._latest[state.step] = row
        self._latest.pop(state.step - APPEND_AT_MOST, None)
        if state.step == 0:
            create(self.path, self.header, [row])
            self._rows_in_file = 1
            self._appended = time.monotonic()
            return False
        return time.monotonic() - self._appended >= APPEND_INTERVAL and self.flush()

    def flush(self) -> bool:
        """Append the recorded rows; return True if they wait for a reader."""
        if self._rows_in_file == len(self._sources) or self._failed:
            return False
        try:
            while self._rows_in_file < len(self._sources):
                first = self._rows_in_file
                # Append few rows at a time: a reader may have delayed a whole campaign.
                until = min(len(self._sources), first + APPEND_AT_MOST)
                rows = [self._row(index) for index in range(first, until)]
                # Wait for the reader at the first deferral; while it remains, try once
                # per step.
                append(self.path, self.header, rows, first, patience=self._patience)
                self._rows_in_file = until
        except ResultError:
            self._failed = (
                True  # the steps are recorded: the next start checks the file
            )
            raise
        except (OSError, RuntimeError):
            try:
                row_count(self.path)
            except ResultError:
                self.rebuilt = True
                self._rebuild()
            else:
                self._patience = 0.0
                return True
        self._patience = None
        self._rows_in_file = len(self._sources)
        self._appended = time.monotonic()
        return False

    def limit_met(self, row: Mapping[str, np.ndarray]) -> str | None:
        """Name the limit met by a row that ends the campaign, None if there is none."""
        return first_met(row, ending_limits(self.header.attributes), self._laws)

    def finish(self, closing: Callable[[Mapping[str, np.ndarray]], Header]) -> str:
        """Complete, verify and mark the result file; return why the campaign ended.

        The records are removed. `closing` gives static variables and attributes by the
        last row.
        """
        count, given = len(self._sources), self.header.attributes
        last = self.records.row(count - 1)
        met = self.limit_met(last)
        ended = f"limit of {QUANTITIES[met].meaning} met" if met else "distance reached"
        limits_met = met_attributes(
            (read() for read in self._readers()), limits_of(given), self._laws
        )
        used = {"source": _in_order_of_use(self._sources), "finished": ended}
        # written anew: smaller, and independent of readers of the appended file
        closed = closing(last)
        static, attributes = (
            {**self.header.static, **closed.static},
            {**given, **closed.attributes},
        )
        self._rebuild(
            replace(
                self.header,
                static=static,
                attributes={**attributes, **limits_met, **used},
            )
        )
        if verify(self.path, self._readers()) != count:
            raise ResultError(
                f"{self.path} does not read back as it was written; its steps are "
                "safe, check the disk and run the same command again"
            )
        write_atomically(self._last, self.records.path(count - 1).read_bytes())
        mark = {
            "campaign": self.records.campaign,
            "rows": count,
            "sha256": _sha256(self.path),
            "distance": given.get("target_distance"),
            "sources": _first_uses(self._sources),
        }
        write_atomically(self._mark, json.dumps(mark, indent=2).encode())
        self.records.remove()
        return ended

    def _reopen(self, mark: Mapping[str, Any]) -> None:
        """Restore the records of a finished campaign with an increased distance.

        All but the last have no state. The mark of completion is removed last, so that
        an interruption before it repeats the same.
        """
        count, first_uses = int(mark["rows"]), mark["sources"]
        if not self._last.is_file():
            raise ResultError(
                f"{self.path} cannot be made longer: its last state, {self._last}, is "
                "missing; nothing was changed, run the longer scene with another "
                "--out"
            )
        for index, row in enumerate(stored_rows(self.path)):
            *_, source = [
                source for source, first in first_uses.items() if first <= index
            ]
            self.records.write_row(index, row, source)
        write_atomically(self.records.path(count - 1), self._last.read_bytes())
        if len(self.records.sources()) != count:
            raise ResultError(
                f"{self.path} cannot be made longer: {self._last} is damaged; nothing "
                "was changed, run the longer scene with another --out"
            )
        self._mark.unlink()

    def _row(self, index: int) -> Mapping[str, np.ndarray]:
        row = self._latest.get(index)
        return self.records.row(index) if row is None else row

    def _rebuild(self, header: Header | None = None) -> None:
        create(self.path, header or self.header, (read() for read in self._readers()))

    def _readers(self) -> list[Callable[[], Mapping[str, np.ndarray]]]:
        return [
            functools.partial(self._row, index) for index in range(len(self._sources))
        ]


@signals_wait()
def outcome_of(path: Path) -> dict[str, Any]:
    """Return steps and their limits, distance and largest depth [m], reason of the end.

    The reason is that of a finished campaign.
    """
    with open_whole(path) as data:
        last = data.isel(step=-1)
        return {
            "step_limits": step_limits(data),
            "step": data.sizes["step"] - 1,
            "distance": float(last["distance"]),
            "worst_depth": float(last["max_wear_depth"].max()),
            "reprofiled": new_row(data, data.sizes["step"] - 1) > 0,
            "ended": str(data.attrs["finished"]),
            "left_out": int(last["left_out"].sum()) if "left_out" in data else 0,
            "left_out_share": float(last["left_out_share"])
            if "left_out" in data
            else 0.0,
        }


def mark_of(directory: Path, name: str) -> Path:
    """Return the path of the file that marks a campaign as finished."""
    return directory / f".{name}.finished.json"


def read_mark(path: Path) -> dict[str, Any] | None:
    """Read the mark of a finished campaign: digest, number of rows, hash of its file.

    None without a mark.
    """
    try:
        mark: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return {**mark, "campaign": mark["campaign"], "sha256": mark["sha256"]}
    except (OSError, ValueError, KeyError, TypeError):
        return None


def require_unchanged(path: Path, mark: Mapping[str, Any]) -> None:
    """Raise an error unless the file of a finished campaign is unchanged."""
    if _sha256(path) != mark["sha256"]:
        raise ResultError(
            f"{path} was changed after its campaign had finished; nothing was changed, "
            f"move it away to have it computed again"
        )


def _in_order_of_use(sources: list[str]) -> str:
    """List each program version once, with the step of its first use."""
    (first, _), *later = _first_uses(sources).items()
    return "; ".join(
        [first, *(f"from step {index} on {source}" for source, index in later)]
    )


def _first_uses(sources: list[str]) -> dict[str, int]:
    """Step of the first use of each program version, in their order."""
    return {source: sources.index(source) for source in dict.fromkeys(sources)}


def _sha256(path: Path) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
