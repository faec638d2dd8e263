"""Designs of sweeps: which cases they make, and what they are refused with."""

from pathlib import Path

import pytest

from wearsim.errors import SceneError
from wearsim.scene import load_campaign, load_scene
from wearsim.scene.sweep import sweep_of_flags

HEAD = '[scene]\nkind = "sweep"\n[sweep]\nbase = "rig.toml"\n'


def cases_of(text):
    Path("sweep.toml").write_text(text)
    return load_scene("sweep.toml")._inputs.cases


def values(case):
    return {item.key: item.value for item in case.overrides}


def test_full_factorial_has_every_value_with_every_other(folder):
    vary = (
        "[sweep.vary]\nwheelset.radius_mm = [420, 460]\n"
        "operation.block.friction = [0.1, 0.2, 0.3]\n"
    )
    cases = cases_of(HEAD + vary)
    assert [case.number for case in cases] == [1, 2, 3, 4, 5, 6]
    result = [tuple(values(case).values()) for case in cases]
    assert result == [(r, f) for r in (420, 460) for f in (0.1, 0.2, 0.3)]
    scene = load_campaign(cases[-1].base, overrides=cases[-1].overrides)
    assert scene.wheelset.radius_mm == 460
    assert {block.friction for block in scene.operation.blocks} == {0.3}


def test_several_scenes_each_run_every_case(folder):
    text = '[scene]\nkind = "sweep"\n[sweep]\nscenes = ["rig.toml", "field.toml"]\n'
    cases = cases_of(text + "[sweep.vary]\nwheelset.radius_mm = [420, 460]\n")
    assert [(case.base.name, values(case)["wheelset.radius_mm"]) for case in cases] == [
        ("rig.toml", 420),
        ("rig.toml", 460),
        ("field.toml", 420),
        ("field.toml", 460),
    ]
    assert [case.base.name for case in cases_of(text)] == ["rig.toml", "field.toml"]


def test_a_table_has_a_case_per_line_and_empty_cells_keep_the_base(folder):
    Path("cases.csv").write_text(
        "# mine\nwheelset.radius_mm, wear.law\n420,none\n\n,usfd\n,\n"
    )
    cases = cases_of(HEAD + 'table = "cases.csv"\n')
    assert [values(case) for case in cases] == [
        {"wheelset.radius_mm": 420, "wear.law": "none"},
        {"wear.law": "usfd"},
        {},  # the base itself
    ]
    assert [case.overrides[0].line for case in cases[:2]] == [3, 5]


def test_flags_make_the_same_cases_as_a_file(folder):
    file = cases_of(
        HEAD + '[sweep.vary]\nwheelset.radius_mm = [420, 460]\nwear.law = ["usfd"]\n'
    )
    flags = sweep_of_flags(
        "rig.toml", ["wheelset.radius_mm=420,460", "wear.law=usfd"], None
    ).cases
    assert [values(case) for case in flags] == [values(case) for case in file]


def test_in_a_comparison_keys_act_on_both_scenes_or_on_the_named_one(folder):
    text = HEAD.replace("rig.toml", "compare.toml")
    (case,) = cases_of(
        text
        + "[sweep.vary]\nwheelset.radius_mm = [420]\nrig.campaign.distance_km = [7]\n"
    )
    scene = load_campaign(case.base, overrides=case.overrides)
    assert (scene.rig.wheelset.radius_mm, scene.field.wheelset.radius_mm) == (420, 420)
    assert scene.rig.campaign.distance_km == 7
    assert scene.field.campaign.distance_km != 7


@pytest.mark.parametrize(
    ("rest", "message"),
    {
        "no list": (
            "[sweep.vary]\nwear.law = 3\n",
            "sweep.toml:6: law = 3 must be a list of values; write [3]",
        ),
        "empty list": ("[sweep.vary]\nwear.law = []\n", "sweep.toml:6: law"),
        "tables": (
            "[sweep.vary]\noperation.block = [{a = 1}]\n",
            "vary keys, not tables",
        ),
        "twice": (
            '[sweep.vary]\nwear.law = ["usfd"]\n"wear.law" = ["none"]\n',
            "wear.law is varied twice",
        ),
        "table and vary": (
            'table = "a.csv"\n[sweep.vary]\nwear.law = ["usfd"]\n',
            "give either table",
        ),
        "no table": ('table = "a.csv"\n', "sweep.toml:5: table"),
        "unknown key": ("jobs = 3\n", "unknown key jobs in [sweep]"),
        "two bases": (
            'scenes = ["rig.toml"]\n',
            "give either base, one scene, or scenes",
        ),
        "too many": (
            "[sweep.vary]\n"
            + "".join(f"wear.k{i} = [{'1, ' * 50}]\n" for i in range(4)),
            "more than 100000 cases",
        ),
    }.values(),
)
def test_faults_of_a_sweep_file(folder, faults_of, rest, message):
    assert any(message in line for line in faults_of(HEAD + rest, "sweep.toml"))


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("radius\n1\n", "cases.csv:1: column"),
        ("a.b,c.d\n1\n", "cases.csv:2: 1 cells, the header has 2"),
        ("a.b\n", "no cases"),
        ("a.b,a.b\n1,2\n", 'column "a.b" stands twice'),
    ],
)
def test_faults_of_a_table(folder, faults_of, table, message):
    Path("cases.csv").write_text(table)
    assert any(
        message in line
        for line in faults_of(HEAD + 'table = "cases.csv"\n', "sweep.toml")
    )


@pytest.mark.parametrize(
    ("vary", "table", "message"),
    [
        ([], None, "say what to vary"),
        (["wear.law"], None, "must be KEY=VALUE"),
        (["wear.law="], None, "must be KEY=VALUE"),
        (["a.b=1", "a.b=2"], None, "varied twice"),
    ],
)
def test_faults_of_the_flags(folder, vary, table, message):
    with pytest.raises(SceneError, match=message):
        sweep_of_flags("rig.toml", vary, table)
