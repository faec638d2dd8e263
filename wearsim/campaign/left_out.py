"""Failure of operating points in a campaign: omission if they carry little wear.

Every state is solved with all points, those that failed before separately, so that a
failure does not affect the others. The failed points follow from the state; their last
wear is part of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from wearsim.campaign.passage import Passage
from wearsim.campaign.state import PatchWear, PointHistory
from wearsim.errors import ContactError
from wearsim.operation.points import (
    LARGEST_SHARE,
    OperatingPoints,
    carried_share,
    mask_of,
    never_solved,
)
from wearsim.quantities import kilometres
from wearsim.results import FILL_FLOAT

Failed = dict[int, ContactError]
"""Errors of operating points without contact solution, by their number."""


def new_history(points: OperatingPoints) -> PointHistory:
    """Return the history of points that have never been solved."""
    count = len(points.label)
    return PointHistory(np.full(count, np.nan), np.zeros(count, dtype=bool))


def judged(
    history: PointHistory,
    points: OperatingPoints,
    passage: Passage,
    wear: PatchWear,
    distance: float,
    *,
    raises: bool = True,
) -> PointHistory:
    """History after a solution of some of the points; the others keep theirs.

    Raises
    ------
    ContactError
        If the points that failed carry more than `LARGEST_SHARE` of the wear, and it
        `raises`.
    """
    failed, point, count = passage.failed, passage.contact.point, len(points.label)
    in_contact = np.bincount(point, minlength=count) > 0
    in_contact[list(failed)] = False  # also on one side of a jump of the force
    rate = np.where(
        in_contact, np.bincount(point, wear.area_rate, count), history.area_rate
    )
    out = history.left_out & ~in_contact
    history = with_failed(
        replace(history, area_rate=rate, left_out=out, share=0.0), points, failed
    )
    out, share = history.left_out, history.share
    if raises and share > LARGEST_SHARE:
        number = np.flatnonzero(out & (points.weight > 0.0)).tolist()
        with_error = [k for k in number if k in failed]
        first = next(
            (k for k in with_error if failed[k].row == k), (with_error or number)[0]
        )
        reason = (
            failed[first].text if first in failed else "nor had it in its last step"
        )
        have, carry = (
            ("has", "carries")
            if len(number) == 1
            else (f"and {len(number) - 1} more have", "carry")
        )
        limit_text = f"where at most {100 * LARGEST_SHARE:g} % may be left out"
        share_text = f"{carry} {100 * share:.3g} % of the wear, {limit_text}"
        if never_solved(points.weight, points.of_class, history.area_rate, out).any():
            share_text = (
                "no point of its block or class was ever solved, so that its wear is "
                "not known"
            )
        raise ContactError(
            f"after {kilometres(distance)} the operating point {points.label[first]} "
            f"{have} no contact solution and {share_text}: {reason}"
        )
    return history


def with_failed(
    history: PointHistory, points: OperatingPoints, failed: Mapping[int, ContactError]
) -> PointHistory:
    """History in which failed points are omitted as well."""
    out = history.left_out | mask_of(failed, history.left_out.size)
    if not out.any():
        return history
    weight = points.weight * points.environment
    return replace(
        history,
        left_out=out,
        share=carried_share(weight, points.of_class, history.area_rate, out),
    )


def row_left_out(history: PointHistory | None) -> dict[str, np.ndarray]:
    """Return the variables of one row on omitted points."""
    if history is None:
        return {}
    rate = history.area_rate
    return {
        "left_out": history.left_out.astype(np.int32),
        "left_out_share": np.asarray(history.share),
        "last_wear_area_rate": np.where(np.isfinite(rate), rate, FILL_FLOAT),
    }
