"""Draws of the uncertain inputs of a scene, run as cases, and the bands made of them.

Each draw is a campaign in a run directory of its own, `bands/case_0001` and so on: the
same call goes on after whatever stopped it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from wearsim.campaign.changes import distances_in
from wearsim.campaign.directory import (
    SCENE_FOLDER,
    is_locked,
    locked,
    read_manifest,
    read_status,
)
from wearsim.campaign.record import write_atomically
from wearsim.errors import SceneError
from wearsim.results import load_results
from wearsim.results.checks import percent
from wearsim.scene import CampaignScene, load_campaign
from wearsim.scene.draws import (
    Dimension,
    Drawn,
    dimensions_of,
    draws_of,
    material_overrides,
    overrides_of,
)
from wearsim.scene.input_names import titled
from wearsim.scene.overrides import Override, Overrides, as_overrides
from wearsim.scene.sweep import Case
from wearsim.studies.ensemble import Runner, case_folders, check_cases, outcome_in
from wearsim.studies.learned import Learned, learned_for
from wearsim.texts import text_table, wrapped
from wearsim.translation import bands
from wearsim.translation.bands import FILE, MATERIALS
from wearsim.translation.translate import content_hash
from wearsim.whole_files import NO_FILL, utf8, write_netcdf

FOLDER = "bands"
"""Folder of the draws in a run directory."""

_NOMINAL = 0
"""Number of the case with nominal inputs and the contact models of the draws, where the
scene has others.
"""


@dataclass(frozen=True)
class Plan:
    """Draws of a scene: what is drawn, and the steels."""

    scene: CampaignScene
    base: Path
    dimensions: tuple[Dimension, ...]
    overrides: tuple[Override, ...]  # of all draws
    steels: tuple[tuple[str, tuple[Override, ...]], ...]  # that of the scene first
    standard: (
        bool  # whether the draws have the standard contact models, and the scene others
    )
    learned: Learned | None = None  # draws of a calibration in place of distributions

    def shares(self, count: int) -> np.ndarray:
        """Shares of the distributions of the first draws (count, dimensions)."""
        assert self.scene.uncertainty is not None
        shares = draws_of(len(self.dimensions), count, self.scene.uncertainty.seed)
        for index, values in (self.learned.values if self.learned else {}).items():
            rank = np.argsort(np.argsort(values, kind="stable"), kind="stable")
            shares[:, index] = (rank[:count] + 0.5) / len(values)
        return shares

    def drawn(self, count: int) -> list[list[Drawn]]:
        """Values of the inputs in the first draws."""
        rows = [
            [
                dimension.drawn(float(share))
                for dimension, share in zip(self.dimensions, row, strict=True)
            ]
            for row in self.shares(count)
        ]
        for index, values in (self.learned.values if self.learned else {}).items():
            for row, value in zip(rows, values, strict=False):
                row[index] = float(value)
        return rows

    def cases(self, first: int, count: int) -> list[Case]:
        """Cases of the draws from the first up to `count`, each with every steel."""
        rows, cases = self.drawn(count), []
        for draw in range(first, count):
            drawn = overrides_of(zip(self.dimensions, rows[draw], strict=True))
            for k, (_, steel) in enumerate(self.steels):
                number = 1 + draw * len(self.steels) + k
                cases.append(Case(number, self.base, (*self.overrides, *drawn, *steel)))
        return cases


def plan_of(
    base: Path, overrides: Overrides = (), posterior: str | Path | None = None
) -> Plan:
    """Read what is uncertain in a scene; a SceneError has all faults of it.

    `posterior` is the directory of a calibration whose draws are taken.
    """
    overrides = as_overrides(overrides)
    scene = load_campaign(base, overrides=overrides)
    dimensions = dimensions_of(scene)
    assert scene.uncertainty is not None
    steels = [
        (steel.name, material_overrides(steel)) for steel in scene.uncertainty.material
    ]
    standard = _by_standard(scene)
    draw_overrides = [
        *overrides,
        *([Override("contact.model", "standard")] if standard else []),
    ]
    if hasattr(scene, "compare"):
        draw_overrides.append(Override("compare.causes", False))
    draw_overrides.append(Override("uncertainty", None))
    learned = None if posterior is None else learned_for(scene, dimensions, posterior)
    largest_count = scene.uncertainty.most_draws or scene.uncertainty.draws
    if learned is not None and largest_count > learned.count:
        text = (
            f"{largest_count} draws are more than the {learned.count} of the "
            "posterior; give fewer"
        )
        raise SceneError([scene.fault(("uncertainty", "draws"), text)])
    return Plan(
        scene,
        base,
        dimensions,
        tuple(draw_overrides),
        (("", ()), *steels),
        standard,
        learned,
    )


def run_bands(
    base: str | Path,
    out: str | Path,
    runner: Runner | None = None,
    *,
    overrides: Overrides = (),
    posterior: str | Path | None = None,
) -> tuple[xr.Dataset, pd.DataFrame]:
    """Run the draws of a scene whose campaigns stand in `out`, or continue them.

    Then write the bands.

    Parameters
    ----------
    base : str or Path
        Scene file with [uncertainty].
    out : str or Path
        Run directory of the scene, finished; `bands.nc` and, with steels,
        `materials.csv` are written to it.
    runner : Runner, optional
        Runs the draws, by default one for each core at a time.
    overrides : mapping or sequence of Override
        Values in place of those of the scene file, as of `load_scene`, also for the
        draws.
    posterior : str or Path, optional
        Directory of a calibration whose draws take the place of the distributions of
        the
        inputs that it has learned.

    Returns
    -------
    bands : Dataset
        From `translation.bands.bands_of`.
    steels : DataFrame
        From `translation.bands.rank_materials`; empty without steels.

    Raises
    ------
    SceneError
        With all faults of [uncertainty] and of all draws; nothing is run then.
    ResultError
        If a draw failed, the finished ones are kept; or if another process runs them.
    """
    out = Path(out).absolute()
    all_overrides = [*as_overrides(overrides), *distances_in(out)]
    plan = plan_of(Path(base), all_overrides, posterior)
    with locked(out / FOLDER):
        return _run_draws(plan, out, runner or Runner())


def _run_draws(
    plan: Plan, out: Path, runner: Runner
) -> tuple[xr.Dataset, pd.DataFrame]:
    """Run the draws of a plan, or continue them, and write the bands.

    See `run_bands`.
    """
    section = plan.scene.uncertainty
    assert section is not None
    folder, cases_per_draw = out / FOLDER, len(plan.steels)
    nominal = bands.values_of(_results(out))
    values: dict[int, xr.Dataset] = {}
    ends: dict[int, dict[str, xr.Dataset]] = {}
    done, count, submitted = 0, section.draws, 0
    while True:
        cases = plan.cases(done, count)
        if plan.standard and not done:
            cases.insert(0, Case(_NOMINAL, plan.base, plan.overrides))
        check_cases(cases, folder)
        left = [case for case in cases if not _finished(folder, case, plan.scene)]
        advice = "narrow its distribution, and run the same command again"
        runner.finish(left, folder, f"{len(cases)} draws", advice, submitted)
        submitted += len(left)
        drawn = range(
            1, 1 + count * cases_per_draw, cases_per_draw
        )  # with the scene's own steel
        for case in cases:
            results = _results(folder / case.name)
            ends[case.number] = _steel_results(results)
            if case.number in drawn or case.number == _NOMINAL:
                values[case.number] = bands.values_of(results, nominal)
        band_dataset = bands.bands_of(
            nominal,
            [values[number] for number in drawn],
            plan.shares(count),
            {dimension.name: _choices(dimension) for dimension in plan.dimensions},
            values.get(_NOMINAL),
        )
        sure = bands.sure(band_dataset)
        if sure <= bands.SURE or 2 * count > (section.most_draws or section.draws):
            break
        done, count = count, 2 * count
    band_dataset = _with_attributes(band_dataset, plan, count, sure, runner.command)
    others = {
        name: [ends[number + k] for number in drawn]
        for k, (name, _) in enumerate(plan.steels[1:], 1)
    }
    ranked = pd.DataFrame()
    if others:
        ranked = bands.rank_materials([ends[number] for number in drawn], others)
    advice = "all draws are safe, make room and run it again"
    write_netcdf(
        band_dataset, out / FILE, advice, dict.fromkeys(band_dataset.coords, NO_FILL)
    )
    if len(ranked):
        text = ranked.to_csv(index=False, lineterminator="\n", float_format="%.6g")
        write_atomically(out / MATERIALS, text.encode())
    return band_dataset, ranked


def _choices(dimension: Dimension) -> int:
    """Count the values of an input that is drawn from a list, 0 for others."""
    section = dimension.section
    return len(section.values) if section.distribution == "values" else 0


def _with_attributes(
    band_dataset: xr.Dataset, plan: Plan, count: int, sure: float, command: str
) -> xr.Dataset:
    """Bands with the drawn values, and with what they are of as attributes."""
    section = plan.scene.uncertainty
    assert section is not None
    rows = np.array([[str(value) for value in row] for row in plan.drawn(count)])
    about = {"long_name": "drawn values of the inputs, texts for choices"}
    models = (
        "those of the draws are standard" if plan.standard else "those of the scene"
    )
    sources = [
        f"{uncertain_input.label}: {uncertain_input.source or 'not stated'}"
        for uncertain_input in section.input
    ]
    band_dataset = band_dataset.assign(
        drawn=(("draw", "input"), rows, about)
    ).assign_attrs(
        Conventions="CF-1.11",
        title=utf8(f"bands of {plan.scene.scene.title or plan.base.stem}"),
        history=utf8(command or "wearsim run --bands"),
        seed=section.seed,
        largest_error_over_width=sure,
        contact_models=models,
        input_sources="\n".join(sources),
    )
    if plan.learned is None:
        return band_dataset
    return band_dataset.assign_attrs(
        posterior=plan.learned.source,
        learned=", ".join(plan.learned.taken),
        not_learned=", ".join(plan.learned.left),
    )


def progress_of(out: Path) -> dict[str, Any] | None:
    """Count the draws of a run directory that are done.

    Returns
    -------
    dict or None
        JSON values: state ("not begun", "running", "stopped" or "finished"), and the
        numbers of draws, of those done and of those failed; None for a scene without
        uncertain inputs.
    """
    folder = out / FOLDER
    scene = load_campaign(out / SCENE_FOLDER / read_manifest(out).main, copied=True)
    if scene.uncertainty is None:
        return None
    cases_per_draw, count = 1 + len(scene.uncertainty.material), scene.uncertainty.draws
    last = max(case_folders(folder), default=0)
    while last > count * cases_per_draw:  # draws are doubled until the bands are sure
        count *= 2
    done = failed = 0
    for draw in range(count):
        cases = [
            Case(1 + draw * cases_per_draw + k, scene.origin.path)
            for k in range(cases_per_draw)
        ]
        states = [outcome_in(folder / case.name, case.number).state for case in cases]
        done += states.count("finished") == cases_per_draw
        failed += "failed" in states
    state = "stopped" if folder.is_dir() else "not begun"
    if is_locked(folder):
        state = "running"
    elif done == count and (out / FILE).is_file():
        state = "finished"
    return {"state": state, "draws": count, "done": done, "failed": failed}


def _by_standard(scene: CampaignScene) -> bool:
    """Return True if draws have the standard contact models and the scene others."""
    return any(part.contact.model == "accurate" for part in scene.parts)


@dataclass(frozen=True)
class DrawnResults:
    """Draws of one campaign.

    Parameters
    ----------
    results : tuple of Path
        Result files of the draws with its own steel.
    nominal : Path
        Result file of its own inputs by the contact models of the draws.
    bands : Dataset
        Its bands.
    """

    results: tuple[Path, ...]
    nominal: Path
    bands: xr.Dataset


def draws_in(out: Path) -> DrawnResults | None:
    """Find the draws of the campaign in a run directory; None without its bands."""
    scene = load_campaign(out / SCENE_FOLDER / read_manifest(out).main, copied=True)
    (part,) = scene.parts
    name = part.scene.kind
    stored_bands = bands.known_bands(
        out, {name: content_hash(load_results(out / f"{name}.nc"))}
    )
    if stored_bands[0] is None or scene.uncertainty is None:
        return None
    cases_per_draw = 1 + len(scene.uncertainty.material)
    cases = [
        Case(1 + draw * cases_per_draw, scene.origin.path)
        for draw in range(int(stored_bands[0].attrs["draws"]))
    ]
    files = tuple(out / FOLDER / case.name / f"{name}.nc" for case in cases)
    nominal_file = out / FOLDER / Case(_NOMINAL, scene.origin.path).name / f"{name}.nc"
    nominal = nominal_file if _by_standard(scene) else out / f"{name}.nc"
    if not all(file.is_file() for file in (nominal, *files)):
        return None
    return DrawnResults(files, nominal, stored_bands[0])


def _finished(folder: Path, case: Case, scene: CampaignScene) -> bool:
    """Return True if a draw has been run to the distances of the scene."""
    if outcome_in(folder / case.name, case.number).state != "finished":
        return False
    campaigns = read_status(folder / case.name)["campaigns"]
    targets = [
        (1e3 * part.campaign.distance_km, campaigns[part.scene.kind]["target"])
        for part in scene.parts
    ]
    return all(math.isclose(*pair) for pair in targets)


def _results(directory: Path) -> dict[str, xr.Dataset]:
    files = {role: directory / f"{role}.nc" for role in ("rig", "field")}
    return {role: load_results(file) for role, file in files.items() if file.is_file()}


def _steel_results(results: dict[str, xr.Dataset]) -> dict[str, xr.Dataset]:
    """Select what the ranking of steels takes of the results of a draw.

    Its last states.
    """
    names = ["worn_area", "wear_depth_by_regime", "regime_name"]
    return {
        role: data[names].isel(step=slice(-1, None)) for role, data in results.items()
    }


def text_of(band_dataset: xr.Dataset, ranked: pd.DataFrame) -> str:
    """Lines for people on the bands."""
    lines = [
        f"Bands of {band_dataset.attrs['draws']} draws (90 %):",
        *_band_lines(bands.band_table(titled(band_dataset))),
    ]
    sure = float(band_dataset.attrs["largest_error_over_width"])
    if sure > bands.SURE:
        text = (
            f"warning: the standard error of a quantile is {percent(sure)} of its "
            f"band, above {percent(bands.SURE)}; raise draws or most_draws in "
            "[uncertainty]"
        )
        lines.append(wrapped(text))
    if "learned" in band_dataset.attrs:
        lines.append(f"from the posterior: {band_dataset.attrs['learned']}")
        lines.append(
            f"as the scene states: {band_dataset.attrs['not_learned'] or 'none'}"
        )
    if len(ranked):
        lines += ["", "Worn area over that of the scene's steel:"]
        lines.append(
            ranked.to_string(index=False, float_format=lambda value: f"{value:.4g}")
        )
    return "\n".join(lines)


def _band_lines(table: pd.DataFrame) -> list[str]:
    """Lines of the table of bands: numbers, and below them what they are of."""
    heads = ["nominal", "5%", "50%", "95%"]
    numbers = [["", *(head.replace("%", " %") for head in heads)]]
    abouts = [""]
    for row in table.to_dict("records"):
        unit = "" if row["unit"] == "1" else f" [{row['unit']}]"
        cells = ["" if np.isnan(row[head]) else f"{row[head]:.4g}" for head in heads]
        numbers.append([f"{row['quantity']}{unit}", *cells])
        decided = f"; decided by {row['decided by']}" if row["decided by"] else ""
        abouts.append(wrapped(f"  {row['where']}{decided}", "    "))
    rows = zip(text_table(numbers), abouts, strict=True)
    return [line for pair in rows for line in pair if line]
