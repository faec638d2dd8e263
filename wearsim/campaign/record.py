"""Records of single wear steps: the safe copy a campaign is continued from.

The result file is appended in place and can be damaged when the process dies in the middle; a record is
written beside it first, under another name, brought to the disk and renamed.  A record is therefore whole
or absent; its digest guards against what a file system may still do to it.
"""

from __future__ import annotations

import functools
import hashlib
import io
import json
import math
import os
import shutil
import time
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.errors import ResultError
from wearsim.quantities import QUANTITIES
from wearsim.results import ROW, Header, append, create, open_results, row_count, row_names, verify
from wearsim.results.limits import ending_limits, first_met, limits_of, met_attributes
from wearsim.results.older import RENAMED


def write_atomically(path: Path, content: bytes, *, durable: bool = True) -> None:
    """Write a file so that `path` always is the whole old or the whole new content.

    Parameters
    ----------
    path : Path
        File to write.
    content : bytes
        New content.
    durable : bool
        Whether to wait until the disk has it, so that it survives a power failure.

    Raises
    ------
    ResultError
        If the disk is full or the directory cannot be written.
    """
    temporary = path.with_name(f".{path.name}.tmp")
    try:
        with open(temporary, "wb") as file:
            file.write(content)
            if durable:
                file.flush()
                os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        raise ResultError(
            f"{path} cannot be written: {error.strerror}; finished steps are safe, make room or "
            f"give write access and run the same command again"
        ) from error


