"""[vehicle] in field scenes: what it becomes, and what is refused."""

import html
from pathlib import Path

import numpy as np
import pytest

from wearsim.campaign.evaluate import setup_of, worn_bodies
from wearsim.campaign.evolution import WheelsetEvolution
from wearsim.campaign.row import header_of
from wearsim.campaign.run import run_scene
from wearsim.campaign.running import with_help
from wearsim.errors import NumericalError, SceneError
from wearsim.operation.states import StateError
from wearsim.profile import standard
from wearsim.profile.standard import shipped_path
from wearsim.report.html import write_report
from wearsim.results import open_results
from wearsim.scene import build, load_scene, prepare, prepare_again, prepared
from wearsim.scene.inputs import inputs_of
from wearsim.scene.setup import warnings_of

FIELD = (Path(__file__).parents[1] / "data" / "scene_vehicle.toml").read_text()
SHORT = FIELD.replace("distance_km = 500", "distance_km = 5")  # a wear step


def test_a_vehicle_gives_points_with_its_loads_and_positions(folder):
    Path("scene.toml").write_text(FIELD)
    scene = load_scene("scene.toml")
    setup = build(scene)
    points, shift = setup.points, setup.points.conditions.shift
    assert points.weight.sum() == pytest.approx(1.0)
    assert points.class_name[-2:] == ("curve leading", "curve trailing")
    # a leading axle runs towards the outer rail, here the right one, and yaws towards
    # it
    assert shift[-4] == pytest.approx(-shift[-2], abs=1e-6)
    assert shift[-4] > 4e-3 > abs(shift[-3])
    assert points.conditions.yaw[-4] > 2e-4
    np.testing.assert_allclose(
        points.conditions.loads.sum(axis=1), inputs_of(scene).route.vehicle.axle_load
    )
    np.testing.assert_array_equal(points.environment[-4:], 0.5)
    np.testing.assert_array_equal(points.conditions.friction_flange[-4:], 0.15)
    assert any("vehicle.file" in name for name, _ in setup.input_hashes)
    assert warnings_of(scene) == ()


PRACTICE = """rails = [
  {share = 0.6},
  {profile = "own.csv", gauge_mm = 1440, inclination = "none", share = 0.4},
]
axle_torques = [{axle_torque_kN_m = 2, share = 0.3}, {axle_torque_kN_m = 0, share = 0.7}]
lubricated_share = 0.25
"""


def test_rails_torques_and_lubrication_are_states_with_shares(folder, changed):
    rail = standard.rail("60E1", 1 / 20, 1.435, 0.75)
    np.savetxt(
        "own.csv", 1e3 * np.stack([rail.y, rail.z], axis=1), delimiter=",", fmt="%.4f"
    )
    Path("scene.toml").write_text(changed(FIELD, ("environment = 0.5\n", PRACTICE)))
    scene = load_scene("scene.toml")
    setup = build(scene)
    points, conditions = setup.points, setup.points.conditions
    curved = np.char.startswith(np.array(points.class_name), "curve")
    assert curved.sum() == 4 * 2 * 2 * 2
    assert not conditions.rail[~curved].any()
    for mask, share in (
        (conditions.rail == 1, 0.4),
        (conditions.torque == 2e3, 0.3),
        (conditions.friction_flange == 0.15, 0.25),
    ):
        assert points.weight[curved & mask].sum() == pytest.approx(0.4 * share)
    (other,) = setup.counterface.further
    assert any("own.csv" in name for name, _ in setup.input_hashes)
    # wider by 5 mm: 2.5 mm more for the leading axle on its way to the outer rail
    first = np.flatnonzero(
        np.array([label.endswith("greased leading") for label in points.label])
    )
    shift = conditions.shift[first].reshape(2, -1)
    assert (shift[1] - shift[0] > 1.5e-3).all()
    assert np.ptp(other.profile.y) > 0.05


