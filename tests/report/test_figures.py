import numpy as np
import pytest

from wearsim.profile.measures import measure
from wearsim.profile.shape import Profile
from wearsim.quantities import QUANTITIES, kilometres
from wearsim.report.figures import campaign as figures
from wearsim.report.figures import translation as figures_translation
from wearsim.report.figures import wheels
from wearsim.report.style import (
    COLOURS,
    distance_text,
    grid,
    in_terminal,
    plain,
    to_svg,
)
from wearsim.translation.translate import translate


@pytest.fixture(scope="module")
def translation(rig, field):
    return translate(rig, field)


def test_profile_lines_are_the_data(rig):
    ax = figures.plot_profile(rig, wheel=1)
    lines = {line.get_label(): line for line in ax.lines}
    np.testing.assert_array_equal(
        lines["worn, rig"].get_xdata(), 1e3 * rig["profile_y"].values[-1, 1]
    )
    np.testing.assert_array_equal(
        lines["worn, rig"].get_ydata(), 1e3 * rig["profile_z"].values[-1, 1]
    )
    np.testing.assert_array_equal(
        lines["new wheel"].get_ydata(), 1e3 * rig["profile_z"].values[0, 1]
    )
    assert not ax.yaxis_inverted()  # flange up


def test_exaggerated_wear_is_a_factor_on_the_depth(rig):
    """Along the normal of the new wheel: on its flat tread that is the height."""
    factor = figures.exaggeration([rig])
    deepest = rig["wear_depth"].values[-1].max()
    assert 3e-3 <= factor * deepest <= 6e-3
    new, worn = (figures.worn_shape(rig, 0, distance, 1.0) for distance in (0.0, None))
    drawn = figures.worn_shape(rig, 0, None, factor)
    moved = np.hypot(*(drawn - new))
    np.testing.assert_allclose(
        moved, factor * rig["wear_depth"].values[-1, 0], rtol=1e-9, atol=1e-15
    )
    at = int(moved.argmax())
    assert drawn[1, at] < worn[1, at] < new[1, at]  # out is up: wear goes down
    unworn = rig.assign(wear_depth=0.0 * rig["wear_depth"])
    assert figures.exaggeration([unworn]) == 1.0


def test_each_campaign_has_its_new_wheel_and_measures_where_profiles_differ(rig, field):
    """One new wheel for both where they have the same profile."""
    names = {f"wheel_profile_{side}": "another profile" for side in ("right", "left")}
    other = field.copy(deep=True).assign_attrs(names)
    other["profile_z"].values[0] += 1e-3
    other["flange_thickness"].values[0] = 31e-3
    same, apart = (wheels.plot_shapes([rig, data]) for data in (field, other))
    new = [line for line in same.lines if "new wheel" in line.get_label()]
    assert [line.get_label() for line in new] == ["new wheel"]
    new = [line for line in apart.lines if "new wheel" in line.get_label()]
    assert [line.get_label() for line in new] == ["rig, new wheel", "field, new wheel"]
    for line, data in zip(new, (rig, other), strict=True):
        height = 1e3 * data["profile_z"].values[0, 0]
        np.testing.assert_array_equal(line.get_ydata(), height)
    texts = [text.get_text() for text in apart.texts]
    assert "Sd new: worn" in texts
    right, left = 1e3 * other["flange_thickness"].values[-1]
    assert f"31.00: {right:.2f} | {left:.2f}" in texts


def test_a_left_wheel_of_another_profile_is_drawn_and_measured_too(rig, field):
    other = field.copy(deep=True).assign_attrs(wheel_profile_left="another profile")
    other["profile_z"].values[0, 1] += 1e-3
    other["flange_height"].values[0, 1] = 29e-3
    ax = wheels.plot_shapes([rig, other])
    new = {line.get_label(): line for line in ax.lines if ", new" in line.get_label()}
    assert list(new) == [
        "rig, new wheel",
        "field, new right wheel",
        "field, new left wheel",
    ]
    np.testing.assert_array_equal(
        new["field, new left wheel"].get_ydata(), 1e3 * other["profile_z"].values[0, 1]
    )
    first = 1e3 * other["flange_height"].values[0, 0]
    right, left = 1e3 * other["flange_height"].values[-1]
    texts = [text.get_text() for text in ax.texts]
    assert f"{first:.2f} | 29.00: {right:.2f} | {left:.2f}" in texts


