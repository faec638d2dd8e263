"""Wheels turned during a campaign: when, to what, and that nothing is lost on the
way.
"""

import re
from dataclasses import replace

import netCDF4
import numpy as np
import pytest

import wearsim
from wearsim.campaign.control import reached
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.record import outcome_of
from wearsim.campaign.reprofiling import (
    late,
    reprofile,
    reprofiling_due,
    to_next_reprofiling,
)
from wearsim.campaign.row import recorded_measures
from wearsim.campaign.run import resume, run_scene
from wearsim.profile.conicity import equivalent_conicity
from wearsim.profile.measures import running_circle_level
from wearsim.profile.reprofiling import reprofile_axle
from wearsim.profile.shape import Profile, polygon_area_between, vertex_normals
from wearsim.profile.standard import shipped_path
from wearsim.profile.worn import cut_along_normals
from wearsim.quantities import STEP_LIMITS, kilometres
from wearsim.report.figures.campaign import (
    plot_fatigue_damage,
    plot_profile,
    plot_wear_by_regime,
    plot_wear_depth,
)
from wearsim.report.html import render
from wearsim.report.inspect import inspect, summary, summary_text
from wearsim.report.service_life import life
from wearsim.report.service_life import reprofilings as table_of
from wearsim.report.style import distance_text
from wearsim.report.tables import quality
from wearsim.report.tables_damage import fatigue_laws
from wearsim.results import layout_of, open_results, result_warnings
from wearsim.results.checks import (
    cracks_left,
    regime_shares,
    reprofiled_rows,
    reprofilings,
    spans,
)
from wearsim.results.limits import limits_met
from wearsim.results.service_life import PARTS
from wearsim.scene import build, load_scene
from wearsim.scene.campaign import ReprofilingRules

CAMPAIGN = """\
distance_km = 12
point_spacing_mm = 0.5
max_step_depth_um = 30
error_tolerance_um = 5
stability = 1.0
first_step_depth_um = 10
[campaign.limits]
depth_mm = 0.004
diameter_mm = 800
damage = 0.001
[campaign.reprofiling]
at_limits = ["depth_mm"]
at_km = [10]
cut_mm = 0.3
"""


@pytest.fixture(scope="module")
def rig_text(scene_text):
    block = {"shift_mm": 4, "friction": 0.4, "distance_km": 0.5}
    return scene_text(block, campaign=CAMPAIGN, more='[fatigue]\nlaws = ["wlrm"]')


@pytest.fixture(scope="module")
def scene(tmp_path_factory, rig_text):
    path = tmp_path_factory.mktemp("scene") / "rig.toml"
    path.write_text(rig_text)
    return path


@pytest.fixture(scope="module")
def setup(scene):
    return build(load_scene(scene))


def test_steps_have_the_same_bits_on_two_threads(setup):
    ends = []
    for threads in (1, 2):
        evolution = WheelsetEvolution(setup, threads=threads)
        state, taken = evolution.start()
        while not reached(state.distance, evolution.target):
            state, taken = evolution.advance(state, evolution.evaluate(state, taken))
        ends.append(state)
    for name in ("y", "z"):
        np.testing.assert_array_equal(getattr(ends[0], name), getattr(ends[1], name))


@pytest.fixture(scope="module")
def finished(scene, tmp_path_factory):
    out = tmp_path_factory.mktemp("finished") / "out"
    return run_scene(scene, out, command="wearsim run rig.toml --out out")[0]


@pytest.fixture(scope="module")
def data(finished):
    with open_results(finished) as opened:
        return opened.load()


