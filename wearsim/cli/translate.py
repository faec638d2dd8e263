"""`wearsim translate`: the factors that carry a rig result to the field."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from wearsim.cli import print_json

if TYPE_CHECKING:
    from pandas import DataFrame


SUMMARY = "compare a rig result with a field result: factors at equal distance and equal depth"
EXAMPLES = "wearsim translate out/rig.nc out/field.nc --out translation.nc"


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the flags."""
    parser.add_argument("rig", metavar="RIG", help="result file of the rig")
    parser.add_argument("field", metavar="FIELD", help="result file of the field")
    parser.add_argument(
        "--out", metavar="FILE", help="also write all factors, as functions, to this netCDF file"
    )
    parser.add_argument("--json", action="store_true", help="print the tables as JSON; null where undefined")


def execute(arguments: argparse.Namespace) -> int:
    """Print the factors where both campaigns end; write all of them on request."""
    import sys

    from wearsim.results import open_results
    from wearsim.translation.translate import point_table, table, translate, write

    with open_results(arguments.rig) as rig, open_results(arguments.field) as field:
        for kind, path, result in (("rig", arguments.rig, rig), ("field", arguments.field, field)):
            held = result.attrs.get("scene_kind")
            if held != kind:  # allowed, to compare two rigs, but an exchange would invert every factor
                print(f"warning: {path} holds a {held} campaign and is taken as the {kind}", file=sys.stderr)
        factors = translate(rig, field)
        rows, points = table(factors), point_table(factors)
        if arguments.out:
            write(factors, arguments.out)
    if arguments.json:
        records = [row for part in (rows, points) for row in part.to_dict(orient="records")]
        known = [{k: v if v == v else None for k, v in row.items()} for row in records]  # NaN equals nothing
        print_json(known, allow_nan=False)
    else:
        print(_text(rows, index=False))
        for state in dict.fromkeys(points["state"]):
            print(f"\nFactors at equal operating points, {state}, by shift [mm]:")
            print(_text(_by_shift(points[points["state"] == state])))
    # after the table where people read it, on stderr where a program does
    for line in rows.attrs["warnings"]:
        print(f"warning: {line}", file=sys.stderr if arguments.json else sys.stdout)
    return 0


def _text(rows: DataFrame, index: bool = True) -> str:
    text: str = rows.to_string(index=index, na_rep="undefined", float_format=lambda value: f"{value:.4g}")
    return text


def _by_shift(points: DataFrame) -> DataFrame:
    """Factors of one state, a row for each quantity and wheel, a column for each operating point."""
    import pandas as pd

    names = points.drop_duplicates(["variable", "wheel"]).sort_values("wheel", ascending=False, kind="stable")
    factor = points.set_index(["variable", "wheel"])["factor"]
    # labels and shifts may be given twice: only their order distinguishes points
    places = points[(points["variable"] == names["variable"].iloc[0]) & (points["wheel"] == "right")]
    twice = bool(places["shift"].duplicated().any())
    return pd.DataFrame(
        [factor.loc[[key]].to_numpy() for key in zip(names["variable"], names["wheel"], strict=True)],
        index=[names["quantity"], names["wheel"]],
        columns=list(places["point"]) if twice else [f"{shift:g}" for shift in places["shift"]],
    ).rename_axis(index=["", ""])
