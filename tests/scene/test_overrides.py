"""Overrides merged into a parsed scene: what changes, what stays, and where a fault
stands.
"""

import copy
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wearsim.errors import Fault, SceneError
from wearsim.scene import load_scene
from wearsim.scene.overrides import (
    Override,
    at_its_source,
    merge,
    overridden_text,
    toml_value,
    value_of,
)
from wearsim.toml_faults import key_lines, line_of

TEXT = """\
# a comment
title = "kept"
[wheel]
radius = 460.0
inline = { a = 1, b = "two" }
[[block]]
name = "left"
friction = 0.3
[[block]]
name = "right"
[block.monitor]
shifts = [1, 2,
  3]
"""
DATA = tomllib.loads(TEXT)


def merged(key, value):
    """Scene with one override, as read again from the copy that a run directory
    keeps.
    """
    override, before = Override(key, value, "sweep.toml", 7), copy.deepcopy(DATA)
    data = merge(DATA, [override], key_lines(TEXT))
    assert before == DATA
    assert tomllib.loads(overridden_text(data, [override])) == data
    edited = overridden_text(data, [override], TEXT)
    assert tomllib.loads(edited) == data
    assert "# a comment" in edited
    return data


@pytest.mark.parametrize(
    ("key", "value", "path"),
    [
        ("title", "other", ["title"]),
        ("wheel.radius", 500, ["wheel", "radius"]),
        ("wheel.inline.b", False, ["wheel", "inline", "b"]),
        ("wheel.new", [1, -2.5], ["wheel", "new"]),
        ("campaign.distance", 1e-7, ["campaign", "distance"]),
        ("block.2.name", 'a "quoted" \\ text\n', ["block", 1, "name"]),
        ("block.2.monitor.shifts", [0], ["block", 1, "monitor", "shifts"]),
        ("block.right.monitor.shifts", [0], ["block", 1, "monitor", "shifts"]),
        ("block.left.friction", 0.1, ["block", 0, "friction"]),
    ],
)
def test_one_value_changes_and_all_others_stay(key, value, path):
    result, before = merged(key, value), copy.deepcopy(DATA)
    for data, is_set in ((result, True), (before, False)):
        inner = data
        for part in path[:-1]:
            inner = (
                inner.setdefault(part, {}) if isinstance(inner, dict) else inner[part]
            )
        if is_set:
            assert inner[path[-1]] == value
        inner.pop(path[-1], None)
    assert result == before


def test_a_key_without_number_means_all_tables_of_a_list():
    assert [block["friction"] for block in merged("block.friction", 0.1)["block"]] == [
        0.1,
        0.1,
    ]


@pytest.mark.parametrize(
    "key",
    [
        "wheel.radius",
        "wheel",
        "block.2.monitor",
        "block.friction",
        "wheel.absent",
        "no.b",
    ],
)
def test_none_removes_a_key_or_a_table(key):
    result = merged(key, None)
    first, *rest = key.split(".")
    if not rest:
        assert first not in result
    elif first == "block":
        assert all(rest[-1] not in block for block in result["block"])
    else:
        assert rest[0] not in result.get(first, {})
        assert ("no" in result) is False


def test_the_first_line_of_the_copy_lists_the_overrides():
    overrides = [
        Override("wheel.radius", 3),
        Override("title", None),
        Override("wheel.radius", 500),
    ]
    first = overridden_text(merge(DATA, overrides, {}), overrides).splitlines()[0]
    assert first == "# scene with title removed, wheel.radius = 500"


def test_a_fault_stands_where_the_override_does():
    lines = key_lines(TEXT)
    merge(
        DATA,
        [
            Override("wheel.new", 1, "sweep.toml", 7),
            Override("wheel.radius", 1, "--set wheel.radius=1"),
        ],
        lines,
    )
    assert line_of(lines, ("block", 0, "friction")) == 8
    fault = Fault("new = 1 is wrong", "rig.toml", line_of(lines, ("wheel", "new")))
    assert str(at_its_source(fault)) == "sweep.toml:7: new = 1 is wrong (in rig.toml)"
    fault = Fault(
        "radius = 1 is wrong", "rig.toml", line_of(lines, ("wheel", "radius"))
    )
    assert (
        str(at_its_source(fault))
        == "--set wheel.radius=1: radius = 1 is wrong (in rig.toml)"
    )
    assert at_its_source(Fault("title is wrong", "rig.toml", 2)) == Fault(
        "title is wrong", "rig.toml", 2
    )