def test_each_campaign_has_its_own_state_where_one_was_reprofiled(reprofiled, field):
    """The wear of the other one counts from the new wheels."""
    ax = wheels.plot_shapes([reprofiled, field])
    labels = [line.get_label() for line in ax.lines]
    assert "rig, reprofiled wheel" in labels
    assert "field, new wheel" in labels
    texts = [text.get_text() for text in ax.texts]
    assert "Sd: worn" in texts
    for data, row, state in ((reprofiled, 3, "reprofiled"), (field, 0, "new")):
        start = " | ".join(
            dict.fromkeys(
                f"{1e3 * one:.2f}" for one in data["flange_height"].values[row]
            )
        )
        right, left = 1e3 * data["flange_height"].values[-1]
        assert f"{start} {state}: {right:.2f} | {left:.2f}" in texts
    other = reprofiled.copy(deep=True).assign_attrs(scene_kind="field")
    both = wheels.plot_shapes([reprofiled, other])
    assert any(text.get_text().endswith(" reprofiled") for text in both.texts)
    other["profile_z"].values[3:] -= 1e-3  # the lathe took more
    apart = [line.get_label() for line in wheels.plot_shapes([reprofiled, other]).lines]
    assert {"rig, reprofiled wheel", "field, reprofiled wheel"} < set(apart)


def test_wheels_of_page_one_are_the_data_in_true_scale_flange_up(rig, field):
    ax = wheels.plot_shapes([rig, field])
    lines = {line.get_label(): line for line in ax.lines}
    for data, run in ((rig, distance_text(60e3)), (field, distance_text(90e3))):
        for wheel, side in enumerate(("right", "left")):
            line = lines[f"{data.attrs['scene_kind']}, {run}, {side} wheel"]
            for values, axis in ((line.get_xdata(), "y"), (line.get_ydata(), "z")):
                expected = 1e3 * data[f"profile_{axis}"].values[-1, wheel]
                np.testing.assert_array_equal(values, expected)
    assert not ax.yaxis_inverted()
    assert ax.get_aspect() == 1.0
    texts = [text.get_text() for text in ax.texts]
    for symbol, name in wheels.GAUGED.items():
        assert f"{symbol} {1e3 * rig[name].values[0, 0]:.2f} new" in texts
        for data in (rig, field):
            right, left = 1e3 * data[name].values[-1]
            assert f"{right:.2f} | {left:.2f}" in texts
    ax = wheels.plot_depths([rig, field])
    np.testing.assert_array_equal(
        ax.lines[1].get_ydata(), 1e6 * rig["wear_depth"].values[-1, 1]
    )


def test_measures_are_drawn_where_they_are_measured(rig):
    """At another height, another running circle; on the profile but for its cubics over
    chords of 0.7 mm, which move a place by 0.02 mm.
    """
    y, z = (rig[f"profile_{axis}"].values[0, 0] for axis in "yz")
    profile = Profile("made up", "wheel", y, z)
    for rule in ({}, {"measuring_height": 12e-3, "running_circle": 65e-3}):
        values = measure(profile, **rule).values
        other = rig.assign_attrs(rule).copy(deep=True)
        for name in wheels.GAUGED.values():
            other[name].values[:] = values[name]
        ax = wheels.plot_shapes([other])
        (points,) = [line for line in ax.lines if line.get_marker() == "o"]
        tip, circle, sd, upper, lower = points.get_xydata()
        drawn = np.array([circle, sd, upper, lower])
        np.testing.assert_allclose(
            np.interp(drawn[:, 0], 1e3 * y, 1e3 * z), drawn[:, 1], atol=0.05
        )
        assert circle[0] == pytest.approx(1e3 * rule.get("running_circle", 70e-3) - 70)
        height = 1e3 * rule.get("measuring_height", 10e-3)
        assert sd[1] - circle[1] == pytest.approx(height)
        assert lower[1] - circle[1] == pytest.approx(10.0)
        assert tip[1] - upper[1] == pytest.approx(2.0)