def test_brake_blocks_wear_what_they_are_said_to(folder, changed):
    """Their cross-section: depth per distance times width, within a vertex at each
    edge.
    """
    block = (
        "[wear]\n[wear.brake_block]\num_per_1000_km = 40\nfrom_mm = -20\nto_mm = 30\n"
        "[vehicle]"
    )
    areas = []
    for name, text in (
        ("plain", SHORT),
        ("braked", changed(SHORT, ("[vehicle]", block))),
    ):
        Path(f"{name}.toml").write_text(text)
        run_scene(f"{name}.toml", name)
        with open_results(f"{name}/field.nc") as result:
            areas.append(result["worn_area"].values[-1])
    np.testing.assert_allclose(areas[1] - areas[0], 40e-6 * 0.05 * 5e-3, rtol=0.03)
    Path("scene.toml").write_text(
        changed(FIELD, ("[vehicle]", block.replace("to_mm = 30", "to_mm = -30")))
    )
    with pytest.raises(SceneError, match="to_mm = -30 must be above from_mm = -20"):
        load_scene("scene.toml")


def test_cant_and_deficiency_of_the_same_curve_are_alike(folder, changed):
    speed, radius = 90 / 3.6, 600.0
    cant = 1e3 * (1.5 * speed**2 / (9.81 * radius)) - 50.0
    Path("a.toml").write_text(FIELD)
    Path("b.toml").write_text(
        changed(FIELD, ("cant_deficiency_mm = 50", f"cant_mm = {cant:.9f}"))
    )
    found = [
        build(load_scene(name)).points.controlled.bogies.acceleration
        for name in ("a.toml", "b.toml")
    ]
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)
    np.testing.assert_allclose(found[0], [9.81 * 0.05 / 1.5, -9.81 * 0.05 / 1.5])


@pytest.mark.parametrize(
    ("tangent", "wavelength", "refused"),
    [
        ("suspended", True, True),
        ("kinematic", True, True),
        ("guided", False, True),
        ("guided", True, False),
        ("shifted", False, False),
    ],
)
def test_independent_wheels_do_not_steer_on_straight_track(
    folder, faults_of, tangent, wavelength, refused
):
    text = FIELD.replace("strips = 10", 'strips = 10\nrotation = "independent"')
    text = text.replace("[vehicle]", f'[vehicle]\ntangent = "{tangent}"')
    if not wavelength:
        text = text.replace("tangent_wavelength_m = 9\n", "")
    if refused:
        (fault,) = faults_of(text)
        assert f'tangent = "{tangent}" needs the steering of an axle' in fault
        return
    Path("scene.toml").write_text(text)
    assert load_scene("scene.toml").contact.rotation == "independent"


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        (
            '"regional_multiple_unit"',
            '"regional_multiple"',
            "is no file, nor a shipped vehicle; did",
        ),
        (
            "share = 0.6",
            "share = 0.5",
            "the shares of all classes must sum to 1 within 1 %, not 0.9",
        ),
        ("share = 0.4", "share = 0", "must be above 0"),
        (
            "cant_deficiency_mm = 50",
            "",
            "a curve needs either cant_mm or cant_deficiency_mm",
        ),
        (
            "cant_deficiency_mm = 50",
            "cant_deficiency_mm = 50\ncant_mm = 5",
            "needs either cant_mm or",
        ),
        ("shift_std_mm = 1.5", "", "straight track needs shift_std_mm"),
        ("shift_std_mm = 1.5", "shift_std_mm = 1.5\ncant_mm = 5", "cant is for curves"),
        (
            "environment = 0.5",
            "axle_torque_kN_m = 30",
            "friction x axle load x radius_mm = 21.2 kN m; lower it",
        ),
        (
            "environment = 0.5",
            "shift_std_mm = 1",
            "the balance of the bogie gives the shift; delete it",
        ),
        (
            "-600",
            "8",
            "must be between 10 and 1000000 m, with + to the right or - to the left",
        ),
        (
            "tangent_wavelength_m = 9",
            'tangent = "free"',
            "suspended, kinematic, guided, shifted",
        ),
        (
            "[contact]",
            '[contact]\nroll = "given"',
            "lets no forces of the vehicle be balanced",
        ),
        (
            "environment = 0.5",
            "lubricated_share = 1.5",
            "lubricated_share = 1.5 must be at least 0 and at most 1",
        ),
        (
            "friction_flange = 0.15",
            "lubricated_share = 0.5",
            (
                "lubricated_share = 0.5 needs friction_flange, that of the lubricated "
                "flange"
            ),
        ),
        (
            "environment = 0.5",
            (
                "axle_torques = [{axle_torque_kN_m = 30, share = 0.1}, "
                "{axle_torque_kN_m = 0, share = 0.9}]"
            ),
            "axle_torque_kN_m = 30 is more than friction can carry",
        ),
        (
            "environment = 0.5",
            "axle_torque_kN_m = 3\naxle_torques = [{axle_torque_kN_m = 3, share = 1}]",
            "axle_torques and axle_torque_kN_m exclude each other",
        ),
        (
            "environment = 0.5",
            "gauge_mm = 1435",
            "write rails = [{gauge_mm = 1435, share = 0.5}, ...]",
        ),
        (
            "environment = 0.5",
            "rails = [{share = 0.5}]",
            "the shares must sum to 1 within 1 %, not 0.5",
        ),
        (
            "environment = 0.5",
            'rails = [{profile = "60E9", share = 1}]',
            'profile = "60E9"',
        ),
        (
            "environment = 0.5",
            "rails = [{gauge_mm = 1400, share = 1}]",
            "gauge_mm = 1400 must be above 14",
        ),
        ("tangent_wavelength_m = 9", 'axle = "middle"', "outer, inner"),
        (
            "tangent_wavelength_m = 9",
            "axle_yaw_offset_mrad = 50",
            "must be at least -20 and at most 20 mrad",
        ),
        (
            "[vehicle]",
            "[vehicle]\nwheel_diameter_difference_mm = 1",
            "write it in [wheelset]",
        ),
    ],
)
def test_faults_of_the_vehicle_and_its_track(
    folder, changed, faults_of, old, new, fault
):
    assert fault in "\n".join(faults_of(changed(FIELD, (old, new))))


