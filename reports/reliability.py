"""What attacks on wearsim came to: the whole siege of tests/siege, counted.

    python reports/reliability.py [--kind KIND] [--seed SEED] [--jobs N] [--out DIR] [--from-csv]

attacks with every seed of every kind, or of one, writes the counts into reliability.csv as they come in and
reliability.md at the end; hours on two cores.  The environment variable WEARSIM_SIEGE is a share of the counts
(default: 1.0).  With --seed one attack is made again and nothing is written.
"""

import os
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pandas as pd
from writing import Table, options, write_csv, write_report

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "siege"))
import siege  # noqa: E402

CHUNK = 50
"""Seeds that a process attacks with before their counts are written."""
COLUMNS = ["kind", "way", "outcome", "count"]


def besieged(kind, file, jobs):
    """Attack with every seed of a kind and keep its rows of the table up to date."""
    total, counts = siege.count_of(kind), Counter()
    seeds = range(total)
    chunks = [seeds[k : k + CHUNK] for k in range(0, total, CHUNK)]
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        for number, (found, faults) in enumerate(pool.map(siege.besiege, [kind] * len(chunks), chunks), 1):
            counts += found
            for fault in faults:
                print(fault, flush=True)
            rows = [(kind, *key, count) for key, count in sorted(counts.items())]
            others = pd.read_csv(file) if file.exists() else pd.DataFrame(columns=COLUMNS)
            table = pd.concat([others[others["kind"] != kind], pd.DataFrame(rows, columns=COLUMNS)])
            write_csv(table, file)
            print(f"{kind}: {min(number * CHUNK, total)} of {total}", file=sys.stderr, flush=True)


def main(arguments=None):
    """Attack, or read what attacks came to, and write the report."""
    more = {
        "kind": {"choices": list(siege.COUNTS), "help": "only this kind of attack"},
        "seed": {"type": int, "help": "only this attack of --kind, again"},
        "jobs": {"type": int, "default": os.cpu_count(), "help": "processes (default: as many as cores)"},
    }
    chosen = options(__file__, __doc__, arguments, from_csv=True, more=more)
    if chosen.seed is not None:
        print(*siege.attack(chosen.kind, chosen.seed), sep=": ")
        return
    os.environ.setdefault("WEARSIM_SIEGE", "1.0")
    file = chosen.out / "reliability.csv"
    if not chosen.from_csv:
        for kind in [chosen.kind] if chosen.kind else siege.COUNTS:
            besieged(kind, file, chosen.jobs)


if __name__ == "__main__":
    main()
