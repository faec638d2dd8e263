"""[wear] and [fatigue]: which laws and numbers a scene stands for, and what raises an
error.
"""

import re
from pathlib import Path

import pytest
from law_settings import wear_settings

from wearsim.campaign.comparison import comparison_laws
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.cli.flags import overrides_of
from wearsim.damage import fatigue
from wearsim.damage.wear import WEAR_LAWS, coefficients_of, energy
from wearsim.scene import build, files_to_copy, load_scene, scene_schema
from wearsim.scene.setup import warnings_of

RIG = (Path(__file__).parents[1] / "data" / "scene_rig.toml").read_text()
FIRST = RIG.count("\n") + 1

TABLE = """\
[wear.table]
source = "twin disc, our laboratory"
certainty = "measured, 10 %"
interpolation = "linear"
beyond = "slope"
T_gamma_A_N_mm2 = [0, 10.4, 20]
mass_rate_ug_m_mm2 = [0, 55.0, 60]
"""
FILE = """\
# source = twin disc
# certainty = measured
# interpolation = step
# beyond = hold
power_density_W_mm2, energy_coefficient_mm3_kJ
0, 0.1
4, 0.3
"""


def loaded(text):
    Path("scene.toml").write_text(RIG + text)
    return load_scene("scene.toml")


@pytest.mark.parametrize(
    "law", sorted(name for name, law in WEAR_LAWS.items() if law.coefficients)
)
def test_each_law_comes_with_its_own_set_and_form(folder, law):
    scene = loaded(f'[wear]\nlaw = "{law}"\n')
    wear = build(scene).wear
    record = WEAR_LAWS[law]
    assert (wear.law, wear.coefficients, wear.form) == (
        law,
        record.coefficients,
        record.forms[0],
    )
    assert (
        scene.wear.coefficients == record.coefficients
    )  # shown by every output of the scene
    assert scene.wear.form == record.forms[0]


def test_wear_without_a_section_is_as_ever(folder):
    wear = build(load_scene("rig.toml")).wear
    assert (wear.law, wear.coefficients, wear.form) == (
        "usfd",
        "lewis_dwyer_joyce_2004",
        "local",
    )
    setup = build(load_scene("rig.toml"))
    assert setup.also_evaluate == setup.fatigue == ()


def test_archard_takes_the_hardness_of_the_wheel_and_a_cap(folder):
    setup = build(
        loaded(
            '[wear]\nlaw = "archard"\nform = "patch_mean"\nhardness_GPa = 2.7\n'
            'seizure_cap = "regime"\n'
        )
    )
    assert setup.wear.seizure_cap == "regime"
    assert coefficients_of(setup.wear)["hardness"] == pytest.approx(2.7, rel=1e-15)
    assert setup.warnings == ()


def test_values_and_scale_are_shown_by_every_output(folder):
    setup = build(loaded("[wear]\nscale = 2.5\n[wear.values]\nsevere_limit = 8.0\n"))
    changed, other = coefficients_of(setup.wear), coefficients_of(wear_settings("usfd"))
    assert (changed["severe_limit"], changed["mild_slope"]) == (
        8.0,
        other["mild_slope"],
    )
    assert set(changed.numbers) - set(other.numbers) == {
        "severe_limit = 8 N mm-2",
        "wear.scale = 2.5",
    }
    for text in (
        "severe_limit = 8 N mm-2 (as given in [wear.values]) in place of 10.4.",
        "multiplied by 2.5",
    ):
        assert any(text in one for one in changed.departures)
    attributes = WheelsetEvolution(setup).header.attributes
    assert (
        "severe_limit = 8 N mm-2, catastrophic_limit = 77.2"
        in attributes["wear_law_numbers"]
    )
    assert "in place of 10.4." in attributes["wear_coefficients_departures"]