@pytest.fixture(scope="module")
def worn(setup):
    """Worn 1 mm off the right tread and 0.5 mm all over the left wheel, made up."""
    state, _ = WheelsetEvolution(setup).start()
    depth = np.stack(
        [1e-3 * np.exp(-((state.y[0] / 8e-3) ** 2)), np.full(state.y.shape[1], 0.5e-3)]
    )
    return replace(
        state,
        step=7,
        distance=5e3,
        z=state.z - depth,
        wear_depth=depth,
        worn_area=np.array([1e-6, 2e-6]),
        worn_mass=np.array([3.0, 4.0]),
        fatigue_damage=tuple(np.full_like(one, 0.3) for one in state.fatigue_damage),
        point_length=np.full(len(setup.points.label), 500.0),
    )


def test_turned_wheels_are_the_template_at_the_least_loss_and_the_least_cut(
    setup, worn
):
    state = reprofile(worn, setup)
    wheels = [replace(setup.wheelset.right, y=worn.y[w], z=worn.z[w]) for w in (0, 1)]
    depth = reprofile_axle(*wheels, setup.templates)[0].depth
    assert depth == pytest.approx(
        1e-3, abs=5e-6
    )  # the deepest vertex is not on the tread's steepest part
    for w in (0, 1):
        np.testing.assert_array_equal(state.y[w], setup.templates[w].y)
        # rounding of z
        np.testing.assert_allclose(
            state.z[w], setup.templates[w].z - depth - 0.3e-3, rtol=0, atol=1e-15
        )
    assert running_circle_level(state.y[0], state.z[0]) == running_circle_level(
        state.y[1], state.z[1]
    )
    assert (state.step, state.reprofiled, state.distance) == (8, 8, 5e3)
    assert not state.point_length.any()
    for fresh in (state.wear_depth, state.regime_depth, *state.fatigue_damage):
        assert not fresh.any()
    np.testing.assert_array_equal(state.worn_area, worn.worn_area)
    np.testing.assert_array_equal(state.worn_mass, worn.worn_mass)


@pytest.fixture
def cracked(setup, worn):
    """The same wheels with cracks 1.5 mm deep all over: damage 0.3, of which 1 is a
    crack of 5 mm.
    """
    rising = replace(setup.fatigue[0], branch="rising", crack_depth=5e-3)
    return replace(setup, fatigue=(rising,)), worn


def cut_at(before, after, w):
    """Depth of cut along the normals of the wheel before, where the turned one is
    met [m].
    """
    wheels = [
        Profile("wheel", "wheel", state.y[w], state.z[w]) for state in (before, after)
    ]
    return cut_along_normals(*wheels, *vertex_normals(wheels[0].y, wheels[0].z))[0]


def test_the_lathe_leaves_what_cracks_reach_deeper_than_its_cut(cracked):
    """Left wheel, 0.5 mm worn everywhere and 0.8 mm cut, of which the normal sees the
    cosine of the slope.

    The curvature of the tread costs 1e-3, six points of the straight flank between
    others 1e-4. The right wheel has lost 1 mm where it is deepest: 0.3 mm are cut
    there.
    """
    setup, worn = cracked
    after = reprofile(worn, setup)
    (left,) = after.fatigue_damage
    y, z = after.y[1], after.z[1]
    slope = np.arctan(np.gradient(z, y))
    tread = (y > -20e-3) & (y < 25e-3)
    flank = np.abs(np.degrees(slope) + 70.0) < 0.02
    assert flank.sum() > 5
    for part, rtol in ((tread, 1e-3), (flank, 2e-4)):
        np.testing.assert_allclose(
            left[1, part], 0.3 - 0.8 * np.cos(slope[part]) / 5.0, rtol=rtol
        )
    deepest = np.abs(after.y[0]) < 0.5e-3
    np.testing.assert_allclose(left[0, deepest], 0.3 - 0.3 / 5.0, rtol=5e-3)
    deep = replace(
        setup, control=replace(setup.control, reprofiling=ReprofilingRules(cut=2e-3))
    )
    assert not reprofile(worn, deep).fatigue_damage[0][:, tread].any()


