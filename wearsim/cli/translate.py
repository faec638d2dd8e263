"""`wearsim translate`: the factors that carry a rig result to the field."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import pandas as pd
import xarray as xr

from wearsim.cli import print_json
from wearsim.cli.inspect import result_in
from wearsim.cli.streams import formula_warning, print_warning
from wearsim.errors import brief
from wearsim.results import load_results
from wearsim.scene.input_names import titled
from wearsim.texts import wrapped
from wearsim.translation import text, translate
from wearsim.translation.bands import band_table, known_bands
from wearsim.translation.compare import answers
from wearsim.whole_files import write_whole


def execute(arguments: argparse.Namespace) -> int:
    """Print the answer, or all tables; write all factors on request."""
    paths = _paths(arguments)
    rig, field = map(load_results, paths.values())
    stored_path = paths["rig"].with_name("translation.nc")
    factors = translate.with_known_causes(translate.translate(rig, field), stored_path)
    _warn_of_kind("rig", paths["rig"], rig)
    _warn_of_kind("field", paths["field"], field)
    rows, points = translate.table(factors), translate.point_table(factors)
    causes = translate.cause_table(factors)
    power = translate.power_cause_table(factors)
    hashes = {role: str(factors.attrs[f"{role}_sha256"]) for role in ("rig", "field")}
    bands, steels = known_bands(paths["rig"].parent, hashes)
    # people read words, programs the keys of the scene
    named = bands if bands is None or arguments.json else titled(bands)
    band_rows = pd.DataFrame() if named is None else band_table(named)
    distances_km = {"field": arguments.field_km, "rig": arguments.rig_km}
    distance_answers = {
        of: answers(rig, field, of, 1e3 * km)
        for of, km in distances_km.items()
        if km is not None
    }
    if arguments.out:
        translate.write(factors, arguments.out)
    table = _csv(rows, points) if arguments.csv is not None else ""
    if arguments.csv not in (None, "-"):
        formula_warning(table, arguments.csv)
        write_whole(Path(arguments.csv), table)
    if arguments.json:
        tables = {
            "factors": rows,
            "points": points,
            "causes": causes.reset_index(),
            "power_causes": power,
            "bands": band_rows,
            "materials": steels,
        }
        tables |= {f"{of}_distance": answer for of, answer in distance_answers.items()}
        print_json({name: frame.to_dict("records") for name, frame in tables.items()})
    elif arguments.csv == "-":
        formula_warning(table, "--csv")
        sys.stdout.write(table)
    else:
        ends = {"rig": rig, "field": field}
        runs = {role: 1e-3 * float(data["distance"][-1]) for role, data in ends.items()}
        print(
            *text.answer_lines(factors, rows, band_rows, runs, distance_answers),
            sep="\n",
        )
        if arguments.all:
            print("\n" + _all(rows, points, causes, power, band_rows, steels))
    programs_read = arguments.json or arguments.csv == "-"
    _print_warnings(rows.attrs["warnings"], programs_read)
    if not programs_read and not arguments.all:
        ask = "" if distance_answers else "; a distance: --field-km KM, --rig-km KM"
        print(f"more: --all, --csv FILE, --json{ask}")
    return 0


def _paths(arguments: argparse.Namespace) -> dict[str, Path]:
    """Return the result files by role; a comparison has both in its run directory."""
    given = {"rig": arguments.rig, "field": arguments.field or arguments.rig}
    return {role: result_in(Path(path), role) for role, path in given.items()}


def _warn_of_kind(kind: str, path: Path, result: xr.Dataset) -> None:
    """Warn of a result of another kind; two rigs may be compared."""
    stated = result.attrs.get("scene_kind")
    if stated != kind:
        held = f"{path} holds a {brief(str(stated))} campaign"
        print_warning(f"{held} and is taken as the {kind}")


def _print_warnings(lines: Sequence[str], programs_read: bool) -> None:
    for line in lines:
        if programs_read:
            print_warning(line)
        else:
            print(wrapped(f"warning: {line}"))


def _all(
    rows: pd.DataFrame,
    points: pd.DataFrame,
    causes: pd.DataFrame,
    power: pd.DataFrame,
    bands: pd.DataFrame,
    steels: pd.DataFrame,
) -> str:
    """All tables by their titles."""
    tables = text.factor_tables(rows)
    for state in dict.fromkeys(points["state"]):
        of_state = points[points["state"] == state]
        title = f"Factors at equal operating points, {state}, by shift [mm]"
        tables[title] = text.by_shift(of_state)
    tables |= {
        "Causes of the worn area per distance, by share of the common range of worn "
        "depth": causes,
        "Causes of the frictional power at equal operating points, new wheels": power,
        "Bands of the draws": bands.drop(columns="variable", errors="ignore"),
        "Worn area over that of the scene's steel": steels,
    }
    return "\n".join([text.all_tables(tables), *text.undefined_lines(rows)])


def _csv(rows: pd.DataFrame, points: pd.DataFrame) -> str:
    """Both tables of factors as CSV; cells are empty where a factor is undefined."""
    table = pd.concat([rows.rename(columns={"basis": "state"}), points])
    csv: str = table[points.columns].to_csv(
        index=False, float_format="%.12g", lineterminator="\n"
    )
    return csv
