"""What attacks on wearsim came to: the whole siege of tests/siege, counted.

    python reports/reliability.py [--kind KIND]
    [--seed SEED] [--jobs N] [--out DIR] [--from-csv]

attacks with every seed of every kind, or of one, and writes the counts into
reliability.csv as they come in and reliability.md at the end: about an hour of one
core. Faults in reliability.csv are attacked again, no other seed that it counts is:
remove the rows of a kind to make it anew. The environment variable WEARSIM_SIEGE is a
share of the counts (default: 1.0). With --seed one attack of --kind is made again and
nothing is written.
"""

import importlib
import os
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pandas as pd
from writing import Table, options, write_csv, write_report

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "siege"))
siege = importlib.import_module("siege")

CHUNK = 10
"""Seeds that a process attacks with before their counts are written."""
COLUMNS = ["kind", "way", "outcome", "seed", "count"]
"""Of a fault the row has the seed; of other outcomes it counts the seeds, from 0
without a gap.
"""
MENDED = (
    "Control characters and marks of direction of a file (U+202E, NUL) came to the "
    "terminal as they were, in messages on scenes, tables of all kinds and cases of "
    "sweeps: they are escaped (`tests/test_hostile_files.py`).",
    "The message on shares of classes that do not sum to 1 listed every share, "
    "thousands of characters: it lists ten (`tests/test_hostile_files.py`).",
    "A variable of a result file with the same dimension twice made a warning of a "
    "library precede the fault: it is a fault of its own "
    "(`tests/results/test_damaged.py`).",
    "A text with a line break in place of a number in a result file made its message "
    "two lines: one, with an escape (`tests/results/test_damaged.py`).",
    "A `translation.nc` of kilobytes in a run directory that states a dimension of "
    "5e8 filled 18 GB of memory in `translate` and `report`: it is not loaded, nor is "
    "such a `bands.nc` (`tests/results/test_damaged.py`).",
    "`nan` or `inf` as positions in the table of a programme or route was an internal "
    "error, exit code 3: a fault with file and line "
    "(`tests/scene/test_rig_programmes.py`).",
    "Names of columns of a record, and keys and values of the cases of a sweep, were "
    "repeated at any length: 40 characters (`tests/test_hostile_files.py`).",
    "A text of a result file that differs between rig and field, such as the wear "
    "law, was repeated at any length, and with line breaks, in the warnings of "
    "`translate`: 40 characters, escaped (`tests/translation/test_translate.py`).",
    "A kind of campaign of any length was repeated in the warning on results in the "
    "wrong order: 40 characters (`tests/cli/test_commands.py`).",
    "A signal (Ctrl-C, SIGTERM) at the moment at which factors, bands or tables were "
    "written or results read as a whole hung the command: a lock of xarray stayed "
    "taken. Signals wait for such files (`tests/test_whole_files.py`).",
    "Patches of a result file that wear an area without a depth divided by zero in "
    "`inspect`, exit code 3: such a file is refused (`tests/results/test_damaged.py`).",
    "A command in a folder that was deleted meanwhile ended in an internal error, "
    "exit code 3: one line (`tests/cli/test_main.py`).",
)
"""Faults found, and how they are mended."""


def rows_in(file):
    """Rows of the table so far; the seed of what is no fault is empty."""
    return (
        pd.read_csv(file, dtype={"seed": "Int64"})
        if file.exists()
        else pd.DataFrame(columns=COLUMNS)
    )