def test_wheels_turned_at_a_damage_limit_come_back_sound_with_the_least_loss(cracked):
    """Cracks of the tread decide, 0.6 mm on the left: a um less would leave some of
    them.
    """
    setup, worn = cracked
    bump = np.exp(-((worn.y[1] / 6e-3) ** 4))
    damage = np.stack([np.zeros_like(bump), 0.25 * bump])
    worn = replace(worn, fatigue_damage=(damage,))
    of_damage = ReprofilingRules(limits=("fatigue_damage",))
    setup = replace(setup, control=replace(setup.control, reprofiling=of_damage))
    after = reprofile(worn, setup)
    assert not np.any(after.fatigue_damage)
    assert running_circle_level(after.y[0], after.z[0]) == running_circle_level(
        after.y[1], after.z[1]
    )
    assert running_circle_level(after.y[1], after.z[1]) == pytest.approx(
        -0.5e-3 - 5e-3 * 0.25, abs=3e-6
    )
    over = cut_at(worn, after, 1) - 5e-3 * damage[1]
    assert -1e-12 < np.nanmin(over[bump > 0.01]) < 1e-6
    # at a limit of shape the lathe takes what the shape needs, and cracks stay
    by_shape = replace(
        setup,
        control=replace(
            setup.control, reprofiling=ReprofilingRules(limits=("hollowing",))
        ),
    )
    less = reprofile(worn, by_shape)
    assert running_circle_level(less.y[1], less.z[1]) == pytest.approx(-1e-3, abs=5e-6)
    assert less.fatigue_damage[0].max() == pytest.approx(0.25 - 0.5 / 5.0, rel=3e-3)


def test_mirrored_wheels_come_back_mirrored(setup, worn):
    mirrored = replace(worn, y=worn.y[::-1], z=worn.z[::-1])
    np.testing.assert_array_equal(
        reprofile(mirrored, setup).z, reprofile(worn, setup).z[::-1]
    )


def test_turning_is_due_at_limits_and_places_and_never_twice(setup, worn):
    def with_rules(**rules):
        return replace(
            setup, control=replace(setup.control, reprofiling=ReprofilingRules(**rules))
        )

    def due(state, of):
        return reprofiling_due(state, of, recorded_measures(state, of))

    at_depth = with_rules(limits=("max_wear_depth",))
    assert due(worn, at_depth)
    assert not due(replace(worn, wear_depth=np.full_like(worn.y, 0.0039e-3)), at_depth)
    assert not due(reprofile(worn, at_depth), at_depth)
    assert not due(
        replace(worn, reprofiled=7), at_depth
    )  # a template that meets the limit turns no more
    at_place = with_rules(places=(4e3, 5e3, 6e3))
    assert due(worn, at_place)
    assert not due(reprofile(worn, at_place), at_place)
    assert not due(replace(worn, distance=5.001e3), at_place)
    assert not due(
        worn, replace(setup, control=replace(setup.control, reprofiling=None))
    )
    assert to_next_reprofiling(worn, at_place.control).distance == 6e3
    assert (
        to_next_reprofiling(replace(worn, distance=6e3), at_place.control).distance
        == 12e3
    )


def test_measures_of_a_state_are_computed_once_for_row_and_turning(setup, monkeypatch):
    """The conicity, for the row and for its limit, at the start and at the end of every
    step.
    """
    calls = []

    def counted(*arguments, **keywords):
        calls.append(arguments)
        return equivalent_conicity(*arguments, **keywords)

    monkeypatch.setattr("wearsim.campaign.row.equivalent_conicity", counted)
    rules = ReprofilingRules(limits=("equivalent_conicity",))
    limits = (("equivalent_conicity", 0.9),)
    of = WheelsetEvolution(
        replace(setup, control=replace(setup.control, limits=limits, reprofiling=rules))
    )
    state, taken = of.start()
    for states in (1, 2):
        evaluation = of.evaluate(state, taken)
        assert len(calls) == states
        row = of.row(state, evaluation, taken)
        assert row["equivalent_conicity"] == evaluation.measures["equivalent_conicity"]
        state, taken = of.advance(state, evaluation)
        assert len(calls) == states + 1


