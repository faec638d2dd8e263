"""Bands: what quantiles must hold to, what decides a result, how steels are ranked."""

import numpy as np
import pandas as pd
import pytest

from wearsim.scene.draws import draws_of
from wearsim.studies.bands import text_of
from wearsim.translation.bands import (
    SCRAMBLES,
    bands_of,
    quantiles_of,
    rank_materials,
    sensitivity,
    values_of,
)


def wear(share):
    """Worn depth by a closed form: coefficient and environment lognormal, friction
    quadratic.
    """
    from scipy.stats import norm

    scale = np.exp(0.4 * norm.ppf(share[:, 0]) + 0.3 * norm.ppf(share[:, 1]))
    return scale * (0.25 + 0.2 * share[:, 2]) ** 2


def test_bands_cover_nine_truths_of_ten():
    """100 bands of 64 draws, 20 truths each; the spread of that mean is 0.7 %."""
    truths = wear(np.random.default_rng(0).random((2000, 3))).reshape(100, 20)
    inside = []
    for seed, truth in enumerate(truths):
        low, _, high = quantiles_of(wear(draws_of(3, 64, seed)))[0]
        inside.append((truth >= low) & (truth <= high))
    assert 0.86 < np.mean(inside) < 0.94


def test_quantiles_meet_a_fine_reference_within_their_standard_error():
    """Of 4 096 points: 512 draws within 5 % of the band; the stated error is that
    order.
    """
    reference = quantiles_of(wear(draws_of(3, 4096, 1)))[0]
    band = reference[2] - reference[0]
    found, error = np.transpose(
        [quantiles_of(wear(draws_of(3, 512, seed))) for seed in range(2, 10)], (1, 0, 2)
    )
    assert (np.abs(found - reference).mean(axis=0) < 0.05 * band).all()
    assert (error.mean(axis=0) < 0.06 * band).all()
    scatter = found.std(axis=0, ddof=1)
    assert (error.mean(axis=0) > 0.3 * scatter).all()


def test_there_is_no_band_where_a_draw_did_not_come():
    values = np.tile(np.arange(16.0)[:, None], (1, 3))
    values[3, 1] = np.nan
    values[4:, 2] = np.inf  # a limit that most draws never met
    band, error = quantiles_of(values)
    assert np.isnan(band[:, 1]).all()
    assert np.isnan(error[:, 1]).all()
    assert band[0, 2] == 0.0
    assert np.isinf(band[1:, 2]).all()
    np.testing.assert_allclose(band[:, 0], [0.75, 7.5, 14.25])


def test_a_draw_that_ended_before_others_met_the_limit_leaves_no_band(rig):
    """As in bands of two campaigns; one that ran as far has met it beyond any."""
    depth = float(rig["max_wear_depth"].values[-1].max())
    met = rig.assign_attrs(limit_max_wear_depth=0.75 * depth)
    unmet = rig.assign_attrs(limit_max_wear_depth=10.0 * depth)
    stops = int(np.searchsorted(rig["max_wear_depth"].values.max(axis=1), 0.5 * depth))
    early = unmet.isel(step=slice(0, stops))
    nominal = values_of({"rig": met})
    name = "rig_max_wear_depth_met"
    assert np.isfinite(nominal[name])
    drawn = draws_of(1, SCRAMBLES, 1)

    def band(other):
        results = [met] * (SCRAMBLES - 1) + [other]
        draws = [values_of({"rig": data}, nominal) for data in results]
        return bands_of(nominal, draws, drawn, {"friction": 0})[f"{name}_band"].values

    low, _, high = band(unmet)
    assert low == pytest.approx(float(nominal[name]), rel=1e-9)
    assert high == np.inf
    assert np.isnan(band(early)).all()


def test_bands_keep_to_the_width_of_a_terminal(rig):
    """Whatever the name of the input that decides them; NaN is left empty."""
    name = "temperature of the lubricant in the third coach as the depot states it"
    nominal = values_of({"rig": rig.assign_attrs(limit_max_wear_depth=1.0)})
    drawn = draws_of(1, SCRAMBLES, 1)
    bands = bands_of(nominal, [nominal] * SCRAMBLES, drawn, {name: 0})
    met = bands["rig_max_wear_depth_met_band"]
    text = text_of(
        bands.assign(rig_max_wear_depth_met_band=np.nan * met).assign_attrs(
            largest_error_over_width=0.3
        ),
        pd.DataFrame(),
    )
    assert text.startswith(f"Bands of {SCRAMBLES} draws (90 %):")
    assert max(map(len, text.splitlines())) <= 100
    assert f"decided by {name[:30]}" in text
    assert "distance to the limit of max wear depth [km]" in text
    assert "nan" not in text
    assert "is 30 % of its band, above" in " ".join(text.split())


def test_shares_of_the_variance_of_a_known_model():
    """Logarithm 2 x + z of uniform x and a choice z of two: variances 4/12 and 1/4."""
    share = draws_of(3, 128, 4)
    found = sensitivity(
        share, np.exp(2.0 * share[:, 0] + (share[:, 2] >= 0.5)), [0, 0, 2]
    )
    assert found.kind == "share of variance"
    assert found.q2 > 0.999
    np.testing.assert_allclose(
        found.value, np.array([4 / 12, 0.0, 1 / 4]) / (7 / 12), atol=0.02
    )
    assert (found.low <= found.value + 1e-9).all()
    assert (found.value <= found.high + 1e-9).all()


def test_ranks_where_a_surrogate_predicts_nothing():
    share = draws_of(2, 64, 5)
    noise = np.random.default_rng(1).normal(size=64)
    found = sensitivity(share, np.exp(share[:, 0] + 2.0 * noise), [0, 0])
    assert found.kind == "rank correlation"
    assert found.q2 < 0.8
    assert found.value[0] > abs(found.value[1])


@pytest.mark.parametrize(("in_the_field", "survives"), [(2.0, 1.0), (0.5, 0.0)])
def test_the_order_of_two_steels(rig, field, in_the_field, survives):
    def worn(data, times):
        return data.assign(worn_area=times * data["worn_area"])

    draws = [{"rig": rig, "field": field}] * 16
    other = [{"rig": worn(rig, 1.5), "field": worn(field, in_the_field)}] * 16
    (row,) = rank_materials(draws, {"R9T": other}).to_dict("records")
    assert row["steel"] == "R9T"
    assert row["rig, 50%"] == pytest.approx(1.5)
    assert row["field, 5%"] == pytest.approx(in_the_field)
    assert row["order survives"] == survives
