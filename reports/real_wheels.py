"""How far, how fast and how exactly worn and measured wheels run.

python reports/real_wheels.py                           runs all cases: real_wheels.csv, .md, .svg (an hour)
python reports/real_wheels.py --quick                   runs the cases of 100 km or less only
python reports/real_wheels.py --cases rig66_20km ...    runs these cases; all other rows stay as they are
python reports/real_wheels.py --from-csv                writes text and figure from the table as it stands
"""

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from writing import HERE, Figure, Table, options, write_csv, write_report

import wearsim
from wearsim.contact.patch import load_factor
from wearsim.contact.tangential import fastsim
from wearsim.errors import WearsimError
from wearsim.quantities import kilometres
from wearsim.report.style import SERIES_COLOURS, grid, legend, save_svg, style
from wearsim.scene import load_scene
from wearsim.scene.initial_contact import check_contact
from wearsim.scene.overrides import Override

TITLE = "Worn and measured wheels"
WHEELS = HERE.parent / "tests" / "data" / "real_wheels"
FIELD = HERE.parent / "workflows" / "field_given.toml"
# target of the difference from a quarter of the error tolerance [% of the deepest]
TOLERANCE = 2.0
REPEATABLE = (
    0.01  # share by which depths of the same run may differ from machine to machine
)
SMOOTHED_MM = 4.0  # wavelength of the smoothing of noisy wheels [mm]
NOISE = 10e-3  # standard deviation of the noise of the seeds [mm]
WINDOW = 1e-3  # half width of the parabola that gives the curvature [m]
WORN = 2e-6  # the curvature is that of places worn deeper [m]
LIMIT = 900.0  # CPU time at which a run is stopped [s]


QUICK = 100.0  # longest distance of the quick cases [km]
COLUMNS = (
    "case",
    "distance_km",
    "end",
    "reached_km",
    "cpu_s",
    "target_s",
    "kernel_ns",
    "steps",
    "stages",
    "rejected",
    "held_by",
    "deepest_um",
    "curvature_new_per_m",
    "curvature_worn_per_m",
    "left_out",
    "steps_quarter",
    "difference_percent",
    "unsmoothed",
)

INTRODUCTION = f"""\
The worn, noisy, smoothed and new wheels of `tests/data/real_wheels` on a rig with rollers of 0.75 m, six
blocks with curving at 6.6 mm, Archard's law; the noisy pair on rollers of 1 m in five blocks by lateral
forces up to 25 kN, `forced`; and the shipped field scene with the worn pair. Models
`kik_piotrowski` + `fastsim` if not said otherwise, `field_worn`, as shipped, and `_strips` and
`forced` with `model = "standard"`; the noisy pair is smoothed by {SMOOTHED_MM:g} mm. CPU time is that of one
run in a process of its own on one thread, with kernels compiled before, and of the machine that wrote this;
the time of the FASTSIM kernel before and after the run (the shorter one) shows how fast that machine was;
targets are those of a quiet core, and other work on the machine, such as more than one `--jobs`, raises CPU
times without changing anything else. κ is the largest curvature of parabolas over {2e3 * WINDOW:g} mm along
the profile where it is worn by more than {1e6 * WORN:g} µm. Repeated runs of these deterministic cases give
the same depths on one machine; other compilers may move them by {100.0 * REPEATABLE:g} %.
"""
CAPTION = (
    "CPU time of the whole distances, or of what was run of them, and their targets."
)


@dataclass(frozen=True)
class Case:
    """One run.

    `quarter` adds one with a quarter of the error tolerance, `seed` noise on the
    points.
    """

    name: str
    scene: str
    distance: float  # [km]
    target: float | None = None  # CPU time [s]
    quarter: bool = False
    seed: int | None = None
    changes: dict[str, object] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """Name in the tables and of the option `--cases`."""
        return f"{self.name}_{self.distance:g}km"


