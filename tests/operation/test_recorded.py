"""Records reduced to operating points: weights of samples, and the wear of a known
collective.
"""

from dataclasses import replace

import numpy as np
import pytest
from law_settings import wear_settings

from wearsim.contact.solve import ContactModels
from wearsim.operation.recorded import (
    Reducer,
    Samples,
    binning_error,
    bisected,
    merged,
    reduce_samples,
    samples_of,
)

# set-points of a collective: shift [m], yaw [rad], load of the right and left
# wheel [N], share
KNOWN = np.array(
    [
        [0.0, 0.0, 80e3, 80e3, 4],
        [3e-3, 1e-3, 85e3, 75e3, 2],
        [-3e-3, -1e-3, 75e3, 85e3, 2],
        [1e-3, -1e-3, 80e3, 80e3, 3],
        [6.4e-3, 4e-3, 90e3, 70e3, 1],
        [-6.4e-3, -4e-3, 70e3, 90e3, 1],
        [5e-3, 2e-3, 80e3, 80e3, 2],
        [-1e-3, 1e-3, 80e3, 80e3, 3],
    ]
)
NAMES = ("shift", "yaw", "wheel_load_right", "wheel_load_left")


def record(rows):
    """Record of samples of set-points, 10 m apart at 20 m/s."""
    count = len(rows)
    values = {name: rows[:, k].copy() for k, name in enumerate(NAMES)}
    values |= {"speed": np.full(count, 20.0), "friction": np.full(count, 0.35)}
    return {"time": 0.5 * np.arange(count), **values}


@pytest.fixture(scope="module")
def reducer(bodies):
    models = ContactModels.of("fast", strips=10, cells=10, cell_size=2e-3)
    return Reducer(*bodies(0.0), models, wear_settings("archard"), 2.5e-3)


@pytest.fixture(scope="module")
def rows():
    """18 samples of each unit of share, in a fixed disorder."""
    many = np.repeat(KNOWN[:, :4], (6 * KNOWN[:, 4]).astype(int), axis=0)
    return many[np.random.default_rng(1).permutation(len(many))]


def test_a_record_of_a_known_collective_gives_its_wear(reducer, rows):
    """Samples of a set-point are one point, whatever their order, and two records are
    their sum.
    """
    found = reduce_samples(samples_of(record(rows)), reducer, 1e-6)
    assert found.error <= 1e-9  # rounding of means
    assert (found.samples, len(found.group)) == (len(rows), len(KNOWN))
    values = np.stack([found.points.values[name] for name in NAMES], axis=1)
    order = np.lexsort(values.T)
    known = np.lexsort(KNOWN[:, :4].T)
    np.testing.assert_allclose(values[order], KNOWN[known, :4], rtol=1e-9, atol=1e-12)
    shares = found.points.distance / found.points.distance.sum()
    np.testing.assert_allclose(
        shares[order], KNOWN[known, 4] / KNOWN[:, 4].sum(), rtol=1e-9
    )
    assert set(found.group) == {"tread", "right flange", "left flange"}
    twice = reduce_samples(
        samples_of(record(np.repeat(rows[::-1], 2, axis=0))), reducer, 1e-6
    )
    increments = [one.reducer.increment(one.points) for one in (twice, found)]
    np.testing.assert_allclose(*increments, atol=1e-9 * increments[0].max())
    assert binning_error(found.increments_on(reducer.wheelset)) == found.error


