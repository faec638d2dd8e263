"""Do calibrations recover what is hidden? Coverage, noise, truths by the half-space.

    python reports/calibration.py [--out DIR] [--from-csv] [--rigs N] [--noises N]
        [--models N] [--work DIR]

writes calibration.md and a table of each part: calibration_rigs.csv,
calibration_noises.csv and calibration_models.csv; some ten minutes of one core, seven
of them the last part. A number of 0 leaves the table of that part as it stands.
Campaigns in the folder of --work are kept, and those that it has are not run again.
"""

import importlib
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import closed_form_rig as rig
import numpy as np
import pandas as pd
from scipy.interpolate import PchipInterpolator
from scipy.special import ndtr, ndtri
from scipy.stats import chisquare, qmc
from writing import HERE, Table, options, write_csv, write_report

from wearsim.errors import ResultError
from wearsim.scene.overrides import Override
from wearsim.studies import calibration, posterior
from wearsim.studies.ensemble import Runner
from wearsim.studies.measured import Curves, read_measured

sys.path.insert(0, str(HERE.parent / "profiles" / "measured"))
example = importlib.import_module("make_calibrate_rig")

TITLE = "Calibrations: what is hidden, and what is found"
SCENE = HERE.parent / "workflows" / "calibrate_rig.toml"
TABLE = SCENE.with_suffix(".csv")
INPUTS = ("wear coefficient", "friction", "yaw bias", "shift bias", "load")
RIGS, NOISES, TRUTHS = 300, 8, 5
MODELS = ("fast", "standard")
TRUTH_GRID = 30  # cells across and along of the half-space, those of scenes are 20
REACH = 1.05e6  # of the campaigns of hidden inputs [m]
DRAWS = 55  # campaigns that the polynomial follows
FARTHEST = 2.2e6  # of these campaigns, at wear coefficient 1 [m]
_CENTRE = np.array([0.3, 0.5, 0.67, 0.3])  # of their scores, near the hidden ones
_SPREAD = np.array([1.2, 0.8, 0.25, 1.2])


def of_rigs(count, _folder=None):
    """Rows of closed-form rigs: rank of the truth among 99 draws, interval held."""
    random = np.random.default_rng(5)
    rows = []
    for number in range(count):
        began = time.process_time()
        truth = random.standard_normal(len(rig.NAMES))
        found = rig.learn(rig.measured(truth, random), seed=number)
        low, high = np.quantile(found.draws, (0.05, 0.95), axis=0)
        chosen = found.draws[random.choice(len(found.draws), 99, replace=False)]
        row = {"rig": number, "seconds": time.process_time() - began}
        for k, name in enumerate(rig.NAMES):
            row[f"{name}_rank"] = int((chosen[:, k] < truth[k]).sum())
            row[f"{name}_held"] = int(low[k] < truth[k] < high[k])
        rows.append(row)
    return pd.DataFrame(rows)


def hidden_scores(plan):
    """Scores (d,) of the inputs that the shipped files were made from."""
    found = []
    for one in plan.dimensions:
        shares = np.linspace(0.001, 0.999, 9999)
        values = [float(one.drawn(float(share))) for share in shares]
        found.append(ndtri(np.interp(example.TRUTH[one.name], values, shares)))
    return np.array(found)


def run_campaigns(plan, batch, distance, folder):
    """Run the rig at scores (n, d) over a distance [m]; what each predicts."""
    folder.mkdir(parents=True, exist_ok=True)
    cases = [
        plan.case(number, "rig", scores, distance, own_models=True)
        for number, scores in enumerate(batch, start=1)
    ]
    for outcome in Runner(jobs=1).run(cases, folder):
        if outcome.state != "finished":
            raise SystemExit(outcome.fault)
    return [calibration.curves_of(folder / case.name / "rig.nc") for case in cases]