@pytest.fixture(scope="module")
def long_block(tmp_path_factory, scene_text):
    """Finished campaign of one block, which steps of any length divide."""
    block = {"shift_mm": 4, "friction": 0.4, "distance_km": 50}
    once = CAMPAIGN.replace("distance_km = 12", "distance_km = 9")
    folder = tmp_path_factory.mktemp("long_block")
    (folder / "rig.toml").write_text(
        scene_text(
            block,
            campaign=once.replace("at_km = [10]\n", ""),
            more='[fatigue]\nlaws = ["wlrm"]',
        )
    )
    with open_results(run_scene(folder / "rig.toml", folder / "out")[0]) as opened:
        return opened.load()


def test_wheels_are_turned_within_one_percent_of_their_limit(long_block):
    """The limit is one of depth, which grows nearly as the distance does: 1 % of the
    distance and the curvature of the growth within the last step.
    """
    rows = reprofiled_rows(long_block)
    assert rows
    depth = long_block["max_wear_depth"].values
    for row in rows:
        assert 4e-6 <= depth[row - 1].max() <= 1.015 * 4e-6
    names = [STEP_LIMITS[int(long_block["step_limit"][row - 1])] for row in rows]
    assert "reprofiling" in names  # without the rule these steps are longer


@pytest.mark.parametrize(
    ("length", "end"),
    [
        (3000.0, 2500.0),  # six loops of 500 m: the limit is met after 2250 m
        (2000.0, None),  # after 1500 m, and a whole loop more is the whole step
        (500.0, None),
        (400.0, 300.0 + 0.005 * 1300.0),  # part of a loop: half of the 1 % beyond
        (40.0, None),  # less than 1 % of the distance beyond
    ],
)
def test_late_steps_of_loops_end_with_a_loop(setup, worn, length, end):
    """Steps 1 km after the reprofiling, over which the depth grows from 1 to 5 um."""
    rules = ReprofilingRules(limits=("max_wear_depth",))
    control = replace(
        setup.control, limits=(("max_wear_depth", 4e-6),), reprofiling=rules
    )
    setup = replace(setup, control=control)
    assert setup.points.block_length.sum() == 500.0
    state = replace(worn, distance=11e3, reprofiled_at=10e3)
    before, after = (
        {"max_wear_depth": np.array([depth, 0.5e-6])} for depth in (1e-6, 5e-6)
    )
    found = late(state, length, (before, after), setup)
    assert found == (end if end is None else pytest.approx(end, rel=1e-12))
    assert late(state, length, (after, after), setup) is None
    assert late(state, length, (before, before), setup) is None


def test_rows_tell_each_turning(data):
    """One where 4 um are worn, one at 10 km; each takes the wear and 0.3 mm of radius
    off both wheels.
    """
    rows = reprofiled_rows(data)
    made = reprofilings(data)
    assert len(rows) == len(made) >= 2
    assert made[-1].distance == pytest.approx(10e3, rel=1e-12)
    depth = data["max_wear_depth"].values
    assert depth[rows[0] - 1].max() >= 4e-6
    for row, one in zip(rows, made, strict=True):
        assert not depth[row].any()
        assert float(data["step_length"][row]) == 0.0
        assert float(data["distance"][row]) == float(data["distance"][row - 1])
        # depth counts along the normal: on slopes below 60 degrees it costs at most
        # twice as much radius
        lost = one.before[0] - one.after[0] - 0.6e-3
        assert 0.0 < lost < 2.0 * 2.0 * depth[row - 1].max()
        assert one.after[0] == one.after[1] < min(one.before) - 0.6e-3 + 1e-12
        # the measures are the new wheel's again; but for the rounding of z and of
        # crossings found in it
        for name in (
            "flange_height",
            "flange_thickness",
            "flange_gradient",
            "hollowing",
        ):
            np.testing.assert_allclose(
                data[name][row], data[name][0], rtol=0, atol=1e-12
            )
        np.testing.assert_allclose(
            data["equivalent_conicity"][row], data["equivalent_conicity"][0], atol=1e-8
        )
        assert not data["fatigue_damage"][row].any()
    table = table_of([data])[0].frame
    assert len(table) == 2 * len(rows)  # both wheels
    assert table.iloc[-1, 1] == pytest.approx(10.0, rel=1e-9)
    assert table.iloc[0, 4] == pytest.approx(920.0, abs=0.1)


