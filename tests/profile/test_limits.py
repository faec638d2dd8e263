"""Limits as data: the shipped table, files of users with all their faults, and
judgements.
"""

import csv
import io
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wearsim.errors import ProfileError
from wearsim.profile.limits import (
    LIMITED,
    Diameters,
    LimitSet,
    judge,
    load_limits,
    shipped_limits,
)
from wearsim.profile.measures import (
    Measures,
    MeasuringRule,
    axle_measures,
    wheel_measures,
)
from wearsim.profile.standard import wheel

NEW = wheel("S1002")


def judged(values, limits, diameter=None):
    """Judgements on one wheel."""
    size = {} if diameter is None else {"wheel_diameter": diameter}
    known = [
        each for each in judge({"right": Measures({**values, **size}, {})}, limits)
    ]
    return [each for each in known if each.measure in values]


TSI = load_limits("TSI")


def _wheelset(right, left, back_to_back):
    """Measures of new wheels of these diameters and of their axle."""
    wheels = [wheel_measures(NEW, diameter=diameter) for diameter in (right, left)]
    return {
        "right": wheels[0],
        "left": wheels[1],
        "axle": axle_measures(*wheels, back_to_back),
    }


# shared/spec/profiles.md section 8, row by row: measure, a diameter within, min,
# max [mm]
TABLE = """\
flange_thickness,920,22,33
flange_thickness,840.1,22,33
flange_thickness,840,25,33
flange_thickness,760.1,25,33
flange_thickness,760,27.5,33
flange_thickness,330,27.5,33
flange_height,920,27.5,36
flange_height,760.1,27.5,36
flange_height,760,29.5,36
flange_height,630.1,29.5,36
flange_height,630,31.5,36
flange_height,330,31.5,36
flange_gradient,920,6.5,
flange_gradient,330,6.5,
back_to_back,920,1357,1363
back_to_back,840,1358,1363
back_to_back,760,1359,1363
front_to_front,920,1410,1426
front_to_front,840,1412,1426
front_to_front,760,1415,1426
rim_width,330,133,140
"""


@pytest.mark.parametrize(
    "row", list(csv.reader(io.StringIO(TABLE))), ids=lambda row: "-".join(row[:2])
)
def test_shipped_limits_are_those_of_the_table(row):
    measure, diameter, least, most = row
    result = judged({measure: 1.0}, TSI, 1e-3 * float(diameter))
    limits = {each.bound: each.limit for each in result}
    expected = {"min": least, "max": most}
    assert limits == {
        bound: pytest.approx(1e-3 * float(x), abs=1e-15)
        for bound, x in expected.items()
        if x
    }
    assert all(each.certainty.startswith("TSI default, check") for each in result)
    assert all("EN 15313" in each.source for each in result)


def test_every_limited_measure_of_the_table_is_covered_and_hollowing_is_no_tsi_limit():
    assert {limit.measure for limit in TSI.limits} == {
        row.split(",")[0] for row in TABLE.split()
    } | {"hollowing"}
    (hollow,) = [limit for limit in TSI.limits if limit.measure == "hollowing"]
    assert "not verified" in hollow.certainty
    assert "EN 15313" not in hollow.source


def test_judgement_of_a_new_wheel():
    """New S1002 has a margin of 0.5 mm to the largest flange thickness and to the least
    flange height.
    """
    result = [
        each for each in judge(_wheelset(0.92, 0.92, 1.36), TSI) if each.wheel != "left"
    ]
    assert not any(each.exceeded for each in result)
    margins = {(each.measure, each.bound): each.margin for each in result}
    assert margins["flange_thickness", "max"] == pytest.approx(0.5e-3, abs=0.1e-6)
    assert margins["flange_height", "min"] == pytest.approx(0.5e-3, abs=0.1e-6)
    assert margins["front_to_front", "max"] == pytest.approx(1e-3, abs=0.2e-6)
    assert {
        each.condition for each in result if each.measure == "flange_thickness"
    } == {"D > 840 mm"}


def test_a_small_wheel_with_a_flange_of_28_mm_is_beyond():
    (low,) = [
        each
        for each in judge({"right": wheel_measures(NEW, diameter=0.70)}, TSI)
        if (each.measure, each.bound) == ("flange_height", "min")
    ]
    assert low.exceeded
    assert low.margin == pytest.approx(-1.5e-3, abs=0.1e-6)
    assert low.condition == "630 < D <= 760 mm"


