"""[uncertainty]: what is drawn, where it acts, and what is refused."""

import numpy as np
import pytest

from wearsim.errors import SceneError
from wearsim.profile.standard import shipped_path
from wearsim.scene import load_scene
from wearsim.scene.draws import dimensions_of, draws_of, overrides_of
from wearsim.scene.input_names import input_unit

COMPARE = """\
[scene]
kind = "compare"
[compare]
rig = "workflows/rig_given.toml"
field = "workflows/field_given.toml"
"""


@pytest.fixture
def scene_of(tmp_path):
    """Function that loads the shipped comparison with inputs of [uncertainty]."""

    def load(*inputs, head=""):
        text = f"{COMPARE}[uncertainty]\n{head}\n"
        text += "".join(f"[[uncertainty.input]]\n{one}\n" for one in inputs)
        (tmp_path / "compare.toml").write_text(text)
        return load_scene(tmp_path / "compare.toml")

    return load


def test_more_draws_continue_fewer_and_fill_the_range():
    few, more = draws_of(3, 64, 7), draws_of(3, 128, 7)
    np.testing.assert_array_equal(few, more[:64])
    np.testing.assert_array_equal(few, draws_of(3, 64, 7))
    assert not np.array_equal(few, draws_of(3, 64, 8))
    # each scramble of eight Sobol points has one in every eighth of each dimension
    for k in range(8):
        assert (np.sort(np.floor(8 * few[k::8]), axis=0) == np.arange(8)[:, None]).all()


def test_distributions(scene_of):
    scene = scene_of(
        (
            'key = "wear.density_kg_m3"\nshared = true\ndistribution = "uniform"\n'
            "low = 7000\nhigh = 8000"
        ),
        (
            'key = "operation.friction"\nshared = true\ndistribution = "normal"\n'
            "mean = 0.35\nstd = 0.02"
        ),
        (
            'key = "field.operation.environment"\ndistribution = "lognormal"\n'
            "median = 0.18\nwithin = 2.0"
        ),
        (
            'key = "wear.form"\nshared = true\ndistribution = "values"\n'
            'values = ["local", "patch_mean"]'
        ),
    )
    one = {dimension.section.key: dimension.drawn for dimension in dimensions_of(scene)}
    assert [one["wear.density_kg_m3"](share) for share in (0.25, 0.5)] == [
        7250.0,
        7500.0,
    ]
    assert one["operation.friction"](0.841345) == pytest.approx(0.37, abs=1e-6)
    # 90 % between half and twice the median
    assert [one["field.operation.environment"](s) for s in (0.05, 0.5, 0.95)] == [
        0.09,
        0.18,
        0.36,
    ]
    assert [one["wear.form"](share) for share in (0.0, 0.49, 0.51)] == [
        "local",
        "local",
        "patch_mean",
    ]


def test_values_and_scale_of_the_law_can_be_drawn(tmp_path):
    law = "[wear]\nscale = 1.0\nvalues = {severe_limit = 10.4}\n"
    uniform = 'distribution = "uniform"\nlow = 8.0\nhigh = 10.0'
    inputs = "".join(
        f'[[uncertainty.input]]\nkey = "wear.{key}"\n{uniform}\n'
        for key in ("values.severe_limit", "scale")
    )
    text = shipped_path("workflows", "limits.toml").read_text()
    (tmp_path / "scene.toml").write_text(f"{text}\n{law}[uncertainty]\n{inputs}")
    drawn = [
        (one, one.drawn(0.5))
        for one in dimensions_of(load_scene(tmp_path / "scene.toml"))
    ]
    overrides = overrides_of(drawn)
    wear = load_scene(tmp_path / "scene.toml", overrides=overrides).wear
    assert (wear.values, wear.scale) == ({"severe_limit": 9.0}, 9.0)


def test_keys_act_where_they_stand(scene_of):
    """Of every block and class; of one scene; shared by both or drawn for each; factors
    after values.
    """
    scene = scene_of(
        'key = "operation.environment"\nacts = "factor"\nshared = true\n'
        'name = "steel"\n'
        'distribution = "lognormal"\nmedian = 1\nwithin = 2',
        (
            'key = "field.operation.environment"\ndistribution = "uniform"\n'
            "low = 0.1\nhigh = 0.3"
        ),
        'key = "operation.friction"\ndistribution = "uniform"\nlow = 0.3\nhigh = 0.4',
        'key = "rig.operation.block.2.yaw_mrad"\nacts = "addition"\n'
        'distribution = "normal"\nmean = 0\nstd = 1',
    )
    dimensions = dimensions_of(scene)
    names = [
        "steel",
        "field.operation.environment",
        "operation.friction, rig",
        "operation.friction, field",
        "rig.operation.block.2.yaw_mrad",
    ]
    assert [one.name for one in dimensions] == names
    drawn = overrides_of(zip(dimensions, (2.0, 0.25, 0.31, 0.39, 0.5), strict=True))
    values = {item.key: item.value for item in drawn}
    assert [values[f"field.operation.class.{k}.environment"] for k in (1, 2, 3)] == [
        0.5
    ] * 3
    # those of the rig are not in its scene: their default is 1
    assert [values[f"rig.operation.block.{k}.environment"] for k in (1, 2, 3, 4)] == [
        2.0
    ] * 4
    assert {values[f"rig.operation.block.{k}.friction"] for k in (1, 2, 3, 4)} == {0.31}
    assert {values[f"field.operation.class.{k}.friction"] for k in (1, 2, 3)} == {0.39}
    assert values["rig.operation.block.2.yaw_mrad"] == 0.5
    changed = load_scene(scene.origin.path, overrides=drawn)
    assert changed.rig.operation.blocks[1].yaw_mrad == 0.5
    assert changed.field.operation.classes[0].environment == 0.5


