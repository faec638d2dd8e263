"""Lines of keys in TOML texts, and values and names in messages."""

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wearsim.errors import shown
from wearsim.toml_faults import key_lines, line_of, nearest, syntax_fault

TEXT = '''\
# a comment
title = "x"
a.b.c = 1
"quoted key"."d.e" = 2
'single' = 3
inline = { x = 1, y.z = 2, w = [ { u = 1 }, { u = 2 } ] }
[table]
text = """
[not.a.table]
k = 3
"""
literal = \'\'\'
k = 4
\'\'\'
after = 5
list = [
  1,  # one
  2,
  { deep = 3 },
]
[[operation.block]]
name = "first"
[operation.block.sub]
z = 1
[[operation.block]]
name = "second"
[operation.block.sub]
z = 2
[[operation.block.part]]
p = 1
[[operation.block.part]]
p = 2
[ "spaced" . header ]
v = "ä\\u00e9"
[late.implicit.table]
k = 1
[late]
k = 2
'''


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("title",), 2),
        (("a",), 3),
        (("a", "b", "c"), 3),
        (("quoted key", "d.e"), 4),
        (("single",), 5),
        (("inline", "x"), 6),
        (("inline", "y", "z"), 6),
        (("inline", "w", 1, "u"), 6),
        (("table",), 7),
        (("table", "text"), 8),
        (("table", "literal"), 12),
        (("table", "after"), 15),
        (("table", "list"), 16),
        (("table", "list", 0), 17),
        (("table", "list", 1), 18),
        (("table", "list", 2, "deep"), 19),
        (("operation", "block"), 21),
        (("operation", "block", 0), 21),
        (("operation", "block", 0, "name"), 22),
        (("operation", "block", 0, "sub", "z"), 24),
        (("operation", "block", 1), 25),
        (("operation", "block", 1, "name"), 26),
        (("operation", "block", 1, "sub", "z"), 28),
        (("operation", "block", 1, "part", 0, "p"), 30),
        (("operation", "block", 1, "part", 1, "p"), 32),
        (("spaced", "header", "v"), 34),
        (("late", "implicit", "table", "k"), 36),
        (("late",), 37),
        (("late", "k"), 38),
    ],
)
def test_every_kind_of_key_has_its_line(path, line):
    assert key_lines(TEXT)[path] == line


def every_path(value, path=()):
    if path:
        yield path
    items = (
        value.items()
        if isinstance(value, dict)
        else enumerate(value)
        if isinstance(value, list)
        else ()
    )
    for key, inner in items:
        yield from every_path(inner, (*path, key))


def test_the_lines_cover_all_that_the_toml_reader_finds():
    data = tomllib.loads(TEXT)
    assert set(key_lines(TEXT)) == set(every_path(data))


def test_text_inside_multi_line_strings_is_no_key():
    assert ("not", "a", "table") not in key_lines(TEXT)
    assert ("table", "k") not in key_lines(TEXT)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_line_ends_of_other_systems_do_not_shift_lines(end):
    assert key_lines(TEXT.replace("\n", end)) == key_lines(TEXT)


NAMES = st.text(st.sampled_from("ab.\"' é]"), min_size=1, max_size=4)
VALUES = st.sampled_from(["1", "[1,\n 2]", '"""\nx = 1\n"""', "{ k = 1 }", "'# no'"])


def basic_string(name):
    return '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'


@given(
    st.lists(
        st.tuples(NAMES, st.dictionaries(NAMES, VALUES, max_size=4), st.integers(0, 2)),
        unique_by=lambda item: item[0],
        max_size=5,
    )
)
def test_generated_tables_are_found_line_by_line(tables):
    """Names with dots, quotes and brackets, values over several lines, tables and
    arrays of tables.
    """
    text, expected = "", {}
    for table, pairs, comments in tables:
        text += "# [no.table]\n" * comments
        expected[(table, 0)] = text.count("\n") + 1
        text += f"[[ {basic_string(table)} ]]\n"
        for name, value in pairs.items():
            expected[(table, 0, name)] = text.count("\n") + 1
            text += f"{basic_string(name)} = {value}\n"
    lines = key_lines(text)
    assert {path: lines[path] for path in expected} == expected
    assert set(lines) == set(every_path(tomllib.loads(text)))


def test_an_unknown_path_gets_the_line_of_the_table_around_it():
    lines = key_lines(TEXT)
    assert line_of(lines, ("operation", "block", 1, "missing")) == 25
    assert line_of(lines, ("nowhere", "at", "all")) == 1


@pytest.mark.parametrize(
    ("text", "line"),
    [("a = 1\nb = = 2\n", 2), ("a = 1\nb = [1,\n", 2), ("a = 1\na = 2\n", 2), ("a", 1)],
)
def test_syntax_faults_name_the_line(text, line):
    with pytest.raises(tomllib.TOMLDecodeError) as caught:
        tomllib.loads(text)
    fault = syntax_fault(caught.value, text, "x.toml")
    assert fault.line == line
    assert str(fault).startswith(f"x.toml:{line}: not valid TOML: ")


def test_values_are_shown_on_one_short_line():
    assert shown("a\nb") == '"a\\nb"'
    assert shown(True) == "true"
    assert shown(1.5) == "1.5"
    assert shown({"a": 1}) == "(a table)"
    assert shown([1, "b"]) == '[1, "b"]'
    assert len(shown("x" * 500)) <= 60


def test_the_nearest_name_is_found_whatever_its_case_and_only_if_it_is_near():
    assert nearest("load_KN", ["load_kN", "speed_km_h"]) == "load_kN"
    assert nearest("zzz", ["load_kN", "speed_km_h"]) is None


@pytest.mark.parametrize(
    ("name", "other"),
    [
        ("profile_right", "profile_left"),
        ("friction", "rotation"),
        ("shift_std", "shift_mean_mm"),
        ("yaw_mrad", "roll_mrad"),
    ],
)
def test_a_name_of_another_meaning_is_no_suggestion(name, other):
    assert nearest(name, [other]) is None
    assert nearest(f"{other}x", [other]) == other