def test_values_act_on_the_active_law_alone(folder):
    text = """[wear]
also_evaluate = ["archard", {law = "usfd", form = "patch_mean"}, {law = "usfd", coefficients = "%s"}]
values = {mild_slope = 4.0}
scale = 2.0
"""
    setup = build(loaded(text % WEAR_LAWS["usfd"].coefficients))
    given = (("mild_slope", 4.0),), 2.0
    of_law = [(one.values, one.scale) for one in (setup.wear, *setup.also_evaluate)]
    assert of_law == [
        given,
        ((), 1.0),
        given,
        ((), 1.0),
    ]  # the last is the published law, for comparison
    archard, mean, published = comparison_laws(setup).names
    assert (archard, mean) == (
        "archard",
        "usfd (patch mean, lewis_dwyer_joyce_2004, changed)",
    )
    assert published == "usfd (local, lewis_dwyer_joyce_2004)"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "sever_limit = 8",
            (
                'sever_limit is no value of coefficients = "lewis_.*", which has '
                "mild_slope, .*did you"
            ),
        ),
        (
            "severe_limit = 8000",
            (
                "severe_limit = 8000.* must be at least 0.104 and at most 1040 N "
                "mm-2; the publ.* 10.4"
            ),
        ),
        ("severe_limit = -8", "severe_limit = -8.* must be at least"),
        (
            "severe_limit = 80",
            "severe_limit = 80 must be below catastrophic_limit = 77.2 N mm-2$",
        ),
        ("severe_limit = true", "severe_limit = true must be a number"),
        ('severe_limit = "8"', 'severe_limit = "8" must be a number'),
    ],
)
def test_a_value_out_of_its_range_is_an_error_at_its_line(
    folder, faults_of, text, message
):
    (line,) = faults_of(f"{RIG}[wear.values]\n{text}\n")
    assert re.match(rf"scene.toml:{FIRST + 1}: {message}", line)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            'law = "archard"\nvalues = {hardness = 2.7}',
            "hardness has a key of its own; write hardness_GPa in",
        ),
        (
            f'law = "table"\nvalues = {{k = 1.0}}\n{TABLE}',
            'values: law = "table" has the numbers of its table;',
        ),
        ("scale = 0", "scale = 0 must be at least 0.01 and at most 100"),
    ],
)
def test_values_that_have_another_place_are_errors(folder, faults_of, text, message):
    (line,) = faults_of(f"{RIG}[wear]\n{text}\n")
    assert message in line


def test_a_value_is_set_by_its_key(folder):
    scene = load_scene(
        "rig.toml", overrides=overrides_of(["wear.values.severe_limit=8"])
    )
    assert scene.wear.values == {"severe_limit": 8.0}
    without = load_scene(
        "rig.toml", overrides=overrides_of(["wear.values.severe_limit="])
    )
    assert not without.wear.values


def test_a_table_in_the_scene(folder):
    setup = build(loaded('[wear]\nlaw = "table"\nform = "patch_mean"\n' + TABLE))
    table = coefficients_of(setup.wear)
    assert setup.wear.form == "patch_mean"
    assert (table.name, table.index, table.rate) == (
        "wear.table",
        ("T_gamma_A_N_mm2",),
        "mass_rate_ug_m_mm2",
    )
    assert table.axes[0].tolist() == [0.0, 10.4e6, 20e6]
    assert "measured, 10 %" in table.validity


def test_a_table_in_a_file_goes_with_the_scene(folder):
    Path("own.csv").write_text(FILE)
    scene = loaded('[wear]\nlaw = "table"\ntable_file = "own.csv"\n')
    setup = build(scene)
    table = coefficients_of(setup.wear)
    assert table.name == "own.csv"
    assert table.rates.tolist() == pytest.approx([0.1e-12, 0.3e-12], rel=1e-15)
    assert dict(setup.input_hashes)["wear.table_file own.csv"]
    Path("kept").mkdir()
    for name, content in files_to_copy(scene).items():
        (Path("kept") / name).write_bytes(content)
    Path("own.csv").unlink()
    again = build(load_scene("kept/scene.toml", copied=True))
    assert coefficients_of(again.wear).rates.tolist() == table.rates.tolist()
    assert again.input_hashes == setup.input_hashes