@pytest.mark.parametrize(
    "key", ["block.3.friction", "block.0.friction", "block.2", "title.radius"]
)
def test_a_key_that_cannot_be_set_is_a_fault_of_the_override(key):
    with pytest.raises(SceneError) as caught:
        merge(DATA, [Override(key, 1, "sweep.toml", 7)], {})
    (fault,) = caught.value.faults
    assert (fault.file, fault.line) == ("sweep.toml", 7)
    assert key in fault.message


_VALUES = st.recursive(
    st.booleans()
    | st.integers(-(10**15), 10**15)
    | st.floats(allow_nan=False)
    | st.text(),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3)
    ),
    max_leaves=8,
)


@given(st.dictionaries(st.text(), _VALUES, max_size=4))
def test_written_scenes_are_read_back(data):
    assert tomllib.loads(f"key = {toml_value(data)}")["key"] == data
    assert tomllib.loads(overridden_text(data, [])) == data


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("3", 3),
        (" -0.5 ", -0.5),
        ("1e3", 1000.0),
        ("true", True),
        ("usfd", "usfd"),
        ("1:40", "1:40"),
        ("nan", "nan"),
        ("", None),
        ('["archard", "brr"]', ["archard", "brr"]),
        ("[1, -2.5]", [1, -2.5]),
        ("{ share = 0.5 }", {"share": 0.5}),
        ('"54E1"', "54E1"),
        ("[archard]", "[archard]"),
        ("[1]\nother = 2", "[1]\nother = 2"),
        ("[" * 5000, "[" * 5000),
    ],
)
def test_cells_and_flags_are_values_of_toml_or_texts(text, value):
    result = value_of(text)
    assert result == value
    assert type(result) is type(value)


@pytest.mark.parametrize("text", ["54E1", "3", "true", "[draft]", "1e3"])
def test_a_cell_or_flag_of_a_text_is_a_text(text):
    assert value_of(text, as_text=True) == text
    assert value_of(f'"{text}"', as_text=True) == text
    assert value_of("", as_text=True) is None


def test_the_copy_of_an_overridden_scene_keeps_comments_and_order(folder, changed):
    wheelset = 'profile = "S1002"\nradius_mm = 460  # of the new wheel'
    text = changed(Path("rig.toml").read_text(), ('profile = "S1002"', wheelset))
    Path("rig.toml").write_text(f"# our wheelset\n{text}")
    overrides = {
        "wheelset.radius_mm": 455,
        "wear.law": "brr",
        "campaign.max_step_km": np.float64(2.5),
    }
    copied = load_scene("rig.toml", overrides=overrides).origin.content.decode()
    assert copied.startswith(
        '# scene with campaign.max_step_km = 2.5, wear.law = \\"brr\\", wheelset'
    )
    assert "# our wheelset" in copied
    assert "radius_mm = 455  # of the new wheel" in copied
    Path("copy.toml").write_text(copied)
    assert (
        load_scene("copy.toml").model_dump()
        == load_scene("rig.toml", overrides=overrides).model_dump()
    )


@pytest.mark.parametrize(
    "text",
    [
        "[a]\nx = 1\n[b]\ny = 2\n[a.c]\nz = 3\n",  # a table out of order
        "a.x = 1\na.c.z = 3\nb = {y = 2}\n",
        "[[a.c]]\nz = 3\n[b]\nx = 1\n",
    ],
)
def test_a_text_of_any_order_stands_for_the_merged_scene(text):
    for override in (
        Override("b.y", None),
        Override("b.new", 5),
        Override("a.c.z", "text"),
    ):
        data = merge(tomllib.loads(text), [override], key_lines(text))
        assert tomllib.loads(overridden_text(data, [override], text)) == data


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            {"campaign..distance_km": 1},
            "overrides: 'campaign..distance_km' must be a dotted key, such as",
        ),
        ({3: 1}, "overrides: 3 must be a dotted key"),
        (
            {"wheelset.radius_mm": "big"},
            'overrides: radius_mm = "big" must be a number, .* .in rig.toml.',
        ),
        (
            {"wheelset.radios_mm": 460},
            "overrides: unknown key radios_mm in .wheelset.; .* .in rig.toml.",
        ),
        ({"wheelset.profile": object()}, "wheelset.profile is a object; give a number"),
    ],
)
def test_overrides_of_python_that_cannot_act_name_their_key(folder, given, message):
    with pytest.raises(SceneError, match=message):
        load_scene("rig.toml", overrides=given)


def test_none_removes_a_key(folder):
    assert load_scene("rig.toml", overrides={"scene.title": None}).scene.title == ""
