"""The reference of scene files: complete, and the committed file is that of the
models.
"""

import re
import typing
from pathlib import Path

import pytest
from pydantic import BaseModel

from wearsim.cli import main
from wearsim.scene import CompareScene, FieldScene, RigScene, SweepScene
from wearsim.scene.reference import scene_reference

COMMITTED = Path(__file__).parents[2] / "workflows" / "reference.md"
TEXT = scene_reference()


def tables():
    """Rows by heading and key; a key that differs between kinds of scene has
    several.
    """
    found = {}
    for heading, body in re.findall(
        r"^## \[+([\w.]+)\]+\n(.*?)(?=^## |\Z)", TEXT, re.MULTILINE | re.DOTALL
    ):
        rows = found.setdefault(heading, {})
        for line in re.findall(r"^\| `.*", body, re.MULTILINE):
            key, *cells = (cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1])
            rows.setdefault(key.strip("`"), []).append(cells)
    return found


def models_in(annotation):
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in typing.get_args(annotation):
        yield from models_in(inner)


def keys_of(model, path=""):
    """Path of every key that is no table, from the models alone."""
    for name, field in model.model_fields.items():
        key = f"{path}.{field.alias or name}".removeprefix(".")
        inner = list(models_in(field.annotation))
        for each in inner:
            yield from keys_of(each, key)
        if not inner:
            yield key


def test_the_committed_file_is_current():
    """To renew it: wearsim schema --markdown > workflows/reference.md."""
    assert COMMITTED.read_text(encoding="utf-8") == TEXT


@pytest.mark.parametrize("model", [RigScene, FieldScene, CompareScene, SweepScene])
def test_every_key_has_a_row_with_values_and_a_meaning(model):
    found = tables()
    for path in keys_of(model):
        table, key = path.rsplit(".", 1)
        for unit, values, default, meaning in found[table][key]:
            assert values, path
            assert default, path
            assert meaning, path
            assert key.endswith("_percent") or not unit or unit[0] in key, (
                path
            )  # the key carries its unit


def test_rows_say_what_the_models_say():
    found = tables()
    assert found["wheelset"]["radius_mm"][0][:3] == ["mm", "5 to 1500", "`460.0`"]
    assert found["wheelset"]["profile"][0][:3] == ["", "text", "required"]
    assert found["operation.block"]["positions"][0][:3] == ["", "whole, 2 to 200", "–"]
    assert (
        found["operation.class"]["curve_radius_m"][0][1]
        == "-1000000 to -10 or 10 to 1000000"
    )
    assert found["wear"]["law"][0][1].startswith('`"archard"`, ')
    assert found["campaign"]["distance_km"][0][1] == "above 0 to 10000000"
    assert found["counterface"]["roller_radius_mm"][0][3].endswith("(rig only)")
    assert [cells[1] for cells in found["scene"]["kind"]] == [
        '`"rig"`',
        '`"field"`',
        '`"compare"`',
        '`"sweep"`',
    ]
    assert "## [[operation.block]]\n\nScenes: rig.\n" in TEXT
    assert "## [operation]\n\nScenes: rig, field; required.\n" in TEXT


def test_the_command_prints_it(capsys):
    assert main(["schema", "--markdown"]) == 0
    assert capsys.readouterr().out == TEXT
