"""`wearsim contact --match`: a contact of the field on a rig."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TextIO

import pandas as pd

from wearsim.cli import print_json
from wearsim.cli.flags import overrides_of
from wearsim.errors import ContactError
from wearsim.studies.contact_flags import MATCHED
from wearsim.studies.contact_points import SIDES_OF, conditions, problem_of
from wearsim.whole_files import replacing


def match_faults(arguments: Namespace) -> list[str]:
    """Faults of flags that do not go together with --match, or without it."""
    given = {
        "--rig": arguments.rig is not None,
        "--csv": arguments.csv is not None,
        "--set": bool(arguments.set),
    }
    if arguments.match is None:
        return [
            f"{flag} acts with --match only; add --match, or leave it out"
            for flag in given
            if given[flag]
        ]
    faults = []
    if not given["--rig"]:
        faults.append("--match needs --rig, the scene file of the rig")
    apart = {
        "--table": arguments.table,
        "--plot": arguments.plot,
        "--creepage": arguments.creepage,
        "--normal-force-kN": arguments.normal_force_kN,
    }
    faults += [
        f"--match and {flag} exclude each other; leave one of them out"
        for flag, value in apart.items()
        if value is not None
    ]
    unknown = [name for name in _names(arguments.match) if name not in MATCHED]
    if unknown:
        quantities = ", ".join(MATCHED)
        faults.append(f"--match = {arguments.match}: must be some of {quantities}")
    return faults


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",")]


def print_match(values: pd.DataFrame, arguments: Namespace) -> None:
    """Find the set-point of the rig, and print it; `values` of the single point."""
    # scenes and reports take long to import, and a contact alone needs none of them
    from wearsim.report.match import match_lines, match_record, match_table
    from wearsim.studies.match import match_contact

    wheelset, counterface, models = problem_of(values)
    posed, share_past_jump = conditions(values)
    if share_past_jump > 0.0:
        raise ContactError(
            "the lateral force lies within a jump of the contact, on both sides of "
            "which the wheelset runs in turn; give the shift of one side"
        )
    table = None if arguments.csv in (None, "-") else Path(arguments.csv)
    with nullcontext() if table is None else _opened(table) as file:
        made = match_contact(
            wheelset,
            counterface,
            posed,
            arguments.rig,
            models,
            quantities=_names(arguments.match),
            sides=SIDES_OF[values["side"].iloc[0]],
            overrides=overrides_of(arguments.set),
        )
        text = match_table(made).to_csv(index=False) if arguments.csv else ""
        if file is not None:
            file.write(text)
    if arguments.json:
        print_json(match_record(made))
    elif arguments.csv == "-":
        sys.stdout.write(text)
    else:
        print(*match_lines(made), sep="\n")


@contextmanager
def _opened(path: Path) -> Iterator[TextIO]:
    """Open a table before the search that fills it, which may be for nothing else."""
    with replacing(path) as part, open(part, "w", encoding="utf-8") as file:
        yield file