def test_faults_of_a_table_file_have_its_lines(folder, faults_of):
    Path("own.csv").write_text(
        FILE.replace("4, 0.3", "4, -0.3").replace("hold", "stop")
    )
    text = RIG + '[wear]\nlaw = "table"\ntable_file = "own.csv"\n'
    assert faults_of(text) == [
        (
            'own.csv:4: beyond = "stop" is not allowed; did you mean "slope"? (known: '
            "hold, slope)"
        ),
        "own.csv:7: energy_coefficient_mm3_kJ[1] = -0.3 must be at least 0 and at "
        "most 1e+12 mm3/kJ; give volume lost per frictional work",
    ]
    Path("own.csv").unlink()
    (fault,) = faults_of(text)
    assert fault.startswith(
        f'scene.toml:{FIRST + 2}: table_file = "own.csv" does not exist'
    )


def test_comparison_laws(folder):
    Path("own.csv").write_text(FILE)
    setup = build(
        loaded(
            '[wear]\nalso_evaluate = ["archard", "brr", "table"]\n'
            'table_file = "own.csv"\n'
            "hardness_GPa = 2.8\ndensity_kg_m3 = 7800\n"
        )
    )
    assert (setup.wear.law, setup.wear.hardness) == ("usfd", None)
    archard, brr, table = setup.also_evaluate
    assert (archard.law, archard.coefficients, archard.hardness) == (
        "archard",
        "jendel_2002",
        2.8e9,
    )
    assert (brr.form, brr.density) == ("patch_mean", 7800.0)
    assert table.coefficients.name == "own.csv"
    for settings in setup.also_evaluate:
        coefficients_of(settings)


def test_a_comparison_law_with_another_form_or_set(folder):
    """The active law, too; what is not given is as for a name alone."""
    scene = loaded(
        '[wear]\nlaw = "energy"\ncoefficients = "krause_poll_1986"\n'
        'also_evaluate = ["usfd", {law = "usfd", form = "patch_mean"}, {law = '
        '"energy", form = "patch_mean"}, {law = "energy", coefficients = '
        '"zobory_1997"}]\n'
    )
    message = [
        (one.law, one.form, one.coefficients) for one in build(scene).also_evaluate
    ]
    assert message == [
        ("usfd", "local", "lewis_dwyer_joyce_2004"),
        ("usfd", "patch_mean", "lewis_dwyer_joyce_2004"),
        ("energy", "patch_mean", "krause_poll_1986"),
        ("energy", "local", "zobory_1997"),
    ]
    assert comparison_laws(build(scene)).names == (
        "usfd (local)",
        "usfd (patch mean)",
        "energy (patch mean, krause_poll_1986)",
        "energy (local, zobory_1997)",
    )
    written = scene.model_dump(by_alias=True, mode="json")["wear"]["also_evaluate"]
    assert written[0] == "usfd"
    assert written[3] == {"law": "energy", "form": None, "coefficients": "zobory_1997"}
    alone = loaded(
        '[wear]\nalso_evaluate = ["archard", {law = "usfd", form = "patch_mean"}]\n'
    )
    assert comparison_laws(build(alone)).names == ("archard", "usfd (patch mean)")


def test_one_energy_coefficient_in_place_of_a_set(folder):
    scene = loaded(
        '[wear]\nlaw = "energy"\nenergy_coefficient_mm3_kJ = 0.7\n'
        'also_evaluate = [{law = "energy", coefficients = "zobory_1997"}]\n'
    )
    assert scene.wear.coefficients is None
    setup = build(scene)
    result = coefficients_of(setup.wear)
    assert (result.name, result["mild"], result.uncertain) == (
        "constant",
        pytest.approx(0.7e-12, rel=1e-15),
        (),
    )
    assert energy.power_limit(result) == float("inf")
    assert comparison_laws(setup).names == ("energy (zobory_1997)",)


