"""Content of one result file: summary as a dict or as text, figures of the report."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from wearsim.errors import ResultError
from wearsim.profile.conicity import JUDGED_AMPLITUDE
from wearsim.quantities import QUANTITIES, kilometres
from wearsim.report import learned, service_life, tables_damage, zones
from wearsim.report.figures.campaign import WHEELS
from wearsim.report.html import Campaigns, all_figures
from wearsim.report.plates import COUNTERFACE_MEASURES, Plate
from wearsim.report.rail_wear import rail_summary, rail_text
from wearsim.report.style import (
    capital,
    in_terminal,
    plain,
    role_of,
    save_svg,
    with_unit,
)
from wearsim.report.tables import MEASURES, UNDEFINED, limit_text, setting_text
from wearsim.report.texts import environment, stated_warnings, wears, words
from wearsim.results import checks, load_results, loaded, result_warnings
from wearsim.results.fatigue import largest_index, quantity_of
from wearsim.results.limits import distances_to, limits_met
from wearsim.results.service_life import service_life as life_of
from wearsim.results.settings import SETTINGS
from wearsim.texts import wrapped
from wearsim.whole_files import json_value

_ALONG = {
    "comparison": {"max_wear_depth": "comparison_wear_depth"},
    "fatigue": {name: name for name in ("fatigue_damage", "fatigue_damage_rate")},
}
"""Variables along the profile of which the largest value is listed, by the laws' group
and its name there.
"""
_CONTACT = ("area", "max_pressure", "power", "spin")


def inspect(results: str | Path | xr.Dataset) -> dict[str, Any]:
    """Summarise a result.

    Parameters
    ----------
    results : str, Path or Dataset
        Result file of a campaign, finished or not, or a result as
        `wearsim.open_results` gives it.

    Returns
    -------
    dict
        Ready for JSON: SI units, lists are (right, left), null where a value is
        undefined. Wear measures at the start ("new") and at the end ("worn"), extremes
        of the contact over all patches at the end; of a campaign that ends with a
        reprofiling, in the state before it.

    Raises
    ------
    ResultError
        If the file is missing, damaged or not a whole result of this version of
        wearsim.

    Examples
    --------
    >>> import wearsim
    >>> found = wearsim.inspect("out/rig.nc")
    >>> found["kind"], found["distance"]
    ('rig', 2000.0)
    >>> right, left = found["worn"]["flange_thickness"]
    >>> 32e-3 < right < 33e-3
    True
    """
    return summary(loaded(results))


def summary(dataset: xr.Dataset) -> dict[str, Any]:
    """Summarise a loaded result, see `inspect`."""
    end = checks.last_worn_row(dataset)
    measures, stated = (*MEASURES, "equivalent_conicity"), words("variables")["inspect"]
    depth = checks.depth_by_regime(dataset).sum(axis=0)
    share = depth / depth.sum() if depth.sum() > 0.0 else np.full(depth.shape, np.nan)
    closing = [text] if (text := checks.closing_reprofiling(dataset)) else []
    content: dict[str, Any] = {
        "title": str(dataset.attrs.get("title", "")),
        "kind": role_of(dataset),
        "finished": "finished" in dataset.attrs,
        "distance": dataset["distance"].values[-1],
        "distance_since_reprofiling": _since_reprofiling(dataset, end),
        "steps": checks.wear_steps(dataset),
        "step_limits": checks.step_limits(dataset),
        "operating_points": dataset.sizes["operating_point"],
        "monitoring_points": int((dataset["weight"].values == 0.0).sum()),
        "environment": _ends(dataset["environment"].values),
        "warnings": [*stated_warnings(dataset), *result_warnings(dataset), *closing],
        "settings": {key: dataset.attrs[key] for key in stated if key in dataset.attrs},
        "new": {name: dataset[name].values[0] for name in measures},
        "worn": {name: dataset[name].values[end] for name in measures},
        "contact": {
            name: _ends(np.abs(dataset[name].values[end]))
            for name in (*_CONTACT, *_balanced(dataset))
        },
        "regime_share": dict(zip(dataset["regime_name"].values, share, strict=True)),
        "ended": str(dataset.attrs.get("finished", "")) or None,
        "limits": {
            limit.name: {"limit": limit.limit, "met": limit.distance}
            for limit in limits_met(dataset)
        },
        "conicity_amplitude": float(
            dataset.attrs.get("conicity_amplitude", JUDGED_AMPLITUDE)
        ),
        "first_limit": _first_limit(dataset),
        "reprofilings": checks.reprofilings(dataset),
        "service_life": life_of(dataset),
        "wear_by_zone": zones.zones(dataset),
        "cracks_left": checks.cracks_left(dataset),
        "rail_wear": rail_summary(dataset),
    }
    if "comparison_name" in dataset or "fatigue_name" in dataset:
        content["damage"] = _damage(dataset)
    if wears(dataset):
        count = int(dataset["counterface_redressed_count"].values[-1])
        ends = {name: dataset[name].values[-1] for name in COUNTERFACE_MEASURES}
        content["counterface"] = {"counterface_redressed_count": count, **ends}
    return dict(json_value(content))


def _balanced(dataset: xr.Dataset) -> list[str]:
    """Variables of results whose wheelsets run where their forces are balanced."""
    name = "force_residual"
    holds = name in dataset and np.isfinite(dataset[name].values).any()
    return [name] if holds else []


def _since_reprofiling(dataset: xr.Dataset, row: int) -> float | None:
    """Distance of a row from the last reprofiling before it [m], None before one."""
    run, start = dataset["distance"].values, checks.new_row(dataset, row)
    return float(run[row] - run[start]) if start else None


def _first_limit(dataset: xr.Dataset) -> dict[str, Any] | None:
    """Limit that is met first, by which wheel, or at the mean rate so far would be."""
    firsts = []
    for limit in limits_met(dataset):
        at, met = distances_to(dataset, limit)
        side = int(np.argmin(at))
        first = {"name": limit.name, "limit": limit.limit, "distance": at[side]}
        first["wheel"] = WHEELS[side] if at.size == len(WHEELS) else None
        firsts.append({**first, "met": bool(met[side])})
    return min(firsts, key=lambda first: first["distance"], default=None)


def _damage(dataset: xr.Dataset) -> dict[str, Any]:
    """Wear by comparison laws and damage by fatigue laws, lists are (right, left)."""
    end = checks.last_worn_row(dataset)
    damage_by: dict[str, Any] = {}
    for group, variables in _ALONG.items():
        if f"{group}_name" in dataset:
            largest = {
                name: dataset[of].values[end].max(axis=2)
                for name, of in variables.items()
            }
            damage_by[group] = {
                law: {name: values[:, k] for name, values in largest.items()}
                for k, law in enumerate(dataset[f"{group}_name"].values)
            }
    if "fatigue" in damage_by:
        damage_by["fatigue_index"] = {
            law: _index(dataset, k, law) for k, law in enumerate(damage_by["fatigue"])
        }
        life = tables_damage.life(dataset)
        if life is not None:
            damage_by["life"] = dict(
                zip(life.frame.iloc[:, 0], life.frame["Life ends by"], strict=True)
            )
    return damage_by


def _index(dataset: xr.Dataset, k: int, law: str) -> dict[str, Any]:
    """Largest index of a law with its place and point, lists are (right, left)."""
    indexes = largest_index(dataset, checks.last_worn_row(dataset), k)
    keys = (quantity_of(law), "fatigue_index_y", "operating_point_name")
    return {
        key: [None if largest is None else largest[i] for largest in indexes]
        for i, key in enumerate(keys)
    }


def summary_text(content: dict[str, Any], details: bool = True) -> str:
    """Write a summary from `inspect` for a terminal, in the units people read.

    Without details it ends with the wheels, their limits and the warnings.
    """
    template = environment(autoescape=False).get_template("summary.txt.j2")
    text = template.render(
        c=content,
        details=details,
        measures=MEASURES,
        title=_title,
        text=_text,
        texts=_texts,
        span=_span,
        verdict=_verdict(content),
        life=service_life.summary_lines(content["service_life"]),
        settings=[_setting_line(*pair) for pair in content["settings"].items()],
        zones=zones.summary_lines(content["wear_by_zone"], details),
        wrapped=wrapped,
        limit_text=limit_text,
        kilometres=kilometres,
        diameter=lambda value: UNDEFINED if value is None else f"{1e3 * value:.2f}",
    )
    rails = rail_text(content) if details else ""
    return "\n\n".join(filter(None, [text.rstrip("\n"), rails]))


def _verdict(content: dict[str, Any]) -> str:
    """End of a campaign, the wheel that has worn deepest, and the first limit."""
    distance = kilometres(content["distance"])
    ended = f" ({content['ended']})" if content["ended"] else ""
    state = f"finished, {distance}{ended}"
    if not content["finished"]:
        state = f"unfinished, {distance} so far"
    depths = content["worn"]["max_wear_depth"]
    worst = int(np.argmax(depths))
    wheel = f"{WHEELS[worst]} wheel {_text('max_wear_depth', depths[worst])} mm deep"
    since = content["distance_since_reprofiling"]
    if since is not None:
        wheel += f" in {kilometres(since)} since reprofiling"
    return f"{content['kind']}: {state}; {wheel}; {_limit_verdict(content)}"


def _limit_verdict(content: dict[str, Any]) -> str:
    first = content["first_limit"]
    if first is None:
        return "no limits stated"
    name = QUANTITIES[first["name"]].meaning.removesuffix(" of the wheel")
    wheel = f" ({first['wheel']})" if first["wheel"] else ""
    if first["distance"] is None:  # null in JSON: infinite
        return "no limit in sight"
    km = kilometres(first["distance"])
    when = f"met at {km}" if first["met"] else f"not met, after about {km}"
    return f"first limit: {name}{wheel}, {when}"


def _setting_line(name: str, value: Any) -> str:
    """Write an attribute of a result with its words, in the unit people read."""
    setting = SETTINGS[name]
    text, head = setting_text(value, setting), capital(setting.title)
    if isinstance(value, str):
        return f"{head}: {text}"
    if setting.quantity is not None:
        head = with_unit(setting.title, setting.quantity.name)
    return f"{head}: {in_terminal(text)}"


def _texts(name: str, ends: list[float | None]) -> list[str]:
    return [_text(name, value) for value in ends]


def write_figures(path: str | Path, directory: str | Path) -> list[Path]:
    """Write the figures of the report for one result file as SVG to a folder.

    It is made if it is not there.
    """
    dataset = load_results(path)
    return _written(all_figures(Campaigns([dataset])), Path(directory), Path(path).stem)


def write_learned_figures(calibration: xr.Dataset, directory: Path) -> list[Path]:
    """Write the figures of a calibration as SVG to a folder, made if missing."""
    return _written(list(learned.figures(calibration)), directory, "posterior")


def _written(plates: list[Plate], directory: Path, stem: str) -> list[Path]:
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ResultError(
            f"{directory}: figures cannot be written: {error.strerror}; choose another "
            "folder"
        ) from error
    return [
        save_svg(plate.figure, directory / f"{stem}_{plate.name}.svg")
        for plate in plates
    ]


def write_animation(path: str | Path, target: Path) -> Path:
    """Write the running wear of one result file as a GIF, see `animate_wear`."""
    from wearsim.report.figures.animation import animate_wear

    return animate_wear(load_results(path), target)


def _ends(values: np.ndarray) -> tuple[float, float]:
    finite = values[np.isfinite(values)]
    return (
        (float(finite.min()), float(finite.max())) if finite.size else (np.nan, np.nan)
    )


def _title(name: str) -> str:
    return with_unit(QUANTITIES[name].meaning.removesuffix(" of the wheel"), name)


def _text(name: str, value: float | None) -> str:
    if value is None:
        return UNDEFINED
    return in_terminal(plain(value * QUANTITIES[name].shown_factor))


def _span(name: str, ends: list[float | None]) -> str:
    low, high = _texts(name, ends)
    return low if low == high else f"{low} to {high}"
