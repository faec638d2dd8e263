"""Names of inputs in words, on tables and figures for readers."""

from collections import Counter
from collections.abc import Iterator

import pytest

from wearsim.scene.input_names import input_title, input_unit
from wearsim.scene.reference import scene_schema

SCHEMA = scene_schema()
NO_INPUTS = ("scene", "compare", "uncertainty")
OF_EVERY_POINT = ("operation.block.1.", "operation.class.1.")


def keys_of(part: dict, path: tuple[str, ...] = (), listed: bool = False) -> Iterator:
    """Dotted keys of a part of the schema, of lists of tables those of entry 1."""
    if "$ref" in part:
        part = SCHEMA["$defs"][part["$ref"].rsplit("/", 1)[1]]
    path = (*path, "1") if listed and "properties" in part else path
    inner_keys = [
        key for inner in part.get("anyOf", ()) for key in keys_of(inner, path, listed)
    ]
    if "items" in part:
        inner_keys += keys_of(part["items"], path, listed=True)
    for name, value in part.get("properties", {}).items():
        inner_keys += keys_of(value, (*path, name))
    itself = ".".join(path)
    yield from [key for key in inner_keys if key != itself] or [itself]


def inputs_of(kind: str) -> list[str]:
    """Keys of a kind of scene that can be inputs, those of every point too."""
    model = SCHEMA["$defs"][{"rig": "RigScene", "field": "FieldScene"}[kind]]
    keys = dict.fromkeys(
        key
        for name, value in model["properties"].items()
        if name not in NO_INPUTS
        for key in keys_of(value, (name,))
        if "." in key
    )
    of_every_point = dict.fromkeys(
        f"operation.{key.removeprefix(start)}"
        for start in OF_EVERY_POINT
        for key in keys
        if key.startswith(start)
    )
    return [*keys, *of_every_point]


@pytest.mark.parametrize("kind", ["rig", "field"])
def test_names_of_all_keys_of_a_scene_are_words_and_unique(kind):
    keys = inputs_of(kind)
    assert len(keys) > 150
    titles = {key: input_title(key) for key in keys}
    for key, title in titles.items():
        assert title != key, f"{key} has no words"
        assert not set("_[]=") & set(title), f"{key}: {title}"
        first = title.split()[0]
        assert first not in ("of", "in", "where", "whether", "same", "its"), title
    counts = Counter(titles.values())
    assert [key for key, title in titles.items() if counts[title] > 1] == []


@pytest.mark.parametrize(
    ("key", "title"),
    [
        ("wheelset.smooth_mm", "cut-off wavelength of profile smoothing (wheels)"),
        (
            "counterface.smooth_mm",
            "cut-off wavelength of profile smoothing (counterface)",
        ),
        ("wheelset.origin", "origin of y in profile files (wheels)"),
        (
            "rig.operation.block.slow.wheel_torque_left_kN_m",
            "drive or brake torque on the left wheel of block slow, rig",
        ),
        ("operation.friction, field", "friction coefficient, field"),
        ("wear.values.severe_level", "coefficient severe level of the law USFD"),
        ("wear.values.K1", "coefficient K1 of the wear law"),
        (
            "vehicle.class.R 300.rails.2.profile",
            "profile of rails 2 of route class R 300",
        ),
        ("load (cells)", "load (cells)"),
        ("wheel.profil", "wheel.profil"),
    ],
)
def test_names_state_the_body_or_the_law(key, title):
    assert input_title(key) == title


def test_depth_of_brake_blocks_is_no_distance():
    assert input_unit("wear.brake_block.um_per_1000_km") == "µm"
    assert input_unit("campaign.distance_km") == "km"
