"""Whatever key, flag or command a text of the package names exists: nobody is sent
where nothing is.
"""

import argparse
import ast
import re
from pathlib import Path

import pytest

import wearsim
from wearsim.cli import build_parser
from wearsim.errors import listed, shown
from wearsim.profile.alignment import ALIGNMENTS
from wearsim.quantities import QUANTITIES
from wearsim.scene import scene_schema
from wearsim.studies.contact_flags import COLUMNS

PACKAGE = Path(wearsim.__file__).parent
COMMANDS = next(
    action.choices
    for action in build_parser()._actions
    if isinstance(action, argparse._SubParsersAction)
)
FLAGS = {
    name: {flag for action in parser._actions for flag in action.option_strings}
    for name, parser in COMMANDS.items()
}
ELSEWHERE = {
    "curvature_window": "parameter of the normal model hertz in Python",
    "crack_depth": "parameter of a fatigue law in Python, crack_depth_mm in scenes",
    "crack_width": "parameter of a fatigue law in Python, crack_width_mm in scenes",
    "side_depth": "key of a definition of a rail",
    "up_to": "key of a limits file",
    "diameter_mm": "key of a limits file",
    "load_scene": "function of wearsim",
    "field_given": "kind of `wearsim new`",
    "rig_given": "kind of `wearsim new`",
    "roll_rule": "attribute of a result file",
    "no_wear": "value of a result file",
    "running_circle": "value of --origin",
    "mass_sd_kg": "column of a table of measured wheels",
    "flange_back": "value of --origin",
    "gauge_point": "value of --origin",
    "flange_back_mm": "old name of back_to_back_mm, in the message that names the new one",
}
"""Names in messages on other things than scenes, flags, tables of operating points and
result files.
"""

TABLES_OF_NAMES = [PACKAGE / name for name in ("quantities.py", "__init__.py")]

_FLAG = re.compile(r"(?<![\w./-])--[a-z][\w-]*")
_KEY = re.compile(r"(?<![\w./{}-])[a-z][a-z0-9]*(?:_[A-Za-z0-9]+)+(?![\w(]|\.[a-z])")
_EXPRESSION = re.compile(r"\{[{%].*?[%}]\}")  # of a template
_COMMAND = re.compile(r"`wearsim (\w+)([^`]*)`")


def texts(tree):
    """Line and text of every string that is no docstring; values put into it as {}."""
    skipped = {
        item.value
        for node in ast.walk(tree)
        for item in (
            getattr(node, "body", None)
            if isinstance(getattr(node, "body", None), list)
            else ()
        )
        if isinstance(item, ast.Expr)
    }
    for node in ast.walk(tree):  # outer nodes come first
        if isinstance(node, ast.JoinedStr):
            skipped.update(node.values)
            parts = (
                part.value if isinstance(part, ast.Constant) else "{}"
                for part in node.values
            )
            yield node.lineno, "".join(parts)
        elif (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and node not in skipped
        ):
            yield node.lineno, node.value


def names_in(schema):
    """Keys and allowed values of a JSON schema."""
    if isinstance(schema, dict):
        for key, value in schema.items():
            yield from (
                value
                if key in ("properties", "enum")
                else [value]
                if key == "const"
                else ()
            )
            yield from names_in(value)
    elif isinstance(schema, list):
        for value in schema:
            yield from names_in(value)


def quoted(expression):
    """Sentences in an expression of a template."""
    return " ".join(
        text for text in re.findall(r'"([^"]*)"', expression[0]) if " " in text
    )


@pytest.fixture(scope="module")
def messages():
    """(place, text) of every text of more than one word, and of each line of tables and
    templates.
    """
    tables = sorted(PACKAGE.rglob("*.txt.j2"))
    return [
        (f"{path.relative_to(PACKAGE)}:{number}", _EXPRESSION.sub(quoted, line))
        for path in tables
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if not line.startswith("#")
    ] + [
        (f"{path.relative_to(PACKAGE)}:{line}", text)
        for path in sorted(PACKAGE.rglob("*.py"))
        if path not in TABLES_OF_NAMES
        for line, text in texts(ast.parse(path.read_text(encoding="utf-8")))
        if " " in text
    ]


def test_every_key_of_a_message_exists(messages):
    known = {
        *map(str, names_in(scene_schema())),
        *COLUMNS,
        *QUANTITIES,
        *ALIGNMENTS,
        *ELSEWHERE,
    }
    unknown = [
        (place, key)
        for place, text in messages
        for key in _KEY.findall(text)
        if key not in known
    ]
    assert unknown == []


def test_every_flag_of_a_message_exists(messages):
    known = {flag for flags in FLAGS.values() for flag in flags}
    unknown = [
        (place, flag)
        for place, text in messages
        for flag in _FLAG.findall(text)
        if flag not in known
    ]
    assert unknown == []


def test_every_command_of_a_message_exists_with_its_flags(messages):
    result = [
        (place, *match) for place, text in messages for match in _COMMAND.findall(text)
    ]
    assert len(result) > 10
    for place, command, rest in result:
        assert command in COMMANDS, place
        assert set(_FLAG.findall(rest)) <= FLAGS[command], place


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("a", '"a"'),
        ("x" * 50, '"' + 35 * "x" + '..."'),
        (True, "true"),
        (1.5, "1.5"),
        (["a", 2], '["a", 2]'),
        ([1, 2, 3, 4, 5], "(a list)"),
        ({"a": 1}, "(a table)"),
    ],
)
def test_a_value_is_shown_as_toml_writes_it_and_shortened(value, text):
    assert shown(value) == text


def test_values_are_listed_with_the_word_between_them():
    assert listed(["x", 2]) == "x, 2"
    assert listed(iter(["x", "y"]), " or ") == "x or y"
    assert listed([]) == ""