def besieged(kind, file, jobs):
    """Attack with the seeds of a kind that are left, and those of faults.

    Keep its rows up to date.
    """
    total, rows = siege.count_of(kind), rows_in(file)
    own, others = rows[rows["kind"] == kind], rows[rows["kind"] != kind]
    again = own.loc[own["outcome"] == siege.FAULT, "seed"].tolist()
    counts = Counter(
        {
            (row.way, row.outcome): row.count
            for row in own.itertuples()
            if row.seed is pd.NA
        }
    )
    faults = dict.fromkeys(again)
    made = sum(counts.values()) + len(again)
    seeds = [*again, *range(made, total)]
    chunks = [seeds[k : k + CHUNK] for k in range(0, len(seeds), CHUNK)]
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        for chunk, (found, texts) in zip(
            chunks, pool.map(siege.besiege, [kind] * len(chunks), chunks), strict=True
        ):
            counts += found
            faults = {
                seed: way for seed, way in faults.items() if seed not in chunk
            } | dict.fromkeys(texts)
            for text in texts.values():
                print(text, flush=True)  # noqa: T201
            own = [(kind, *key, pd.NA, count) for key, count in sorted(counts.items())]
            own += [
                (kind, siege.way_of(kind, seed)[1], siege.FAULT, seed, 1)
                for seed in sorted(faults)
            ]
            write_csv(pd.concat([others, pd.DataFrame(own, columns=COLUMNS)]), file)
            done = f"{kind}: {counts.total() + len(faults)} of {total}"
            print(done, file=sys.stderr, flush=True)  # noqa: T201


def blocks_of(rows):
    """Blocks of the report: what was attacked, how often, and what came of it."""
    totals, tables = [], []
    for kind, (whole, _) in siege.COUNTS.items():
        part = rows[rows["kind"] == kind]
        made, faults = (
            int(some["count"].sum())
            for some in (part, part[part["outcome"] == siege.FAULT])
        )
        totals.append([kind, whole, made, max(whole - made, 0), faults])
        if not made:
            continue
        by_way = part.pivot_table(
            index="way", columns="outcome", values="count", aggfunc="sum", fill_value=0
        )
        described = str(importlib.import_module(f"siege_{kind}").__doc__)
        title = " ".join(described.partition("\n\n")[0].split())
        body = [[way, int(row.sum()), *map(int, row)] for way, row in by_way.iterrows()]
        head, caption = (
            ["What", "attacks", *by_way.columns],
            f"{kind.capitalize()}: {title}",
        )
        tables.append(Table(head, body, caption=caption))
    head = ["Kind", "in full", "made", "missing", "faults"]
    return [
        "Each attack is made from its seed (`tests/siege`). In process: an exit code "
        "of 0 or 2, every fault one short printable line with its file, no traceback, "
        "no number that is not finite, within 20 s and 1 GB. Of processes that are "
        "killed: nothing half written under a final name, and after they are "
        "continued every variable of every result bit-equal to that of an "
        "uninterrupted run. An attack that breaks a rule counts as a fault and is "
        "printed with the command that repeats it.",
        Table(head, totals, caption="Attacks of the whole siege."),
        *tables,
        "## Faults found",
        "The following were found by the siege and are mended; the attacks that met "
        "them were made again and count above with what comes of them today.",
        "\n".join(f"- {text}" for text in MENDED),
    ]


def main(arguments=None):
    """Attack, or read what attacks came to, and write the report."""
    more = {
        "kind": {"choices": list(siege.COUNTS), "help": "only this kind of attack"},
        "seed": {"type": int, "help": "only this attack of --kind, again"},
        "jobs": {
            "type": int,
            "default": os.cpu_count(),
            "help": "processes (default: as many as cores)",
        },
    }
    chosen = options(__file__, __doc__, arguments, from_csv=True, more=more)
    if chosen.seed is not None:
        print(*siege.attack(chosen.kind, chosen.seed), sep=": ")  # noqa: T201
        return
    os.environ.setdefault("WEARSIM_SIEGE", "1.0")
    file = chosen.out / "reliability.csv"
    if not chosen.from_csv:
        for kind in [chosen.kind] if chosen.kind else siege.COUNTS:
            besieged(kind, file, chosen.jobs)
    write_report(chosen.out, __file__, "Reliability", blocks_of(rows_in(file)))


if __name__ == "__main__":
    main()
