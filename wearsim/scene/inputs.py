"""The files that scenes name, as they are read, and their copies in run directories."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from wearsim.damage.wear.table import WearTable
from wearsim.errors import Fault, SceneError, shown
from wearsim.operation.recorded import Samples
from wearsim.profile.shape import Profile
from wearsim.profile.standard import shipped_path
from wearsim.scene.models import CompareScene, FieldScene, Origin, RigScene, find_file
from wearsim.scene.route import Route
from wearsim.toml_faults import LARGEST_FILE, content_of

INPUTS = "inputs.json"
"""File of a run directory that names its copies of the files of a scene by their
roles.
"""
_PROFILE_KEYS = ("profile", "profile_left")
_RESERVED = (INPUTS, "manifest.json")


@dataclass(frozen=True)
class InputFile:
    """A file behind a campaign, as it was read.

    Its role is what names it: "scene", "rig", "field", or a key such as
    "wheelset.profile"; its name is as the scene writes it; a shipped one is a
    definition that comes with wearsim.
    """

    role: str
    name: str
    path: Path
    content: bytes
    shipped: bool = False

    @property
    def label(self) -> str:
        """Name in results, without its folder."""
        return self.path.name if self.role == "scene" else f"{self.role} {self.name}"

    @property
    def sha256(self) -> str:
        """Hash of the content."""
        return hashlib.sha256(self.content).hexdigest()


@dataclass(frozen=True)
class Inputs:
    """Profiles of a campaign and the files they come from.

    The wheels have points at the scene's spacing, equally many; their flange clearances
    and templates, the profiles they are reprofiled to, are right and left.
    """

    right: Profile
    left: Profile
    rails: tuple[
        tuple[Profile, Profile | None], ...
    ]  # placed; the left one if it differs
    half_span: float  # from the track centre to the origin of the wheel profile [m]
    clearances: tuple[
        tuple[float | None, float | None], ...
    ]  # on each pair of rails [m]
    files: tuple[InputFile, ...]  # the scene file first
    wear_table: WearTable | None = None  # of the file that `table_file` names
    templates: tuple[Profile, Profile] | None = None
    samples: Samples | None = None  # of a record
    route: Route | None = None  # of a vehicle
    warnings: tuple[Fault, ...] = ()  # of what the files say
    # profiles of files with their own points, by key such as "wheelset.profile"
    measured: Mapping[str, Profile] = field(default_factory=dict)

    @property
    def counterface(self) -> Profile:
        """The right one of the first pair of rails."""
        return self.rails[0][0]


def inputs_of(scene: RigScene | FieldScene) -> Inputs:
    """Contents of the files of a scene that `load_scene` has read."""
    inputs = scene._inputs
    if not isinstance(inputs, Inputs):
        raise ValueError("a scene is built after load_scene has read its files")
    return inputs


def files_to_copy(scene: RigScene | FieldScene | CompareScene) -> dict[str, bytes]:
    """Files to load a scene from elsewhere, by `load_scene(..., copied=True)`.

    Contents, as they were read, by plain file name; the scene file comes first. Shapes
    that wearsim ships are not among them.
    """
    named: dict[str, Origin | InputFile] = {"scene": scene.origin}
    for part in scene.parts:
        named[part.origin.role] = part.origin
        named |= {
            f"{part.origin.role}/{f.role}": f
            for f in inputs_of(part).files[1:]
            if not f.shipped
        }
    files: dict[str, bytes] = {}
    roles: dict[str, str] = {}
    for role, file in named.items():
        name, number = file.path.name, 1
        while name in _RESERVED or files.get(name, file.content) != file.content:
            number += 1
            name = f"{file.path.stem}-{number}{file.path.suffix}"
        files[name], roles[role] = file.content, name
    files[INPUTS] = json.dumps(roles, indent=2).encode()
    return files


class Files:
    """Files that a scene names, the scene file first.

    In a run directory the copies of them.
    """

    def __init__(
        self,
        scene: RigScene | FieldScene,
        kept: Mapping[str, Path],
        profiles: Mapping[str, Profile],
    ) -> None:
        self.scene, self.origin, self.kept = scene, scene.origin, kept
        self.profiles = profiles  # by the name that stands for them in the scene
        self.read = [
            InputFile(
                "scene", self.origin.path.name, self.origin.path, self.origin.content
            )
        ]

    def place(self, role: str, name: str) -> Path | None:
        """File of a role, if it exists."""
        kept = self.kept.get(f"{self.origin.role}/{role}")
        return kept or find_file(name, (self.origin.path.parent,), "profiles")

    def found(
        self, key: tuple[str, ...], name: str, what: str, path: Path | None = None
    ) -> Path:
        """File that a key names, or `path` in place of it.

        A SceneError asks for `what`.
        """
        path = self.place(".".join(key), name) or path
        if path is None:
            text = (
                f"{key[-1]} = {shown(name)} does not exist as given or next to the "
                f"scene file; give {what}"
            )
            raise SceneError([self.scene.fault(key, text)])
        return path

    def path_of(self, role: str) -> Path:
        """File of a role that was read."""
        return next(file.path for file in self.read if file.role == role)

    def note(
        self,
        role: str,
        name: str,
        path: Path,
        most: int = LARGEST_FILE,
        content: bytes | None = None,
    ) -> None:
        """Keep the content of a file, by default as it is.

        Definitions of wearsim itself count as shipped.
        """
        shipped = path.suffix == ".toml" and path.is_relative_to(
            shipped_path("profiles")
        )
        content = content_of(path, "another file", most) if content is None else content
        self.read.append(InputFile(role, name, path, content, shipped))


def named_profiles(
    tables: Mapping[str, Any], profiles: dict[str, Profile]
) -> dict[str, Any]:
    """Return tables with the name of a file in place of each `Profile`.

    `profiles` gets them by that name.
    """
    text = repr(tables)  # with all names of real files

    def name_of(profile: Profile) -> str:
        for name, stored in profiles.items():
            if stored is profile:
                return name
        stem = re.sub(r"[^\w.-]+", "_", profile.name) or "profile"
        name, number = f"{stem}.csv", 1
        while name in profiles or name in text:
            number += 1
            name = f"{stem}-{number}.csv"
        profiles[name] = profile
        return name

    def named(value: Any, key: str) -> Any:
        if isinstance(value, Mapping):
            return {
                name: named(item, str(name).rpartition(".")[2])
                for name, item in value.items()
            }
        if isinstance(value, list | tuple):
            return [named(item, "") for item in value]
        return (
            name_of(value)
            if isinstance(value, Profile) and key in _PROFILE_KEYS
            else value
        )

    return {
        name: named(value, str(name).rpartition(".")[2])
        for name, value in tables.items()
    }


def kept_files(path: Path) -> dict[str, Path]:
    """Return the copies of the files of a scene in its folder, by their roles."""
    try:
        roles = json.loads((path.parent / INPUTS).read_text(encoding="utf-8"))
        return {str(role): path.parent / str(name) for role, name in roles.items()}
    except (OSError, ValueError, AttributeError) as error:
        text = (
            f"cannot be read ({error}); start the scene again with `wearsim run` and "
            "another --out"
        )
        raise SceneError([Fault(text, str(path.parent / INPUTS))]) from error