class Polynomial:
    """Depths of the rig at wear coefficient 1 by a polynomial of its other inputs.

    Of third degree, without products of three inputs but for those with the shift.
    """

    def __init__(self, plan, folder):
        self.plan = plan
        self.grid = np.linspace(0.0, FARTHEST, 45)
        share = qmc.Sobol(4, rng=3).random(64)[:DRAWS]
        normal = np.clip(ndtri(np.clip(share, 1e-9, 1.0 - 1e-9)), -2.0, 2.0)
        others = _CENTRE + _SPREAD * normal
        batch = np.insert(others, 0, 0.0, axis=1)
        rows = []
        for own in run_campaigns(plan, batch, FARTHEST, folder):
            rows.append(PchipInterpolator(own.distance, own.depth, axis=0)(self.grid))
        design, flat = self.columns(others), np.array(rows).reshape(len(rows), -1)
        inverse = np.linalg.pinv(design)
        self.weights = inverse @ flat
        free = 1.0 - np.einsum("ij,ji->i", design, inverse)
        left_out = (flat - design @ self.weights) / free[:, None]
        self.error = float(np.sqrt(np.mean(left_out**2)))

    def columns(self, others):
        """Columns of the polynomial at scores (n, 4) of all inputs but the first."""
        x = (others - _CENTRE) / _SPREAD
        squares = [x[:, i] * x[:, j] for i in range(4) for j in range(i + 1)]
        cubes = [x[:, i] ** 3 for i in range(4)]
        mixed = [x[:, 3] * x[:, i] * x[:, j] for i in range(3) for j in range(i + 1)]
        return np.column_stack([np.ones(len(x)), *x.T, *squares, *cubes, *mixed])

    def run(self, batch):
        """Responses of campaigns at scores (n, d), as `posterior.search` needs them."""
        found = []
        for scores in batch:
            flat = self.columns(scores[None, 1:]) @ self.weights
            own = Curves(self.grid, flat.reshape(self.grid.size, 2, -1), {})
            found.append(self.response(np.concatenate([[0.0], scores[1:]]), own))
        return found

    def response(self, own, curves):
        """Predictions at scores that differ from a campaign's own in the first."""

        def response(scores):
            scale = self.plan.scale("rig", scores) / self.plan.scale("rig", own)
            return self.plan.measured.predicted({"rig": curves}, {"rig": scale})

        return response


def measured_again(plan, result, seed, folder):
    """Measurements of the hidden wheels by the instrument, with other noise."""
    folder.mkdir(exist_ok=True)
    *_, table = example.measure(result, seed, folder, folder / "table.csv")
    settings = plan.scene.uncertainty.measured
    return replace(plan, measured=read_measured(table, plan.parts, settings))


def of_noises(count, folder):
    """Rows of the shipped rig, its wheels measured with other noise: what is found."""
    plan = calibration.plan_of(SCENE, TABLE)
    hidden = hidden_scores(plan)
    rows = []
    result = example.truth(folder / "hidden")
    polynomial = Polynomial(plan, folder / "draws")
    for seed in (example.SEED, *range(100, 100 + count)):
        own = measured_again(plan, result, seed, folder / f"noise{seed}")
        polynomial.plan = own
        began = time.process_time()
        try:
            found = calibration.learn(own, polynomial.run, polynomial.run)
        except ResultError as error:
            rows.append({"noise": seed, "refused": str(error)})
            continue
        seconds = time.process_time() - began
        rows.append({"noise": seed} | _found(own, found, hidden) | {"seconds": seconds})
    return pd.DataFrame(rows).assign(polynomial_error_um=1e6 * polynomial.error)