def test_a_vehicle_excludes_classes_and_needs_all_its_data(folder, faults_of):
    classes = Path("field.toml").read_text()
    classes = classes[
        classes.index("[[operation.class]]") : classes.index("[campaign]")
    ]
    assert (
        "[vehicle] and [[operation.class]] exclude each other"
        in faults_of(FIELD + classes)[0]
    )
    Path("own.toml").write_text(
        'name = "mine"\nsource = "drawing"\nwheelbase_m = 0.1\n'
    )
    lines = faults_of(FIELD.replace("regional_multiple_unit", "own.toml"))
    assert any("own.toml:3: wheelbase_m = 0.1 must be" in line for line in lines)
    assert sum("is missing in the file" in line for line in lines) == 9


def test_a_curve_without_balance_is_named_by_class_and_radius(folder, changed):
    high = shipped_path(
        "profiles", "vehicles", "regional_multiple_unit.toml"
    ).read_text()
    Path("high.toml").write_text(
        changed(high, ("body_height_m = 1.7", "body_height_m = 4"))
    )
    text = changed(FIELD, ("regional_multiple_unit", "high"), ("mm = 50", "mm = 400"))
    Path("scene.toml").write_text(text)
    expected = (
        r"scene.toml:21: curve.*: no equilibrium of the bogie in the curve of -600 "
        r"m.*it runs .*speed_km_h"
    )
    with pytest.raises(SceneError, match=expected):
        build(load_scene("scene.toml"))


def test_a_campaign_that_ends_in_a_curve_says_what_would_let_it_go_on(folder):
    Path("scene.toml").write_text(FIELD)
    evolution = WheelsetEvolution(build(load_scene("scene.toml")))
    state, _ = evolution.start()
    points = evolution.setup.points
    leading = int(points.controlled.bogies.leading[0])
    ended = NumericalError(
        "after 500 km no equilibrium; reprofile earlier, or end there"
    )
    lost = StateError({leading: "no equilibrium"})
    lost.bodies = worn_bodies(state, setup_of(evolution.setup))
    ended.__cause__ = lost
    helped = with_help(ended, points, setup_of(evolution.setup))
    assert str(helped).startswith(f"{ended}; it runs with half the friction")
    assert "curve_radius_m" in str(helped)
    of_another_kind = NumericalError("after 500 km no wear step keeps the tolerance")
    assert (
        with_help(of_another_kind, points, setup_of(evolution.setup)) is of_another_kind
    )