def test_parts_of_the_loss_of_diameter_add_up(finished, data):
    """0.6 mm of diameter is the allowance, and the second reprofiling is at 10 km."""
    table = wearsim.reprofilings(finished)
    parts = [f"{part}_mm" for part in PARTS]
    np.testing.assert_allclose(table[parts].sum(axis=1), table["loss_mm"], atol=1e-9)
    np.testing.assert_allclose(table["allowance_mm"], 0.6, atol=1e-9)
    assert not table["cracks_mm"].any()  # not among the limits of reprofiling
    *before, last = table["cause"].tolist()[::2]
    assert before
    assert {*before} == {"max_wear_depth"}
    assert last == "distance"
    lost = 1e3 * (data["wheel_diameter"][0] - data["wheel_diameter"][-1]).values
    since = table.groupby("wheel")["loss_mm"].sum()
    circle = data["wheel_diameter"].values[[reprofiled_rows(data)[-1], -1]]
    for wheel, side in enumerate(("right", "left")):
        worn = 1e3 * (circle[0, wheel] - circle[1, wheel])
        assert since[side] + worn == pytest.approx(lost[wheel], abs=1e-9)


def test_summary_begins_with_the_life_of_the_wheels(finished, data):
    """The damage, at which the wheels are not reprofiled, ends it at once; 800 mm of
    diameter are far beyond ten times the 12 km that were run.
    """
    text = " ".join(summary_text(inspect(finished), details=False).split()[:120])
    met, count = data.attrs["limit_fatigue_damage_met_right"], len(reprofilings(data))
    end = f"life: {kilometres(met)} to the limit of fatigue damage (right), after 0"
    assert end in text
    often = f"reprofiled {count} times, every {kilometres(10e3 / count)}"
    assert f"assumes the environment factor 1 {often}" in text
    assert (
        "where a limit is met, at most 1 % or one loop of a programme later; " in text
    )
    assert "mm deep in 2 km since reprofiling; first limit: " in text
    assert outcome_of(finished)["reprofiled"]
    (table,) = life([data])
    rows = dict(table.frame.to_numpy().tolist())
    assert rows["Reprofilings in the campaign"] == str(count)
    assert rows["Distance to there"] == f"{distance_text(met)}, met"
    assert "Wheels are reprofiled where a limit is met" in table.caption
    other = data.copy()
    del other.attrs["limit_fatigue_damage"]
    page_one = render([other])
    page_one = page_one[: page_one.index('id="measures"')]
    assert "needs bands" in page_one
    depth = f"deepest wear since the last reprofiling, {distance_text(2e3)}, "
    assert depth in page_one
    text = " ".join(summary_text(inspect(other), details=False).split())
    beyond = "beyond 10 times the distance run"
    assert (
        f"life: the limit of wheel diameter at the running circle is {beyond}" in text
    )
    (table,) = life([other])
    assert dict(table.frame.to_numpy().tolist())["Distance to there"] == beyond
    compared = wearsim.side_by_side(other, other).set_index("quantity")
    assert compared.loc["life", "a"] == "not in sight"