def test_figures_of_reprofiled_wheels_say_so(reprofiled):
    ax = wheels.plot_shapes([reprofiled])
    assert "reprofiled wheel" in [line.get_label() for line in ax.lines]
    texts = [text.get_text() for text in ax.texts]
    assert len([text for text in texts if text.endswith(" reprofiled")]) == 3
    assert not any(text.endswith(" new") for text in texts)
    labels = [line.get_label() for line in wheels.plot_depths([reprofiled]).lines]
    assert labels[0] == f"rig, {distance_text(30e3)} since reprofiling, right wheel"


def test_pressure_along_the_wheel_is_the_largest_of_all_patches(rig):
    """At the middle of the patch that is pressed most it is its pressure, within the
    spacing of places; a patch reaches half its width to both sides.
    """
    end, side = rig.isel(step=-1), rig["side"].values[-1]
    for wheel in (0, 1):
        y, pressure = wheels.envelope(rig, "max_pressure", -1, wheel, True)
        here = side == wheel
        most = 1e-6 * end["max_pressure"].values[here].max()
        assert 0.995 * most <= np.nanmax(pressure) <= most
        centre, width = (1e3 * end[key].values[here] for key in ("wheel_y", "width"))
        low, high = (centre - 0.5 * width).min(), (centre + 0.5 * width).max()
        known = y[np.isfinite(pressure)]
        assert known.min() == pytest.approx(low, abs=0.25)
        assert known.max() == pytest.approx(high, abs=0.25)


def test_axes_of_measures_span_a_tenth_of_a_millimetre(rig):
    """Less is not told apart by a gauge; what is never below zero starts there."""
    still = rig.copy(deep=True)
    still["flange_height"].values[:] = 28e-3
    low, high = figures.plot_over_distance(still, "flange_height").get_ylim()
    assert high - low >= 0.1
    assert low < 28.0 < high
    still["hollowing"].values[:] = 1e-6 * np.arange(still.sizes["step"])[:, None]
    low, high = figures.plot_over_distance(still, "hollowing").get_ylim()
    assert high - low >= 0.1
    assert low > -0.01


def test_limits_stand_in_figures_of_measures_where_they_are_near(rig):
    worn = rig["max_wear_depth"].values.max()
    near, far = (
        rig.assign_attrs(limit_max_wear_depth=part * worn) for part in (1.5, 10.0)
    )
    for data, count in ((rig, 2), (near, 3), (far, 2)):
        assert len(figures.plot_over_distance(data, "max_wear_depth").lines) == count


def test_axes_have_no_offsets(rig):
    ax = figures.plot_over_distance(rig, "flange_height")
    formatter = ax.yaxis.get_major_formatter()
    formatter.set_axis(ax.yaxis)
    texts = formatter.format_ticks([28.0, 28.00001, 28.00002])
    assert formatter.get_offset() == ""
    assert len(set(texts)) == 3


def test_counterface_touches_the_new_wheel(rig):
    """Neither gap nor overlap, within the wheel's chords."""
    lines = {line.get_label(): line for line in figures.plot_profile(rig).lines}
    wheel, rail = lines["new wheel"], lines["counterface profile"]
    gap = rail.get_ydata() - np.interp(
        rail.get_xdata(), wheel.get_xdata(), wheel.get_ydata()
    )
    assert gap.min() == pytest.approx(0.0, abs=1e-12)


def test_wear_depth_line_is_the_data(field):
    ax = figures.plot_wear_depth(field, wheel=0)
    np.testing.assert_array_equal(
        ax.lines[-1].get_xdata(), 1e3 * field["profile_y"].values[0, 0]
    )
    np.testing.assert_array_equal(
        ax.lines[-1].get_ydata(), 1e3 * field["wear_depth"].values[-1, 0]
    )
    assert ax.lines[-1].get_color() == COLOURS["field"]
    assert ax.get_ylim()[1] >= 1e3 * field["wear_depth"].values.max()


def test_second_campaign_does_not_leave_the_axes(rig, field):
    """The deeper one drawn last must still be inside."""
    ax = figures.plot_wear_depth(field)
    figures.plot_wear_depth(rig, ax)
    assert ax.get_ylim()[0] == 0.0
    assert ax.get_ylim()[1] >= 1e3 * rig["wear_depth"].values.max()


