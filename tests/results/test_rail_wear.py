"""Rail wear per 100 MGT from stored contacts: closed forms on a synthetic result."""

import numpy as np
import pytest

import wearsim
from wearsim.errors import ResultError
from wearsim.report.rail_wear import rail_tables
from wearsim.report.tables import settings
from wearsim.results import load_results
from wearsim.results.rail_wear import NO_CO_EVOLUTION, rail_wear

PASSAGES = 1e8 * 1e3 * 9.81 / 160e3  # of axles of 160 kN in 100 MGT
CIRCLE = 2.0 * np.pi * 0.46
ENVIRONMENT = 0.2
# of the patches of each point of the synthetic field, see `synthetic_campaign.py`
AREA = {"outer": (3e-12, 5e-12), "inner": (4e-12,)}
DEPTH = {"outer": (400e-12, 900e-12), "inner": (300e-12,)}
# heights of the synthetic profile over the radius, up to 1.5 mm of 460
RADII = 4e-3


@pytest.fixture
def field(tmp_path, write_campaign):
    """Result in the field: three points on straight track, each a class of its own."""
    path = write_campaign(tmp_path / "field.nc", "field", 4, 8e-9)
    with wearsim.open_results(path) as data:
        return data.load()


@pytest.mark.parametrize("rail", ["outer", "inner"])
def test_a_passage_wears_the_rail_once(field, rail):
    """Depth and area per metre run times the circumference, not divided by it; patches
    that do not overlap keep their own depths.
    """
    wear = rail_wear(field).sel(rail=rail)
    scale = CIRCLE * ENVIRONMENT * PASSAGES
    assert wear["rail_wear_depth"].sel(face="head").values == pytest.approx(
        max(DEPTH[rail]) * scale, rel=RADII
    )
    assert not wear["rail_wear_depth"].sel(face="gauge_face").any()
    assert wear["rail_worn_area"].values == pytest.approx(
        sum(AREA[rail]) * scale, rel=RADII
    )
    assert wear["passages"].values == pytest.approx(PASSAGES, rel=1e-12)


def test_points_of_a_class_share_its_passages(field):
    """Three points that touch the rail at one place wear as one point; moved apart,
    each wears its share.
    """
    names = field["operating_point_name"].values.astype(object)
    names[:3] = "curve"
    field = field.assign_coords(operating_point_name=("operating_point", names))
    scale = CIRCLE * ENVIRONMENT * PASSAGES

    def depth():
        wear = rail_wear(field)["rail_wear_depth"]
        assert wear["class"].values.tolist() == ["curve"]
        return float(wear.sel(rail="inner", face="head").values[0])

    assert depth() == pytest.approx(300e-12 * scale, rel=RADII)
    field["rail_y"].values[:, :, 2] = 1e-3 * np.array([-20, 0, 20, 0, 0, 0, 0])
    # the second point has half of the distance
    assert depth() == pytest.approx(0.5 * 300e-12 * scale, rel=RADII)


def test_both_axles_of_a_bogie_wear_one_rail(field):
    """Of vehicles, points of the leading and the trailing axle are of one class."""
    names = field["operating_point_name"].values.astype(object)
    names[:3] = "R 500 leading", "R 500 trailing", "R 500 leading"
    field = field.assign_coords(operating_point_name=("operating_point", names))
    apart = rail_wear(field)["class"].values.tolist()
    assert apart == ["R 500 leading", "R 500 trailing"]
    field.attrs["vehicle"] = "coach"
    assert rail_wear(field)["class"].values.tolist() == ["R 500"]


def test_outer_rail_of_a_curve_and_its_gauge_face(field):
    """A curve to the right has the left rail outside; from 40 degrees on a patch lies
    on the gauge face.
    """
    straight = rail_wear(field)
    field["curve_curvature"].values[:] = 1.0 / 500.0
    wear = rail_wear(field)
    for rail, other in (("outer", "inner"), ("inner", "outer")):
        assert wear["rail_worn_area"].sel(rail=rail).values == pytest.approx(
            straight["rail_worn_area"].sel(rail=other).values, rel=1e-12
        )
    assert wear["track_curvature"].values == pytest.approx(2e-3)
    field["curve_curvature"].values[:] = -1.0 / 500.0
    field["contact_angle"].values[:, :, 1] = -1.1
    face = rail_wear(field)["rail_wear_depth"].sel(rail="outer")
    scale = CIRCLE * ENVIRONMENT * PASSAGES
    assert face.sel(face="gauge_face").values == pytest.approx(
        900e-12 * scale, rel=RADII
    )
    assert face.sel(face="head").values == pytest.approx(400e-12 * scale, rel=RADII)


@pytest.mark.parametrize("curvature", [2e-5, -2e-5])
def test_noise_of_a_recorded_curvature_makes_no_curve_of_straight_track(
    field, curvature
):
    straight = rail_wear(field)
    field["curve_curvature"].values[:] = curvature
    noisy = rail_wear(field)
    assert not noisy["track_curvature"].any()
    for name in ("rail_wear_depth", "rail_worn_area"):
        np.testing.assert_array_equal(noisy[name].values, straight[name].values)


def test_the_path_of_the_wheelset_makes_no_curve_of_straight_track(field):
    """No radius, and the right rail stays the outer one; results without the curvature
    of the track have the one they hold.
    """
    straight = rail_wear(field)
    field["track_curvature"].values[:] = 1.0 / 500.0
    swaying = rail_wear(field)
    assert not swaying["track_curvature"].any()
    for name in ("rail_wear_depth", "rail_worn_area"):
        np.testing.assert_array_equal(swaying[name].values, straight[name].values)
    (table,) = rail_tables([field])
    assert table.frame["Curve radius [m]"].isna().all()
    older = field.drop_vars("curve_curvature")
    assert rail_wear(older)["track_curvature"].values == pytest.approx(2e-3)
    (table,) = rail_tables([older])
    assert table.frame["Curve radius [m]"].tolist() == pytest.approx([500.0] * 3)


