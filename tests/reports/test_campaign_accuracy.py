"""Campaigns and contacts with frozen references, and what the report measures against
them.
"""

import hashlib
from types import SimpleNamespace

import campaign_accuracy
import frozen_references
import numpy as np
import pandas as pd
import pytest
from campaign_accuracy import MOST, QUANTITIES, ratios_of, read_references, read_table
from frozen_references import (
    CONTACTS,
    contact,
    errors_of_contact,
    frozen_campaign,
    frozen_contact,
    read_contacts,
)
from made_up_campaigns import CASES, WORN, places_of, scene

from wearsim.contact.problem import PAIRS

TEXTS = "c16e939847fe7462"


def test_campaigns_are_those_of_the_references():
    texts = "".join(scene(number).replace(str(WORN), "") for number in range(CASES))
    assert hashlib.sha256(texts.encode()).hexdigest()[:16] == TEXTS


def test_contacts_are_those_of_the_references(reports):
    table = read_contacts(reports)
    assert (table["power"].notna().sum(), len(table)) == (CONTACTS, CONTACTS)
    for row in table.to_dict("records"):
        for name, value in contact(row["contact"]).items():
            assert row[name] == (
                pytest.approx(value, rel=1e-5) if isinstance(value, float) else value
            )
    worn = table["kind"].isin(["measured", "hollow"])
    assert worn.mean() == 0.5
    assert (table["curvature"] > 0.0).mean() > 0.3
    assert (table["shift"] > 4e-3).mean() > 0.25
    assert table["power_change"].abs().max() < 0.01


def test_contact_of_the_table(reports):
    """An eighth of a second; the digits of the table.

    But 0.2 % for what hangs on where its grids lie: since 0.3.0 they do not begin at
    those of coarse patches.
    """
    table = read_contacts(reports)
    (frozen,) = table[table["contact"] == 1].to_dict("records")
    row = frozen_contact(1)
    for name in ("force_x", "force_y", "power", "max_pressure"):
        assert row[name] == pytest.approx(frozen[name], rel=1e-4), name
    assert row["area"] == pytest.approx(frozen["area"], rel=2e-3)
    largest = max(value for name, value in frozen.items() if name.startswith("work_"))
    for name in ("work_4", "work_30"):
        assert row[name] == pytest.approx(frozen[name], abs=2e-3 * largest), name


@pytest.mark.slow
def test_standard_in_the_contacts_of_the_table(reports):
    """Strip work 2 % in the median and 5 % in 90 %, power 2 % in 90 %, largest pressure
    3 % in 97 %.
    """
    table = read_contacts(reports).to_dict("records")
    errors = pd.DataFrame(
        [errors_of_contact(row, *PAIRS["standard"], 30) for row in table]
    )
    assert errors["strip_work"].median() < 2.0
    assert errors["strip_work"].quantile(0.9) < 5.0
    assert errors["power"].quantile(0.9) < 2.0
    assert errors["max_pressure"].quantile(0.97) < 3.0


@pytest.mark.slow
def test_campaign_of_the_table(reports, tmp_path):
    """The shortest one again: to the tolerance of the balance, magnified by the law."""
    campaigns, depths, _ = read_references(reports)
    (frozen,) = campaigns[
        (campaigns["case"] == 4) & (campaigns["cells"] == 30)
    ].to_dict("records")
    known = depths[(depths["case"] == 4) & (depths["cells"] == 30)]
    found = frozen_campaign(4, 30, 1e3 * frozen["distance_km"], known, tmp_path)
    assert found["campaigns"]["deepest_um"].item() == pytest.approx(
        frozen["deepest_um"], rel=1e-3
    )
    samples = [name for name in known if name.startswith("d") and name != "distance_km"]
    ours, theirs = (table[samples].to_numpy() for table in (found["depths"], known))
    np.testing.assert_allclose(ours, theirs, atol=2e-3 * theirs.max())


def test_places_of_programmes_are_ends_of_loops_or_blocks():
    def places(distance, *blocks):
        points = SimpleNamespace(block_length=np.array(blocks))
        return places_of(SimpleNamespace(points=points), distance)

    np.testing.assert_allclose(places(100.0, 0.0, 0.0), np.arange(10.0, 101.0, 10.0))
    np.testing.assert_allclose(places(100.0, 3.0), np.arange(10.0, 101.0, 10.0))
    np.testing.assert_allclose(
        places(100.0, 1.0, 2.0), [9, 21, 30, 39, 51, 60, 69, 81, 90, 99]
    )
    np.testing.assert_allclose(places(10.0, 3.0, 4.0), [3, 7, 10])