@settings(max_examples=50, deadline=None, derandomize=True)
@given(value=st.floats(0.0, 60e-3), diameter=st.floats(0.33, 1.2))
def test_exceeded_is_the_sign_of_the_margin(value, diameter):
    for each in judged({"flange_thickness": value}, TSI, diameter):
        assert each.exceeded == (each.margin < -1e-9)
        assert each.margin == pytest.approx(
            value - each.limit if each.bound == "min" else each.limit - value, abs=1e-15
        )


def test_without_a_diameter_only_what_all_limits_agree_on_is_judged():
    result = {
        (each.measure, each.bound): each
        for each in judged(wheel_measures(NEW).values, TSI)
    }
    low, high = (
        result["flange_height", "min"],
        result["flange_height", "max"],
    )  # 28 mm of 27.5, 29.5, 31.5
    assert (low.limit, low.margin, low.exceeded) == (None, None, None)
    assert low.reason == "depends on the wheel diameter, which is not given"
    assert (high.limit, high.exceeded, high.condition) == (
        36e-3,
        False,
        "any diameter listed",
    )
    low = result["flange_thickness", "min"]  # 32.5 mm, more than the strictest
    assert (low.limit, low.exceeded, low.condition) == (
        27.5e-3,
        False,
        "any diameter listed",
    )


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    values=st.fixed_dictionaries(
        {
            "flange_thickness": st.floats(20e-3, 35e-3),
            "flange_height": st.floats(26e-3, 37e-3),
            "back_to_back": st.floats(1.355, 1.365),
            "front_to_front": st.floats(1.405, 1.430),
        }
    )
)
def test_without_a_diameter_what_is_told_holds_for_every_listed_one(values):
    """The diameters are the ends of all ranges of the file, and one within each."""
    diameters = [0.33, 0.63, 0.6301, 0.7, 0.76, 0.7601, 0.8, 0.84, 0.8401, 0.92, 1.2]
    message = [
        {(j.measure, j.bound): j.exceeded for j in judged(values, TSI, each)}
        for each in diameters
    ]
    for each in judged(values, TSI):
        by_diameter = {result[each.measure, each.bound] for result in message}
        if each.exceeded is None:
            assert by_diameter == {True, False}
            assert (each.limit, each.margin) == (None, None)
            assert each.reason
        else:
            assert by_diameter == {each.exceeded}
            assert each.margin == pytest.approx(
                (each.value - each.limit) * (1 if each.bound == "min" else -1),
                abs=1e-15,
            )


def test_a_bound_that_some_diameters_lack_condemns_nothing_without_a_diameter():
    (first, *_) = [limit for limit in TSI.limits if limit.measure == "flange_thickness"]
    small = first.model_copy(
        update={"min_mm": None, "diameter_mm": Diameters(up_to=840.0)}
    )
    result = {
        each.bound: each
        for each in judged(
            {"flange_thickness": 20e-3}, LimitSet("", "", (first, small))
        )
    }
    assert result["min"].exceeded is None
    assert result["max"].exceeded is False


def test_an_axle_with_a_wheel_of_unknown_size_is_judged_as_without_a_diameter():
    right = Measures({"wheel_diameter": 0.9}, {})
    axle = Measures({"back_to_back": 1.3575}, {})
    (low, _) = judge({"right": right, "left": Measures({}, {}), "axle": axle}, TSI)
    assert low.exceeded is None


def test_a_diameter_without_limits_is_told():
    result = {
        (each.measure, each.bound): each
        for each in judged(wheel_measures(NEW).values, TSI, 0.30)
    }
    assert result["flange_thickness", "max"].exceeded is None
    assert (
        result["flange_thickness", "max"].reason
        == "no limit is given for a wheel diameter of 300 mm"
    )
    assert result["flange_gradient", "min"].exceeded is False


def test_what_was_not_measured_stays_in_the_list_with_its_reason():
    tread = NEW.y > -36e-3
    measured = wheel_measures(
        replace(NEW, y=NEW.y[tread], z=NEW.z[tread]), diameter=0.92
    )
    (thickness, _) = [
        each
        for each in judge({"right": measured}, TSI)
        if each.measure == "flange_thickness"
    ]
    assert (thickness.value, thickness.exceeded) == (None, None)
    assert "does not reach 10 mm" in thickness.reason
    assert judged({}, TSI) == []


def test_wheelset_the_smaller_wheel_chooses_the_limits_of_the_axle():
    result = judge(_wheelset(0.8402, 0.8398, 1.3575), TSI)
    thickness = [
        each
        for each in result
        if (each.wheel, each.measure) == ("right", "flange_thickness")
    ]
    assert {each.condition for each in thickness} == {"D > 840 mm"}
    (low, _) = [each for each in result if each.measure == "back_to_back"]
    assert low.exceeded
    assert low.condition == "760 < D <= 840 mm"


