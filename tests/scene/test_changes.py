"""Values set in the text of a scene: what changes, what stays, and where a fault is told."""

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wearsim.scene.changes import Change, ChangedLine, changed_text, toml_value, value_of

TEXT = """\
# a comment
title = "kept"   # beside
[wheel]          # a table
radius = 460.0   # mm
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


def set_in(text, key, value):
    changed = changed_text(text, [Change(key, value, "sweep.toml", 7)])
    assert changed.faults == ()
    return changed


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
    ],
)
def test_one_value_changes_and_all_others_stay(key, value, path):
    changed = set_in(TEXT, key, value)
    found, before = tomllib.loads(changed.text), tomllib.loads(TEXT)
    for data, wanted in ((found, value), (before, None)):
        inner = data
        for part in path[:-1]:
            inner = inner.setdefault(part, {}) if isinstance(inner, dict) else inner[part]
        if wanted is not None:
            assert inner[path[-1]] == value
        inner.pop(path[-1], None)
    assert found == before
    assert "# a comment" in changed.text
    assert "# mm" in changed.text


def test_a_key_without_number_means_all_tables_of_a_list():
    found = tomllib.loads(set_in(TEXT, "block.friction", 0.1).text)
    assert [block["friction"] for block in found["block"]] == [0.1, 0.1]


def test_lines_are_those_of_the_file_and_know_the_change():
    changed = set_in(TEXT, "wheel.new", 1)
    assert changed.lines["block", 0, "friction"] == 8
    line = changed.lines["wheel", "new"]
    assert isinstance(line, ChangedLine)
    assert (line, line.change.line) == (3, 7)


@pytest.mark.parametrize("key", ["block.3.friction", "block.0.friction", "block.2", "title.radius"])
def test_a_key_that_cannot_be_set_is_a_fault_of_the_change(key):
    (fault,) = changed_text(TEXT, [Change(key, 1, "sweep.toml", 7)]).faults
    assert (fault.file, fault.line) == ("sweep.toml", 7)
    assert key in fault.message


@given(
    st.recursive(
        st.booleans() | st.integers(-(10**15), 10**15) | st.floats(allow_nan=False) | st.text(),
        lambda inner: st.lists(inner, max_size=3),
        max_leaves=5,
    )
)
def test_written_values_are_read_back(value):
    assert tomllib.loads(f"key = {toml_value(value)}")["key"] == value


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
    ],
)
def test_cells_and_flags_are_numbers_truths_or_texts(text, value):
    found = value_of(text)
    assert found == value
    assert type(found) is type(value)
