"""What a calibration has learned, for the draws of another scene or of the same one.

An input is taken over by its name and key. Those of the wear law and of the scale of
the wear (keys of [wear], and environment) that both scenes share pass to any scene;
all others, such as friction, only to the campaign that was measured.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from wearsim.errors import Fault, ResultError, SceneError
from wearsim.results.file import UNREADABLE, load_derived
from wearsim.scene import CampaignScene, FieldScene, RigScene
from wearsim.scene.draws import Dimension, of_campaign
from wearsim.studies.posterior import FloatArray

FILE = "posterior.nc"
"""File of the posterior in the directory of a calibration."""

_WORLD = ("wheelset", "counterface", "operation", "recorded", "vehicle")


@dataclass(frozen=True)
class Learned:
    """Draws of some dimensions of a scene from a posterior."""

    values: Mapping[int, FloatArray]  # (n,) by number of the dimension
    taken: tuple[str, ...]  # names of these dimensions
    left: tuple[str, ...]  # the others, which keep their distributions
    source: str  # file, with its SHA-256

    @property
    def count(self) -> int:
        """Number of draws."""
        return len(next(iter(self.values.values())))


def about_input(one: Dimension, prefixes: Mapping[str, str]) -> dict[str, Any]:
    """Describe an input of a posterior as JSON values."""
    acting = [
        name for name, prefix in prefixes.items() if of_campaign(one, prefix).keys
    ]
    return {
        "label": one.section.label,
        "key": _plain_key(one.section.key),
        "acts": one.section.acts,
        "shared": one.section.shared,
        "campaigns": acting,
    }


def _plain_key(key: str) -> str:
    first, _, rest = key.partition(".")
    return rest if first in ("rig", "field") else key


def identity_of(part: RigScene | FieldScene) -> str:
    """Hash of what a campaign is: bodies and operation, not how it is computed."""
    data = part.model_dump(mode="json", by_alias=True, include=set(_WORLD))
    if monitors := data.get("operation"):
        monitors.pop("monitor", None)
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def wear_of(part: RigScene | FieldScene) -> dict[str, Any]:
    """Law and coefficients that a scale belongs to, as JSON values."""
    data = part.wear.model_dump(mode="json", by_alias=True)
    return {
        key: data[key] for key in data if key not in ("also_evaluate", "brake_block")
    }


def load_posterior(directory: str | Path) -> xr.Dataset:
    """Read the posterior of a calibration from its directory.

    Raises
    ------
    ResultError
        If there is none, or it cannot be read.
    """
    path = Path(directory) / FILE
    if not path.is_file():
        raise ResultError(
            f"{path}: there is no such file; `wearsim calibrate SCENE --measured TABLE "
            f"--out {directory}` makes it"
        )
    try:
        found = load_derived(path)
        json.loads(found.attrs["inputs"])
        found["value"]
    except (*UNREADABLE, KeyError, ValueError) as error:
        raise ResultError(
            f"{path} cannot be read ({error}); delete it, and calibrate again"
        ) from error
    return found


def learned_for(
    scene: CampaignScene, dimensions: tuple[Dimension, ...], directory: str | Path
) -> Learned:
    """Take over what a posterior has on the dimensions of a scene.

    Raises
    ------
    SceneError
        If it has none of them, or they stand for something else there.
    ResultError
        If there is no posterior.
    """
    found = load_posterior(directory)
    path = Path(directory) / FILE
    inputs = json.loads(found.attrs["inputs"])
    known = {
        name: json.loads(found.attrs[name])
        for name in ("identities", "wear", "contact_pairs")
    }
    values: dict[int, FloatArray] = {}
    faults = list[Fault]()
    seed = int(found.attrs["seed"])
    for index, one in enumerate(dimensions):
        named = (one.section.label, _plain_key(one.section.key))
        parts = [
            part
            for prefix, part in scene.prefixed.items()
            if of_campaign(one, prefix).keys
        ]
        for column, item in enumerate(inputs):
            if (item["label"], item["key"]) != named:
                continue
            same = _same_campaigns(item, parts, known["identities"])
            if not same and not _is_law(item, one):
                continue
            if text := _unlike(item, one, parts, known["wear"]):
                place = ("uncertainty", "input", _number(scene, one), "key")
                faults.append(scene.fault(place, f"{one.section.label}: {text}"))
                continue
            drawn = found["value"].values[:, column]
            if not (same and _same_models(parts, known["contact_pairs"])):
                width = float(found["transfer_deviation"].values[column])
                random = np.random.default_rng([seed, column])
                drawn = drawn * np.exp(width * random.standard_normal(drawn.size))
            values[index] = np.array([float(f"{value:.6g}") for value in drawn])
    if faults:
        raise SceneError(faults)
    if not values:
        names = ", ".join(dict.fromkeys(item["label"] for item in inputs))
        text = (
            f"--posterior {directory} has no input of this scene: it has {names}; "
            "inputs are taken over by name and key, those of wear law and environment "
            "with shared = true in both scenes, others to the same campaign alone"
        )
        raise SceneError([scene.fault(("uncertainty",), text)])
    return Learned(
        values,
        tuple(one.name for k, one in enumerate(dimensions) if k in values),
        tuple(one.name for k, one in enumerate(dimensions) if k not in values),
        f"{path.name} {hashlib.sha256(path.read_bytes()).hexdigest()}",
    )


def _same_campaigns(
    item: Mapping[str, Any],
    parts: Sequence[RigScene | FieldScene],
    identities: Mapping[str, str],
) -> bool:
    """Return True if an input of a posterior was learned in the same campaigns."""
    return all(
        part.scene.kind in item["campaigns"]
        and identities.get(part.scene.kind) == identity_of(part)
        for part in parts
    )


def _is_law(item: Mapping[str, Any], one: Dimension) -> bool:
    """Return True if an input is of a law that posterior and scene share."""
    key = item["key"]
    law = key.split(".")[0] == "wear" or key.endswith("environment")
    return bool(law and item["shared"] and one.section.shared)


def _same_models(
    parts: Sequence[RigScene | FieldScene], pairs: Mapping[str, list[str]]
) -> bool:
    """Return True if the campaigns have the contact models of the posterior."""
    return all(pairs.get(part.scene.kind) == list(part.contact.pair) for part in parts)


def _number(scene: CampaignScene, one: Dimension) -> int:
    assert scene.uncertainty is not None
    return [item.label for item in scene.uncertainty.input].index(one.section.label)


def _unlike(
    item: Mapping[str, Any],
    one: Dimension,
    parts: list[RigScene | FieldScene],
    wear: Mapping[str, Any],
) -> str:
    """Say how an input of a posterior stands for something else; "" if it does not."""
    if item["acts"] != one.section.acts:
        return f'acts = "{one.section.acts}", in the posterior it is "{item["acts"]}"'
    if not item["key"].endswith(("environment", "wear.scale")):
        return ""
    learned = [wear[name] for name in item["campaigns"]]
    for part in parts:
        if (own := wear_of(part)) not in learned:
            return (
                f"it multiplies law {own['law']} with coefficients "
                f"{own['coefficients']}, and was learned with law {learned[0]['law']} "
                f"and {learned[0]['coefficients']}; a scale belongs to its law"
            )
    return ""
