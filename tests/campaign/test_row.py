from types import SimpleNamespace

import numpy as np

from wearsim.campaign.comparison import ComparisonPassage
from wearsim.campaign.passage import Passage
from wearsim.campaign.row import summarise
from wearsim.campaign.state import PatchWear
from wearsim.results import FILL_FLOAT, PATCH_SLOTS


def test_of_more_patches_than_slots_the_most_loaded_are_kept():
    """Noisy profiles touch in any number of patches."""

    class Contact:
        point = np.zeros(10, dtype=int)
        side = np.array([0, 1] * 5)
        normal_force = np.array([5.0, 1.0, 9.0, 8.0, 2.0, 7.0, 6.0, 4.0, 3.0, 10.0])
        patch = SimpleNamespace(width=np.ones(10))

        def __getattr__(self, name):
            return np.arange(10.0) + 1.0

    wear = PatchWear(
        area_rate=np.arange(10.0),
        depth_rate_max=np.zeros(10),
        regime=np.zeros(10, dtype=int),
        regime_highest=np.arange(10),
        zone_share=np.arange(40.0).reshape(10, 4),
    )
    ones = np.ones((10, 3))
    passage = Passage(Contact(), ones, ones[:, 0], (), ComparisonPassage(), ones[:, 0])
    row = summarise(passage, wear, 2)
    assert list(row["n_patch"]) == [10, 0]
    np.testing.assert_array_equal(
        row["area"][0], [1, 3, 4, 6, 7, 8, 9, 10]
    )  # all but the lightest two
    np.testing.assert_array_equal(row["wear_area_rate"][0], row["area"][0] - 1)
    np.testing.assert_array_equal(row["wear_regime_highest"][0], row["area"][0] - 1)
    np.testing.assert_array_equal(row["zone_share"][0, :, 1], 4 * row["area"][0] - 3)
    np.testing.assert_array_equal(row["area"][1], np.full(PATCH_SLOTS, FILL_FLOAT))
