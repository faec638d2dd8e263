"""Records of single wear steps, and the result file that follows them.

The result file is appended in place and may be damaged when the process ends during a write. Each step is
first written as a record: under another name, synchronised with the disk, and renamed. A record is therefore
complete or absent; its digest detects later changes.
"""

from __future__ import annotations

import functools
import hashlib
import io
import json
import math
import shutil
import time
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.errors import ResultError
from wearsim.quantities import QUANTITIES
from wearsim.results import (
    Header,
    append,
    attribute_of,
    create,
    layout_of,
    open_results,
    row_count,
    row_names,
    verify,
)
from wearsim.results.checks import step_limits
from wearsim.results.limits import ending_limits, first_met, limits_of, met_attributes
from wearsim.results.schema import CHANGES, RENAMED
from wearsim.whole_files import write_whole

_LARGEST_RECORD = 200_000_000  # bytes

MEMORY = "memory: "
"""Beginning of the names of what a record holds besides the row of the result file."""


@contextmanager
def readable_errors(what: str, advice: str = "choose another --out") -> Iterator[None]:
    """Raise a ResultError with the reason and advice where the operating system fails."""
    try:
        yield
    except OSError as error:
        raise ResultError(f"{what}: {error.strerror}; {advice}") from error


def write_atomically(path: Path, content: bytes, *, durable: bool = True) -> None:
    """Write a file of a run directory, which always has the complete old or the complete new content."""
    advice = "finished steps are safe, make room or give write access and run the same command again"
    write_whole(path, content, advice, durable=durable)