def test_all_fatigue_laws(folder):
    setup = build(
        loaded(
            '[fatigue]\nlaws = ["surface_fatigue_index", '
            '"surface_fatigue_index_local", "stress_index", "wlrm"]\n'
            'coefficients = ["burstow_2004_20n"]\nshear_yield_MPa = 320\n'
            'wear_number = "with_spin"\n'
            'branch = "rising"\ncrack_depth_mm = 5\ncrack_width_mm = 12\n'
            "wear_limit_mm = 4\n"
        )
    )
    assert [each.law for each in setup.fatigue] == [
        "surface_fatigue_index",
        "surface_fatigue_index_local",
        "stress_index",
        "wlrm",
    ]
    result = [fatigue.coefficients_of(each) for each in setup.fatigue]
    assert [each["shear_yield"] for each in result[:3]] == [320.0] * 3
    wlrm = setup.fatigue[3]
    assert (result[3].name, wlrm.branch, wlrm.wear_number) == (
        "burstow_2004_20n",
        "rising",
        "with_spin",
    )
    assert (wlrm.crack_depth, wlrm.crack_width, wlrm.wear_limit) == (5e-3, 12e-3, 4e-3)
    assert (setup.fatigue[0].branch, setup.fatigue[0].crack_depth) == ("net", None)


def test_break_points_of_ones_own(folder):
    setup = build(
        loaded(
            '[fatigue]\nlaws = ["wlrm"]\n[fatigue.damage_function]\n'
            'source = "our fleet"\n'
            'certainty = "a guess"\nstart_N = 20\npeak_N = 80\nend_N = 200\n'
            "peak_damage = 5e-6\nfloor = 0\n"
        )
    )
    result = fatigue.coefficients_of(setup.fatigue[0])
    assert result.source == "our fleet"
    assert [
        result[name] for name in ("start", "peak", "end", "peak_damage", "floor")
    ] == [
        20,
        80,
        200,
        5e-6,
        0,
    ]


def test_comparison_laws_and_fatigue_need_no_warning(folder):
    setup = build(loaded('[wear]\nalso_evaluate = ["energy"]\n[fatigue]\n'))
    assert setup.warnings == ()
    assert (len(setup.also_evaluate), len(setup.fatigue)) == (1, 1)