def test_positions_of_axles_are_those_of_the_axle_in_rows_header_and_check(folder):
    """Looked for at the height of the rails; the roll of half a milliradian moves the
    axle by 0.2 mm.
    """
    Path("scene.toml").write_text(FIELD)
    evolution = WheelsetEvolution(build(load_scene("scene.toml")))
    state, taken = evolution.start()
    row = evolution.row(state, evolution.evaluate(state, taken), taken)
    conditions = evolution.setup.points.conditions
    bogies = evolution.setup.points.controlled.bogies.points
    aside = row["lateral_position"] - conditions.shift
    expected = 0.46 * np.sin(row["wheelset_roll"][bogies])
    np.testing.assert_allclose(aside[bogies], expected, rtol=0.0, atol=1e-9)
    assert (np.abs(aside[bogies]) > 1e-6).all()
    assert (np.delete(aside, bogies) == 0.0).all()
    shift = header_of(evolution.setup, "").static["shift"]
    # the roll of the search and of the passage, both at rest within some nm
    np.testing.assert_allclose(shift, row["lateral_position"], rtol=0.0, atol=2e-8)
    frozen = FIELD.replace(
        "tangent_wavelength_m", 'positions = "frozen"\ntangent_wavelength_m'
    )
    Path("scene.toml").write_text(frozen)
    held = header_of(build(load_scene("scene.toml")), "").static["shift"]
    np.testing.assert_array_equal(held, shift)


def test_values_hardly_meant_are_noted_in_classes_of_a_vehicle(folder, changed):
    text = changed(
        FIELD, ('name = "curve"', 'name = "wet curve"'), ("friction_flange = 0.15", "")
    )
    Path("scene.toml").write_text(text.replace("friction = 0.35", "friction = 0.5"))
    warnings = "\n".join(str(one) for one in warnings_of(load_scene("scene.toml")))
    assert (
        'scene.toml:27: friction = 0.5 in class "wet curve" is that of dry surfaces'
        in warnings
    )


def test_motion_beyond_the_flange_is_noted(folder, changed):
    Path("scene.toml").write_text(
        changed(FIELD, ("shift_std_mm = 1.5", "shift_std_mm = 3"))
    )
    warnings = [str(one) for one in warnings_of(load_scene("scene.toml"))]
    assert "11 % of the motion would go beyond the flange clearance" in warnings[0]


def test_a_campaign_of_a_vehicle_stores_where_both_axles_run(folder):
    Path("scene.toml").write_text(SHORT)
    run_scene("scene.toml", "out")
    with open_results("out/field.nc") as result:
        yaw, shift = result["wheelset_yaw"].values, result["lateral_position"].values
        assert (
            np.ptp(shift[:, -4:], axis=0) > 1e-6
        ).all()  # found anew with the profiles of the moment
        # turned half of the time: the mirror image, of alike wheels
        np.testing.assert_allclose(yaw[:, -4:-2], -yaw[:, -2:], atol=1e-5)
        assert result["worn_area"].values[-1].min() > 0.0
        assert result.attrs["vehicle"].startswith(
            "regional multiple unit (example, made up"
        )
    said = html.unescape(write_report("out").read_text())
    assert (
        "The vehicle is a regional multiple unit, quasi-static in curves, on "
        "straight track held by its yaw stiffness."
    ) in said
    assert "Not modelled: switches and crossings" in said


def test_frozen_positions_are_those_of_the_new_wheels(folder, changed):
    text = changed(
        SHORT, ("tangent_wavelength_m", 'positions = "frozen"\ntangent_wavelength_m')
    )
    Path("scene.toml").write_text(text)
    run_scene("scene.toml", "out")
    Path("found.toml").write_text(FIELD)
    found = build(load_scene("found.toml")).points.conditions
    with open_results("out/field.nc") as result:
        assert (result["wheelset_yaw"].values == found.yaw).all()
        # the place of axles in curves is that at the height of the rails
        at_rails = result["lateral_position"].values - found.shift_depth * np.sin(
            result["wheelset_roll"].values
        )
        np.testing.assert_allclose(
            at_rails, np.broadcast_to(found.shift, at_rails.shape), rtol=0.0, atol=1e-15
        )