@dataclass(frozen=True)
class Records:
    """The records of one campaign.

    Parameters
    ----------
    folder : Path
        Where they are.
    campaign : str
        Digest of the campaign they must belong to.
    names : tuple of str
        Variables of a row.
    """

    folder: Path
    campaign: str
    names: tuple[str, ...] = ROW

    def path(self, index: int) -> Path:
        """Return the file of step `index`."""
        return self.folder / f"{index:08d}.npz"

    def write(self, index: int, row: Mapping[str, np.ndarray], source: str) -> None:
        """Write the record of step `index`.

        Parameters
        ----------
        index : int
            Step.
        row : mapping of arrays
            Row of the result file; it holds the full state.
        source : str
            Program versions that computed it.
        """
        arrays = {name: np.asarray(row[name]) for name in self.names}
        layout = {name: (value.dtype.str, value.shape) for name, value in arrays.items()}
        payload = b"".join(arrays[name].tobytes() for name in layout)
        label = json.dumps({"campaign": self.campaign, "index": index, "source": source, "layout": layout})
        digest = hashlib.sha256(label.encode() + payload).hexdigest()
        buffer = io.BytesIO()
        # one array for all values: fifty small ones would cost more than the disk does
        values = np.frombuffer(payload, np.uint8)
        np.savez(buffer, allow_pickle=False, label=label, digest=digest, payload=values)
        try:
            self.folder.mkdir(exist_ok=True)
        except OSError as error:
            raise ResultError(
                f"{self.folder} cannot be made: {error.strerror}; choose another --out"
            ) from error
        write_atomically(self.path(index), buffer.getvalue())

    def read(self, index: int) -> tuple[dict[str, np.ndarray], str] | None:
        """Read the record of step `index`, None if it is missing, torn or of another campaign.

        Parameters
        ----------
        index : int
            Step.

        Returns
        -------
        tuple of dict and str
            Row of the result file, and the program versions that computed it.
        """
        found = self._load(index)
        if found is None or found[0]["campaign"] != self.campaign or found[0]["index"] != index:
            return None
        label, payload = found
        arrays = {}
        for name, (kind, shape) in label["layout"].items():
            dtype = np.dtype(kind)
            size = dtype.itemsize * math.prod(shape)
            arrays[RENAMED.get(name, name)] = np.frombuffer(payload[:size], dtype).reshape(shape)
            payload = payload[size:]
        return (arrays, str(label["source"])) if set(arrays) == set(self.names) else None

    def row(self, index: int) -> dict[str, np.ndarray]:
        """Read the row of a step that is known to be there.

        Parameters
        ----------
        index : int
            Step.
        """
        found = self.read(index)
        if found is None:
            raise ResultError(
                f"{self.path(index)} was changed while the campaign ran; run the same command again"
            )
        return found[0]

    def refuse_other_campaign(self) -> None:
        """Raise if the first record is sound but of another campaign."""
        found = self._load(0)
        if found is not None and found[0]["campaign"] != self.campaign:
            raise ResultError(
                f"{self.folder} holds another campaign's steps; nothing was touched, choose another --out"
            )

    def count(self) -> int:
        """Return how many records, from step 0 on without gap, are sound."""
        count = 0
        while self.read(count) is not None:
            count += 1
        return count

    def sources(self, count: int) -> str:
        """Name the program versions behind the first `count` records, in order of first use.

        Parameters
        ----------
        count : int
            Number of records.
        """
        seen: dict[str, int] = {}
        for index in range(count):
            found = self.read(index)
            if found is not None:
                seen.setdefault(found[1], index)
        first, *later = seen.items() or [("", 0)]
        return "; ".join([first[0], *(f"from step {index} on {source}" for source, index in later)])

    def remove(self) -> None:
        """Delete all records of the campaign."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _load(self, index: int) -> tuple[dict[str, Any], memoryview] | None:
        """Label and values of a record whose digest is right."""
        try:
            with open(self.path(index), "rb") as record, np.load(record, allow_pickle=False) as file:
                label, digest, payload = str(file["label"]), str(file["digest"]), file["payload"]
        except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile):
            return None
        if digest != hashlib.sha256(label.encode() + payload.tobytes()).hexdigest():
            return None
        return json.loads(label), memoryview(payload)


APPEND_INTERVAL = 0.5
"""Rows of steps faster than this are appended together: opening the file costs more than a short step [s]."""

APPEND_AT_MOST = 16
"""So many rows are held in memory to be appended."""


class Writer:
    """Keeps records and result file of one campaign in step.

    Parameters
    ----------
    header : Header
        Static part of the result file.
    directory : Path
        Run directory.
    name : str
        Of the campaign; the file is `<name>.nc`, the records are in `.<name>.records`.
    digest : str
        Tells campaigns apart.
    """

    def __init__(self, header: Header, directory: Path, name: str, digest: str) -> None:
        self.header = header
        self.path = directory / f"{name}.nc"
        self.records = Records(directory / f".{name}.records", digest, row_names(header.static))
        self.rebuilt = False
        self._mark = directory / f".{name}.finished.json"
        self._rows_in_file = 0
        self._patience: float | None = None
        self._failed = False
        self._count = 0
        self._appended = 0.0

    def finished(self) -> bool:
        """Tell whether the campaign was finished before; raise if its file was changed since."""
        try:
            mark = json.loads(self._mark.read_text(encoding="utf-8"))
            campaign, digest = mark["campaign"], mark["sha256"]
        except (OSError, ValueError, KeyError, TypeError):
            return False
        if campaign != self.records.campaign:
            raise ResultError(
                f"{self.path} is the result of another campaign; nothing was touched, choose another --out"
            )
        if not self.path.exists():
            self._mark.unlink()  # the user removed the result: compute it again
            return False
        if _sha256(self.path) != digest:
            raise ResultError(
                f"{self.path} was changed after its campaign had finished; nothing was touched, "
                f"move it away to have it computed again"
            )
        self.records.remove()
        return True

    def outcome(self) -> dict[str, Any]:
        """Read steps, distance [m], largest depth [m] and reason of the end of the finished file."""
        with open_results(self.path) as data:
            last = data.isel(step=-1)
            return {
                "step": data.sizes["step"] - 1,
                "distance": float(last["distance"]),
                "worst_depth": float(last["max_wear_depth"].max()),
                "ended": str(data.attrs["finished"]),
            }

    def recover(self) -> int:
        """Bring the result file to the state of the records; return how many steps are recorded."""
        self.records.refuse_other_campaign()
        self._count = count = self.records.count()
        if count == 0:
            if self.path.exists() and not self.records.folder.is_dir():
                raise ResultError(
                    f"{self.path} exists, but no steps of this campaign do; nothing was touched, "
                    f"move it away or choose another --out"
                )
            return 0
        rows = verify(self.path, self._readers())
        if rows is None:
            self.rebuilt = self.path.exists()
            self._rebuild()
            rows = count
        self._rows_in_file = rows
        self.flush()
        return count

    def write(self, index: int, row: Mapping[str, np.ndarray]) -> bool:
        """Write record and row of one step; return True if the row has to wait for a reader."""
        self.records.write(index, row, str(self.header.attributes.get("source", "")))
        self._count = index + 1
        if index == 0:
            create(self.path, self.header, [row])
            self._rows_in_file = 1
            self._appended = time.monotonic()
            return False
        if time.monotonic() - self._appended < APPEND_INTERVAL:
            return False
        return self.flush()

    def flush(self) -> bool:
        """Append the rows that are recorded only; return True if they have to wait for a reader."""
        if self._rows_in_file == self._count or self._failed:
            return False
        try:
            while self._rows_in_file < self._count:
                first = self._rows_in_file
                # of the rows that a reader kept waiting, few at a time: they may be a whole campaign
                until = min(self._count, first + APPEND_AT_MOST)
                rows = [self.records.row(index) for index in range(first, until)]
                # met for the first time, a reader gets its second; as long as it stays, each step asks once
                append(self.path, self.header, rows, first, patience=self._patience)
                self._rows_in_file = until
        except ResultError:
            self._failed = True  # the steps are in their records: the next start looks at the file
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

    def finish(self) -> str:
        """Bring the file up to date, verify it against the records, mark it finished, drop the records.

        Returns
        -------
        str
            Why the campaign ended.
        """
        count = self._count
        given = self.header.attributes
        limits = limits_of(given)
        laws = self.header.static.get("fatigue_name", ())
        met = first_met(self.records.row(count - 1), ending_limits(given), laws)
        ended = f"limit of {QUANTITIES[met].meaning} met" if met else "distance reached"
        attributes = {
            **given,
            **met_attributes((read() for read in self._readers()), limits, laws),
            "source": self.records.sources(count),
            "finished": ended,
        }
        header = replace(self.header, attributes=attributes)
        # written anew in one go: also right while a reader holds the appended file, and smaller
        self._rebuild(header)
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


def _sha256(path: Path) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