WEAR = '[wear]\nlaw = "usfd"\n'
LAWS = '[fatigue]\nlaws = ["stress_index"]\n'
OWN = (
    '[fatigue.damage_function]\nsource = "x"\ncertainty = "y"\n'
    "start_N = 20\npeak_N = 10\nend_N = 30\npeak_damage = 1e-6\n"
)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        (
            WEAR + 'coefficients = "jendel_2002"\n',
            2,
            'coefficients = "jendel_2002" belong to archard',
        ),
        ('[wear]\nlaw = "brr"\nform = "local"\n', 2, 'write form = "patch_mean"'),
        (WEAR + "hardness_GPa = 3\n", 2, "hardness_GPa acts with"),
        (WEAR + 'seizure_cap = "regime"\n', 2, "seizure_cap acts with"),
        (WEAR + 'seizure_cap = "load"\n', 2, 'seizure_cap = "load" is not allowed'),
        ('[wear]\nlaw = "table"\n', 1, 'law: "table" needs its table'),
        (
            WEAR + 'also_evaluate = ["table"]\n',
            2,
            'also_evaluate: "table" needs its table',
        ),
        (
            WEAR + 'also_evaluate = [{law = "usfd", form = "local"}]\n',
            2,
            'also_evaluate[0] = "usfd" is the active law; delete it, or give it '
            "another form or other "
            "coefficients",
        ),
        (
            WEAR
            + (
                'also_evaluate = [{law = "usfd", form = "patch_mean"}, {form = '
                '"patch_mean", law = "usfd"}]\n'
            ),
            2,
            'also_evaluate[1] = "usfd" is given twice',
        ),
        (
            WEAR + 'also_evaluate = [{law = "energy", coefficients = "jendel_2002"}]\n',
            2,
            (
                'also_evaluate[0] = "energy": coefficients = "jendel_2002" belong to '
                "archard"
            ),
        ),
        (
            WEAR + 'also_evaluate = [{law = "brr", form = "local"}]\n',
            2,
            'write form = "patch_mean"',
        ),
        (
            WEAR + 'also_evaluate = [{law = "bbr"}]\n',
            2,
            'law = "bbr" is not known; did you mean "brr"?',
        ),
        (WEAR + 'also_evaluate = [{law = "brr", shape = 1}]\n', 2, "unknown key shape"),
        (
            WEAR + 'form = "mean"\n',
            2,
            'form = "mean" is not allowed; known: local, patch_mean',
        ),
        (
            WEAR + 'beside = ["brr"]\n',
            2,
            (
                "unknown key beside in [wear]: the comparison laws are the key "
                "also_evaluate"
            ),
        ),
        (
            WEAR + 'coefficients = "burstow_2004"\n',
            2,
            '"burstow_2004" is not known; known: ',
        ),
        (
            LAWS + 'coefficients = ["jendel_2002"]\n',
            2,
            '"jendel_2002" is not known; known: ',
        ),
        (WEAR + "also_evaluate = [3]\n", 2, "also_evaluate[0] = 3 must be a table"),
        (
            WEAR + "energy_coefficient_mm3_kJ = 0.7\n",
            2,
            'acts with law = "energy" only, not with "usfd"',
        ),
        (
            (
                '[wear]\nlaw = "energy"\ncoefficients = "zobory_1997"\n'
                "energy_coefficient_mm3_kJ = 0.7\n"
            ),
            3,
            "are both given; delete one",
        ),
        (
            WEAR + 'also_evaluate = ["brr", "usfd"]\n',
            2,
            'also_evaluate[1] = "usfd" is the active law',
        ),
        (
            WEAR + 'also_evaluate = ["brr", "brr"]\n',
            2,
            'also_evaluate[1] = "brr" is given twice',
        ),
        (
            WEAR + 'also_evaluate = ["bbr"]\n',
            2,
            'also_evaluate[0] = "bbr" is not known; did you mean "brr"?',
        ),
        (WEAR + TABLE, 2, 'table acts with law = "table" only'),
        (WEAR + 'table_file = "x.csv"\n', 2, 'table_file acts with law = "table" only'),
        (
            '[wear]\nlaw = "table"\ncoefficients = "zobory_1997"\n' + TABLE,
            2,
            'law = "table" has its own numbers',
        ),
        (
            '[wear]\nlaw = "table"\n' + TABLE.replace("10.4", "30"),
            7,
            "T_gamma_A_N_mm2 = 20 must be above 30",
        ),
        (
            '[wear]\nlaw = "table"\n' + TABLE.replace("0, 55.0", "55.0"),
            8,
            "the columns must be equally long",
        ),
        (
            '[wear]\nlaw = "table"\n' + TABLE.replace('"slope"', '"stop"'),
            6,
            'beyond = "stop" is not allowed',
        ),
        (
            '[wear]\nlaw = "table"\n' + TABLE.replace("[0, 10.4, 20]", "3"),
            7,
            "must be a list",
        ),
        (
            '[wear]\nlaw = "table"\n' + TABLE.replace("[0, 10.4, 20]", "[2, 10.4, 20]"),
            7,
            'nothing says what holds below it; write below = "proportional"',
        ),
        (
            '[wear]\nlaw = "table"\n'
            + TABLE.replace("beyond =", 'below = "hold"\nbeyond ='),
            6,
            "below acts where the first row is above 0 only; delete it",
        ),
        (LAWS.replace("stress_index", "stress"), 1, 'laws[0] = "stress" is not known'),
        ('[fatigue]\nlaws = ["wlrm", "wlrm"]\n', 1, 'laws[1] = "wlrm" is given twice'),
        (
            LAWS + 'branch = "rising"\n',
            2,
            'branch acts with "wlrm" among the laws only',
        ),
        (LAWS + "crack_depth_mm = 5\n", 2, 'crack_depth_mm acts with "wlrm"'),
        (
            LAWS + "wear_limit_mm = 4\n",
            2,
            "wear_limit_mm acts with crack_depth_mm only",
        ),
        (LAWS + 'wear_number = "with_spin"\n', 2, 'wear_number acts with "wlrm"'),
        (
            LAWS + OWN.replace("peak_N = 10", "peak_N = 25"),
            2,
            'damage_function acts with "wlrm"',
        ),
        ('[fatigue]\nlaws = ["wlrm"]\n' + OWN, 2, "must rise"),
        (
            '[fatigue]\nlaws = ["wlrm"]\nshear_yield_MPa = 300\n',
            2,
            'shear_yield_MPa acts with "stress',
        ),
        ('[fatigue]\nlaws = ["wlrm"]\nbranch = "rising"\n', 2, "give crack_depth_mm"),
        (
            '[fatigue]\nlaws = ["wlrm"]\ncrack_depth_mm = 5\n',
            2,
            "both would count wear twice",
        ),
        (
            LAWS + 'coefficients = ["burstow_2004"]\n',
            2,
            "belongs to wlrm, of which laws has none",
        ),
        (
            (
                '[fatigue]\nlaws = ["wlrm"]\n'
                'coefficients = ["burstow_2004", "burstow_2004_20n"]\n'
            ),
            2,
            (
                'coefficients[1] = "burstow_2004_20n" and "burstow_2004" both belong '
                "to wlrm"
            ),
        ),
    ],
)
def test_what_does_not_fit_together(folder, faults_of, text, line, message):
    result = faults_of(RIG + text)
    (fault,) = [each for each in result if message in each]
    assert fault.startswith(f"scene.toml:{FIRST + line}: ")


