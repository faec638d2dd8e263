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


def about_input(dimension: Dimension, prefixes: Mapping[str, str]) -> dict[str, Any]:
    """Describe an input of a posterior as JSON values."""
    acting = [
        name for name, prefix in prefixes.items() if of_campaign(dimension, prefix).keys
    ]
    return {
        "label": dimension.section.label,
        "key": _plain_key(dimension.section.key),
        "acts": dimension.section.acts,
        "shared": dimension.section.shared,
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
        posterior = load_derived(path)
        json.loads(posterior.attrs["inputs"])
        posterior["value"]
    except (*UNREADABLE, KeyError, ValueError) as error:
        raise ResultError(
            f"{path} cannot be read ({error}); delete it, and calibrate again"
        ) from error
    return posterior


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
    posterior = load_posterior(directory)
    path = Path(directory) / FILE
    inputs = json.loads(posterior.attrs["inputs"])
    attributes = {
        name: json.loads(posterior.attrs[name])
        for name in ("identities", "wear", "contact_pairs")
    }
    values: dict[int, FloatArray] = {}
    faults = list[Fault]()
    seed = int(posterior.attrs["seed"])
    for index, dimension in enumerate(dimensions):
        named = (dimension.section.label, _plain_key(dimension.section.key))
        parts = [
            part
            for prefix, part in scene.prefixed.items()
            if of_campaign(dimension, prefix).keys
        ]
        for column, item in enumerate(inputs):
            if (item["label"], item["key"]) != named:
                continue
            same = _same_campaigns(item, parts, attributes["identities"])
            if not same and not _is_law(item, dimension):
                continue
            if text := _input_difference(item, dimension, parts, attributes["wear"]):
                place = ("uncertainty", "input", _number(scene, dimension), "key")
                faults.append(scene.fault(place, f"{dimension.section.label}: {text}"))
                continue
            drawn = posterior["value"].values[:, column]
            if not (same and _same_models(parts, attributes["contact_pairs"])):
                width = float(posterior["transfer_deviation"].values[column])
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
        tuple(dimension.name for k, dimension in enumerate(dimensions) if k in values),
        tuple(
            dimension.name for k, dimension in enumerate(dimensions) if k not in values
        ),
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


def _is_law(item: Mapping[str, Any], dimension: Dimension) -> bool:
    """Return True if an input is of a law that posterior and scene share."""
    key = item["key"]
    law = key.split(".")[0] == "wear" or key.endswith("environment")
    return bool(law and item["shared"] and dimension.section.shared)


def _same_models(
    parts: Sequence[RigScene | FieldScene], pairs: Mapping[str, list[str]]
) -> bool:
    """Return True if the campaigns have the contact models of the posterior."""
    return all(pairs.get(part.scene.kind) == list(part.contact.pair) for part in parts)


def _number(scene: CampaignScene, dimension: Dimension) -> int:
    assert scene.uncertainty is not None
    return [item.label for item in scene.uncertainty.input].index(
        dimension.section.label
    )


def _input_difference(
    item: Mapping[str, Any],
    dimension: Dimension,
    parts: list[RigScene | FieldScene],
    wear: Mapping[str, Any],
) -> str:
    """Say how an input of a posterior stands for something else; "" if it does not."""
    if item["acts"] != dimension.section.acts:
        return (
            f'acts = "{dimension.section.acts}", in the posterior it is '
            f'"{item["acts"]}"'
        )
    if not item["key"].endswith(("environment", "wear.scale")):
        return ""
    learned = [wear[name] for name in item["campaigns"]]
    for part in parts:
        if (part_wear := wear_of(part)) not in learned:
            return (
                f"it multiplies law {part_wear['law']} with coefficients "
                f"{part_wear['coefficients']}, and was learned with law "
                f"{learned[0]['law']} and {learned[0]['coefficients']}; a scale "
                "belongs to its law"
            )
    return ""
