"""Quantities of contact models that are chosen: results of scenes that ask for it."""

from __future__ import annotations

from wearsim.nomenclature.row import Row

ROWS: tuple[Row, ...] = (
    ("contact_candidate", "", "", "contact models that may be chosen", "by rising cost", None),
    (
        "contact_candidate_cost",
        "C",
        "1",
        "cost of one solution by the contact models, over that of the cheapest ones",
        "from the committed chart of speed against accuracy",
        None,
    ),
    (
        "contact_class",
        "",
        "",
        "class of operating points",
        "by the share of the work that they do, least first",
        None,
    ),
    (
        "contact_point_class",
        "",
        "1",
        "place of the class of the operating point in contact_class",
        "points that only monitor belong to the last one",
        None,
    ),
    (
        "contact_models",
        "k",
        "1",
        "place of the contact models of the class in contact_candidate",
        "",
        None,
    ),
    (
        "contact_models_error",
        "ε",
        "1",
        "error of the wear increment of the contact models when they were chosen",
        "largest difference from half-space solutions over the largest depth, estimated from a sample",
        None,
    ),
    (
        "contact_candidate_error",
        "ε",
        "1",
        "error of the wear increment if the contact models solved all operating points",
        "when it was chosen; missing where they were not tried, or refused a point",
        None,
    ),
)