def test_two_records_joined_wear_as_their_sum_weighted_by_distance(reducer, rows):
    """One on the tread and at the right flange, the other, half as long, elsewhere."""
    right = rows[rows[:, 0] > 0.0]
    parts = (right, rows[rows[:, 0] <= 0.0][: len(right) // 2])
    one, other, both = (
        reduce_samples(samples_of(record(part)), reducer, 1e-6)
        for part in (*parts, np.concatenate(parts))
    )
    depth = [each.reducer.increment(each.points) for each in (one, other, both)]
    run = [each.points.distance.sum() for each in (one, other)]
    assert run[0] == pytest.approx(2.0 * run[1], rel=0.02)
    np.testing.assert_allclose(
        np.average(depth[:2], axis=0, weights=run), depth[2], atol=1e-9 * depth[2].max()
    )


def test_scattered_samples_keep_the_tolerance_by_nested_points(reducer, rows):
    scattered = rows * (
        1.0 + 0.05 * np.random.default_rng(2).standard_normal(rows.shape)
    )
    samples = samples_of(record(scattered))
    coarse, fine = (reduce_samples(samples, reducer, one) for one in (0.2, 0.03))
    assert coarse.error <= 0.2
    assert fine.error <= 0.03
    assert 8 <= len(coarse.group) < len(fine.group) < len(rows)
    # the difference that it states, with the sharing of weights of its points
    share = fine.points.distance / fine.points.distance.sum()
    depth = np.tensordot(
        share, reducer.worn(reducer.conditions(fine.points))[0], axes=1
    )
    whole = np.tensordot(
        samples.distance / samples.distance.sum(),
        reducer.worn(reducer.conditions(samples))[0],
        axes=1,
    )
    assert np.abs(depth - whole).max() / whole.max() == pytest.approx(
        fine.error, rel=1e-9
    )


def test_groups_are_nested_and_never_join_what_is_apart():
    values = np.random.default_rng(3).standard_normal((200, 3))
    start = (values[:, 0] > 1.0).astype(int)
    few, many = (bisected(values, np.ones(200), count, start) for count in (8, 40))
    assert len(np.unique(few)) == 8
    assert len(np.unique(many)) == 40
    for group, outer in ((many, few), (few, start)):
        assert all(len(np.unique(outer[group == k])) == 1 for k in np.unique(group))


def test_samples_weigh_what_they_run_without_standstill_and_gaps():
    values = {
        "time": np.array([0.0, 1, 2, 3, 4, 100, 101]),
        "shift": np.zeros(7),
        "yaw": np.zeros(7),
    }
    speed = np.array([10.0, 10, 20, 0, 20, 10, 10])
    samples = samples_of({**values, "speed": speed})
    np.testing.assert_allclose(samples.distance, [10, 10, 20, 20, 10, 10])
    text = "; ".join(samples.notes)
    assert "1 gaps" in text
    assert "14.3 % of the samples stand still" in text
    assert "lateral and yaw velocities are not known" in text
    with pytest.raises(ValueError, match="the time does not rise"):
        samples_of({**values, "time": np.zeros(7), "speed": speed})
    with pytest.raises(ValueError, match="no distance is run"):
        samples_of({**values, "speed": np.zeros(7)})


def test_a_moving_wheelset_has_a_drift_and_a_turn_where_samples_are_close():
    """A wave of 9 m sampled each 0.5 m: y' within 1 % but for the ends; the yaw rate
    adds to the curvature of the track.
    """
    place = 0.5 * np.arange(200)
    wave = 2 * np.pi / 9.0
    values = {
        "place": place,
        "speed": np.full(200, 20.0),
        "shift": 2e-3 * np.sin(wave * place),
    }
    samples = samples_of({**values, "yaw": 1e-3 * np.cos(wave * place)})
    expected = 2e-3 * wave * np.cos(wave * place)
    inner = slice(4, -4)
    np.testing.assert_allclose(
        samples.values["drift"][inner], expected[inner], atol=0.01 * 2e-3 * wave
    )
    turn = -1e-3 * wave * np.sin(wave * place)
    np.testing.assert_allclose(
        samples.values["track_curvature"][inner], turn[inner], atol=0.01e-3 * wave
    )
    assert not samples.values["curve_curvature"].any()
    curve = {**values, "track_curvature": np.full(200, -2e-3)}
    curve = samples_of({**curve, "yaw": 1e-3 * np.cos(wave * place)})
    np.testing.assert_array_equal(curve.values["curve_curvature"], -2e-3)


def test_a_merged_sample_is_the_mean_over_the_distance():
    samples = Samples({"shift": np.array([1.0, 2.0, 4.0])}, np.array([1.0, 1.0, 2.0]))
    both = merged(samples, np.array([0, 1, 1]))
    np.testing.assert_allclose(both.values["shift"], [1.0, 10.0 / 3.0])
    np.testing.assert_allclose(replace(both).distance, [1.0, 3.0])


def test_a_constant_column_that_rounding_spreads_does_not_end_the_division():
    """The spread of a constant is rounding; scaled to a spread of one it looks like the
    widest column.
    """
    values = np.stack([np.full(100, 1e150), np.linspace(0.0, 1.0, 100)], axis=1)
    values[0, 0] = np.nextafter(1e150, 0.0)
    group = bisected(values, np.ones(100), 8, np.zeros(100, dtype=np.int64))
    assert group.max() == 7


def test_long_records_are_thinned_not_merged(monkeypatch):
    """Means of tread and flange contact are neither: the points are compared with
    samples themselves.
    """
    monkeypatch.setattr("wearsim.operation.recorded.MOST_SAMPLES", 50)

    class Still(Reducer):
        def __init__(self):
            pass

        def conditions(self, samples):
            return samples

        def worn(self, samples):
            depth = np.zeros((samples.distance.size, 2, 3))
            depth[:, 0, 0] = samples.values["shift"] ** 2
            return depth, np.zeros(samples.distance.size, dtype=np.int64)

    shift = np.tile([-1.0, 1.0], 500)
    record = Samples({"shift": shift, "speed": np.full(1000, 20.0)}, np.ones(1000))
    found = reduce_samples(record, Still(), 0.02)
    assert found.samples == 1000
    assert found.error < 1e-12
    assert set(found.points.values["shift"]) == {-1.0, 1.0}