FAST = {"contact.model": "fast"}
SMOOTHED = {"wheelset.smooth_mm": SMOOTHED_MM}
STRIPS = {"contact.model": "standard"}
RIGS = (
    ("rig66", 90.0, FAST),
    ("rig66_smooth", 180.0, FAST),
    ("rig66_noisy", 90.0, FAST | SMOOTHED),
    ("rig66_new", 180.0, FAST),
)
SIDES = ("right", "left")
CASES = (
    *(Case(name, name, 3000.0, target, changes=more) for name, target, more in RIGS),
    *(
        Case(f"{name}_strips", name, 3000.0, target, changes=more | STRIPS)
        for name, target, more in RIGS
    ),
    *(Case(name, name, 100.0, quarter=True, changes=more) for name, _, more in RIGS),
    Case("rig66", "rig66", 20.0, quarter=True, changes=FAST),
    *(
        Case(f"rig66_seed{n}", "rig66", 100.0, seed=n, changes=FAST | SMOOTHED)
        for n in range(1, 6)
    ),
    *(
        Case(f"{name}_strips", name, 100.0, quarter=True, changes=more | STRIPS)
        for name, _, more in RIGS
    ),
    Case("field_worn", "field", 100_000.0, 300.0),
    Case("forced", "forced", 3000.0, 300.0, changes=SMOOTHED | STRIPS),
)
BY_LABEL = {case.label: case for case in CASES}


class TimeUpError(Exception):
    """The run took its CPU time."""


def kernel_time():
    """Least time per cell of the FASTSIM kernel on 64 patches of 50 x 50 cells [ns]."""
    patches, cells, strips = 64, 50, 50
    a, b = 6e-3, 4e-3
    y = np.tile((np.arange(strips) + 0.5) / strips * 2 * b - b, (patches, 1))
    half = a * np.sqrt(1.0 - (y / b) ** 2)
    creepage = np.random.default_rng(2).uniform(-1.0, 1.0, (patches, 3)) * [
        2e-3,
        2e-3,
        0.4,
    ]
    width = np.full(patches, 2 * b / strips)
    slope = np.full_like(
        half,
        80e3 / (0.5 * np.pi * (half[0] ** 2).sum() * width[0]) * load_factor(cells),
    )
    flexibility = np.tile([[1.2e-14], [1.3e-14], [1.1e-14]], (1, patches))
    given = (
        y,
        width,
        half,
        -half,
        np.full(patches, 0.35),
        slope,
        creepage,
        flexibility,
    )
    counts = (np.full(patches, strips), np.full(patches, cells))
    outputs = (
        np.empty((5, patches, cells, strips)),
        np.zeros((patches, 3)),
        np.zeros(patches),
    )
    rows = fastsim.rows_for_march()
    times = []
    for _ in range(40):
        start = time.perf_counter()
        fastsim._march(
            *given, np.full(patches, 1.25e-14), *counts, True, rows, *outputs
        )
        times.append(time.perf_counter() - start)
    return 1e9 * min(times) / (patches * cells * strips)


def scene_of(case, folder):
    """Scene file of a case and values that replace those in it.

    Writes noisy wheels into a folder.
    """
    scene = FIELD if case.scene == "field" else WHEELS / f"{case.scene}.toml"
    changes = {"campaign.distance_km": case.distance, **case.changes}
    wheels = {side: WHEELS / f"wheel_worn_{side}.whl" for side in SIDES}
    if case.seed is not None:
        random = np.random.default_rng(case.seed)
        for side, source in wheels.items():
            wheels[side] = folder / f"wheel_seed{case.seed}_{side}.whl"
            wheels[side].write_text(noisy(source.read_text(), random))
    if case.seed is not None or case.scene == "field":
        changes |= {
            "wheelset.profile": str(wheels["right"]),
            "wheelset.profile_left": str(wheels["left"]),
        }
    return scene, [Override(key, value) for key, value in changes.items()]


def noisy(text, random):
    """Return the text of a .whl file with noise on the heights of its points."""

    def moved(match):
        return f"{match[1]} {float(match[2]) + random.normal(0.0, NOISE):.5f}"

    return re.sub(r"^(-?\d+\.\d+) (-?\d+\.\d+)$", moved, text, flags=re.MULTILINE)