OWN = """\
title = "our depot"
source = "works rule 7"
certainty = "binding"

[[limit]]
measure = "wheel_diameter_difference"
max_mm = 0.5

[[limit]]
measure = "equivalent_conicity"
max = 0.4
source = "works rule 8"

[[limit]]
measure = "hollowing"
diameter_mm = { below = 900 }
max_mm = 3
"""


def test_limits_of_ones_own(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(OWN)
    own = load_limits(path)
    assert (own.name, own.title) == ("own", "our depot")
    values = {
        "wheel_diameter_difference": -0.7e-3,
        "equivalent_conicity": 0.3,
        "hollowing": 3.5e-3,
    }
    result = judged(values, own, 0.9)
    assert [each.exceeded for each in result] == [True, False, None]
    assert result[0].margin == pytest.approx(
        -0.2e-3, abs=1e-12
    )  # a difference counts by its size
    assert [each.source for each in result[:2]] == ["works rule 7", "works rule 8"]
    (hollow,) = judged({"hollowing": 3.5e-3}, own, 0.8999)
    assert hollow.exceeded
    assert hollow.condition == "D < 900 mm"


FAULTY = """\
title = 3
colour = "red"
[[limit]]
measure = "flange_hight"
min_mm = 3
[[limit]]
measure = "hollowing"
max_mm = "a"
diameter_mm = { above = 900, up_to = 800 }
[[limit]]
source = "x"
certainty = "y"
measure = "rim_width"
min_mm = 5
max_mm = 3
[[limit]]
measure = "equivalent_conicity"
max_mm = 3
[[limit]]
measure = "flange_gradient"
min_mm = 6.5
[[limit]]
source = "x"
certainty = "y"
measure = "flange_gradient"
[[limit]]
measure = "flange_gradient"
min_mm = nan
diameter_mm = { over = 3 }
[[limit]]
min_mm = 1
"""


def test_all_faults_of_a_file_are_told_at_once_with_their_lines(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text(FAULTY)
    with pytest.raises(ProfileError) as caught:
        load_limits(path)
    message = str(caught.value).splitlines()
    assert all(line.startswith(f"{path}:") for line in message)
    assert [
        (int(line.split(":")[1]), line.split(": ", 1)[1][:31]) for line in message
    ] == [
        (1, "title = 3 must be a text"),
        (2, "unknown key colour in the file;"),
        (4, 'measure = "flange_hight" is not'),
        (8, 'max_mm = "a" must be a number, '),
        (9, "diameter_mm: 900 must be below "),
        (14, "min_mm = 5 is above max_mm = 3"),
        (18, "max_mm is no key of a limit of "),
        (22, "gives no min_mm and no max_mm o"),
        (28, "min_mm = nan must be a finite n"),
        (29, "unknown key over in [limit.diam"),
        (30, "key measure is missing in [[lim"),
    ]
    assert 'did you mean "flange_height"?' in message[2]


def test_limits_need_source_and_certainty_of_their_own_or_of_the_file(tmp_path):
    path = tmp_path / "bare.toml"
    path.write_text(
        '[[limit]]\nmeasure = "flange_gradient"\nmin_mm = 6.5\n[[limit]]\n'
        'source = "x"\nmeasure = "hollowing"\nmax_mm = 3\n'
    )
    with pytest.raises(ProfileError) as caught:
        load_limits(path)
    assert str(caught.value) == (
        f"{path}:1: the limits of flange_gradient, hollowing have no source or "
        "certainty; give it for each limit or for the file"
    )


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", r"\[\[limit\]\] is missing; give at least one"),
        (b'title = "a"\nx = [1\n', ":2: not valid TOML"),
        (b"limit = 3\n", r"1: \[limit\] must be a list of tables; write \[\[limit\]\]"),
        (b"\xff\xfe\x00", "is not UTF-8 text"),
        (
            b"[[limit]]\nmeasure = [1]\n",
            r"2: measure = \[1\] is not allowed; known: flange_height",
        ),
        (b'limit = [{ measure = "hollowing" }]\n', "gives no min_mm"),
        (b"x = " + b"[" * 5000, "nested too deeply"),
    ],
)
def test_damaged_files_are_one_clear_line_each(tmp_path, content, message):
    path = tmp_path / "bad.toml"
    path.write_bytes(content)
    with pytest.raises(ProfileError, match=message) as caught:
        load_limits(path)
    assert str(caught.value).startswith(f"{path}:")


def test_unknown_names_are_told_with_what_there_is(tmp_path):
    with pytest.raises(
        ProfileError,
        match=r"'TSO' is neither a file nor .*\(AAR, British, Chinese, TSI\); "
        "did you mean 'TSI'",
    ):
        load_limits("TSO")
    with pytest.raises(ProfileError, match="no such file of limits"):
        load_limits(tmp_path / "none.toml")