def test_settings_tell_the_track_from_the_path_of_the_wheelset(field):
    """The path is a row of its own, only where it differs from the track."""

    def rows(data):
        return {row[0]: row[1:] for row in settings([data]).frame.values.tolist()}

    track, path = "Track curvature [1/m]", "Curvature of the path of the wheelset [1/m]"
    assert rows(field)[track] == ["0"]
    assert path not in rows(field)
    field["track_curvature"].values[:] = 1.0 / 500.0
    assert rows(field)[track] == ["0"]
    assert rows(field)[path] == ["0.002"]
    older = rows(field.drop_vars("curve_curvature"))
    assert older[track] == ["0.002"]
    assert path not in older


VEHICLE = """[scene]
kind = "field"
[wheelset]
profile = "S1002"
[counterface]
profile = "60E1"
inclination = "1:40"
[contact]
model = "fast"
strips = 10
cells = 10
[vehicle]
file = "regional_multiple_unit"
tangent_wavelength_m = 9
[[vehicle.class]]
name = "straight"
share = 0.6
speed_km_h = 120
friction = 0.35
shift_std_mm = 1.5
[[vehicle.class]]
name = "curve"
share = 0.4
curve_radius_m = -600
cant_deficiency_mm = 50
speed_km_h = 90
friction = 0.35
[campaign]
distance_km = 2
point_spacing_mm = 0.5
"""


def test_rail_wear_of_a_vehicle_has_the_radius_of_its_curve_alone(tmp_path):
    scene = tmp_path / "vehicle.toml"
    scene.write_text(VEHICLE, encoding="utf-8")
    (path,) = wearsim.run(scene, tmp_path / "out")
    data = load_results(path)
    (table,) = rail_tables([data])
    rows = table.frame.set_index("Class")["Curve radius [m]"]
    assert rows["straight"] is None
    assert rows["curve"] == pytest.approx(600.0)
    # the wear of the right and of the left wheels on straight track
    points = data["operating_point_class"].values == "straight"
    side = data["side"].values[0, points]
    weight = data["weight"].values[points, None]
    rate = weight * data["wear_area_rate"].values[0, points]
    right, left = (np.nansum(rate[side == wheel]) for wheel in (0, 1))
    area = rail_wear(data.isel(step=[0]))["rail_worn_area"].sel({"class": "straight"})
    assert area[0] / area[1] == pytest.approx(right / left, rel=RADII)


def test_a_strip_on_the_gauge_face_is_as_wide_as_its_projection(field):
    """At 60 degrees a strip extends over half its length along y: two of them, three
    quarters of that length apart, do not lie on each other.
    """
    names = field["operating_point_name"].values.astype(object)
    names[:3] = "curve"
    field = field.assign_coords(operating_point_name=("operating_point", names))
    field["contact_angle"].values[:, :, 1] = np.radians(60.0)
    length = AREA["outer"][1] / DEPTH["outer"][1]  # of each strip, 5.6 mm
    field["rail_y"].values[:, :3, 1] = length * np.array([0.0, 0.75, 1.5]) - 31e-3
    face = rail_wear(field)["rail_wear_depth"].sel(rail="outer", face="gauge_face")
    # the deepest strip is that of the second point, which has half of the distance
    scale = CIRCLE * ENVIRONMENT * PASSAGES
    assert face.values == pytest.approx(0.5 * 900e-12 * scale, rel=RADII)


def test_rows_are_averaged_over_the_distance(field):
    """A rate that grows linearly from row to row gives its mean, by the trapezoidal
    rule.
    """
    usual = rail_wear(field)["rail_worn_area"].values
    field["wear_area_rate"].values *= np.arange(5.0)[:, None, None]
    assert rail_wear(field)["rail_worn_area"].values == pytest.approx(
        2.0 * usual,
        rel=1e-3,  # the radius falls by 0.3 mm of 460
    )


def test_gross_tonnes_are_counted_by_the_axle_load(field):
    """Half the axle load, twice the passages; the depth of each stays."""
    usual, light = rail_wear(field), rail_wear(field, axle_load=80e3)
    for name in ("passages", "rail_wear_depth", "rail_worn_area"):
        assert light[name].values == pytest.approx(2.0 * usual[name].values, rel=1e-12)


def test_what_has_no_rail_wear_is_one_clear_line(field, tmp_path, write_campaign):
    path = write_campaign(tmp_path / "rig.nc", "rig", 1, 8e-9)
    with pytest.raises(ResultError, match="this one is of a rig"):
        wearsim.rail_wear(path)
    with pytest.raises(ResultError, match=r"axle_load = 1000 must be at least 0\.2"):
        rail_wear(field, axle_load=1e6)


def test_summary_and_report_say_that_the_rail_keeps_its_profile(field):
    from wearsim.report.html import render
    from wearsim.report.inspect import summary, summary_text

    content = summary(field)
    wear = rail_wear(field)
    first = str(wear["class"].values[0])
    assert content["rail_wear"][first]["outer_rail_wear_depth"] == pytest.approx(
        wear["rail_wear_depth"].values[0, 0].tolist()
    )
    text = summary_text(content)
    assert "Rail wear per 100 MGT [mm]" in text
    assert NO_CO_EVOLUTION.split(":")[0] in text
    assert "Rail wear" not in summary_text(content, details=False)
    page = render([field])
    assert "Rail wear per 100 MGT" in page
    assert NO_CO_EVOLUTION in page