def test_worn_area_is_the_sum_over_the_spans_between_turnings(data):
    """The polygon's area is the law's to 1e-9 in every span; what the lathe took is not
    in it.
    """
    total = np.zeros(2)
    for first, last in spans(data):
        for w in (0, 1):
            y, z = (data[f"profile_{c}"].values[:, w] for c in "yz")
            total[w] += polygon_area_between(y[first], z[first], y[last], z[last])
    np.testing.assert_allclose(total, data["worn_area"].values[-1], rtol=1e-9)
    checks = quality([data]).frame.set_index("Check")["Rig"]
    name = "Worn area by law against profiles, right wheel [relative difference]"
    assert checks[name] < 1e-9
    assert checks["Wear steps"] == data.sizes["step"] - 1 - len(reprofiled_rows(data))


def test_a_turned_wheel_wears_as_a_new_one_of_its_radius(
    data, tmp_path_factory, rig_text
):
    """First step after a turning against that of a new wheelset of the smaller radius,
    by area per distance.

    The same wheel but for heights off by 0.35 mm, which move interpolated places by
    rounding; both programmes are at the beginning of a loop and of the small first
    steps.
    """
    row = reprofiled_rows(data)[0]
    radius = 0.5e3 * float(data["wheel_diameter"][row, 0])
    folder = tmp_path_factory.mktemp("small")
    text = rig_text[: rig_text.index("[campaign.limits]")].replace(
        "distance_km = 12", "distance_km = 0.5"
    )
    (folder / "rig.toml").write_text(
        text.replace('"S1002"', f'"S1002"\nradius_mm = {radius!r}')
    )
    with open_results(run_scene(folder / "rig.toml", folder / "out")[0]) as other:
        for name in (
            "area",
            "max_pressure",
            "creepage_x",
            "spin",
            "power",
            "wear_area_rate",
        ):
            np.testing.assert_allclose(
                data[name][row], other[name][0], rtol=2e-4, err_msg=name
            )


def test_limits_are_told_across_turnings(data, finished):
    """Depth is met before the first turning, and damage where the worst place of any
    law has it.
    """
    result = {limit.name: limit for limit in limits_met(data)}
    first = reprofiled_rows(data)[0]
    met = min(at for at in result["max_wear_depth"].distance if at is not None)
    assert data["distance"].values[first - 2] < met <= data["distance"].values[first]
    assert result["wheel_diameter"].distance == (None, None)
    worst = data["fatigue_damage"].max(["fatigue", "point"]).values
    for wheel, at in enumerate(result["fatigue_damage"].distance):
        assert (at is None) == (worst[:, wheel].max() < 1e-3)
    message = {key: value for key, value in data.attrs.items() if "_met" in key}
    assert (
        message["limit_max_wear_depth_met_right"]
        == result["max_wear_depth"].distance[0]
    )
    assert data.attrs["finished"] == "distance reached"


def test_report_and_summary_tell_the_turnings(data, finished):
    first = reprofilings(data)[0]
    page = render([data])
    table = page[page.index('id="table-reprofilings-rig"') :].partition("</table>")[0]
    assert f'data-value="{1e3 * first.before[0]!r}"' in table
    result = inspect(finished)
    assert len(result["reprofilings"]) == len(reprofilings(data))
    steps = data.sizes["step"] - 1 - len(reprofiled_rows(data))
    assert result["steps"] == steps
    assert re.search(
        rf'>Wear steps</th><td [^>]*data-value="{steps}.0">{steps}</td>', page
    )
    assert "Depth counts from the last reprofiling of the wheels." in page
    message = (
        "The lathe is assumed to take all damage of WLRM, which states no depth of "
        "its cracks."
    )
    assert message in table
    assert message in summary_text(result)
    cracked = data.copy()
    cracked["fatigue_crack_depth"] = ("fatigue", [5e-3])
    assert "(1 is a crack of 5 mm) and left none." in render([cracked])
    damage = data["fatigue_damage"].copy()
    damage[reprofiled_rows(data)[0], 0, 0, 7] = 0.012
    cracked["fatigue_damage"] = damage
    page = render([cracked])
    assert "(1 is a crack of 5 mm) and left at most 0.012 of it." in page
    assert (
        "the lathe left cracks of WLRM, up to 0.06 mm deep; damage among at_limits"
        in page
    )
    assert (
        f"{kilometres(first.distance)}, wheel diameter right 920.00 to 919."
        in summary_text(result)
    )