@pytest.mark.parametrize(
    "name", ["flange_height", "hollowing", "worn_area", "max_wear_depth"]
)
def test_measure_lines_are_the_data(rig, name):
    ax = figures.plot_over_distance(rig, name)
    for wheel in (0, 1):
        expected = rig[name].values[:, wheel] * QUANTITIES[name].shown_factor
        np.testing.assert_array_equal(ax.lines[wheel].get_ydata(), expected)
    assert QUANTITIES[name].shown_unit in ax.get_ylabel()


def test_undefined_conicity_leaves_a_gap(rig):
    line = figures.plot_over_distance(rig, "equivalent_conicity").lines[0].get_ydata()
    assert np.isfinite(line[:4]).all()
    assert np.isnan(line[4:]).all()


def test_patches_of_two_campaigns_lie_on_the_worn_wheels_of_both(rig, field):
    """Each wheel has the colour of its campaign and one entry of the legend."""
    for wheel in (0, 1):
        ax = wheels.plot_patches_along([rig, field], wheel=wheel)
        handles, names = ax.get_legend_handles_labels()
        assert names == ["rig, worn wheel", "field, worn wheel"]
        for line, data in zip(handles, (rig, field), strict=True):
            for values, axis in ((line.get_xdata(), "y"), (line.get_ydata(), "z")):
                expected = 1e3 * data[f"profile_{axis}"].values[-1, wheel]
                np.testing.assert_array_equal(values, expected)
        assert len({line.get_color() for line in handles}) == 2


def test_contact_marks_are_the_patches(rig):
    ax = figures.plot_contact(rig, "max_pressure", new=True)
    side = rig["side"].values[0]
    for wheel in (0, 1):
        expected = rig["max_pressure"].values[0][side == wheel] * 1e-6
        np.testing.assert_array_equal(ax.lines[wheel].get_ydata(), expected)


def test_regimes_add_up_to_the_depth(rig):
    ax = figures.plot_wear_by_regime(rig)
    np.testing.assert_allclose(
        ax.lines[0].get_ydata(), 1e3 * rig["wear_depth"].values[-1, 0], rtol=1e-12
    )


def test_factor_lines_are_the_translation(translation):
    ax = figures_translation.plot_factor(translation, "worn_area", basis=1)
    expected = translation["worn_area_factor"].values[1, :, 2]
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), expected)
    np.testing.assert_array_equal(
        ax.lines[0].get_xdata(), 1e3 * translation["worn_depth"].values[1, :, 0]
    )
    for of, other in (("rig", "field"), ("field", "rig")):
        ax = figures_translation.plot_equivalent_distance(translation, of=of)
        expected = (
            1e-3
            * translation[f"equivalent_{other}_distance_max_wear_depth"].values[:, 2]
        )
        np.testing.assert_array_equal(ax.lines[0].get_ydata(), expected)


def test_svg_has_own_ids_and_no_links():
    figure, axes = grid()
    axes[0, 0].plot([0, 1], [0, 1], "o")
    text = to_svg(figure, "some")
    assert text.startswith("<svg ")
    assert 'id="some-' in text
    assert 'id="figure' not in text
    assert "<metadata" not in text
    assert text == to_svg(figure, "some")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (0.99996, "1.000"),
        (9.99996, "10.00"),
        (9999.4, "9999"),
        (55047.3, "55\N{NARROW NO-BREAK SPACE}047"),
        (-0.0123456, "\N{MINUS SIGN}0.01235"),
        (9.99996e-5, "0.0001000"),
        (8.351e-11, "< 0.0001"),
        (-1.5e-7, "> \N{MINUS SIGN}0.0001"),
        (
            2.5e9,
            "2\N{NARROW NO-BREAK SPACE}500\N{NARROW NO-BREAK SPACE}000\N{NARROW NO-BREAK SPACE}000",
        ),
        (np.nan, "undefined"),
        (np.inf, "undefined"),
    ],
)
def test_numbers_as_people_write_them(value, text):
    assert plain(value) == text


@pytest.mark.parametrize("distance", [0.0, 0.05, 2000.0, 81.25e3, 9999.6e3, 33453.4e3])
def test_distances_are_written_as_in_a_terminal(distance):
    text = distance_text(distance)
    assert text.replace("\N{NARROW NO-BREAK SPACE}", " ") == kilometres(distance)
    assert in_terminal(plain(-1e-3 * distance)).lstrip("-").isascii()