def _found(plan, found, hidden):
    """Row of a posterior against the hidden scores (d,)."""
    low, middle, high = np.quantile(found.draws, (0.05, 0.5, 0.95), axis=0)
    off = (found.draws.mean(axis=0) - hidden) / found.draws.std(axis=0)
    row = {"chi_square": found.mode.chi2, "effective": found.effective}
    for k, one in enumerate(plan.dimensions):
        values = [float(one.drawn(float(ndtr(s[k])))) for s in (low, middle, high)]
        row |= dict(zip([f"{one.name}_{q}" for q in (5, 50, 95)], values, strict=True))
        row[f"{one.name}_off"] = off[k]
        row[f"{one.name}_held"] = int(low[k] < hidden[k] < high[k])
    covariance = np.cov(found.draws.T)
    row["prior_pull"] = -(covariance @ hidden)[0] / np.sqrt(covariance[0, 0])
    return row


def of_models(count, folder):
    """Rows of the shipped rig whose hidden wheels wear by the half-space: k found."""
    plans = {
        name: calibration.plan_of(SCENE, TABLE, {"contact.model": name})
        for name in MODELS
    }
    rows = []
    for number in range(count):
        random = np.random.default_rng([47, number])
        hidden = random.standard_normal(len(INPUTS))
        own = folder / f"truth{number}"
        truth = hidden_wheels(plans["fast"], hidden, own / "hidden")
        for name, plan in plans.items():
            row = {"truth": number, "model": name}
            rows.append(row | mode_of(plan, hidden, truth, own / name))
    return pd.DataFrame(rows)


def hidden_wheels(plan, hidden, folder):
    """Curves of the rig at hidden scores (d,), by the half-space."""
    folder.mkdir(parents=True, exist_ok=True)
    case = plan.case(1, "rig", hidden, REACH, own_models=True)
    finer = [Override("contact.model", "accurate")]
    finer += [Override(f"contact.{key}", TRUTH_GRID) for key in ("strips", "cells")]
    case = replace(case, overrides=(*case.overrides, *finer))
    (outcome,) = Runner(jobs=1).run([case], folder)
    if outcome.state != "finished":
        raise SystemExit(outcome.fault)
    return calibration.curves_of(folder / case.name / "rig.nc")


def mode_of(plan, hidden, truth, folder):
    """Row of the mode of measurements without noise of the hidden wheels.

    It is searched from the hidden inputs, where it lies but for model and prior.
    """
    exact = plan.measured.predicted({"rig": truth}, {"rig": 1.0})
    folder.mkdir(parents=True, exist_ok=True)
    run, _ = calibration.runs_of(plan, folder, Runner(jobs=1))
    mode = posterior.search(run, exact, plan.measured.noise, plan.clocked, hidden)
    sigma = np.log(plan.drawn(np.ones(len(hidden)))[0])  # of ln k, whose median is 1
    pull = -(mode.covariance @ hidden)[0]
    row = {
        "k_hidden": np.exp(sigma * hidden[0]),
        "k_found": np.exp(sigma * mode.scores[0]),
        "deviation_ln_k": sigma * mode.deviation[0],
        "off_ln_k": sigma * (mode.scores[0] - hidden[0]),
        "prior_pull_ln_k": sigma * pull,
        "chi_square": mode.chi2,
        "campaigns": mode.campaigns,
    }
    for k, name in enumerate(INPUTS):
        row[f"{name}_hidden"] = hidden[k]
        row[f"{name}_found"] = mode.scores[k]
    return row