def test_a_campaign_that_ends_with_a_turning_still_tells_its_wear_by_regime(data):
    """Cut off at a turning: shares of all wear that sum to one."""
    row = reprofiled_rows(data)[1]
    ended = data.isel(step=slice(0, row + 1))
    depth = sum(
        data["wear_depth_by_regime"].values[last] for _, last in spans(ended)
    ).sum(axis=(0, 2))
    message = summary(ended)["regime_share"]
    np.testing.assert_allclose(list(message.values()), depth / depth.sum(), rtol=1e-12)
    seized = ended.copy()
    seized["regime_name"] = ("regime", ["seizure", *[*message][1:]])
    assert regime_shares(seized, "seizure")[
        str(data.attrs["wear_law"])
    ] == pytest.approx(depth[0] / depth.sum(), rel=1e-12)


def test_a_campaign_that_ends_with_a_turning_still_tells_its_fatigue(data):
    """Cut off at a turning: damage, life and worn measures are those of the row before,
    and that is said.
    """
    row = reprofiled_rows(data)[1]
    ended, before = (data.isel(step=slice(0, end)) for end in (row + 1, row))
    damage = data["fatigue_damage"].values[row - 1, :, 0].max(axis=1)
    assert damage.max() > 0.0
    table, other = (fatigue_laws(one) for one in (ended, before))
    assert table.frame.equals(other.frame)
    assert table.frame.loc[0, "Largest damage"] == damage.max()
    message = "The campaign ends with a reprofiling of the wheels"
    assert message in table.caption
    assert message not in other.caption
    one, another = summary(ended), summary(before)
    assert one["damage"] == another["damage"]
    assert one["worn"] == another["worn"]
    assert one["contact"] == another["contact"]
    assert any(line.startswith(message) for line in one["warnings"])
    assert not any(line.startswith(message) for line in another["warnings"])
    assert message in render([ended])
    for draw in (plot_fatigue_damage, plot_wear_depth):
        np.testing.assert_array_equal(
            draw(ended).lines[-1].get_xydata(), draw(before).lines[-1].get_xydata()
        )


def test_a_life_of_cracks_costs_the_diameter_that_they_are_deep(tmp_path, rig_text):
    """Turned at a limit of damage alone: sound each time, for twice the depth of the
    deepest crack.

    At most for that over the cosine of the root's slope, below 45 degrees there; what
    is worn, 1 um, apart.
    """
    text = rig_text[: rig_text.index("[campaign.limits]")].replace(
        "distance_km = 12", "distance_km = 4"
    )
    text += "max_step_km = 1\n[campaign.limits]\ndamage = 0.001\n"
    text += '[campaign.reprofiling]\nat_limits = ["damage"]\n'
    text = text.replace('["wlrm"]', '["wlrm"]\nbranch = "rising"\ncrack_depth_mm = 50')
    (tmp_path / "rig.toml").write_text(text)
    with open_results(run_scene(tmp_path / "rig.toml", tmp_path / "out")[0]) as opened:
        result = opened.load()
    rows = reprofiled_rows(result)
    assert len(rows) > 1
    damage, diameter = result["fatigue_damage"].values, result["wheel_diameter"].values
    for row in rows:
        assert damage[row - 1].max() >= 0.001
        assert not damage[row].any()
        lost, deepest = diameter[row - 1] - diameter[row], 50e-3 * damage[row - 1].max()
        assert lost.min() > 2.0 * deepest - 2e-6
        assert lost.max() < 2.0 * deepest / np.cos(np.radians(45.0)) + 2e-6
    assert cracks_left(result).endswith("and left none.")
    assert not any("the lathe" in line for line in result_warnings(result))


