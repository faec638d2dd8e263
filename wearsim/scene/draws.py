"""Drawn values of the uncertain inputs of a scene, and its steels, as overrides."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from wearsim.errors import SceneError, listed, raise_any, shown
from wearsim.scene.models import CompareScene, FieldScene, RigScene
from wearsim.scene.overrides import Override, paths_of
from wearsim.scene.section import Section
from wearsim.scene.uncertainty import (
    NEEDS,
    InputSection,
    MaterialSection,
    UncertaintySection,
    input_faults,
)
from wearsim.toml_faults import KeyPath, is_key, removed_key, unknown_key

_WITHIN = float(
    ndtri(0.95)
)  # standard deviations from the middle to the end of a 90 % range
_EVERYWHERE = (("operation", "block"), ("operation", "class"), ("vehicle", "class"))
Drawn = float | int | str | dict[str, Any]


@dataclass(frozen=True)
class Dimension:
    """Number to draw from the distribution of an uncertain input.

    Its input, the keys it acts on, with the scene's own values, and its name.
    """

    name: str
    section: InputSection
    keys: tuple[tuple[str, Any], ...]

    def drawn(self, share: float) -> Drawn:
        """Value at a share of the distribution between 0 and 1.

        Of numbers six digits, legible in tables.
        """
        section, deviation = self.section, float(ndtri(share))
        if section.distribution == "values":
            return section.values[
                min(int(share * len(section.values)), len(section.values) - 1)
            ]
        first, second = (getattr(section, key) for key in NEEDS[section.distribution])
        if section.distribution == "uniform":
            value = first + (second - first) * share
        elif section.distribution == "normal":
            value = first + second * deviation
        else:
            value = first * second ** (deviation / _WITHIN)
        return float(f"{value:.6g}")

    def acted(self, base: Any, drawn: Drawn) -> Any:
        """Value of a key with the drawn value, from that of the scene."""
        if self.section.acts == "value" or isinstance(drawn, str | dict):
            return drawn
        return float(
            f"{base * drawn if self.section.acts == 'factor' else base + drawn:.9g}"
        )


def overrides_of(drawn: Iterable[tuple[Dimension, Drawn]]) -> list[Override]:
    """Gather what a draw changes in a scene.

    Values first, then what acts on them, in the order of inputs.
    """
    values: dict[str, Any] = {}
    order = sorted(drawn, key=lambda pair: pair[0].section.acts != "value")
    for dimension, value in order:
        for key, base in dimension.keys:
            if isinstance(value, dict):
                values |= {f"{key}.{name}": entry for name, entry in value.items()}
            else:
                values[key] = dimension.acted(values.get(key, base), value)
    return [Override(key, value) for key, value in values.items()]


def of_campaign(dimension: Dimension, prefix: str) -> Dimension:
    """Dimension with its keys in one campaign alone, as the scene of that has them.

    `prefix` stands before the keys of the campaign, "" where the scene is one itself.
    """
    keys = [pair for pair in dimension.keys if pair[0].startswith(prefix)]
    campaign_keys = tuple((key.removeprefix(prefix), value) for key, value in keys)
    return replace(dimension, keys=campaign_keys)


def scales_wear(dimension: Dimension, part: RigScene | FieldScene) -> bool:
    """Return True if an input, with keys of one campaign, multiplies all its wear."""
    if (
        dimension.section.distribution == "values"
        or dimension.section.acts == "addition"
    ):
        return False
    kind, content = part.scene.kind, _content(part)
    environment_keys = _keys("operation.environment", "", kind, type(part), content)
    names = {key for key, _ in dimension.keys}
    return names in ({key for key, _ in environment_keys}, {"wear.scale"})


def draws_of(dimensions: int, count: int, seed: int) -> NDArray[np.float64]:
    """Shares of the distributions (count, dimensions) [-].

    Eight independent scrambles of Sobol points [1]_. Scramble k has the draws k, k + 8,
    k + 16, ...: more draws continue fewer.

    References
    ----------
    .. [1] A. B. Owen, "Monte Carlo variance of scrambled net quadrature", SIAM J.
           Numer. Anal. 34 (1997) 1884-1910, doi:10.1137/S0036142994277468.
    """
    from scipy.stats import qmc  # 0.3 s to import, only spent where it is needed

    per_scramble = -(-count // SCRAMBLES)
    points = np.empty((per_scramble, SCRAMBLES, dimensions))
    for k, random in enumerate(np.random.default_rng(seed).spawn(SCRAMBLES)):
        points[:, k] = qmc.Sobol(dimensions, rng=random).random(per_scramble)
    return points.reshape(-1, dimensions)[:count]


SCRAMBLES = 8


def dimensions_of(scene: RigScene | FieldScene | CompareScene) -> tuple[Dimension, ...]:
    """Return the numbers to draw for a scene.

    Raises
    ------
    SceneError
        With all faults of its [uncertainty]: none at all, keys it has not,
        distributions without their numbers.
    """
    section = scene.uncertainty
    if section is None or not section.input:
        text = (
            "bands need uncertain inputs; write [[uncertainty.input]] with key and "
            "distribution"
        )
        raise SceneError([scene.fault(("uncertainty",), text)])
    parts = [
        (prefix, str(part.scene.kind), type(part), _content(part))
        for prefix, part in scene.prefixed.items()
    ]
    messages: list[tuple[KeyPath, str]] = []
    dimensions: list[Dimension] = []
    labels: list[str] = []
    model = type(scene.parts[0])
    for index, uncertain_input in enumerate(section.input):
        keys_by_kind = {part[1]: _keys(uncertain_input.key, *part) for part in parts}
        keys = {kind: pairs for kind, pairs in keys_by_kind.items() if pairs}
        faults = [
            *input_faults(uncertain_input),
            *_key_faults(uncertain_input, keys, len(parts), model),
        ]
        if uncertain_input.label in labels:
            text = (
                f"two inputs are called {shown(uncertain_input.label)}; give one of "
                "them another name"
            )
            faults.append(("key", text))
        labels.append(uncertain_input.label)
        if uncertain_input.shared or len(keys) == 1:
            dimensions.append(
                Dimension(
                    uncertain_input.label, uncertain_input, tuple(chain(*keys.values()))
                )
            )
        else:
            dimensions += [
                Dimension(
                    f"{uncertain_input.label}, {kind}", uncertain_input, tuple(pairs)
                )
                for kind, pairs in keys.items()
            ]
        messages += [
            (("uncertainty", "input", index, key), text) for key, text in faults
        ]
    for index, steel in enumerate(section.material):
        unknown = [key for key in steel.wear if not is_key(model, ["wear", key])]
        if unknown:
            text = (
                f"wear of {shown(steel.name)}: "
                f"{unknown_key(['wear', unknown[0]], model)}"
            )
            messages.append((("uncertainty", "material", index, "wear"), text))
    messages += [(("uncertainty", key), text) for key, text in _count_faults(section)]
    raise_any([scene.fault(*message) for message in messages])
    return tuple(dimensions)


def _count_faults(section: UncertaintySection) -> Iterator[tuple[str, str]]:
    """Faults of numbers of draws."""
    for key in ("draws", "most_draws"):
        count = getattr(section, key)
        if count is not None and count & (count - 1):
            low = 2 ** int(math.log2(count))
            powers = listed([low, 2 * low], " or ")
            yield key, f"{key} = {count} must be a power of two; write {powers}"


def _content(part: RigScene | FieldScene) -> dict[str, Any]:
    return part.model_dump(mode="json", by_alias=True)


def _key_faults(
    section: InputSection,
    keys: Mapping[str, list[tuple[str, Any]]],
    campaigns: int,
    model: type[Section],
) -> Iterator[tuple[str, str]]:
    """Faults of an input whose keys are given by kind of campaign."""
    lacking = [
        key
        for pairs in keys.values()
        for key, base in pairs
        if type(base) not in (int, float)
    ]
    if section.acts != "value" and lacking:
        text = (
            f"acts = {shown(section.acts)} needs numbers in the scene; write "
            f"{listed(lacking[:3])} there"
        )
        yield "acts", text
    if not keys:
        text = removed_key(section.key.split("."), model) or (
            f"key = {shown(section.key)} is none of this scene; give one such as "
            "operation.friction"
        )
        yield "key", text
    elif section.shared and len(keys) < campaigns:
        text = (
            f"shared = true, but only the {next(iter(keys))} has {section.key}; delete "
            "shared"
        )
        yield "shared", text


def _keys(
    key: str, prefix: str, kind: str, model: type[Section], data: Mapping[str, Any]
) -> list[tuple[str, Any]]:
    """Keys of one scene that a dotted key means, for overrides, with their values."""
    parts = key.split(".")
    if prefix and parts[0] in ("rig", "field"):
        parts = parts[1:] if parts[0] == kind else []
    if (len(parts) < 2 and parts != ["wear"]) or parts[0] in (
        "scene",
        "compare",
        "uncertainty",
    ):
        return []
    tables = [parts]
    if (
        parts[0] == "operation" and len(parts) == 2
    ):  # of every block or class, of a vehicle's route, too
        tables = [
            [*table, parts[1]]
            for table in _EVERYWHERE
            if (data.get(table[0]) or {}).get(table[1])
        ]
    pairs = []
    existing = (keys for keys in tables if is_key(model, keys))
    for path in chain.from_iterable(paths_of(data, keys) for keys in existing):
        steps = [str(step + 1) if isinstance(step, int) else step for step in path]
        pairs.append((f"{prefix}{'.'.join(steps)}", _value_at(data, path)))
    return pairs


def _value_at(data: Any, path: KeyPath) -> Any:
    """Value at a path, None where there is none."""
    for step in path:
        if isinstance(data, Mapping):
            data = data.get(step)
        elif data is not None:
            data = data[int(step)]
    return data


def material_overrides(material: MaterialSection) -> tuple[Override, ...]:
    """Give what a steel changes in [wear], of rig and field alike."""
    return tuple(Override(f"wear.{key}", value) for key, value in material.wear.items())
