"""`wearsim translate`: the factors that carry a rig result to the field."""

from __future__ import annotations

import argparse

from wearsim.cli import Commands, add_command


def add_parser(commands: Commands) -> None:
    """Add the command."""
    parser = add_command(
        commands,
        "translate",
        "compare a rig result with a field result: factors at equal distance and equal depth",
        "wearsim translate out/rig.nc out/field.nc --out translation.nc",
    )
    parser.add_argument("rig", metavar="RIG", help="result file of the rig")
    parser.add_argument("field", metavar="FIELD", help="result file of the field")
    parser.add_argument(
        "--out", metavar="FILE", help="also write all factors, as functions, to this netCDF file"
    )
    parser.add_argument("--json", action="store_true", help="print the table as JSON; null where undefined")


def execute(arguments: argparse.Namespace) -> int:
    """Print the factors where both campaigns end; write all of them if wanted."""
    import json
    import sys

    from wearsim.results import open_results
    from wearsim.translation.translate import table, translate, write

    with open_results(arguments.rig) as rig, open_results(arguments.field) as field:
        for kind, path, result in (("rig", arguments.rig, rig), ("field", arguments.field, field)):
            found = result.attrs.get("scene_kind")
            if found != kind:  # allowed, to compare two rigs, but an exchange would invert every factor
                print(f"warning: {path} holds a {found} campaign and is taken as the {kind}", file=sys.stderr)
        factors = translate(rig, field)
        rows = table(factors)
        if arguments.out:
            write(factors, arguments.out)
    if arguments.json:
        told = rows.astype(object).where(rows.notna(), None).to_dict(orient="records")
        print(json.dumps(told, indent=2, ensure_ascii=False, allow_nan=False))
    else:
        print(rows.to_string(index=False, na_rep="undefined", float_format=lambda value: f"{value:.4g}"))
    return 0
