"""Wear of patches by zone of the wheel profile."""

import numpy as np
import pytest

import wearsim
from wearsim.campaign.zones import zone_shares
from wearsim.profile.worn import WHEEL_ZONES
from wearsim.report.html import render
from wearsim.report.inspect import inspect, summary_text
from wearsim.results import FILL_FLOAT, load_results

ZONES = len(WHEEL_ZONES)


def test_borders_divide_strips_by_their_width():
    """Strips of 2 mm about the border of flange root and tread, -26 mm; the middle one
    lies on it, a quarter in the flange root.
    """
    edges = 1e-3 * (-26.0 + np.array([[-2.5, -0.5, 1.5, 3.5]]))
    shares = zone_shares(edges, np.array([[1.0, 4.0, 3.0]]))
    np.testing.assert_allclose(shares, [[0.0, 2.0 / 8.0, 6.0 / 8.0, 0.0]], atol=1e-12)
    mirrored = zone_shares(edges[:, ::-1], np.array([[3.0, 4.0, 1.0]]))
    np.testing.assert_allclose(mirrored, shares, atol=1e-12)


def test_patches_lie_in_any_zone_and_have_no_shares_without_wear():
    ends = [-50e-3, -38e-3, -26e-3, 32e-3, 60e-3]
    middle = 0.5 * (np.array(ends[1:]) + ends[:-1])
    edges = middle[:, None] + 1e-3 * np.arange(-1, 2)
    np.testing.assert_allclose(
        zone_shares(edges, np.ones((ZONES, 2))), np.eye(ZONES), atol=1e-12
    )
    assert (zone_shares(edges, np.zeros((ZONES, 2))) == FILL_FLOAT).all()


@pytest.fixture(scope="module")
def ran(tmp_path_factory, scene_text):
    """A block in the flange root and one on the tread, and a result of them."""
    blocks = (
        {"name": "centred", "shift_mm": 0.5, "distance_km": 1},
        {"name": "curve", "shift_mm": 5.8, "yaw_mrad": 3, "distance_km": 1},
    )
    folder = tmp_path_factory.mktemp("zones")
    (folder / "rig.toml").write_text(scene_text(*blocks))
    return folder / "rig.toml", wearsim.run(folder / "rig.toml", folder / "out")[0]


def test_shares_of_a_row_are_those_along_the_profile(ran):
    """wear_rate spreads strips over points 0.5 mm apart: a border is exact to half of
    one, of patches some 10 mm wide.
    """
    scene, path = ran
    rate = wearsim.wear_rate(scene)
    arc = rate["arc_length"].values
    area = rate["wear_depth_rate"].sum("regime").values * np.gradient(arc, axis=1)
    zone = np.digitize(rate["profile_y"].values, list(WHEEL_ZONES.values())[:-1])
    row = load_results(path).isel(step=0)
    patches = row["wear_area_rate"].values[..., None] * row["zone_share"].values
    for wheel in (0, 1):
        of_wheel = (row["side"].values == wheel)[..., None]
        shares = np.nansum(np.where(of_wheel, patches, 0.0), axis=1)
        exact = [
            area[:, wheel, zone[wheel] == k].sum(axis=1)
            for k in range(len(WHEEL_ZONES))
        ]
        np.testing.assert_allclose(
            shares, np.stack(exact, axis=1), atol=0.05 * area.sum(axis=(1, 2)).max()
        )


def test_the_table_answers_which_block_wears_the_flange_root(ran):
    _, path = ran
    table = wearsim.wear_by_zone(path)
    assert table.index.tolist() == ["curve", "centred"]
    assert table.to_numpy().sum() == pytest.approx(1.0, rel=1e-12)
    assert table["right"]["flange root"].idxmax() == "curve"
    assert table["right"]["flange root"]["centred"] == 0.0
    found = inspect(path)
    stored = found["wear_by_zone"]["curve"]["right"]["flange root"]
    assert stored == table["right"]["flange root"]["curve"]
    text = summary_text(found, details=False)
    assert "Share of the wear by zone [%]" in text
    assert max(map(len, text.split("\n"))) <= 100
    assert 'id="table-wear-by-zone-rig"' in render([load_results(path)])
    old = load_results(path).drop_vars(["zone_share", "zone_name"])
    assert wearsim.wear_by_zone(old).empty
    assert "by zone" not in summary_text(inspect(old))