def test_the_schema_knows_the_laws(folder):
    text = str(scene_schema())
    for name in (
        "krause_poll_1986",
        "surface_fatigue_index_local",
        "energy_coefficient_mm3_kJ",
    ):
        assert name in text


LOCAL = '[wear]\nlaw = "archard"\n'
BY_SLIP = TABLE.replace("T_gamma_A_N_mm2", "slip_speed_m_s")


@pytest.mark.parametrize("contact", ['model = "fast"', 'tangential = "fastsim"'])
@pytest.mark.parametrize(
    ("wear", "line"),
    [
        (LOCAL, "law: local archard"),
        (f'[wear]\nlaw = "table"\n{BY_SLIP}', "law: local table"),
        (
            '[wear]\nalso_evaluate = ["brr", "archard"]\n',
            "also_evaluate: local archard",
        ),
    ],
)
def test_slip_of_single_cells_is_not_trusted_to_fastsim(folder, contact, wear, line):
    """With fastsim, whose slip at the trailing edge is unbounded, it is a warning that
    names the fix.
    """
    warnings = build(loaded(f"{wear}[contact]\n{contact}\n")).warnings
    (warning,) = [text for text in warnings if "sliding speed of each cell" in text]
    assert warning.startswith(f"scene.toml:{FIRST + 1}: {line}")
    assert "patch_mean" in warning
    assert 'model = "standard" or "accurate" in [contact]' in warning


@pytest.mark.parametrize(
    "text",
    [
        LOCAL,
        f'{LOCAL}[contact]\nmodel = "standard"\n',
        f'{LOCAL}[contact]\nmodel = "accurate"\n',
        f'{LOCAL}[contact]\ntangential = "half_space"\n',
        f'{LOCAL}form = "patch_mean"\n',
        f'[wear]\nlaw = "table"\n{TABLE}',
        (
            '[wear]\nlaw = "usfd"\nalso_evaluate = [{law = "archard", form = '
            '"patch_mean"}, "energy"]\n'
        ),
    ],
)
def test_slip_of_single_cells_is_no_matter_elsewhere(folder, text):
    assert not any(
        "sliding speed of each cell" in line for line in build(loaded(text)).warnings
    )


@pytest.mark.parametrize("name", ["fatigue.toml", "recorded.toml"])
def test_shipped_scenes_take_archard_as_mean_over_the_patch(name):
    assert not any(
        "sliding speed" in str(line) for line in warnings_of(load_scene(name))
    )


@pytest.mark.parametrize(
    ("contact", "low"),
    [
        ("", False),
        ('model = "fast"', True),
        ('normal = "kik_piotrowski"', True),
        ('model = "accurate"', False),
    ],
)
def test_fatigue_with_the_fast_model_says_that_pressures_are_low(folder, contact, low):
    text = f"[contact]\n{contact}\n"
    assert not any("pressures" in line for line in build(loaded(text)).warnings)
    said = [
        line
        for line in build(loaded(f"{text}[fatigue]\n")).warnings
        if "largest pressures" in line
    ]
    assert len(said) == low
    assert all(
        line.startswith("scene.toml:") and "reports/contact_accuracy.md" in line
        for line in said
    )
