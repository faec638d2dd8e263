"""Pairs of contact models at the points of a scene that wear most.

Times, differences from `accurate`.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearsim.campaign.evaluate import Evaluation, setup_of, solve_passage
from wearsim.campaign.passage import Passage
from wearsim.campaign.state import State
from wearsim.contact.patch import FloatArray
from wearsim.contact.problem import PAIRS, ContactModels
from wearsim.errors import WearsimError
from wearsim.scene import CampaignSetup
from wearsim.texts import text_table

MOST_POINTS = 12
"""Points that are solved by all pairs."""
_MEASURES = ("wear_rate", "power", "pressure")


def compared(
    setup: CampaignSetup,
    start: State,
    evaluation: Evaluation,
    seconds: float | None,
    threads: int = 1,
) -> dict[str, Any]:
    """Compare the pairs of contact models on the new profiles of a scene.

    Parameters
    ----------
    setup : CampaignSetup
        The campaign.
    start : State
        At its start.
    evaluation : Evaluation
        Of that state, at all points.
    seconds : float or None
        That the campaign takes with its own models [s].
    threads : int
        Of the contact solver.

    Returns
    -------
    dict
        JSON values: `points`, the number of points that are compared, those that wear
        most; their share of the wear, `wear_share` [-]; and `pairs`, of each its
        `name`, about the `seconds` of the whole campaign, by the time of cold solutions
        at these points, and the differences from `accurate` of `wear_rate` and `power`,
        summed over the points, and of the largest `pressure` [-]. Differences are None
        where a pair does not solve all of these points, seconds where those of the
        campaign are not known.
    """
    share = _wear_share(setup, evaluation)
    heaviest = np.argsort(-share, kind="stable")[:MOST_POINTS]
    heaviest = heaviest[share[heaviest] > 0.0]
    selected = np.isin(np.arange(share.size), heaviest)
    pairs = {name: _pair(setup.models, name) for name in PAIRS}
    different = dict.fromkeys((setup.models, *pairs.values()))
    solved = {
        models: _measures_and_time(setup, start, selected, models, threads)
        for models in different
    }
    own_seconds, reference = solved[setup.models][1], solved[pairs["accurate"]][0]
    rows = []
    for name, models in pairs.items():
        measures, spent = solved[models]
        campaign_seconds = (
            None
            if seconds is None or spent is None or own_seconds is None
            else seconds * spent / own_seconds
        )
        errors = dict(
            zip(_MEASURES, _relative_differences(measures, reference), strict=True)
        )
        rows.append({"name": name, "seconds": campaign_seconds, **errors})
    return {
        "points": int(heaviest.size),
        "wear_share": float(share[heaviest].sum()),
        "pairs": rows,
    }


def _relative_differences(
    values: FloatArray | None, reference: FloatArray | None
) -> list[float] | list[None]:
    """Relative differences of measures from true ones; 0 where these are 0."""
    if values is None or reference is None:
        return [None] * len(_MEASURES)
    return list(
        map(
            float,
            np.divide(
                values - reference,
                reference,
                out=np.zeros_like(reference),
                where=reference > 0.0,
            ),
        )
    )


def _wear_share(setup: CampaignSetup, evaluation: Evaluation) -> FloatArray:
    """Share (n,) of the wear of each point, or of the power where nothing wears [-]."""
    points, contact = setup.points, evaluation.passage.contact
    worn, power = (
        np.bincount(contact.point, rate, points.weight.size) * points.weight
        for rate in (evaluation.wear.area_rate, contact.power)
    )
    amount = worn * points.environment if worn.any() else power
    return np.asarray(amount / amount.sum()) if amount.any() else points.weight


def _pair(models: ContactModels, name: str) -> ContactModels:
    normal, tangential = PAIRS[name]
    return replace(models, normal=normal, tangential=tangential)


def _measures_and_time(
    setup: CampaignSetup,
    start: State,
    selected: NDArray[np.bool_],
    models: ContactModels,
    threads: int,
) -> tuple[FloatArray | None, float | None]:
    """Measures of the points asked for by a pair of models, if it solves all.

    And the time it took [s].
    """
    passage_setup = replace(setup_of(setup, threads), models=models)
    first = np.zeros_like(selected)
    first[np.flatnonzero(selected)[:1]] = True
    try:
        solve_passage(start, setup.points, passage_setup, first)  # compiles
        began = time.perf_counter()
        passage = solve_passage(start, setup.points, passage_setup, selected)
    except WearsimError:  # of no point: the grid
        return None, None
    spent = time.perf_counter() - began
    return None if passage.failed else _wear_rate_and_power(setup, passage), spent


def _wear_rate_and_power(setup: CampaignSetup, passage: Passage) -> FloatArray:
    """Wear rate and power of the points of a passage, by their shares of the distance.

    Largest pressure.
    """
    points, contact, wear = setup.points, passage.contact, passage.wear
    assert wear is not None
    weight = points.weight[contact.point]
    worn = float((weight * points.environment[contact.point] * wear.area_rate).sum())
    return np.array(
        [worn, float((weight * contact.power).sum()), float(contact.max_pressure.max())]
    )


def table_lines(item: dict[str, Any]) -> list[str]:
    """Lines of a table of what `compared` returns."""
    table = [["  models", "whole scene [s]", "wear rate", "power", "largest pressure"]]
    for row in item["pairs"]:
        seconds = "-" if row["seconds"] is None else f"{row['seconds']:.3g}"
        errors = (
            "-" if row[key] is None else f"{100.0 * row[key]:+.1f} %"
            for key in _MEASURES
        )
        table.append([f"  {row['name']}", seconds, *errors])
    return [line.rstrip() for line in text_table(table)]
