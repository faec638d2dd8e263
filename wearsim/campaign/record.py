"""Records of single wear steps: the safe copy a campaign is continued from.

The result file is appended in place and can be damaged when the process dies in the middle; a record is
written beside it first, under another name, brought to the disk and renamed.  A record is therefore whole
or absent; its digest guards against what a file system may still do to it.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import os
import shutil
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.campaign.choose import choice_of
from wearsim.campaign.counterface_row import counterface_of
from wearsim.campaign.state import State
from wearsim.errors import ResultError
from wearsim.results import FILL_FLOAT, ROW
from wearsim.results.schema import RENAMED


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
        np.savez(
            buffer, allow_pickle=False, label=label, digest=digest, payload=np.frombuffer(payload, np.uint8)
        )
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


def state_of(row: Mapping[str, np.ndarray], index: int) -> State:
    """Return the state that a row holds, bit by bit.

    Parameters
    ----------
    row : mapping of arrays
        Row of the result file.
    index : int
        Its step.
    """
    return State(
        step=index,
        distance=float(row["distance"]),
        y=row["profile_y"],
        z=row["profile_z"],
        wear_depth=row["wear_depth"],
        regime_depth=row["wear_depth_by_regime"],
        worn_area=row["worn_area"],
        worn_mass=row["worn_mass"],
        step_length=float(row["step_length"]),
        step_error=_known(row["step_error"]),
        choice=choice_of(row),
        comparison_depth=_by_law(row, "comparison_wear_depth"),
        comparison_area=row.get("comparison_worn_area", np.zeros((2, 0))),
        fatigue_damage=_by_law(row, "fatigue_damage"),
        counterface=counterface_of(row),
        turned=int(row.get("last_reprofiling", 0)),
    )


def _by_law(row: Mapping[str, np.ndarray], name: str) -> tuple[np.ndarray, ...]:
    return tuple(row[name].swapaxes(0, 1)) if name in row else ()


def _known(value: np.ndarray) -> float | None:
    return None if value == FILL_FLOAT else float(value)
