"""Wheel profiles that are written to belong to the other side: a warning."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import PurePath

from wearsim.errors import Fault
from wearsim.scene.models import FieldScene, RigScene
from wearsim.texts import shown

_SIDES = {"l": "left", "r": "right"}
_IN_NAME = re.compile(r"(?<![a-z])(left|right|links|rechts)(?![a-z])")


def side_of(name: str, header: Mapping[str, str]) -> tuple[str, str]:
    """Side of the wheel that the header of a file, or else its name, states, and which does; "" if none."""
    stated = {key.lower(): value.strip().lower() for key, value in header.items()}.get("side", "")
    if side := _SIDES.get(stated[:1], ""):
        return side, "header"
    words = {_SIDES[word[0]] for word in _IN_NAME.findall(PurePath(name).stem.lower())}
    return (words.pop(), "name") if len(words) == 1 else ("", "")


def side_warnings(
    scene: RigScene | FieldScene, headers: Mapping[str, tuple[str, Mapping[str, str]]]
) -> list[Fault]:
    """Warnings of profiles of the other side, where both wheels have a file, by key: its name and header."""
    warnings = []
    for key, wheel in (("profile", "right"), ("profile_left", "left")) if "profile_left" in headers else ():
        name, header = headers.get(key, ("", {}))
        side, where = side_of(name, header)
        if side not in ("", wheel):
            text = f"{key} = {shown(name)} acts on the {wheel} wheel, and its {where} says {side}"
            warnings.append(scene.fault(("wheelset", key), f"{text}: exchange profile and profile_left"))
    return warnings
