"""`wearsim translate`: the factors that carry a rig result to the field."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from wearsim.cli import print_json
from wearsim.errors import brief
from wearsim.results import load_results
from wearsim.translation import translate as factor
from wearsim.translation.bands import band_table, known_bands
from wearsim.translation.compare import answers


def execute(arguments: argparse.Namespace) -> int:
    """Print the factors where both campaigns end; write all of them on request."""
    rig, field = load_results(arguments.rig), load_results(arguments.field)
    known = Path(arguments.rig).with_name("translation.nc")
    factors = factor.with_known_causes(factor.translate(rig, field), known)
    for kind, path, result in (
        ("rig", arguments.rig, rig),
        ("field", arguments.field, field),
    ):
        held = result.attrs.get("scene_kind")
        if held != kind:  # allowed, to compare two rigs
            text = (
                f"warning: {path} holds a {brief(str(held))} campaign and is taken as "
                f"the {kind}"
            )
            print(text, file=sys.stderr)
    rows, points = factor.table(factors), factor.point_table(factors)
    causes, power = factor.cause_table(factors), factor.power_cause_table(factors)
    hashes = {role: str(factors.attrs[f"{role}_sha256"]) for role in ("rig", "field")}
    bands, steels = known_bands(Path(arguments.rig).parent, hashes)
    sure = pd.DataFrame() if bands is None else band_table(bands)
    asked = {
        of: km
        for of in ("field", "rig")
        if (km := getattr(arguments, f"{of}_km")) is not None
    }
    found = {of: answers(rig, field, of, 1e3 * km) for of, km in asked.items()}
    if arguments.out:
        factor.write(factors, arguments.out)
    if arguments.json:
        tables = {
            "factors": rows,
            "points": points,
            "causes": causes.reset_index(),
            "power_causes": power,
        }
        tables |= {"bands": sure, "materials": steels}
        tables |= {f"{of}_distance": answer for of, answer in found.items()}
        print_json(
            {name: part.to_dict(orient="records") for name, part in tables.items()}
        )
    else:
        states = {
            state: points[points["state"] == state]
            for state in dict.fromkeys(points["state"])
        }
        shown = {
            "": rows,
            **{
                f"Factors at equal operating points, {state}, by shift [mm]:": _by_shift(
                    of_state
                )
                for state, of_state in states.items()
            },
            (
                "Causes of the worn area per distance, by share of the common range "
                "of worn depth:"
            ): causes,
            "Causes of the frictional power at equal operating points, new wheels:": power,
            "Bands of the draws:": sure.drop(columns="variable", errors="ignore"),
            "Worn area over that of the scene's steel:": steels,
        }
        for title, frame in shown.items():
            if len(frame):
                print(*[f"\n{title}"] if title else [], _text(frame), sep="\n")
        for of, answer in found.items():
            print(f"\nWhat {asked[of]:.10g} km of the {of} wear:")
            for row in answer.to_dict("records"):
                print(
                    _answered(row, *((of, "rig") if of == "field" else (of, "field")))
                )
    # after the table where people read it, on stderr where a program does
    for line in rows.attrs["warnings"]:
        print(f"warning: {line}", file=sys.stderr if arguments.json else sys.stdout)
    return 0


def _answered(row: Mapping[Any, Any], of: str, other: str) -> str:
    """Answer as a sentence.

    Beyond the end of a campaign what is missing, nothing extrapolated.
    """
    if row[f"{of}_km_missing"] > 0.0:
        found = f"no answer, {row[f'{of}_km_missing']:.5g} km are missing"
    else:
        found = f"like {row[f'{other}_km']:.5g} km of the {other}"
        found += (
            f"; 1 km of the rig like {row['field_km_per_rig_km']:.4g} km of the field"
        )
    reach = f"the two results reach {row[f'{of}_km_within_reach']:.6g} km of the {of}"
    return f"  by {row['quantity']}: {found}; {reach}"


def _text(rows: pd.DataFrame) -> str:
    index = bool(
        rows.index.names[0] is not None
    )  # that of factors by shift, and of causes
    return rows.to_string(
        index=index, na_rep="undefined", float_format=lambda value: f"{value:.4g}"
    )


def _by_shift(points: pd.DataFrame) -> pd.DataFrame:
    """Factors of one state.

    A row for each quantity and wheel, a column for each operating point.
    """
    names = points.drop_duplicates(["variable", "wheel"]).sort_values(
        "wheel", ascending=False, kind="stable"
    )
    factor = points.set_index(["variable", "wheel"])["factor"]
    # labels and shifts may be given twice: only their order distinguishes points
    places = points[
        (points["variable"] == names["variable"].iloc[0]) & (points["wheel"] == "right")
    ]
    twice = bool(places["shift"].duplicated().any())
    return pd.DataFrame(
        [
            factor.loc[[key]].to_numpy()
            for key in zip(names["variable"], names["wheel"], strict=True)
        ],
        index=[names["quantity"], names["wheel"]],
        columns=list(places["point"])
        if twice
        else [f"{shift:g}" for shift in places["shift"]],
    ).rename_axis(index=["", ""])