@pytest.mark.parametrize(
    ("range_", "text", "inside", "outside"),
    [
        ({"above": 840.0}, "D > 840 mm", 0.8401, 0.84),
        ({"from": 330.0}, "D >= 330 mm", 0.33, 0.3299),
        ({"below": 840.0}, "D < 840 mm", 0.8399, 0.84),
        ({"from": 330.0, "up_to": 760.0}, "330 <= D <= 760 mm", 0.76, 0.7601),
    ],
)
def test_diameter_ranges(range_, text, inside, outside):
    diameters = Diameters(**range_)
    assert diameters.text == text
    assert inside in diameters
    assert outside not in diameters
    assert 0.84 + 1e-12 not in Diameters(above=840.0)  # rounding of 2 r is no diameter


def test_every_measure_can_have_limits():
    measured = wheel_measures(NEW, diameter=0.92)
    assert set(measured.values) - {"back_to_back"} <= set(LIMITED)


@pytest.mark.parametrize("name", shipped_limits())
def test_every_shipped_limit_has_source_and_certainty(name):
    limits = load_limits(name)
    assert limits.gauge is not None
    assert limits.back_to_back is not None
    assert all(one.source and one.certainty for one in limits.limits)


def test_limits_are_valid_for_a_family_of_gauge_and_wheelset():
    """1353 mm is a Chinese wheelset, 1676 mm the Indian gauge: no limits of the TSI."""
    assert TSI.foreign(None, None) == ""
    assert TSI.foreign(1.435, 1.360) == ""
    # a bent European wheelset is beyond its limits, not of another railway
    assert TSI.foreign(1.435, 1.3555) == ""
    assert "back-to-back distance of 1355 to 1365 mm, stated are 1353 mm" in (
        TSI.foreign(1.435, 1.353)
    )
    assert "gauge of 1430 to 1470 mm, stated are 1676 mm" in TSI.foreign(1.676, 1.6)
    assert load_limits("Chinese").foreign(1.435, 1.353) == ""


def test_limits_of_another_measuring_height_are_left_open():
    """Sd at 10 mm is not the Sd of Chinese limits; Sh does not depend on the height."""
    limits = load_limits("Chinese")
    at_10 = {"right": wheel_measures(NEW)}
    by_measure = {each.measure: each for each in judge(at_10, limits)}
    assert by_measure["flange_thickness"].exceeded is None
    assert "Sd 12 mm above the running circle" in by_measure["flange_thickness"].reason
    assert by_measure["flange_height"].exceeded is False
    rule = MeasuringRule(height=12e-3)
    at_12 = {"right": wheel_measures(NEW, rule=rule)}
    by_measure = {each.measure: each for each in judge(at_12, limits, rule)}
    assert by_measure["flange_thickness"].exceeded is False
    other = MeasuringRule(12e-3, 65e-3)
    circle = {each.measure: each for each in judge(at_12, limits, other)}
    assert "running circle 70 mm" in circle["flange_height"].reason


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("gauge_mm = [1470, 1430]", "gauge_mm: 1470 must be below 1430"),
        ("back_to_back_mm = [1353]", "back_to_back_mm"),
        ("measuring_height_mm = 40", "measuring_height_mm"),
    ],
)
def test_faults_of_the_range_of_a_set_stand_at_their_line(tmp_path, line, message):
    file = tmp_path / "own.toml"
    file.write_text(
        f'source = "x"\ncertainty = "y"\n{line}\n[[limit]]\n'
        'measure = "flange_height"\nmax_mm = 33\n'
    )
    with pytest.raises(ProfileError) as caught:
        load_limits(file)
    assert "own.toml:3: " in str(caught.value)
    assert message in str(caught.value)


@pytest.mark.parametrize("number", [5.2, 9.0, 13.0, 18.0, 59.0, 71.0, 72.0])
def test_equal_rules_of_measuring_are_equal_beyond_rounding(number):
    """Limits are read as mm / 1000, flags and scenes as 0.001 mm."""
    limits = replace(
        load_limits("TSI"), measuring_height=number / 1e3, running_circle=number / 1e3
    )
    rule = MeasuringRule(height=1e-3 * number, running_circle=1e-3 * number)
    for measure in ("flange_thickness", "flange_height", "wheel_diameter"):
        assert limits.measured_otherwise(measure, rule) == ""
    other = replace(rule, height=1e-3 * number + 1e-6)
    assert limits.measured_otherwise("flange_thickness", other)