def run(scene, overrides, out, limit=LIMIT):
    """Run a scene in this process.

    Its last event (None if it was refused), how it ended, CPU time [s].
    """
    seen, begin = {"event": None}, time.process_time()

    def observe(event):
        seen["event"] = event
        if event.kind == "step" and time.process_time() - begin > limit:
            raise TimeUpError

    try:
        wearsim.run(scene, out, overrides=overrides, observer=observe, threads=1)
        seen["end"] = "reached"
    except TimeUpError:
        seen["end"] = f"stopped after {limit:g} s"
    except WearsimError as error:
        seen["end"] = re.sub(r"\S*/", "", str(error).splitlines()[0])  # without folders
    return seen["event"], seen["end"], time.process_time() - begin


def curvature(y, z):
    """Curvature of parabolas over the points within `WINDOW` of each point [1/m]."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(y), np.diff(z)))])
    result = np.full(y.size, np.nan)
    for k in np.flatnonzero((along > WINDOW) & (along < along[-1] - WINDOW)):
        near = np.abs(along - along[k]) <= WINDOW
        if near.sum() >= 5:
            (ay, by, _), (az, bz, _) = (
                np.polyfit(along[near] - along[k], x[near], 2) for x in (y, z)
            )
            result[k] = 2.0 * (by * az - bz * ay) / np.hypot(by, bz) ** 3
    return result


def largest_curvatures(results):
    """Largest curvatures of the new and the worn wheels where they are worn [1/m]."""
    largest = np.zeros(2)
    for side in range(2):
        worn = results["wear_depth"].values[-1, side] > WORN
        for k, row in enumerate((0, -1)):
            bent = curvature(
                *(
                    results[name].values[row, side]
                    for name in ("profile_y", "profile_z")
                )
            )[worn]
            largest[k] = max(largest[k], np.nanmax(np.abs(bent), initial=0.0))
    return largest


def unsmoothed(scene, overrides):
    """Whether commands refuse a noisy wheel that is not smoothed."""
    try:
        check_contact(
            load_scene(
                scene, overrides=[one for one in overrides if one.key not in SMOOTHED]
            )
        )
    except WearsimError:
        return "refused"
    return "runs"


def measured(case, folder, limit=LIMIT):
    """Row of a case: runs it in this process on one thread, kernels compiled before."""
    blank = {"case": case.name, "distance_km": case.distance, "target_s": case.target}
    scene, overrides = scene_of(case, folder)
    if case.seed is not None:
        blank["unsmoothed"] = unsmoothed(scene, overrides)
    event, end, _ = run(
        scene,
        [*overrides, Override("campaign.distance_km", 0.2)],
        folder / "warm",
        limit,
    )
    if event is None:
        return blank | {"end": end}
    kernel = kernel_time()
    event, end, cpu = run(scene, overrides, folder / "run", limit)
    kernel = min(kernel, kernel_time())
    (file,) = (folder / "run").glob("*.nc")
    with wearsim.open_results(file) as results:
        new, worn = largest_curvatures(results)
        depth = results["wear_depth"].values[-1]
        row = blank | {
            "end": end,
            "reached_km": event.distance / 1e3,
            "cpu_s": cpu,
            "kernel_ns": kernel,
            "steps": event.step,
            "stages": int(results["stages"].sum()),
            "rejected": int(results["rejected_steps"].sum()),
            "held_by": ", ".join(
                f"{name} {n}"
                for name, n in sorted(
                    event.step_limits.items(), key=lambda item: -item[1]
                )
                if n
            ),
            "deepest_um": 1e6 * float(depth.max()),
            "curvature_new_per_m": new,
            "curvature_worn_per_m": worn,
            "left_out": float(results["left_out_share"].max())
            if "left_out_share" in results
            else 0.0,
        }
    if case.quarter and end == "reached":
        tolerance = load_scene(scene, overrides=overrides).campaign.error_tolerance_um
        closer = [*overrides, Override("campaign.error_tolerance_um", tolerance / 4.0)]
        event, end, _ = run(scene, closer, folder / "quarter", limit)
        if end == "reached":
            (file,) = (folder / "quarter").glob("*.nc")
            with wearsim.open_results(file) as results:
                apart = np.abs(results["wear_depth"].values[-1] - depth).max()
            row |= {
                "difference_percent": 100.0 * float(apart / depth.max()),
                "steps_quarter": event.step,
            }
    return row


def in_child(label, limit=LIMIT):
    """Row of a case, solved in a process of its own with one thread."""
    with tempfile.TemporaryDirectory() as folder:
        code = (
            "import sys, json, pathlib, real_wheels as script\n"
            "label, folder, limit = sys.argv[1:]\n"
            "print(json.dumps(script.measured(script.BY_LABEL[label], "
            "pathlib.Path(folder), float(limit))))"
        )
        one = dict.fromkeys(
            ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
        )
        path = os.pathsep.join(
            [str(HERE), str(HERE.parent), os.environ.get("PYTHONPATH", "")]
        )
        done = subprocess.run(
            [sys.executable, "-c", code, label, folder, str(limit)],
            check=True,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | one | {"PYTHONPATH": path},
        )
    return json.loads(done.stdout.splitlines()[-1])


def labels_of(table):
    """Labels of the cases of the rows of a table."""
    return [f"{row.case}_{row.distance_km:g}km" for row in table.itertuples()]


def merged(rows, path):
    """Table with new rows in the place of the old ones of the same cases.

    In the order of `CASES`.
    """
    known = {label: {} for label in BY_LABEL}
    if path.exists():
        table = pd.read_csv(path)
        known |= dict(zip(labels_of(table), table.to_dict("records"), strict=True))
    for label, row in rows.items():
        known[label] = row
    return pd.DataFrame([row for row in known.values() if row], columns=COLUMNS)


def written(value, form):
    """Value of a cell; nothing for a missing one."""
    return "" if pd.isna(value) else format(value, form) if form else str(value)


def part(head, columns, caption, chosen):
    """Table of the report with some columns of some cases; none if no case was run."""
    rows = [
        [f"`{row['case']}`", *(written(row[name], form) for name, form in columns)]
        for row in chosen
    ]
    return [Table(["case", *head], rows, caption=caption)] if rows else []


def tables(table):
    """Tables of the report."""
    rows = table.to_dict("records")
    long = [row for row in rows if row["distance_km"] >= 1000.0]
    short = [row for row in rows if pd.notna(row["difference_percent"])]
    seeds = [row for row in rows if pd.notna(row["unsmoothed"])]
    strips = [
        row
        for row in rows
        if row["case"].endswith("_strips") and row["distance_km"] < 1000.0
    ]
    run_of = (("reached_km", ".6g"), ("cpu_s", ".1f"))
    counts = (("steps", ".0f"), ("stages", ".0f"), ("rejected", ".0f"))
    bent = (("curvature_new_per_m", ".0f"), ("curvature_worn_per_m", ".0f"))
    counts_head, bent_head = (
        ["steps", "stages", "rejected"],
        ["κ new [1/m]", "κ worn [1/m]"],
    )
    return [
        *part(
            [
                "run [km]",
                "CPU [s]",
                "target [s]",
                "kernel [ns/cell]",
                *counts_head,
                "end",
            ],
            (*run_of, ("target_s", ".0f"), ("kernel_ns", ".2f"), *counts, ("end", "")),
            "Whole distances, one thread.",
            long,
        ),
        *part(
            ["held by"],
            (("held_by", ""),),
            "What limited the steps of these runs.",
            long,
        ),
        *part(
            ["deepest [µm]", *bent_head, "left out"],
            (("deepest_um", ".1f"), *bent, ("left_out", ".1e")),
            (
                "What these runs did to the wheels; shares left out are the largest "
                "of a step."
            ),
            long,
        ),
        *part(
            [
                "km",
                "CPU [s]",
                "steps",
                "steps, quarter",
                "difference [%]",
                "target [%]",
            ],
            (
                ("distance_km", ".6g"),
                ("cpu_s", ".1f"),
                ("steps", ".0f"),
                ("steps_quarter", ".0f"),
                ("difference_percent", ".2f"),
                ("tolerance_percent", ".0f"),
            ),
            "Largest difference of the wear depth from a run with a quarter of "
            "`error_tolerance_um`, in per cent of the deepest place.",
            [row | {"tolerance_percent": TOLERANCE} for row in short],
        ),
        *part(
            [
                "unsmoothed",
                "run [km]",
                "CPU [s]",
                *counts_head,
                "deepest [µm]",
                *bent_head,
                "end",
            ],
            (
                ("unsmoothed", ""),
                *run_of,
                *counts,
                ("deepest_um", ".1f"),
                *bent,
                ("end", ""),
            ),
            f"The worn pair with {1e3 * NOISE:g} µm of noise on the heights of its "
            f"points, smoothed by {SMOOTHED_MM:g} mm.",
            seeds,
        ),
        *part(
            ["run [km]", "CPU [s]", *counts_head, "deepest [µm]", *bent_head, "end"],
            (*run_of, *counts, ("deepest_um", ".1f"), *bent, ("end", "")),
            f'Coupled strips, `model = "{STRIPS["contact.model"]}"`.',
            strips,
        ),
    ]


def missing(table):
    """Sentence that names the cases without a row; nothing if there is none."""
    run_before = set(labels_of(table))
    labels = [f"`{label}`" for label in BY_LABEL if label not in run_before]
    return [f"Not run yet: {', '.join(labels)}."] if labels else []


def draw(table):
    """CPU time of the whole distances and their targets."""
    rows = table[table["target_s"].notna() & table["cpu_s"].notna()]
    with style():
        figure, axes = grid(
            1, 1, height=0.5 + 0.35 * max(len(rows), 1), edges=(2.2, 0.15, 0.5, 0.6)
        )
        places = np.arange(len(rows))
        axes[0, 0].barh(
            places, rows["cpu_s"], height=0.5, color=SERIES_COLOURS[4], label="CPU time"
        )
        axes[0, 0].plot(
            rows["target_s"],
            places,
            "|",
            ms=14,
            mew=2,
            color=SERIES_COLOURS[0],
            label="target",
        )
        names = [
            f"{row.case.replace('_', ' ')}, {kilometres(1e3 * row.reached_km)}"
            for row in rows.itertuples()
        ]
        axes[0, 0].set_yticks(places, names)
        axes[0, 0].grid(visible=False, axis="y")
        axes[0, 0].invert_yaxis()
        axes[0, 0].set_xlabel("CPU time, one thread [s]")
        legend(figure, columns=2)
    return figure


def chosen_cases(chosen):
    """Labels of the cases to run."""
    if chosen.cases:
        return chosen.cases
    return [
        label
        for label, case in BY_LABEL.items()
        if not chosen.quick or case.distance <= QUICK
    ]


def main(arguments=None):
    """Write the report."""
    more = {
        "cases": {
            "nargs": "+",
            "choices": list(BY_LABEL),
            "metavar": "CASE",
            "help": ", ".join(BY_LABEL),
        },
        "quick": {"action": "store_true", "help": f"the cases of {QUICK:g} km or less"},
        "jobs": {
            "type": int,
            "default": 1,
            "metavar": "N",
            "help": "cases at a time (default: 1)",
        },
        "limit": {
            "type": float,
            "default": LIMIT,
            "metavar": "S",
            "help": "CPU time of a run [s]",
        },
    }
    chosen = options(__file__, __doc__, arguments, from_csv=True, more=more)
    values = chosen.out / "real_wheels.csv"
    labels = [] if chosen.from_csv else chosen_cases(chosen)
    with ThreadPoolExecutor(chosen.jobs) as pool:
        rows = dict(
            zip(
                labels,
                pool.map(lambda label: in_child(label, chosen.limit), labels),
                strict=True,
            )
        )
    table = merged(rows, values)
    if rows:
        write_csv(table, values)
        table = merged({}, values)
    save_svg(draw(table), chosen.out / "real_wheels.svg")
    blocks = [
        INTRODUCTION,
        *tables(table),
        Figure("real_wheels.svg", CAPTION),
        *missing(table),
        "All values: [real_wheels.csv](real_wheels.csv).",
    ]
    write_report(chosen.out, __file__, TITLE, blocks)


if __name__ == "__main__":
    main()