@dataclass(frozen=True)
class Records:
    """The records of one campaign."""

    folder: Path
    campaign: str  # digest of all its input
    shapes: Mapping[str, tuple[int, ...]]  # of the variables of a row

    def path(self, index: int) -> Path:
        """Return the file of step `index`."""
        return self.folder / f"{index:08d}.npz"

    def write(
        self, index: int, row: Mapping[str, np.ndarray], source: str, memory: Mapping[str, np.ndarray] = {}
    ) -> None:
        """Write the record of step `index`: its row and the program versions.

        Row and `memory`, of which the result file has nothing, hold the full state.
        """
        arrays = {name: np.asarray(row[name]) for name in self.shapes}
        arrays |= {f"{MEMORY}{name}": np.asarray(value) for name, value in memory.items()}
        layout = {name: (value.dtype.str, value.shape) for name, value in arrays.items()}
        payload = b"".join(arrays[name].tobytes() for name in layout)
        label = json.dumps({"campaign": self.campaign, "index": index, "source": source, "layout": layout})
        digest = hashlib.sha256(label.encode() + payload).hexdigest()
        buffer = io.BytesIO()
        # one array for all values is faster than fifty small ones
        values = np.frombuffer(payload, np.uint8)
        np.savez(buffer, allow_pickle=False, label=label, digest=digest, payload=values)
        with readable_errors(f"{self.folder} cannot be made"):
            self.folder.mkdir(exist_ok=True)
        write_atomically(self.path(index), buffer.getvalue())

    def read(self, index: int) -> tuple[dict[str, np.ndarray], str] | None:
        """Row of step `index` and the program versions behind it.

        None if the record is missing, damaged or of another campaign.
        """
        record = self._load(index)
        if record is None:
            return None
        label, payload = record
        if label["campaign"] != self.campaign or label["index"] != index:
            return None
        arrays = {}
        for name, (kind, shape) in label["layout"].items():
            dtype = np.dtype(kind)
            size = dtype.itemsize * math.prod(shape)
            arrays[RENAMED.get(name, name)] = np.frombuffer(payload[:size], dtype).reshape(shape)
            payload = payload[size:]
        of_row = {name for name in arrays if not name.startswith(MEMORY)}
        sound = {name: arrays[name].shape for name in of_row} == self.shapes
        return (arrays, str(label["source"])) if sound else None

    def row(self, index: int) -> dict[str, np.ndarray]:
        """Read the row of a step whose record must exist."""
        return {name: value for name, value in self.entries(index).items() if not name.startswith(MEMORY)}

    def entries(self, index: int) -> dict[str, np.ndarray]:
        """Read row and memory of a step whose record must exist."""
        record = self.read(index)
        if record is None:
            raise ResultError(
                f"{self.path(index)} was changed while the campaign ran; run the same command again"
            )
        return record[0]

    def other_version(self) -> bool:
        """Whether the first record is sound, but has other variables."""
        return self._load(0) is not None and self.read(0) is None

    def require_own_campaign(self) -> None:
        """Raise if the first record belongs to another campaign."""
        record = self._load(0)
        if record is not None and record[0]["campaign"] != self.campaign:
            raise ResultError(
                f"{self.folder} holds another campaign; nothing was changed, choose another --out"
            )

    def sources(self) -> list[str]:
        """Return the program versions behind each of the valid records from step 0 on without gap."""
        sources: list[str] = []
        while (record := self.read(len(sources))) is not None:
            sources.append(record[1])
        return sources

    def remove(self) -> None:
        """Delete all records of the campaign."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _load(self, index: int) -> tuple[dict[str, Any], memoryview] | None:
        """Label and values of a record with the right digest."""
        try:
            with open(self.path(index), "rb") as record, np.load(record, allow_pickle=False) as file:
                if sum(part.file_size for part in file.zip.infolist()) > _LARGEST_RECORD:
                    return None
                label, digest, payload = str(file["label"]), str(file["digest"]), file["payload"]
        except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile):
            return None
        found = hashlib.sha256(label.encode())
        found.update(payload)
        if digest != found.hexdigest():
            return None
        return json.loads(label), memoryview(payload)


APPEND_INTERVAL = 2.0
"""Rows of steps faster than this are appended together [s]."""

APPEND_AT_MOST = 16
"""Largest number of rows appended at a time."""


class Writer:
    """Records and result file of one campaign: `<name>.nc` and `.<name>.records`; `digest` of all input."""

    def __init__(self, header: Header, directory: Path, name: str, digest: str) -> None:
        self.header = header
        self.path = directory / f"{name}.nc"
        layout, sizes = layout_of(header.static), header.sizes
        shapes = {
            name: tuple(sizes[each] for each in layout[name].dimensions if each != "step")
            for name in row_names(header.static)
        }
        self.records = Records(directory / f".{name}.records", digest, shapes)
        self.rebuilt = False
        self._mark = directory / f".{name}.finished.json"
        self._rows_in_file = 0
        self._patience: float | None = None
        self._failed = False
        self._sources: list[str] = []  # program versions behind each record
        self._appended = 0.0

    @property
    def _count(self) -> int:
        """Number of records."""
        return len(self._sources)

    def finished(self) -> bool:
        """Whether the campaign was finished before; raise if its file was changed since."""
        try:
            mark = json.loads(self._mark.read_text(encoding="utf-8"))
            campaign, digest = mark["campaign"], mark["sha256"]
        except (OSError, ValueError, KeyError, TypeError):
            return False
        if campaign != self.records.campaign:
            raise ResultError(
                f"{self.path} is the result of another campaign; nothing was changed, choose another --out"
            )
        if not self.path.exists():
            self._mark.unlink()  # the result was removed: compute it again
            return False
        if _sha256(self.path) != digest:
            raise ResultError(
                f"{self.path} was changed after its campaign had finished; nothing was changed, "
                f"move it away to have it computed again"
            )
        self.records.remove()
        return True

    def outcome(self) -> dict[str, Any]:
        """Return steps and their limits, distance and largest depth [m], and why a finished one ended."""
        with open_results(self.path) as data:
            last = data.isel(step=-1)
            return {
                "step_limits": step_limits(data),
                "step": data.sizes["step"] - 1,
                "distance": float(last["distance"]),
                "worst_depth": float(last["max_wear_depth"].max()),
                "ended": str(data.attrs["finished"]),
                "left_out": int(last["left_out"].sum()) if "left_out" in data else 0,
                "left_out_share": float(last["left_out_share"]) if "left_out" in data else 0.0,
            }

    def recover(self) -> int:
        """Bring the result file to the state of the records; return the number of steps recorded."""
        self.records.require_own_campaign()
        self._sources = self.records.sources()
        count = self._count
        if count == 0:
            if self.records.other_version():
                raise ResultError(
                    f"{self.records.folder} holds steps of another version of wearsim; nothing was changed, "
                    f"choose another --out"
                )
            if self.path.exists() and not self.records.folder.is_dir():
                raise ResultError(
                    f"{self.path} exists, but no steps of this campaign do; nothing was changed, "
                    f"move it away or choose another --out"
                )
            return 0
        rows = verify(self.path, self._readers())
        self.rebuilt = rows is None and self.path.exists()
        if rows is None or self._changes() != self.header.attributes.get(CHANGES, ""):
            self._rebuild()
            rows = count
        self._rows_in_file = rows
        self.flush()
        return count

    def _changes(self) -> str:
        return attribute_of(self.path, CHANGES)

    def write(self, index: int, row: Mapping[str, np.ndarray], memory: Mapping[str, np.ndarray] = {}) -> bool:
        """Write record and row of one step; return True if the row waits for a reader."""
        source = str(self.header.attributes.get("source", ""))
        self.records.write(index, row, source, memory)
        self._sources.append(source)
        if index == 0:
            create(self.path, self.header, [row])
            self._rows_in_file = 1
            self._appended = time.monotonic()
            return False
        if time.monotonic() - self._appended < APPEND_INTERVAL:
            return False
        return self.flush()

    def flush(self) -> bool:
        """Append the recorded rows; return True if they wait for a reader."""
        if self._rows_in_file == self._count or self._failed:
            return False
        try:
            while self._rows_in_file < self._count:
                first = self._rows_in_file
                # few rows at a time: a reader may have kept a whole campaign waiting
                until = min(self._count, first + APPEND_AT_MOST)
                rows = [self.records.row(index) for index in range(first, until)]
                # at the first deferral wait for the reader; while it stays, try once per step
                append(self.path, self.header, rows, first, patience=self._patience)
                self._rows_in_file = until
        except ResultError:
            self._failed = True  # the steps are in their records: the next start checks the file
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
        self._rows_in_file = self._count
        self._appended = time.monotonic()
        return False

    def limit_met(self, row: Mapping[str, np.ndarray]) -> str | None:
        """Name the limit met by a row that ends the campaign, None if there is none."""
        laws = self.header.static.get("fatigue_name", ())
        return first_met(row, ending_limits(self.header.attributes), laws)

    def finish(self) -> str:
        """Write and verify the complete file, mark it finished, remove the records; return why it ended."""
        count, given = self._count, self.header.attributes
        laws = self.header.static.get("fatigue_name", ())
        met = self.limit_met(self.records.row(count - 1))
        ended = f"limit of {QUANTITIES[met].meaning} met" if met else "distance reached"
        attributes = {
            **given,
            **met_attributes((read() for read in self._readers()), limits_of(given), laws),
            "source": _in_order_of_use(self._sources),
            "finished": ended,
        }
        # written anew: smaller, and independent of readers of the appended file
        self._rebuild(replace(self.header, attributes=attributes))
        if verify(self.path, self._readers()) != count:
            raise ResultError(
                f"{self.path} does not read back as it was written; its steps are safe, "
                f"check the disk and run the same command again"
            )
        mark = {"campaign": self.records.campaign, "rows": count, "sha256": _sha256(self.path)}
        write_atomically(self._mark, json.dumps(mark, indent=2).encode())
        self.records.remove()
        return ended

    def _rebuild(self, header: Header | None = None) -> None:
        create(self.path, header or self.header, (read() for read in self._readers()))

    def _readers(self) -> list[Callable[[], dict[str, np.ndarray]]]:
        return [functools.partial(self.records.row, index) for index in range(self._count)]


def _in_order_of_use(sources: list[str]) -> str:
    """Each program version once, with the step of its first use."""
    first, *later = dict.fromkeys(sources)
    return "; ".join([first, *(f"from step {sources.index(source)} on {source}" for source in later)])


def _sha256(path: Path) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