INTRODUCTION = """\
What `wearsim calibrate` states against what is hidden. Intervals are those of 90 %,
from the 5 % to the 95 % quantile of the posterior. Deviations (*off*) are the mean of
the posterior less the hidden value, over the standard deviation of the posterior.
"""
OF_RIGS = """\
## Rigs whose wear is a closed form

Profiles of both wheels at three distances (`closed_form_rig.py`), noise of 10 um,
alignment and error of shape as in a scene; truths of five inputs from their prior.
Ranks are those of the truth among 99 draws; uniform ranks have p above 0.002 (0.01
over five inputs).
"""
OF_NOISES = f"""\
## The shipped rig, measured again and again

`calibrate_rig.toml` with one hidden set of inputs (wear coefficient k =
{example.TRUTH["wear coefficient"]:g}): the instrument of `make_calibrate_rig.py`
measures its wheels with other noise, tilt and place each time, and the files are read
as any others. A polynomial of third degree through {DRAWS} campaigns stands in place
of the campaigns of each calibration. Noise {example.SEED} is that of the shipped files.

Truths of one's own choice are not truths from the prior: where measurements tell
little, the posterior leans to the prior, and hidden values of one side have all their
deviations on one side. *Pull of the prior* is that part of the deviation of the wear
coefficient, from the covariance of the posterior. The posterior allows for an error
of the shape of 5 % of the depth, which these files do not have: intervals hold more
often than stated.
"""
OF_MODELS = f"""\
## Wheels that wear by the half-space

The shipped rig again, its hidden inputs {TRUTHS} draws of their prior, and its hidden
wheels worn by the half-space (`model = "accurate"`, {TRUTH_GRID} x {TRUTH_GRID}
cells). They are measured where the shipped wheels were, without noise, so that what
differs are the models; calibrations allow for noise as ever. *k found* is the mode of
the posterior by campaigns with the model of the row, all five inputs unknown (20 x 20
cells, as the scene). *Off* is ln (found / hidden); *pull of the prior* is the part of
it that is no fault of the model, from the covariance of the posterior: over many draws
of the prior it averages out, over five it does not.
"""
LEFT_OUT = """\
## Not in this report

Coverage with campaigns in place of formula and polynomial: a slow test has the modes
of five truths. What the models differ by in depth stands in
[campaign_accuracy.md](campaign_accuracy.md).
"""


