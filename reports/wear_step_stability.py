"""What steps beyond the limit of stability do to a wheel.

With the control of campaigns on and off.

python reports/wear_step_stability.py              wears all wheels: wear_step_stability.csv, .md and .svg
python reports/wear_step_stability.py --from-csv   writes the text from the table as it stands
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.ticker import NullFormatter
from writing import Figure, Table, options, write_csv, write_report

import wearsim
from wearsim.campaign.control import half_space_rate, largest_step
from wearsim.campaign.evaluate import Setup, rate
from wearsim.campaign.state import State
from wearsim.campaign.step import StepRule, begun, stability_rate
from wearsim.damage.wear import WearSettings
from wearsim.errors import NumericalError, WearsimError
from wearsim.operation.points import OperatingPoints
from wearsim.profile.shape import arc_length, vertex_lengths
from wearsim.profile.smoothing import smoothing_spline
from wearsim.report.style import SERIES_COLOURS, grid, legend, save_svg, style
from wearsim.scene.campaign import HALF_SPACE_DEPTHS, STABILITY, ControlSettings

TITLE = "Stability of wear steps"
WHEEL = wearsim.standard_profile("S1002")
WHEELSET = wearsim.wheelset(WHEEL, radius=0.46, back_to_back=1.36)
RAILS = wearsim.rails("60E1", inclination=1.0 / 40.0, gauge=1.435)
SPACING = 0.25e-3  # of the points of the wheel profile [m]
DENSITY = 7850.0
REGIMES = 3  # of the law usfd: mild, severe, catastrophic
SHIFTS = np.linspace(-4e-3, -1e-3, 7)  # one patch on the tread each
WEIGHT = np.full(SHIFTS.size, 1.0 / SHIFTS.size)
NOISE = 0.05e-6  # standard deviation of the heights of the new profile's points [m]
STRIPS, CELLS = 60, 16
WAVELENGTH = 2.5e-3  # of the smoothing of increments [m]
# waves in the wear depth shorter than this are ripple: the running band is far
# wider [m]
RIPPLE = 4e-3
CONTROL = {
    "distance": 1e12,
    "depth_cap": 50e-6,
    "stability": STABILITY["rkc"][0],
    "half_space_depths": HALF_SPACE_DEPTHS["rkc"],
}
STEP_FACTORS = (
    1.0,
    2.0,
    5.0,
    10.0,
)  # lengths of a single step, in longest safe steps of first order
WAVES = (
    0.5e-3,
    2.5e-3,
)  # the shortest wave that points 0.25 mm apart can carry, and half a patch [m]
AMPLITUDE = 0.2e-6  # of these waves [m]
BAND = (-18.0, 26.0)  # where the wheel wears [mm]


@dataclass(frozen=True)
class Case:
    """How one campaign takes its steps, `factor` times the longest stable one.

    0: control decides.
    """

    normal: str
    steps: str
    depth: float  # wear depth to reach [m]
    factor: float
    smoothing: float  # wavelength [m]
    integrator: str = "euler"


SMOOTHED = "beyond the limit, smoothed"
CASES = (
    Case("kik_piotrowski", "control on", 200e-6, 0.0, WAVELENGTH, "rkc"),
    Case("kik_piotrowski", "beyond the limit, no smoothing", 200e-6, 4.0, 0.0),
    Case("kik_piotrowski", SMOOTHED, 200e-6, 4.0, WAVELENGTH),
    Case("kik_piotrowski", f"{SMOOTHED}, Chebyshev", 200e-6, 4.0, WAVELENGTH, "rkc"),
    Case("half_space", "control on", 80e-6, 0.0, WAVELENGTH, "rkc"),
    Case("half_space", "beyond the limit, no smoothing", 80e-6, 8.0, 0.0),
    Case("half_space", SMOOTHED, 80e-6, 8.0, WAVELENGTH),
)

INTRODUCTION = f"""\
A new S1002 wheel with noise of {1e6 * NOISE:g} µm at its points, {1e3 * SPACING:g} mm apart, runs on 60E1
1:40 at seven lateral positions from -4 to -1 mm with 5 mrad of yaw, 80 kN, friction 0.35; patches of
{STRIPS} strips. With control on, the steps are the longest of a campaign: stability and depth of 50 µm,
Runge-Kutta-Chebyshev rules, increments smoothed at 2.5 mm, no tolerance of the error; on a half-space none
deeper than {HALF_SPACE_DEPTHS["rkc"]:g} times the limit of Euler's rule for the smoothed increments. With
control off, every step is a given multiple of the longest safe one of Euler's rule: S = 1 for
models of virtual penetration, the depth (p0/E*) Δy for models of the half-space kind.
"""
REMARKS = """\
With virtual penetration each strip responds to its own depth only: one step multiplies a wave by 1 - S,
whatever its length. On a half-space short waves are worn off fastest, and a step beyond the limit
overshoots them first: the finer the points of the profile, the shorter the step. Smoothing of the
increments takes the short waves out of both, and raises the limit of the half-space; it does not make long
steps of virtual penetration stable, the Chebyshev rules do.
"""
CAPTION = (
    "Top: wear depth at the end. Bottom: what is shorter than 4 mm in it, on the way; "
    "a campaign that found no contact solution would end in a cross."
)
ONE_STEP = f"""\
What one explicit step leaves of a waviness of {1e6 * AMPLITUDE:g} um, without smoothing, points 0.25 mm
apart: 1 is all of it, more is growth. Steps in units of the longest safe one of first order; longer steps of
campaigns have more stages.
"""
BLIND = """\
Within the limit, {} leave{} 99 % or more of one of these waves: noise of a measured profile stays in it.
Smooth such a profile before the run, and leave the smoothing of the increments on, so that steps add none.
"""


def new_wheels(right_z):
    """State of a wheelset with heights of the right wheel and a new left wheel."""
    blank = np.zeros((2, WHEEL.y.size))
    y, z = np.stack([WHEEL.y, WHEEL.y]), np.stack([right_z, WHEEL.z])
    return State(
        0,
        0.0,
        y,
        z,
        blank,
        np.zeros((2, REGIMES, WHEEL.y.size)),
        np.zeros(2),
        np.zeros(2),
    )


def wear_rate(state, models):
    """Wear rate of a state over the operating points."""
    conditions = wearsim.ContactConditions.of(shift=SHIFTS, yaw=5e-3)
    labels = tuple(f"{1e3 * shift:g} mm" for shift in SHIFTS)
    points = OperatingPoints(
        conditions, WEIGHT, np.ones(SHIFTS.size), np.zeros(SHIFTS.size), labels
    )
    return rate(state, points, WEIGHT, Setup(WHEELSET, RAILS, models, WearSettings()))


def worn(state, now, length, smoothing, integrator, models, stability=None):
    """State after one step of a length [m]."""
    rule = StepRule(WHEELSET.radius, DENSITY, smoothing, integrator)
    stability = stability_rate(now) * length if stability is None else stability
    stages = begun(state, now, length, rule, stability)
    while stages.left:
        ahead = stages.ahead()
        stages = stages.with_rate(ahead, wear_rate(ahead, models))
    return stages.end().state


def wear(case, depth=None, cells=CELLS):
    """Wear the wheel of a case to a depth [m], that of the case if not given.

    Returns largest wear depth and ripple after each step, the message of a breakdown,
    the final wear depth.
    """
    models = wearsim.ContactModels(
        case.normal, "fastsim", STRIPS, cells=cells, most_cells=cells
    )
    settings = ControlSettings(
        **CONTROL, smoothing_wavelength=case.smoothing, integrator=case.integrator
    )
    state = new_wheels(
        WHEEL.z + NOISE * np.random.default_rng(7).standard_normal(WHEEL.z.size)
    )
    way, message = [(0.0, 0.0)], ""
    try:
        while way[-1][0] < (depth or case.depth):
            now = wear_rate(state, models)
            wave, stability = 0.0 if case.factor else case.smoothing, None
            if case.factor:
                steepest = float(now.stability.max()) or half_space_rate(
                    now, state, wave
                )
                length = case.factor / steepest
            else:
                length, _, stiffness = largest_step(now, state, settings)
                stability = stiffness * length
            state = worn(
                state, now, length, case.smoothing, case.integrator, models, stability
            )
            way.append((float(state.wear_depth[0].max()), ripple(state.wear_depth[0])))
    except WearsimError as error:
        message = str(error)
    return way[1:], message, state.wear_depth[0]


def ripple(depth):
    """RMS of what is shorter than `RIPPLE` in a wear depth.

    Over the half of the band that wears most [m].
    """
    lengths = vertex_lengths(WHEEL.y, WHEEL.z)
    long = smoothing_spline(arc_length(WHEEL.y, WHEEL.z), depth[None], lengths, RIPPLE)[
        0
    ]
    return float(np.sqrt(((depth - long)[long > 0.5 * long.max()] ** 2).mean()))


def wave_after_one_step(normal, strips=STRIPS):
    """Table of what one explicit step without smoothing leaves of a waviness.

    Rows by wave and step length.

    `left` is the ratio of the RMS of second differences: shifts and tilts of the
    profile are no waviness.
    """
    models = wearsim.ContactModels(normal, "fastsim", strips, cells=20, most_cells=20)
    plain = new_wheels(WHEEL.z)
    rate_plain = wear_rate(plain, models)
    depth = rate_plain.depth[0]
    waves = half_space_rate(rate_plain, plain, 0.0)
    if waves > 0.0:
        length, limit = 1.0 / waves, "depth <= (p0/E*) x point distance"
    else:
        stability = STABILITY["euler"][0]
        length, limit = (
            stability / float(rate_plain.stability[0].max()),
            f"S <= {stability:g}",
        )
    band = depth > 0.5 * depth.max()

    def waviness(z, smooth_z):
        return float(np.sqrt((np.diff((z - smooth_z)[band], 2) ** 2).mean()))

    rows = []
    for wave in WAVES:
        # Extremes on the points: the shortest wave would vanish with its zeros on them.
        phase = 2.0 * np.pi * SPACING * np.arange(WHEEL.y.size) / wave
        wavy = new_wheels(WHEEL.z + AMPLITUDE * np.cos(phase))
        rate_wavy = wear_rate(wavy, models)
        for factor in STEP_FACTORS:
            row = {
                "normal": normal,
                "limit": limit,
                "depth": length * float(depth.max()),
            }
            row |= {"wavelength": wave, "factor": factor, "left": np.nan, "message": ""}
            try:
                ends = [
                    worn(state, now, factor * length, 0.0, "euler", models).z[0]
                    for state, now in ((wavy, rate_wavy), (plain, rate_plain))
                ]
                row["left"] = waviness(*ends) / waviness(wavy.z[0], plain.z[0])
            except NumericalError as error:
                row["message"] = str(error)
            rows.append(row)
    return pd.DataFrame(rows)


def one_step_section(steps):
    """Text and table of `wave_after_one_step`.

    Also a note on models that leave a wave within the limit.
    """
    rows, blind = [], set()
    for (normal, wavelength), part in steps.groupby(
        ["normal", "wavelength"], sort=False
    ):
        first = part.iloc[0]
        depth, wave = f"{1e6 * first['depth']:.1f}", f"{1e3 * wavelength:g} mm"
        cells = [
            row["message"] or f"{row['left']:.2f}" for row in part.to_dict("records")
        ]
        rows.append([f"`{normal}`", first["limit"], depth, wave, *cells])
        if first["left"] > 0.99:
            blind.add(f"`{normal}`")
    factors = [f"{factor:g} x" for factor in STEP_FACTORS]
    head = ["normal model", "active limit", "depth at the limit [um]", "wave", *factors]
    note = BLIND.format(", ".join(sorted(blind)), "s" if len(blind) == 1 else "")
    return [
        ONE_STEP,
        Table(head, rows, "llrr" + "r" * len(factors)),
        *([note] if blind else []),
    ]


def draw(wheels):
    """Wear depth at the end and ripple on the way; a column for each normal model."""
    names = list(dict.fromkeys(case.normal for case in CASES))
    with style():
        figure, axes = grid(2, len(names), height=2.4, gap=0.8, between=0.6)
        for normal, (end, path) in zip(names, axes.T, strict=True):
            cases = [case for case in CASES if case.normal == normal]
            for case, colour in zip(cases, SERIES_COLOURS, strict=False):
                way, message, depth = wheels[case]
                steps = 1e6 * np.array(way)
                end.plot(
                    1e3 * WHEEL.y, 1e6 * depth, lw=0.9, color=colour, label=case.steps
                )
                path.semilogy(*steps.T, ".-", lw=0.8, color=colour, label=case.steps)
                if message:
                    path.plot(*steps[-1], "x", color=colour)
            end.set_title(
                f"{normal}, {max(case.factor for case in cases):g} times the limit"
            )
            end.set_xlim(*BAND)
            end.set_xlabel("y on the wheel [mm]")
            end.set_ylabel("Wear depth [µm]")
            path.set_xlabel("Largest wear depth on the way [µm]")
            path.set_ylabel(f"Waves below {1e3 * RIPPLE:g} mm, RMS [µm]")
            path.yaxis.set_major_formatter("{x:g}")
            path.yaxis.set_minor_formatter(NullFormatter())
        legend(figure, columns=2)
    return figure


def table_of(wheels):
    """Table with a row for each step of each case."""
    return pd.DataFrame(
        [
            {
                "normal": case.normal,
                "steps": case.steps,
                "step": k,
                "depth": depth,
                "ripple": waves,
            }
            | {"message": message if k == len(way) else ""}
            for case, (way, message, _) in wheels.items()
            for k, (depth, waves) in enumerate(way, start=1)
        ]
    )


def read_table(path):
    """Table of `table_of`, or another with messages, from its CSV file."""
    return pd.read_csv(path, dtype={"message": str}).fillna({"message": ""})


def summary(table):
    """Table of the report: the last step of each case."""
    rows = []
    for case in CASES:
        last = table[
            (table["normal"] == case.normal) & (table["steps"] == case.steps)
        ].iloc[-1]
        steps = case.steps.replace("beyond", f"{case.factor:g} times")
        end = f"breaks down: {last['message']}" if last["message"] else "reached"
        depth, waves = (f"{1e6 * last[name]:.3g}" for name in ("depth", "ripple"))
        rows.append([case.normal, steps, last["step"], depth, waves, end])
    head = [
        "model",
        "steps",
        "number of steps",
        "wear depth [µm]",
        "waves below 4 mm, RMS [µm]",
        "end",
    ]
    return Table(head, rows, "llrrrl")


def main(arguments=None):
    """Write the report."""
    chosen = options(__file__, __doc__, arguments, from_csv=True)
    values = chosen.out / "wear_step_stability.csv"
    if not chosen.from_csv:
        wheels = {case: wear(case) for case in CASES}
        write_csv(table_of(wheels), values)
        save_svg(draw(wheels), chosen.out / "wear_step_stability.svg")
    blocks = [
        INTRODUCTION,
        REMARKS,
        summary(read_table(values)),
        Figure("wear_step_stability.svg", CAPTION),
        "All steps: [wear_step_stability.csv](wear_step_stability.csv).",
    ]
    write_report(chosen.out, __file__, TITLE, blocks)


if __name__ == "__main__":
    main()