LINE = """name,length_km,curve_radius_m,cant_mm,speed_km_h,friction
,3,,,120,
a,0.5,600,100,90,0.3
,0.5,610,100,90,0.3
,0.7,-600,100,90,
"""


@pytest.fixture
def of_route(folder):
    """Scene text with the segments of line.csv."""
    Path("line.csv").write_text(LINE)
    start, end = SHORT.index("[[vehicle.class]]"), SHORT.index("[campaign]")
    more = (
        'route = "line.csv"\n[vehicle.each]\nfriction = 0.35\nshift_std_mm = 1.5\n'
        "environment = 0.5\n"
    )
    return SHORT[:start] + more + SHORT[end:]


def test_a_route_by_segments_becomes_classes_once_and_resumed_they_are_the_same(
    of_route, monkeypatch
):
    Path("scene.toml").write_text(of_route)
    scene = load_scene("scene.toml")
    searched = []
    for name in ("reduced", "settle"):
        search = getattr(prepared, name)
        monkeypatch.setattr(
            prepared,
            name,
            lambda *a, of=search, **k: (searched.append(of), of(*a, **k))[1],
        )
    known = prepare(scene)
    before = len(searched)
    run_scene(scene, "out")
    assert len(searched) == 2 * before > 0
    Path("other.toml").write_text(
        of_route.replace("friction = 0.35", "friction = 0.34")
    )
    resumed, other = (
        load_scene("out/scene/scene.toml", copied=True),
        load_scene("other.toml"),
    )
    assert prepare_again(resumed, scene, known) is known
    assert prepare_again(other, scene, known) is not known
    found = prepare(resumed)
    assert found.track == known.track
    for name in ("shift", "yaw"):
        there, here = (getattr(one.points.conditions, name) for one in (found, known))
        np.testing.assert_array_equal(there, here)
    assert [one.name for one in known.track][-2:] == [
        "R 600 left 90 km/h",
        "straight 120 km/h",
    ]
    assert sum(one.share for one in known.track) == pytest.approx(4.7)
    assert list(
        Path("out").rglob("line.csv")
    )  # the run directory has what the run needs
    with open_results("out/field.nc") as result:
        assert set(result["environment"].values) == {0.5}
        assert set(result["friction"].values) == {0.3, 0.35}
        assert "line.csv" in str(result.attrs)


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        (
            "cant_mm",
            "cannt_mm",
            'line.csv:1: column "cannt_mm" is no key of a segment; did you mean',
        ),
        (
            "0.5,600,100",
            "0.5,600,",
            'line.csv:3: "a": a curve needs either cant_mm or cant_deficiency_mm',
        ),
        ("120,", "1200,", "line.csv:2: speed_km_h = 1200.0 must be"),
        ("3,,,", "0,,,", "line.csv:2: length_km = 0.0 must be"),
    ],
)
def test_faults_of_a_route_have_its_lines(
    of_route, changed, faults_of, old, new, fault
):
    Path("line.csv").write_text(changed(LINE, (old, new)))
    assert fault in "\n".join(faults_of(of_route))


def test_straight_segments_may_state_that_they_have_no_cant(of_route, changed):
    """A column of cant has 0 on straight track: a segment as without it."""
    found = []
    for text in (LINE, changed(LINE, (",3,,,120,", ",3,,0,120,"))):
        Path("line.csv").write_text(text)
        Path("scene.toml").write_text(of_route)
        found.append(inputs_of(load_scene("scene.toml")).route.track)
    assert found[0] == found[1]


def test_a_route_excludes_classes(of_route, changed, faults_of):
    both = changed(FIELD, ("[[vehicle", 'route = "line.csv"\n[[vehicle'))
    assert "route and [[vehicle.class]] exclude each other" in faults_of(both)[0]
    text = changed(of_route, ('route = "line.csv"', 'route = "other.csv"'))
    assert "does not exist as given or next to the scene file" in faults_of(text)[0]
    text = changed(FIELD, ("[campaign]", "[vehicle.each]\nfriction = 0.3\n[campaign]"))
    assert "is for segments of a route" in faults_of(text)[0]
