"""Calibration: what measured wheels tell about the uncertain inputs of a scene.

Campaigns are cases of one folder, numbered as they are asked for: the same command
goes on after whatever stopped it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import ndtr

from wearsim.campaign.directory import is_claimed, is_locked, locked
from wearsim.campaign.row import versions
from wearsim.contact.problem import PAIRS
from wearsim.errors import Fault, ResultError, SceneError, raise_any
from wearsim.results import open_results
from wearsim.scene import CampaignScene, FieldScene, RigScene, load_campaign
from wearsim.scene.draws import (
    Dimension,
    dimensions_of,
    of_campaign,
    overrides_of,
    scales_wear,
)
from wearsim.scene.input_names import input_heading, input_title, input_unit
from wearsim.scene.models import RollerSection
from wearsim.scene.overrides import Override, Overrides, as_overrides
from wearsim.scene.prepared import set_points_of
from wearsim.scene.sweep import Case
from wearsim.studies import posterior
from wearsim.studies.ensemble import (
    Report,
    Runner,
    case_folders,
    check_cases,
    outcome_in,
    running_text,
)
from wearsim.studies.learned import FILE, about_input, identity_of, wear_of
from wearsim.studies.measured import GAUGES, Block, Curves, Measured, read_measured
from wearsim.studies.posterior import FloatArray, Mode, Posterior, Response, Run
from wearsim.texts import WIDTH, wrapped
from wearsim.whole_files import NO_FILL, utf8, write_netcdf

FOLDER = "campaigns"
"""Folder of the campaigns in the directory of a calibration."""
MODEL_DEVIATION: Mapping[str, float] = {"fast": 0.15, "standard": 0.03, "accurate": 0.0}
"""Standard deviation of ln of the wear by contact model, against the half-space."""

LARGEST_MEMORY = 4e9
"""Of the covariances of the measurements [bytes]; more is refused before any campaign.
"""

_FIRST_REACH, _REACH = 2.0, 1.05  # of campaigns, over the largest measured distance
_LONGEST_LOOP = 0.05  # of a programme, over the smallest distance, for the clock
_MEASURES = tuple(name for name, *_ in GAUGES.values())


@dataclass(frozen=True)
class Plan:
    """Unknown inputs, campaigns and measurements of a calibration."""

    scene: CampaignScene
    parts: Mapping[str, RigScene | FieldScene]  # those that were measured
    prefixes: Mapping[str, str]  # of keys of the parts, by campaign
    dimensions: tuple[Dimension, ...]  # that act on them
    clocked: NDArray[np.bool_]  # inputs that multiply all wear
    measured: Measured
    overrides: tuple[Override, ...]
    own_models: bool  # whether campaigns have the scene's contact models, else standard

    @property
    def seed(self) -> int:
        """Seed of the draws."""
        assert self.scene.uncertainty is not None
        return self.scene.uncertainty.seed

    def drawn(self, scores: FloatArray) -> list[Any]:
        """Values of the inputs (d,) at scores (d,)."""
        shares = map(float, ndtr(scores))
        pairs = zip(self.dimensions, shares, strict=True)
        return [dimension.drawn(share) for dimension, share in pairs]

    def case(
        self,
        number: int,
        campaign: str,
        scores: FloatArray,
        reach: float,
        *,
        own_models: bool,
    ) -> Case:
        """Campaign of one scene at scores (d,), as far as the reach [m]."""
        part, prefix = self.parts[campaign], self.prefixes[campaign]
        acting = [
            (of_campaign(dimension, prefix), value)
            for dimension, value in zip(
                self.dimensions, self.drawn(scores), strict=True
            )
        ]
        drawn = overrides_of([pair for pair in acting if pair[0].keys])
        km = float(f"{1e-3 * reach:.9g}")
        fixed = [Override(key, None) for key in _unused_tables(part)]
        fixed.append(Override("campaign.distance_km", km))
        if not own_models:
            fixed.append(Override("contact.model", "standard"))
            fixed += [
                Override(f"contact.{key}", None) for key in ("normal", "tangential")
            ]
        return Case(
            number,
            part.origin.path,
            (*self._acting_overrides(campaign), *drawn, *fixed),
        )

    def _acting_overrides(self, campaign: str) -> list[Override]:
        """Select the overrides of the scene that act on a campaign."""
        inactive_tables = {"rig", "field"} - {campaign}
        if self.prefixes[campaign]:
            inactive_tables |= {"scene", "compare", "uncertainty"}
        return [
            override
            for override in self.overrides
            if override.keys[0] not in inactive_tables
        ]

    def scale(self, campaign: str, scores: FloatArray) -> float:
        """Factor [-] of all wear of a campaign at scores (d,), by clocked inputs."""
        factor = 1.0
        prefix = self.prefixes[campaign]
        for index in np.flatnonzero(self.clocked):
            dimension = self.dimensions[index]
            if of_campaign(dimension, prefix).keys:
                factor *= float(dimension.drawn(float(ndtr(scores[index]))))  # type: ignore[arg-type]
        return factor


def _unused_tables(part: RigScene | FieldScene) -> list[str]:
    """Tables of a scene that change no wear."""
    tables = {
        "uncertainty": part.uncertainty,
        "fatigue": part.fatigue,
        "campaign.limits": part.campaign.limits,
        "wear.also_evaluate": part.wear.also_evaluate or None,
        "operation.monitor": part.operation.monitor,
    }
    return [key for key, value in tables.items() if value is not None]


def plan_of(base: Path, table: str | Path, overrides: Overrides = ()) -> Plan:
    """Read the scene and the measurements of a calibration.

    Raises
    ------
    SceneError
        With all faults of the scene, or of the table.
    """
    overrides = as_overrides(overrides)
    scene = load_campaign(base, overrides=overrides)
    section = scene.uncertainty
    if section is None or not section.input:
        text = (
            "a calibration learns about uncertain inputs; write [[uncertainty.input]] "
            "with key and distribution"
        )
        raise SceneError([scene.fault(("uncertainty",), text)])
    dimensions = dimensions_of(scene)
    parts: dict[str, RigScene | FieldScene] = {
        part.scene.kind: part for part in scene.parts
    }
    faults = [
        scene.fault(
            ("uncertainty", "input", index, "distribution"),
            f'"{uncertain_input.label}" is one of some values; a calibration needs '
            "distributions of numbers: run it once for each value",
        )
        for index, uncertain_input in enumerate(section.input)
        if uncertain_input.distribution == "values"
    ]
    faults += [
        part.fault(
            ("campaign", "reprofiling"),
            "a calibration compares wear since one measurement; remove "
            "[campaign.reprofiling], and measure between two of them",
        )
        for part in parts.values()
        if part.campaign.reprofiling is not None
    ]
    raise_any(faults)
    measured = read_measured(table, parts, section.measured)
    _check_memory(measured, table)
    parts = {name: parts[name] for name in measured.campaigns}
    prefixes: dict[str, str] = {
        part.scene.kind: key for key, part in scene.prefixed.items()
    }
    prefixes = {name: prefixes[name] for name in parts}
    used = [
        dimension
        for dimension in dimensions
        if any(of_campaign(dimension, prefix).keys for prefix in prefixes.values())
    ]
    if not used:
        text = (
            f"no uncertain input acts on the {' or '.join(parts)}, which was measured"
        )
        raise SceneError([scene.fault(("uncertainty",), text)])
    clocked = [
        all(
            _has_clock(part, measured.nearest(name))
            and scales_wear(of_campaign(dimension, prefixes[name]), part)
            for name, part in parts.items()
            if of_campaign(dimension, prefixes[name]).keys
        )
        for dimension in used
    ]
    draw_pairs = {PAIRS["fast"], PAIRS["standard"]}
    own_models = all(part.contact.pair in draw_pairs for part in parts.values())
    return Plan(
        scene,
        parts,
        prefixes,
        tuple(used),
        np.array(clocked),
        measured,
        tuple(overrides),
        own_models,
    )


def _check_memory(measured: Measured, table: str | Path) -> None:
    """Raise a SceneError for more measurements than memory is taken for."""
    if measured.memory > LARGEST_MEMORY:
        text = (
            f"{measured.values.size} measured values need {1e-9 * measured.memory:.1f} "
            f"GB of memory, more than {1e-9 * LARGEST_MEMORY:g} GB; leave out "
            "distances, the first and the last ones tell most"
        )
        raise SceneError([Fault(text, str(table))])


def _has_clock(part: RigScene | FieldScene, nearest: float) -> bool:
    """Return True if wear faster by a factor equals that of a longer distance."""
    counterface = part.counterface.wear
    if counterface is not None and (
        not isinstance(part.counterface, RollerSection)
        or getattr(counterface, "redress_every_km", None) is not None
    ):
        return False
    if part.campaign.max_step_km is not None or part.wear.brake_block is not None:
        return False
    if isinstance(part, FieldScene) or part.operation.together:
        return True
    blocks = part.operation.blocks
    loop = sum(float(set_points_of(part, block)["distance"]) for block in blocks)
    return len(blocks) == 1 or loop <= _LONGEST_LOOP * nearest


def calibrate(
    scene: str | Path,
    measured: str | Path,
    out: str | Path,
    executor: Executor | None = None,
    *,
    overrides: Overrides = (),
    jobs: int | None = 1,
    command: str = "",
    report: Report | None = None,
) -> xr.Dataset:
    """Learn about the uncertain inputs of a scene from measured wheels.

    Parameters
    ----------
    scene : str or Path
        File of a rig, field or compare scene whose [uncertainty] has the unknown inputs
        and their distributions.
    measured : str or Path
        Table (CSV) of measurements, see `wearsim.studies.measured.read_measured`.
    out : str or Path
        Directory; `posterior.nc` is written to it, campaigns run in its folder
        `campaigns`. The same call goes on where it stopped.
    executor : concurrent.futures.Executor, optional
        In place of processes of this machine, as of `studies.ensemble.Runner`.
    overrides : mapping or sequence of Override
        Values in place of those of the scene, by dotted keys.
    jobs : int, optional
        Campaigns at a time, each in a process of its own, None for one per core; with
        1 all run in this process. A script that starts processes must begin under
        ``if __name__ == "__main__":``.
    command : str
        Command line, for the history of the results.
    report : callable, optional
        Called with the number of campaigns so far, those of the step included, and the
        outcome of each.

    Returns
    -------
    xarray.Dataset
        `value` (draw, input): draws of the posterior; prior and posterior quantiles of
        each input, correlations, what a further measurement would be worth, and of each
        measured quantity its values and those predicted.

    Raises
    ------
    SceneError
        With all faults of the scene or of the table; nothing is run then.
    ResultError
        If a campaign failed, or the measurements are not those of the scene.

    Examples
    --------
    >>> import wearsim
    >>> posterior = wearsim.calibrate("rig.toml", "measured.csv", "learned")
    >>> posterior["value"].dims
    ('draw', 'input')
    """
    out = Path(out).absolute()
    plan = plan_of(Path(scene), measured, overrides)
    if is_claimed(out):
        raise ResultError(
            f"{out} is the run directory of a campaign; choose another --out"
        )
    with locked(out / FOLDER):
        runner = Runner(executor, jobs, command, report)
        learned = learn(plan, *runs_of(plan, out / FOLDER, runner))
    dataset = dataset_of(plan, learned).assign_attrs(
        Conventions="CF-1.11",
        title=utf8(f"Calibration of {plan.scene.scene.title or Path(scene).stem}"),
        source=versions(),
        history=utf8(command or f"wearsim.calibrate into {str(out)!r} from Python"),
        scene=utf8(Path(scene).name),
        table=utf8(Path(measured).name),
        campaigns=len(case_folders(out / FOLDER)),
    )
    encoding = {name: NO_FILL for name in dataset.coords}
    write_netcdf(dataset, out / FILE, "all campaigns are safe, run it again", encoding)
    return dataset


def progress_of(out: Path) -> dict[str, Any]:
    """Count the campaigns of the directory of a calibration.

    Returns
    -------
    dict
        JSON values: state ("running", "finished", or "stopped", also where the
        measurements were refused), the numbers of campaigns done and failed, and those
        that run now.
    """
    folder = out / FOLDER
    states = [
        outcome_in(path, number).state for number, path in case_folders(folder).items()
    ]
    state = "finished" if (out / FILE).is_file() else "stopped"
    if is_locked(folder):
        state = "running"
    return {
        "state": state,
        "done": states.count("finished"),
        "failed": states.count("failed"),
        "running": running_text(folder),
    }


def runs_of(plan: Plan, folder: Path, runner: Runner) -> tuple[Run, Run]:
    """Functions that run campaigns: as draws are run, and with the scene's models.

    Of a comparison, a campaign on which the changed inputs do not act is not repeated.
    """
    case_of_key: dict[str, Case] = {}  # by scene and overrides

    def run(batch: FloatArray, *, own_models: bool) -> list[Response]:
        done = len(case_of_key)
        first = not done and bool(plan.clocked.any())
        reach = _FIRST_REACH if first else _REACH
        rows = list[dict[str, Case]]()
        for scores in batch:
            row = {}
            for name in plan.parts:
                distance = reach * plan.measured.farthest(name)
                case = plan.case(
                    len(case_of_key) + 1, name, scores, distance, own_models=own_models
                )
                row[name] = case_of_key.setdefault(
                    f"{case.base} {case.overrides}", case
                )
            rows.append(row)
        cases = list(case_of_key.values())[done:]
        if not done:
            check_cases(cases, folder)
        advice = (
            "where a drawn input is out of range, narrow its distribution and choose "
            "another --out"
        )
        runner.finish(cases, folder, f"{len(cases)} campaigns", advice, done)
        return [
            _response(
                plan,
                scores,
                {n: curves_of(folder / c.name / f"{n}.nc") for n, c in row.items()},
            )
            for scores, row in zip(batch, rows, strict=True)
        ]

    return partial(run, own_models=plan.own_models), partial(run, own_models=True)


def _response(
    plan: Plan, campaign_scores: FloatArray, curves: Mapping[str, Curves]
) -> Response:
    """Give the changes (N,) of one campaign, also where the clocked inputs differ."""
    campaign_scores = campaign_scores.copy()

    def response(scores: FloatArray) -> FloatArray:
        scales = {
            n: plan.scale(n, scores) / plan.scale(n, campaign_scores)
            for n in plan.parts
        }
        return plan.measured.predicted(curves, scales)

    return response


def curves_of(path: Path) -> Curves:
    """Read wear depths [m] and measures [SI] of a campaign from its result file."""
    with open_results(path) as data:
        distance, rows = np.unique(data["distance"].values, return_index=True)
        depth = data["wear_depth"].values[rows]
        measures = {name: data[name].values[rows] for name in _MEASURES}
    return Curves(distance, depth, measures)


def learn(plan: Plan, run: Run, run_own: Run) -> Posterior:
    """Find the posterior of a plan.

    Parameters
    ----------
    plan : Plan
    run, run_own : callable
        Campaigns with the contact models of the draws, and with those of the scene.

    Raises
    ------
    ResultError
        If the measurements are not those of the scene, or tell too little.
    """
    measured, noise = plan.measured.values, plan.measured.noise
    start = posterior.start_by_clock(run, measured, noise, plan.clocked)
    mode = posterior.search(run, measured, noise, plan.clocked, start)
    correction: FloatArray | float = 0.0
    for _ in range(0 if plan.own_models else 2):
        scores = mode.scores
        (own_response,), (draws,) = run_own(scores[None]), run(scores[None])
        correction = own_response(scores) - draws(scores)
        mode = posterior.search(run, measured, noise, plan.clocked, scores, correction)
    refuse(plan, mode)
    return posterior.posterior_around(run, measured, mode, plan.seed, correction)


def refuse(plan: Plan, mode: Mode) -> None:
    """Raise a ResultError if the measurements are not those of the scene."""
    reasons = []
    count = plan.measured.values.size
    p = posterior.p_value(mode.chi2, count)
    if p < posterior.LEAST_P:
        reasons.append(
            "the measurements do not agree with the scene: chi-square "
            f"{mode.chi2:.5g} of {count} values (p = {p:.1g}, below "
            f"{posterior.LEAST_P:g}), most {_largest_residual(plan.measured, mode)}; "
            "look for exchanged or mirrored wheels, a wrong new profile, running-in "
            "(from_km), or an input that is uncertain and not listed"
        )
    for dimension, score in zip(plan.dimensions, mode.scores, strict=True):
        if abs(score) >= posterior.BOUND * (1.0 - 1e-9):
            value = float(dimension.drawn(float(ndtr(score))))  # type: ignore[arg-type]
            reasons.append(
                f"{dimension.name} = {value:.4g} is at the bound of its distribution, "
                f"{posterior.BOUND:g} standard deviations off; widen it if that can be"
            )
    if reasons:
        raise ResultError("refused: " + "; ".join(reasons))


def _largest_residual(measured: Measured, mode: Mode) -> str:
    """Say where the residual is largest, over its standard deviation."""
    worst = (0.0, "")
    parts = measured.split(mode.predicted)
    for block, predicted in zip(measured.blocks, parts, strict=True):
        values, deviation = block.placed(predicted)
        residual = values - predicted
        scaled = np.abs(residual) / deviation
        at = np.unravel_index(int(np.argmax(scaled)), scaled.shape)
        km = 1e-3 * block.distance[at[0]]
        place = f"{block.wheel} wheel of the {block.campaign} at {km:g} km"
        if block.quantity == "wear_depth":
            place += (
                f", y = {1e3 * block.y[at[1]]:.3g} mm: {1e6 * residual[at]:.3g} um of "
                "depth"
            )
        else:
            place += f": {block.quantity.replace('_', ' ')}"
        worst = max(worst, (float(scaled[at]), place))
    return f"{worst[1]} left over, {worst[0]:.2g} standard deviations"


QUANTILES = (0.05, 0.5, 0.95)


def dataset_of(plan: Plan, learned: Posterior) -> xr.Dataset:
    """Make the dataset of a posterior."""
    drawn = np.array([plan.drawn(scores) for scores in learned.draws], dtype=np.float64)
    prior = [[dimension.drawn(q) for q in QUANTILES] for dimension in plan.dimensions]
    about = {"units": "1"}
    widths = [_transfer(plan, dimension) for dimension in plan.dimensions]
    variables: dict[str, Any] = {
        "input_name": ("input", [dimension.name for dimension in plan.dimensions]),
        "value": (("draw", "input"), drawn, {"long_name": "draws of the posterior"}),
        "score": (
            ("draw", "input"),
            learned.draws,
            about | {"long_name": "draws as normal scores of the prior"},
        ),
        "prior": (
            ("quantile", "input"),
            np.array(prior, dtype=np.float64).T,
            {"long_name": "quantiles of the prior"},
        ),
        "posterior": (
            ("quantile", "input"),
            np.quantile(drawn, QUANTILES, axis=0),
            {"long_name": "quantiles of the posterior"},
        ),
        "deviation": (
            "input",
            learned.draws.std(axis=0),
            about | {"long_name": "standard deviation of the posterior over the prior"},
        ),
        "correlation": (
            ("input", "other_input"),
            np.atleast_2d(np.corrcoef(learned.draws.T)),
            about | {"long_name": "correlation of the posterior"},
        ),
        "transfer_deviation": (
            "input",
            widths,
            about
            | {"long_name": "standard deviation of ln that is added in another scene"},
        ),
    }
    names, left = next_measurements(plan.measured, learned.mode)
    variables["measurement_name"] = ("measurement", names)
    variables["worth"] = (
        ("measurement", "input"),
        left,
        about
        | {"long_name": "standard deviation with a further measurement, over now"},
    )
    variables |= _measured_and_predicted(plan.measured, learned)
    attrs = {
        "inputs": json.dumps(
            [about_input(dimension, plan.prefixes) for dimension in plan.dimensions]
        ),
        "identities": json.dumps({n: identity_of(p) for n, p in plan.parts.items()}),
        "wear": json.dumps({n: wear_of(p) for n, p in plan.parts.items()}),
        "contact_models": ", ".join(
            f"{n} {_name_of(p.contact.pair)}" for n, p in plan.parts.items()
        ),
        "contact_pairs": json.dumps({n: p.contact.pair for n, p in plan.parts.items()}),
        "files": json.dumps(dict(plan.measured.files)),
        "chi_square": learned.mode.chi2,
        "measurements": plan.measured.values.size,
        "p_value": learned.p_value,
        "effective_draws": learned.effective,
        "surrogate_error": learned.surrogate.error,
        "seed": plan.seed,
    }
    coords = {"quantile": ("quantile", list(QUANTILES), about)}
    return xr.Dataset(variables, coords, attrs)


def model_deviation(pair: tuple[str, str]) -> float:
    """Return the standard deviation of ln of the wear by a contact model pair [-].

    Pairs that are not known against the half-space count like the least exact one.
    """
    deviations = {PAIRS[name]: value for name, value in MODEL_DEVIATION.items()}
    return deviations.get(pair, max(deviations.values()))


def _name_of(pair: tuple[str, str]) -> str:
    """Name of a pair of contact models, as scenes have it."""
    names = {models: name for name, models in PAIRS.items()}
    return names.get(pair, " + ".join(pair))


def _transfer(plan: Plan, dimension: Dimension) -> float:
    """Return the deviation of ln of a scale by the contact model, in another scene."""
    deviations = {
        model_deviation(part.contact.pair)
        for name, part in plan.parts.items()
        if scales_wear(of_campaign(dimension, plan.prefixes[name]), part)
    }
    return max(deviations, default=0.0)


def _measured_and_predicted(measured: Measured, learned: Posterior) -> dict[str, Any]:
    """Variables of what was measured and what is predicted, of each block."""
    variables: dict[str, Any] = {}
    parts = zip(
        measured.blocks,
        measured.split(learned.predictions),
        measured.split(learned.mode.predicted),
        strict=True,
    )
    for block, bands, predicted in parts:
        name = f"{block.campaign}_{block.wheel}_{block.quantity}"
        dims = (f"{name}_distance", f"{name}_point")
        unit = {"units": "kg" if block.quantity == "worn_mass" else "m"}
        metres = {"units": "m"}
        values, deviation = block.placed(predicted)
        variables[dims[0]] = (
            dims[0],
            block.distance,
            metres | {"long_name": "distance run"},
        )
        variables[f"{name}_y"] = (
            dims[1],
            block.y,
            metres | {"long_name": "place on the wheel"},
        )
        text = (
            f"{block.quantity.replace('_', ' ')}, change since {1e-3 * block.start:g} "
            "km"
        )
        variables[f"{name}_measured"] = (dims, values, unit | {"long_name": text})
        variables[f"{name}_predicted"] = (
            ("quantile", *dims),
            bands,
            unit | {"long_name": f"{text}, predicted by the draws"},
        )
        variables[f"{name}_deviation"] = (
            dims,
            deviation,
            unit | {"long_name": "standard deviation of measured less predicted"},
        )
    return variables


def next_measurements(measured: Measured, mode: Mode) -> tuple[list[str], FloatArray]:
    """Find what further measurements would leave of each standard deviation.

    Returns
    -------
    names : list of str
        Each measured distance once more, and twice as far, all quantities there.
    left : (names, d) array
        Standard deviation with it over that without. Twice as far from the first
        measurement, wear is taken to go on as it has.
    """
    names, rows = list[str](), list[FloatArray]()
    for campaign in measured.campaigns:
        blocks = [block for block in measured.blocks if block.campaign == campaign]
        for at in sorted({float(s) for block in blocks for s in block.distance}):
            more = measured
            for block in blocks:
                index = np.flatnonzero(block.distance == at)
                if index.size:
                    more = more.again(block, int(index[0]))
            names.append(f"{campaign} at {1e-3 * at:g} km once more")
            whiten = more.noise(mode.predicted)
            rows.append(
                posterior.worth(mode.jacobian, mode.whiten, mode.jacobian, whiten)
            )
        more, jacobian, predicted = _at_double_distance(measured, mode, campaign)
        names.append(f"{campaign} at {1e-3 * more.farthest(campaign):g} km, too")
        whiten = more.noise(predicted)
        rows.append(posterior.worth(mode.jacobian, mode.whiten, jacobian, whiten))
    return names, np.array(rows)


def _at_double_distance(
    measured: Measured, mode: Mode, campaign: str
) -> tuple[Measured, FloatArray, FloatArray]:
    """Add a measurement twice as far from the first, with derivatives, predictions."""
    farthest = measured.farthest(campaign)
    blocks, derivatives, predictions = list[Block](), [], []
    parts = zip(
        measured.blocks,
        measured.split(mode.jacobian.T),
        measured.split(mode.predicted),
        strict=True,
    )
    for block, derivative, predicted in parts:
        if block.campaign == campaign:
            end = block.start + 2.0 * (farthest - block.start)
            ratio = (end - block.start) / (block.distance[-1] - block.start)
            block = replace(
                block,
                distance=np.append(block.distance, end),
                values=np.concatenate([block.values, ratio * block.values[-1:]]),
                counts=np.append(block.counts, 1.0),
            )
            more = ratio * derivative[:, -1:]
            derivative = np.concatenate([derivative, more], axis=1)
            predicted = np.concatenate([predicted, ratio * predicted[-1:]])
        blocks.append(block)
        derivatives.append(derivative.reshape(len(derivative), -1))
        predictions.append(predicted.reshape(-1))
    jacobian = np.concatenate(derivatives, axis=1).T
    return (
        replace(measured, blocks=tuple(blocks)),
        jacobian,
        np.concatenate(predictions),
    )


def table_of(dataset: xr.Dataset) -> list[dict[str, Any]]:
    """Rows of the inputs: name, unit, prior and posterior quantiles, deviation, remark.

    The unit is that of the values: that of the key, "factor" for what multiplies its
    value in the scene, with "added" for what is added to it.
    """
    rows, units = [], list(map(_unit_of, json.loads(dataset.attrs["inputs"])))
    for index, name in enumerate(dataset["input_name"].values):
        deviation = float(dataset["deviation"].values[index])
        rows.append(
            {
                "input": str(name),
                "unit": units[index],
                "prior": dataset["prior"].values[:, index].tolist(),
                "posterior": dataset["posterior"].values[:, index].tolist(),
                "deviation": deviation,
                "remark": "prior returned" if deviation > PRIOR_RETURNED else "",
            }
        )
    return rows


def _unit_of(about: Mapping[str, Any]) -> str:
    """Give the unit of the values of an input that `about_input` describes."""
    if about["acts"] == "factor":
        return "factor"
    unit = input_unit(about["key"])
    return f"{unit} added".strip() if about["acts"] == "addition" else unit


PRIOR_RETURNED = 0.9
"""Deviation over that of the prior from which on measurements tell nothing."""


def text_of(dataset: xr.Dataset) -> str:
    """Lines for people on a posterior."""
    heads = (
        "input",
        "unit",
        "prior 5 %",
        "50 %",
        "95 %",
        "posterior 5 %",
        "50 %",
        "95 %",
        "sd/prior",
    )
    table = table_of(dataset)
    rows = [
        [
            input_title(row["input"]),
            row["unit"],
            *(f"{value:.4g}" for value in (*row["prior"], *row["posterior"])),
            f"{row['deviation']:.2f}",
        ]
        for row in table
    ]
    remarks = ["", *(row["remark"] for row in table)]
    widths = [max(len(row[k]) for row in [*rows, heads]) for k in range(len(heads))]
    lines = []
    for row, remark in zip([list(heads), *rows], remarks, strict=True):
        cells = [
            cell.ljust(width) if k < 2 else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        if len("  ".join(cells)) > WIDTH:  # the name has a line of its own
            lines.append(row[0])
            cells[0] = ""
        lines.append("  ".join(cells))
        lines += [f"  {remark}"] if remark else []
    attrs = checks_of(dataset)
    checks = (
        f"chi-square {attrs['chi_square']:.4g} of {attrs['measurements']} values "
        f"(p = {attrs['p_value']:.2g}), {attrs['campaigns']} campaigns, "
        f"{attrs['effective_draws']:.0f} effective draws, error of the polynomial "
        f"{attrs['surrogate_error']:.2f} of the noise"
    )
    lines += [wrapped(line) for line in (checks, *transfer_notes(dataset))]
    return "\n".join(lines)


def checks_of(dataset: xr.Dataset) -> dict[str, Any]:
    """Figures by which a posterior is accepted, as JSON values."""
    names = ("chi_square", "p_value", "effective_draws", "surrogate_error")
    counts = {name: int(dataset.attrs[name]) for name in ("measurements", "campaigns")}
    return {name: float(dataset.attrs[name]) for name in names} | counts


def transfer_notes(dataset: xr.Dataset) -> list[str]:
    """Say what is added to a scale before it is used in another scene."""
    pairs = zip(
        dataset["input_name"].values, dataset["transfer_deviation"].values, strict=True
    )
    return [
        f"{input_heading(str(name))}: in another scene a standard deviation of "
        f"{100.0 * width:.0f} % is added for the contact model "
        f"({dataset.attrs['contact_models']})"
        for name, width in pairs
        if width > 0.0
    ]
