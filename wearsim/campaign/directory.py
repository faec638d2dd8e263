"""The run directory: exclusive lock, copy of the scene, status."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import filelock

from wearsim import __version__
from wearsim.campaign.record import readable_errors, write_atomically
from wearsim.errors import ResultError
from wearsim.scene.inputs import INPUTS
from wearsim.whole_files import read_json, require_utf8

SCENE_FOLDER = "scene"
MANIFEST = "manifest.json"
STATUS = "status.json"
PAIR = "compare.json"
"""File in the directory of two campaigns of one kind, which run in folders of it."""
_LOCK = ".lock"
_PATIENCE = 0.2  # `is_locked` holds the lock for an instant [s]
_OURS = ("rig.nc", "field.nc", "translation.nc", "report.html", STATUS, SCENE_FOLDER)


@dataclass(frozen=True)
class SceneFiles:
    """Files of a scene."""

    main: str  # name of the scene file
    files: Mapping[str, bytes]  # content by relative name, `main` among them

    @property
    def hashes(self) -> dict[str, str]:
        """SHA-256 by name."""
        return {
            name: hashlib.sha256(self.files[name]).hexdigest()
            for name in sorted(self.files)
        }


@dataclass(frozen=True)
class Change:
    """Change of a scene key, from a step of one of its campaigns on."""

    campaign: str  # rig or field
    step: int  # first one computed with it
    key: str
    old: float | str | None
    new: float | str | None


@dataclass(frozen=True)
class Manifest:
    """Campaign of a run directory."""

    main: str  # name of the scene file in the scene folder
    hashes: Mapping[str, str]  # SHA-256 of each copied file
    command: str  # command line that started it
    version: str = ""  # of wearsim that started it; no other one continues it
    changes: tuple[Change, ...] = ()  # in the order they were made


@contextmanager
def locked(out: Path) -> Iterator[None]:
    """Lock a run directory exclusively; the directory is created if missing.

    Raises
    ------
    ResultError
        If the directory cannot be made or written, or another run holds the lock.
    """
    require_utf8(out)
    with readable_errors(f"{out} cannot be made a run directory"):
        out.mkdir(parents=True, exist_ok=True)
    with readable_errors(f"{out} cannot be written"):
        lock = acquired(out, out / _LOCK, _PATIENCE, "run works")
    try:
        yield
    finally:
        lock.release()


def acquired(out: Path, file: Path, patience: float, doing: str) -> filelock.FileLock:
    """Acquire and return the lock of a directory.

    `doing` describes what another process that holds it does.

    Raises
    ------
    ResultError
        If another process holds it for longer than `patience` [s].
    """
    lock = filelock.FileLock(file, timeout=patience)
    try:
        lock.acquire()
    except filelock.Timeout:  # Timeout is an OSError
        raise ResultError(
            f"another wearsim {doing} in {out}; wait for it (see `wearsim status "
            f"{out}`) or choose another --out"
        ) from None
    return lock


def require_own_directory(out: Path) -> None:
    """Raise an error if `out` has files with result names but no campaign.

    The directory need not exist.
    """
    with readable_errors(f"{out} cannot be read"):
        if is_claimed(out) or not out.is_dir():
            return
        present = [name for name in _OURS if (out / name).exists()]
    if present:
        raise ResultError(
            f"{out} already holds {', '.join(present)} but no "
            f"{SCENE_FOLDER}/{MANIFEST}: not a run directory of wearsim; nothing was "
            "changed, choose another --out"
        )


def claim(out: Path, scene: SceneFiles, command: str) -> Manifest:
    """Make the locked directory `out` the run directory of a scene.

    The scene is started by a command line.

    Returns
    -------
    Manifest
        Of this start, or of an earlier one of the same scene, which may have had
        another distance.

    Raises
    ------
    ResultError
        If the directory belongs to another campaign; nothing is changed then.
    """
    require_own_directory(out)
    folder = out / SCENE_FOLDER
    if is_claimed(out):
        manifest = read_manifest(out)
        require_same_scene(out, manifest, scene)
        return manifest
    manifest = Manifest(scene.main, scene.hashes, command, __version__)
    temporary = out / f".{SCENE_FOLDER}.tmp"
    with readable_errors(f"{folder} cannot be written"):
        if temporary.exists():  # left by a start that was killed here
            shutil.rmtree(temporary)
        for name, content in scene.files.items():
            path = temporary / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        write_atomically(
            temporary / MANIFEST, json.dumps(asdict(manifest), indent=2).encode()
        )
        os.replace(temporary, folder)
    return manifest


def require_same_scene(
    out: Path, manifest: Manifest, scene: SceneFiles
) -> tuple[str, ...]:
    """Raise an error unless the manifest of a run directory belongs to a scene.

    Distances may differ.

    Returns
    -------
    tuple of str
        The campaigns, rig or field, whose scene has another distance.
    """
    names = sorted({*manifest.hashes, *scene.hashes})
    differing = [
        name for name in names if manifest.hashes.get(name) != scene.hashes.get(name)
    ]
    if manifest.main == scene.main and not differing:
        return ()
    if campaigns := _campaigns_of_other_distance(out / SCENE_FOLDER, scene):
        return campaigns
    what = f"not the same as in {out / SCENE_FOLDER}: {', '.join(differing)}"
    if manifest.main != scene.main:
        what = f"it was started with {manifest.main}, not {scene.main}"
    raise ResultError(
        f"{out} belongs to another campaign: {what}; nothing was changed, "
        f"choose another --out, or continue that one: `wearsim resume {out}`"
    )


def _campaigns_of_other_distance(folder: Path, scene: SceneFiles) -> tuple[str, ...]:
    """Campaigns of a scene that differs from the copied one in distances alone.

    The result is empty if the scenes do not differ.
    """
    campaigns = []
    try:
        roles, copied = (
            json.loads(text)
            for text in (scene.files[INPUTS], (folder / INPUTS).read_bytes())
        )
        if roles.keys() != copied.keys():
            return ()
        for role, name in roles.items():
            content, copied_content = (
                scene.files[name],
                (folder / copied[role]).read_bytes(),
            )
            if content != copied_content:
                campaigns.append(_kind_but_for_distance(content, copied_content))
    except (
        OSError,
        ValueError,
        KeyError,
        TypeError,
        AttributeError,
    ):  # not a scene file
        return ()
    return tuple(dict.fromkeys(campaigns))


def _kind_but_for_distance(*contents: bytes) -> str:
    """Kind of two scene files that differ in the distance of the campaign alone.

    Raises ValueError for other files.
    """
    scene, copied_scene = (
        tomllib.loads(content.decode("utf-8-sig")) for content in contents
    )
    distances = [
        table["campaign"].pop("distance_km") for table in (scene, copied_scene)
    ]
    if scene != copied_scene or distances[0] == distances[1]:
        raise ValueError
    return str(scene["scene"]["kind"])


def campaigns_of(out: Path, manifest: Manifest) -> tuple[str, ...]:
    """Names of the campaigns of a run directory: rig, field or both."""
    text = (out / SCENE_FOLDER / manifest.main).read_text(encoding="utf-8-sig")
    kind = tomllib.loads(text)["scene"]["kind"]
    return ("rig", "field") if kind == "compare" else (str(kind),)


def names_of_pair(out: Path) -> tuple[str, ...]:
    """Names of two campaigns of one kind in a directory, () if it is not of a pair."""
    path = out / PAIR
    if not path.is_file():
        return ()
    try:
        return tuple(map(str, read_json(path)["campaigns"]))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ResultError(
            f"{path} is damaged ({error}); run the scene again, what is finished stays"
        ) from error


def has_uncertainty(out: Path) -> bool:
    """Return True if the scene of a run directory states [uncertainty].

    False for a directory without a readable scene.
    """
    folder = out / SCENE_FOLDER
    try:
        main = folder / str(read_json(folder / MANIFEST)["main"])
        scene = tomllib.loads(main.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, KeyError, TypeError):
        return False
    return "uncertainty" in scene


def is_claimed(out: Path) -> bool:
    """Return True for a run directory; the directory need not exist."""
    return (out / SCENE_FOLDER / MANIFEST).is_file()


def read_manifest(out: Path) -> Manifest:
    """Read the manifest of a run directory and check its copy of the scene.

    Raises
    ------
    ResultError
        If it is not a run directory, or the copied scene was changed.
    """
    folder = out / SCENE_FOLDER
    if out.is_file():
        raise ResultError(f"{out} is a file; give the run directory, {out.parent}")
    if (out / "sweep.json").is_file():
        raise ResultError(
            f"{out} is the directory of a sweep; the command that began it continues "
            f"it: `wearsim sweep SCENE --out {out}`"
        )
    if pair := names_of_pair(out):
        folders = " or ".join(str(out / name) for name in pair)
        raise ResultError(
            f"{out} holds two campaigns, each in a run directory of its own; give "
            f"{folders}"
        )
    try:
        content = read_json(folder / MANIFEST)
        changes = tuple(Change(**change) for change in content.get("changes", ()))
        inputs = str(content["main"]), dict(content["hashes"]), str(content["command"])
        manifest = Manifest(*inputs, str(content.get("version", "")), changes)
        names = [manifest.main, *manifest.hashes]
        present = {
            name: hashlib.sha256((folder / name).read_bytes()).hexdigest()
            for name in names
        }
    except FileNotFoundError as error:
        raise ResultError(
            f"{out} is not a run directory ({error.filename} is missing); "
            f"start one with `wearsim run SCENE --out {out}`"
        ) from error
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ResultError(
            f"{folder / MANIFEST} cannot be read ({error}); start again with `wearsim "
            "run` and another --out"
        ) from error
    changed = [
        name for name, digest in manifest.hashes.items() if present[name] != digest
    ]
    if changed:
        raise ResultError(
            f"{folder}: {', '.join(changed)} changed since the campaign started; undo "
            "the change, or start the changed scene with `wearsim run` and another "
            "--out"
        )
    return manifest


def is_locked(out: Path) -> bool:
    """Return True if a process holds the lock of a run directory.

    The directory need not exist.
    """
    if not (out / _LOCK).is_file():
        return False
    # the lock cannot be tested without write access
    try:
        with filelock.FileLock(out / _LOCK, timeout=0):
            return False
    except (filelock.Timeout, OSError):
        return True


def write_status(out: Path, name: str, status: Mapping[str, Any]) -> None:
    """Write the status of a campaign, JSON values, into `status.json`.

    This is the only file with wall-clock times.
    """
    campaigns = dict(_stored_status(out).get("campaigns", {}))
    campaigns[name] = dict(status)
    now = datetime.now(UTC).isoformat(timespec="seconds")
    text = json.dumps(
        {"updated": now, "campaigns": campaigns}, indent=2, allow_nan=False
    )
    write_atomically(out / STATUS, text.encode(), durable=False)


def read_status(out: Path) -> dict[str, Any]:
    """Read `status.json` of a run directory, empty without the file.

    A running campaign whose process was killed is "stopped".
    """
    status = _stored_status(out)
    running = [
        item
        for item in (status.get("campaigns") or {}).values()
        if item.get("state") == "running"
    ]
    if running and not is_locked(out):
        for item in running:
            item["state"] = "stopped"
    return status


def _stored_status(out: Path) -> dict[str, Any]:
    try:
        content = read_json(out / STATUS)
        campaigns = content["campaigns"].values()
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}
    return content if all(isinstance(item, dict) for item in campaigns) else {}