def test_a_law_is_drawn_with_its_coefficients(scene_of):
    scene = scene_of(
        'key = "wear"\nshared = true\ndistribution = "values"\n'
        'values = [{law = "usfd"}, {law = "archard", coefficients = "jendel_2002"}]'
    )
    (dimension,) = dimensions_of(scene)
    changed = load_scene(
        scene.origin.path, overrides=overrides_of([(dimension, dimension.drawn(0.9))])
    )
    laws = {(part.wear.law, part.wear.coefficients) for part in changed.parts}
    assert laws == {("archard", "jendel_2002")}


NORMAL = 'distribution = "normal"\nmean = 0.3\nstd = 0.1'


@pytest.mark.parametrize(
    ("inputs", "head", "message"),
    [
        ((), "", "bands need uncertain inputs; write [[uncertainty.input]]"),
        ((f'key = "operaton.friction"\n{NORMAL}',), "", "is none of this scene"),
        (
            ('key = "operation.friction"\ndistribution = "normal"\nmean = 0.3',),
            "",
            "needs std",
        ),
        ((f'key = "operation.friction"\n{NORMAL}\nlow = 0.1',), "", "has no low"),
        (
            (
                (
                    'key = "operation.friction"\ndistribution = "uniform"\nlow = 0.4\n'
                    "high = 0.3"
                ),
            ),
            "",
            "below high",
        ),
        (
            (f'key = "wear.law"\nacts = "factor"\n{NORMAL}',),
            "",
            "needs numbers in the scene",
        ),
        ((f'key = "operation.friction"\n{NORMAL}',), "draws = 100", "write 64 or 128"),
        ((f'key = "operation.friction"\n{NORMAL}',) * 2, "", "two inputs are called"),
        (
            (f'key = "rig.wear.density_kg_m3"\nshared = true\n{NORMAL}',),
            "",
            "only the rig has",
        ),
        (
            (
                f'key = "operation.friction"\n{NORMAL}\n'
                '[[uncertainty.material]]\nname = "R8T"\nwear = {hardnes_GPa = 3}',
            ),
            "",
            'wear of "R8T": ',
        ),
    ],
)
def test_faults_name_the_key_and_the_fix(scene_of, inputs, head, message):
    scene = scene_of(*inputs, head=head)
    with pytest.raises(SceneError) as raised:
        dimensions_of(scene)
    assert any(message in fault.message and fault.line for fault in raised.value.faults)


def test_unknown_distributions_are_faults_of_the_scene(scene_of):
    with pytest.raises(SceneError, match="distribution"):
        scene_of('key = "operation.friction"\ndistribution = "gamma"')


def test_keys_of_a_vehicle_are_uncertain_too(tmp_path):
    """Those of every class of its track under `operation`, as elsewhere; how it moves
    on straight track.
    """
    text = shipped_path("workflows", "field.toml").read_text()
    text += """
[[uncertainty.input]]
key = "operation.environment"
distribution = "uniform"
low = 0.1
high = 0.3
[[uncertainty.input]]
key = "vehicle.tangent"
distribution = "values"
values = ["suspended", "kinematic"]
"""
    (tmp_path / "field.toml").write_text(text)
    drawn = [
        (one, one.drawn(0.75))
        for one in dimensions_of(load_scene(tmp_path / "field.toml"))
    ]
    changes = {one.key: one.value for one in overrides_of(drawn)}
    assert changes.pop("vehicle.tangent") == "kinematic"
    assert changes == {f"vehicle.class.{k}.environment": 0.25 for k in (1, 2, 3, 4)}


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("wear.density_kg_m3", "kg/m³"),
        ("wear.energy_coefficient_mm3_kJ", "mm³/kJ"),
        ("fatigue.shear_yield_MPa", "MPa"),
        ("counterface.wear.area_mm2_per_1000km", "mm²/1000 km"),
        ("operation.block.curve.torque_kN_m", "kN m"),
        ("operation.block.curve.shift_mm", "mm"),
        ("operation.block.curve.friction", ""),
    ],
)
def test_values_of_a_key_have_its_unit_as_people_read_it(key, unit):
    assert input_unit(key) == unit