def test_the_report_is_what_its_tables_say(reports, tmp_path):
    for name in (
        *(f"campaign_accuracy{part}.csv" for part in ("", "_slip", "_contacts")),
        *REFERENCES,
    ):
        (tmp_path / name).write_bytes((reports / name).read_bytes())
    campaign_accuracy.main(["--from-csv", "--out", str(tmp_path)])
    assert (tmp_path / "campaign_accuracy.md").read_text() == (
        reports / "campaign_accuracy.md"
    ).read_text()


REFERENCES = [f"reference_{name}.csv" for name in ("campaigns", "depths", "rows")]


def test_finished_references_are_left_as_they_are(reports, tmp_path, monkeypatch):
    for name in ("reference_contacts.csv", *REFERENCES):
        (tmp_path / name).write_bytes((reports / name).read_bytes())
    monkeypatch.setattr(
        frozen_references, "frozen_campaign", lambda *_: pytest.fail("computed again")
    )
    done = pd.read_csv(reports / "reference_campaigns.csv")
    both = done["case"].value_counts()
    finished = both.index[both == 2].tolist()
    frozen_references.main(["--out", str(tmp_path), "--cases", *map(str, finished)])
    frozen_references.main(["--out", str(tmp_path), "--contacts"])
    for name in ("reference_contacts.csv", *REFERENCES):
        assert (tmp_path / name).read_bytes() == (reports / name).read_bytes()


# ------------------------------------------------------------------------------ targets


def share(law, column, limit):
    """Share of the campaigns of a law whose depths `standard` has within a limit
    [%].
    """

    def of(table, references):
        mine = table[(table["pair"] == "standard") & (table["law"] == law)]
        return (mine[column] <= limit).mean()

    return of


def median(law, column):
    def of(table, references):
        return -table[(table["pair"] == "standard") & (table["law"] == law)][
            column
        ].median()

    return of


def of_points(name, which):
    """Share of the wheels of operating points that `standard` has within a limit."""

    def of(table, references):
        mine = table[(table["pair"] == "standard") & table["compared"].notna()]
        return mine[f"{name}_within_{which}"].sum() / mine["compared"].sum()

    return of


def cpu(kind):
    return lambda table, references: -ratios_of(table, "standard", kind).median()


def cells(case):
    """Difference of the reference between 30 and 60 cells on the way [%]."""

    def of(table, references):
        (row,) = [
            row for row in campaign_accuracy.grids(references) if row["case"] == case
        ]
        return -row["most"]

    return of


TARGETS = {
    "USFD, 3 % in 95 %": (share("usfd", "largest_percent", 3.0), 0.95),
    "USFD, 4 % in all": (share("usfd", "largest_percent", 4.0), 1.0),
    "USFD, median 1.3 %": (median("usfd", "largest_percent"), -1.3),
    "KTH, 3 % in three quarters": (share("archard", "largest_percent", 3.0), 0.75),
    "KTH, 6 % in all": (share("archard", "largest_percent", 6.0), 1.0),
    "CPU, rigs": (cpu("rig"), -0.20),
    "CPU, fields": (cpu("field"), -0.12),
    **{
        f"{name}, median {half:g} %": (of_points(name, "half"), 0.5)
        for name, half in QUANTITIES.values()
    },
    **{
        f"{name}, {MOST:g} % in 90 %": (of_points(name, "most"), 0.9)
        for name, _ in QUANTITIES.values()
    },
    **{
        f"30 against 60 cells, case {case}": (cells(case), -1.0)
        for case in (15, 18, 27, 36)
    },
}
MISSED = {
    "USFD, 3 % in 95 %": "measured 0.75, target 0.95",
    "USFD, 4 % in all": "measured 0.938, target 1",
    "USFD, median 1.3 %": "measured 2.63, target 1.3",
    "KTH, 3 % in three quarters": "measured 0.375, target 0.75",
    "KTH, 6 % in all": "measured 0.667, target 1",
    "CPU, rigs": "measured 0.523, target 0.2",
    "CPU, fields": "measured 0.183, target 0.12",
    "30 against 60 cells, case 15": "measured 1.98, target 1",
    "30 against 60 cells, case 18": "measured 1.96, target 1",
    "30 against 60 cells, case 27": "measured 2.92, target 1",
    "30 against 60 cells, case 36": "measured 2.65, target 1",
}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.xfail(strict=True, reason=MISSED[name]))
        if name in MISSED
        else name
        for name in TARGETS
    ],
)
def test_targets(reports, name):
    """Shares are to be above the target, medians and ratios, negative here, too."""
    measure, target = TARGETS[name]
    value = measure(read_table(reports), read_references(reports))
    assert value >= target