def table_of_rigs(rows):
    """Coverage and ranks of the closed-form rigs."""
    body = []
    for name in rig.NAMES:
        held = 100.0 * rows[f"{name}_held"].mean()
        bins = np.bincount(rows[f"{name}_rank"] // 10, minlength=10)
        body.append([name, f"{held:.0f}", f"{chisquare(bins).pvalue:.2f}"])
    every = np.mean([rows[f"{name}_held"].mean() for name in rig.NAMES])
    body.append(["all", f"{100.0 * every:.1f}", ""])
    caption = (
        f"{len(rows)} rigs, {rows['seconds'].sum():.0f} CPU s, "
        f"{rows['seconds'].mean():.2f} s each."
    )
    return Table(["input", "intervals that hold [%]", "p of ranks"], body, "", caption)


def table_of_noises(rows):
    """List what is found from each set of measurements."""
    body = []
    for row in rows.to_dict("records"):
        if isinstance(row.get("refused"), str):
            body.append([f"{row['noise']:g}", "refused", *["" for _ in range(8)]])
            continue
        held = sum(int(row[f"{name}_held"]) for name in INPUTS)
        three = [f"{row[f'wear coefficient_{q}']:.3f}" for q in (5, 50, 95)]
        off = [f"{row[f'{name}_off']:+.1f}" for name in INPUTS]
        body.append([f"{row['noise']:g}", *three, *off, f"{held} of {len(INPUTS)}"])
    head = ["noise", "k 5 %", "50 %", "95 %", *(f"{n}, off" for n in INPUTS), "hold"]
    return Table(head, body, "", "Quantiles of k, and deviations of all inputs.")


def sentences_of_noises(rows):
    """Say how many intervals hold, and what moves the wear coefficient."""
    refused = 0 if "refused" not in rows else int(rows["refused"].notna().sum())
    kept = rows[rows["chi_square"].notna()]
    others = kept[kept["noise"] != example.SEED]
    shares = {name: int(others[f"{name}_held"].sum()) for name in INPUTS}
    off = others["wear coefficient_off"]
    shipped = kept[kept["noise"] == example.SEED].iloc[0]
    listed = ", ".join(f"{name} {count}" for name, count in shares.items())
    total = sum(shares.values())
    return (
        f"{refused} of {len(rows)} sets of measurements are refused. Of {len(others)} "
        f"others beside the shipped one these intervals hold: {listed}; "
        f"{total} of {len(others) * len(INPUTS)} in all "
        f"({100.0 * total / (len(others) * len(INPUTS)):.0f} %). The wear coefficient "
        f"is off by {off.mean():+.2f} standard deviations in the mean, "
        f"{others['prior_pull'].mean():+.2f} of them the pull of the prior, and "
        f"scatters by {off.std():.2f} of them. The shipped set is off by "
        f"{shipped['wear coefficient_off']:+.2f}. The polynomial is wrong by "
        f"{rows['polynomial_error_um'].iloc[0]:.2g} um (left-out campaigns, "
        "root mean square)."
    )


def table_of_models(rows):
    """Wear coefficients found by each model."""
    body = []
    for row in rows.sort_values(["model", "truth"]).to_dict("records"):
        left = row["off_ln_k"] - row["prior_pull_ln_k"]
        percents = (row["deviation_ln_k"], row["off_ln_k"], row["prior_pull_ln_k"])
        body.append(
            [
                f"`{row['model']}`",
                f"{row['truth']}",
                f"{row['k_hidden']:.3f}",
                f"{row['k_found']:.3f}",
                f"{100.0 * percents[0]:.1f}",
                *(f"{100.0 * value:+.1f}" for value in (*percents[1:], left)),
                f"{row['chi_square']:.0f}",
            ]
        )
    head = ["model", "truth", "k hidden", "k found", "stated deviation [%]"]
    head += ["off [%]", "pull of the prior [%]", "by the model [%]", "chi-square"]
    caption = f"{rows['campaigns'].mean():.0f} campaigns for each mode."
    return Table(head, body, "", caption)


def sentences_of_models(rows):
    """Say how far each model is off, and what is added for it."""
    texts = []
    for name in MODELS:
        own = rows[rows["model"] == name]
        left = 100.0 * (own["off_ln_k"] - own["prior_pull_ln_k"])
        added = 100.0 * calibration.MODEL_DEVIATION[name]
        texts.append(
            f"By `{name}` the wear coefficient is off by "
            f"{100.0 * own['off_ln_k'].mean():+.1f} % in the mean of {len(own)} "
            f"truths, {left.mean():+.1f} % of it the model ({left.min():+.1f} to "
            f"{left.max():+.1f} %); a coefficient that another scene takes over is "
            f"widened by {added:.0f} % for it."
        )
    return " ".join(texts)


CONTENT = {
    "rigs": (OF_RIGS, table_of_rigs),
    "noises": (OF_NOISES, table_of_noises, sentences_of_noises),
    "models": (OF_MODELS, table_of_models, sentences_of_models),
}
PARTS = {"rigs": of_rigs, "noises": of_noises, "models": of_models}


def main(arguments=None):
    """Compute or read the rows, and write the report."""
    more = {
        name: {"type": int, "metavar": "N", "default": count, "help": f"{name} to run"}
        for name, count in zip(PARTS, (RIGS, NOISES, TRUTHS), strict=True)
    }
    more["work"] = {"type": Path, "metavar": "DIR", "help": "folder of the campaigns"}
    chosen = options(__file__, __doc__, arguments, from_csv=True, more=more)
    tables = {}
    with tempfile.TemporaryDirectory() as scratch:
        for name, compute in PARTS.items():
            file = chosen.out / f"calibration_{name}.csv"
            count = getattr(chosen, name)
            if count and not chosen.from_csv:
                write_csv(compute(count, chosen.work or Path(scratch)), file)
            tables[name] = pd.read_csv(file)
    blocks = [INTRODUCTION]
    for name, (text, *made) in CONTENT.items():
        blocks += [text, *(make(tables[name]) for make in made)]
    blocks.append(LEFT_OUT)
    write_report(chosen.out, __file__, TITLE, blocks)


if __name__ == "__main__":
    main()