@pytest.fixture(scope="module")
def reshaped(tmp_path_factory, rig_text):
    """Wheels turned to a template whose flange is 2 mm thinner, and run on."""
    folder = tmp_path_factory.mktemp("reshaped")
    text = rig_text.replace(
        "at_km = [10]", 'at_km = [1]\nprofile = "S1002/e30.5"'
    ).replace("distance_km = 12", "distance_km = 2")
    text = text.replace('["wlrm"]', '["wlrm", "surface_fatigue_index_local"]')
    (folder / "rig.toml").write_text(text)
    with open_results(run_scene(folder / "rig.toml", folder / "out")[0]) as opened:
        return opened.load()


def test_figures_stand_at_the_points_of_the_profile_that_was_turned(reshaped):
    row = reprofiled_rows(reshaped)[-1]
    y, z = (reshaped[f"profile_{c}"].values[row, 0] for c in "yz")
    assert np.abs(y - reshaped["profile_y"].values[0, 0]).max() > 0.5e-3
    x = 1e3 * y
    assert len(reprofiled_rows(reshaped)) < reshaped.sizes["step"] - 2  # runs on
    for draw in (plot_fatigue_damage, plot_wear_depth, plot_wear_by_regime):
        np.testing.assert_allclose(draw(reshaped).lines[-1].get_xdata(), x, rtol=1e-15)
    lines = {line.get_label(): line for line in plot_profile(reshaped).lines}
    np.testing.assert_allclose(
        lines["reprofiled wheel"].get_xydata(), 1e3 * np.stack([y, z], 1), rtol=1e-15
    )
    start = plot_wear_depth(reshaped, distance=0.0).lines[-1].get_xdata()
    np.testing.assert_allclose(
        start, 1e3 * reshaped["profile_y"].values[0, 0], rtol=1e-15
    )
    damage = reshaped["fatigue_damage"].values[-1, :, 1]
    wheel, point = np.unravel_index(damage.argmax(), damage.shape)
    row_of_law = fatigue_laws(reshaped).frame.iloc[1]
    assert row_of_law["Wheel"] == ("right", "left")[wheel]
    assert (
        row_of_law["At y [mm]"] == 1e3 * reshaped["profile_y"].values[row, wheel, point]
    )


@pytest.mark.slow
def test_the_shipped_workflow_turns_the_wheels_once_and_ends_at_their_diameter(
    tmp_path,
):
    """As its comments say; each rail loses what is stated, the steps' sum to 1e-9."""
    with open_results(
        run_scene(shipped_path("workflows", "limits.toml"), tmp_path / "out")[0]
    ) as shipped:
        assert len(reprofilings(shipped)) == 1
        assert "diameter" in shipped.attrs["finished"]
        assert float(shipped["wheel_diameter"].values[-1].min()) <= 919.3e-3
        run = float(shipped["distance"].values[-1])
        np.testing.assert_allclose(
            shipped["counterface_worn_area"].values[-1], 0.5e-12 * run, rtol=1e-9
        )
        assert [limit.name for limit in limits_met(shipped) if any(limit.distance)] == [
            "hollowing",
            "wheel_diameter",
        ]


@pytest.mark.cf
def test_the_file_keeps_the_conventions(finished, assert_cf):
    assert_cf(finished)


def test_a_campaign_stopped_before_and_behind_a_turning_ends_with_the_same_bits(
    scene, finished, data, tmp_path, stopped_at
):
    turning, out = reprofiled_rows(data)[0], tmp_path / "out"
    for step in (turning - 1, turning):
        with stopped_at(step) as stop:
            run_scene(scene, out, observer=stop)
    (path,) = resume(out)
    with netCDF4.Dataset(path) as one, netCDF4.Dataset(finished) as other:
        for name in layout_of(one.variables):
            assert np.array_equal(one[name][:], other[name][:]), name
        for name in {*one.ncattrs(), *other.ncattrs()} - {"history"}:
            assert np.array_equal(one.getncattr(name), other.getncattr(name)), name
