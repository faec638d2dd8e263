"""Errors of the contact models: the committed report, sampled cases of it computed
again, its definitions.
"""

from dataclasses import replace

import contact_accuracy
import numpy as np
import pytest
from contact_accuracy import (
    ERRORS,
    MODELS,
    REFERENCE,
    all_cases,
    errors_of,
    model_name,
    solve,
)

CASES = [3, 17, 40, 74, 101, 120]
MISSING = ("hertz", "fastsim", 50)


@pytest.fixture(scope="module")
def committed(reports):
    return contact_accuracy.read_table(reports / "contact_accuracy.csv")


@pytest.fixture(scope="module")
def again():
    return contact_accuracy.compare(all_cases().loc[CASES])


@pytest.mark.slow
def test_sampled_cases_of_the_report(committed, again):
    """Reference to 1e-4: half-spaces stop at 3e-5 of the pressure; errors are
    differences.

    Areas and shares of them to 2e-4: cells at the edge carry next to nothing (1.2e-4
    and 1.1e-4 between two kinds of processor).
    """
    rows = committed[committed["case"].isin(CASES)].reset_index(drop=True)
    assert list(again.columns) == list(rows.columns)
    exact = ["model", "case", "counterface_profile", "inclination"]
    assert again[exact].equals(rows[exact])
    np.testing.assert_array_equal(again["message"] != "", rows["message"] != "")
    for name in (
        "counterface_curvature",
        "shift",
        "yaw",
        "wheel_load",
        "friction",
        "area",
        "max_pressure",
        "power",
        "slip_share",
        "patches",
    ):
        rtol = 2e-4 if name in ("area", "slip_share") else 1e-4
        np.testing.assert_allclose(again[name], rows[name], rtol=rtol, err_msg=name)
    for name in ERRORS:
        np.testing.assert_allclose(
            again[f"error_{name}"],
            rows[f"error_{name}"],
            rtol=0.0,
            atol=2e-4,
            err_msg=name,
        )


def test_the_report_holds_every_case_and_is_what_its_table_says(
    committed, reports, tmp_path
):
    cases = all_cases()
    assert len(committed) == len(cases) * (1 + len(MODELS))
    (tmp_path / "contact_accuracy.csv").write_bytes(
        (reports / "contact_accuracy.csv").read_bytes()
    )
    contact_accuracy.main(["--from-csv", "--out", str(tmp_path)])
    for suffix in ("md", "svg"):
        name = f"contact_accuracy.{suffix}"
        assert (tmp_path / name).read_text() == (reports / name).read_text(), name


def test_classes_partition_the_cases(committed):
    classes = contact_accuracy.classes(committed)
    assert np.array_equal(classes["slip below 0.9"], ~classes["slip above 0.9"])
    assert np.array_equal(classes["single patch"], ~classes["split patch"])
    assert classes["all"].sum() == len(all_cases())
    assert classes["split patch"].sum() >= 1  # two lobes near 5.5 mm


def test_quantiles_of_the_report_are_those_of_the_errors(committed, reports):
    model = "kik_piotrowski + fastsim, 50 x 50"
    errors = committed[committed["model"] == model]["error_power"].abs()
    middle, most = 100.0 * np.quantile(errors, [0.5, 0.95])
    text = (reports / "contact_accuracy.md").read_text()
    (row,) = (
        line for line in text.splitlines() if line.startswith(f"| `{model}` | all |")
    )
    assert row.split(" | ")[6] == f"{middle:.1f} · {most:.1f}"


def test_a_solution_has_no_error_against_itself_and_a_coarser_one_has_some():
    """20 against 60 strips and cells: FASTSIM's power is off by up to 5 %, strip work
    by its pieces, too.

    A creep force off by 3 % of friction times load shifts load to the normal force: at
    0.1 rad 1e-3 of it, of the pressure a third of that.
    """
    cases = all_cases().loc[[0, 8, 17]]
    fine, coarse = (
        solve(cases, ("kik_piotrowski", "fastsim", grid)) for grid in (60, 20)
    )
    most = {
        "area": 0.01,
        "max_pressure": 4e-4,
        "force": 0.03,
        "power": 0.05,
        "strip_work": 0.12,
    }
    for ours, reference in zip(coarse, fine, strict=True):
        assert not any(errors_of(reference, reference, 28e3).values())
        errors = errors_of(ours, reference, 28e3)
        for name, limit in most.items():
            assert abs(errors[name]) < limit
            assert errors[name] != 0.0 or name == "max_pressure"
        # its error holds that of the sum: the power over speed is the integral of the
        # strip work
        assert errors["strip_work"] > abs(errors["power"]) - 1e-9


def test_a_case_that_fails_keeps_no_other_from_being_solved():
    cases = all_cases().loc[[0, 3, 6]]
    together, (alone,) = solve(cases, MISSING), solve(cases.loc[[6]], MISSING)
    assert "no contact ellipse" in together[1]
    assert [isinstance(sums, str) for sums in together] == [False, True, False]
    assert together[2].power == alone.power


def test_without_power_the_error_is_whether_the_model_has_any():
    (sums,) = solve(all_cases().loc[[0]], ("kik_piotrowski", "fastsim", 20))
    still = replace(sums, power=0.0, strip_work=0.0 * sums.strip_work)
    assert (
        errors_of(sums, still, 28e3)["power"]
        == errors_of(sums, still, 28e3)["strip_work"]
        == 1.0
    )
    assert (
        errors_of(still, still, 28e3)["power"]
        == errors_of(still, still, 28e3)["strip_work"]
        == 0.0
    )


@pytest.mark.parametrize(
    ("tangential", "power"),
    [
        pytest.param(
            tangential,
            target,
            marks=pytest.mark.xfail(strict=True, reason=f"measured {measured}, {why}"),
        )
        for tangential, target, measured, why in (
            (
                "fastsim",
                0.08,
                "12.7 %",
                "target 8 %: one creepage and spin about the centre",
            ),
            (
                "half_space",
                0.03,
                "13.2 %",
                "target 3 %: one creepage and spin about the centre",
            ),
            (
                "coupled_strips",
                0.03,
                "3.4 %",
                "target 3 %: strips lie in planes of their own",
            ),
        )
    ],
)
def test_coupled_strips_keep_their_aim_on_single_patches(committed, tangential, power):
    """Over 95 % of the cases: area 3 %, pressure 5 %, power 8 % with FASTSIM, 3 % with
    others.
    """
    rows = committed[
        committed["model"] == model_name(("coupled_strips", tangential, 50))
    ].set_index("case")
    single = rows[contact_accuracy.classes(committed)["single patch"]]
    for name, limit in {"area": 0.03, "max_pressure": 0.05, "power": power}.items():
        assert single[f"error_{name}"].abs().quantile(0.95) < limit, name


def test_the_reference_is_the_half_space():
    assert REFERENCE[:2] == ("half_space", "half_space")
