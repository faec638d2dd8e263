"""Report on the accuracy of contact models, as Markdown: errors by class, worst cases, refusals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearsim.studies.accuracy import ERRORS, FULL_SLIP

_TITLES = {
    "area": "area",
    "max_pressure": "max. pressure",
    "force": "force",
    "power": "power",
    "strip_work": "strip work",
}
_WORST = 5


def classes(dataset: xr.Dataset) -> dict[str, NDArray[np.bool_]]:
    """Classes of cases by the reference's slip share and number of patches.

    Parameters
    ----------
    dataset : Dataset
        From `wearsim.studies.accuracy.solve_accuracy`.

    Returns
    -------
    dict
        Mask over the cases by name; classes without a case are left out.
    """
    slips = dataset["reference_slip_share"].values >= FULL_SLIP
    single = dataset["reference_patches"].values < 1.5
    found = {
        "all": np.ones(slips.size, dtype=bool),
        f"slip below {FULL_SLIP:g}": ~slips,
        f"slip above {FULL_SLIP:g}": slips,
        "single patch": single,
        "split patch": ~single,
    }
    return {name: mask for name, mask in found.items() if mask.any()}


def markdown(dataset: xr.Dataset, command: str, picture: tuple[str, str]) -> str:
    """Write the report.

    Parameters
    ----------
    dataset : Dataset
        From `wearsim.studies.accuracy.solve_accuracy`.
    command : str
        Command line that writes the report.
    picture : (str, str)
        File name and caption of the figure.

    Returns
    -------
    str
        Markdown.
    """
    parts = [
        f"# {dataset.attrs['title']}",
        _introduction(dataset, command),
        "## Errors by class of cases",
        _quantiles(dataset),
        f"![{picture[1]}]({picture[0]})\n\n*{picture[1]}*",
        "## Worst cases of each model",
        *[_worst(dataset, k) for k in range(dataset.sizes["model"])],
        *_refusals(dataset),
    ]
    return "\n\n".join(parts) + "\n"


def _introduction(dataset: xr.Dataset, command: str) -> str:
    shift, yaw = 1e3 * dataset["shift"].values, 1e3 * dataset["yaw"].values
    rails = sorted(
        set(zip(dataset["counterface_profile"].values, dataset["inclination"].values, strict=True))
    )
    radii = sorted({float(kappa) for kappa in dataset["counterface_curvature"].values})
    against = ", ".join("rail" if kappa == 0.0 else f"roller {1e3 / kappa:g} mm" for kappa in radii)
    return (
        f"{dataset.sizes['case']} cases: {dataset.attrs['wheel_profile']} on "
        f"{', '.join(f'{name} {inclination}' for name, inclination in rails)}; {against}; shifts "
        f"{shift.min():g} to {shift.max():g} mm, yaw {yaw.min():g} to {yaw.max():g} mrad, wheel loads "
        f"{_range(dataset['wheel_load'].values * 1e-3)} kN, friction {_range(dataset['friction'].values)}; "
        "right wheel, rotation speed V/r0. Reference: "
        f"`{dataset.attrs['reference']}`.\n\n"
        "Errors are those of the wheel (sums over its patches): of area, maximum pressure and power relative "
        "to the reference; of the creep force, the length of the difference over friction coefficient times "
        "wheel load; of the strip work, the integral over the wheel profile of the absolute difference over "
        "that of the reference, in pieces of 0.2 mm: what decides the shape of worn profiles. Each cell "
        "holds the median and the 95 % quantile of the absolute errors in per cent.\n\n"
        f"Written by `{command}`." + (f"\n\n{dataset.attrs['remarks']}" if dataset.attrs["remarks"] else "")
    )


def _range(values: NDArray[np.float64]) -> str:
    low, high = float(values.min()), float(values.max())
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def _quantiles(dataset: xr.Dataset) -> str:
    lines = [
        "| model | cases | solved | " + " | ".join(_TITLES[name] for name in ERRORS) + " |",
        "|---|---|---|" + "---|" * len(ERRORS),
    ]
    for k, model in enumerate(dataset["model"].values):
        for title, mask in classes(dataset).items():
            answered = mask & (dataset["refusal"].values[k] == "")
            cells = [_spread(dataset[f"error_{name}"].values[k][answered]) for name in ERRORS]
            named = f"`{model}`" if title == "all" else ""
            share = f"{answered.sum()} of {mask.sum()}"
            lines.append(f"| {named} | {title} | {share} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _spread(errors: NDArray[np.float64]) -> str:
    if errors.size == 0:
        return "-"
    middle, most = np.quantile(np.abs(errors), [0.5, 0.95])
    return f"{100.0 * middle:.1f} · {100.0 * most:.1f}"


def case_name(dataset: xr.Dataset, case: int) -> str:
    """Name a case by its counterface and motion.

    Parameters
    ----------
    dataset : Dataset
        From `wearsim.studies.accuracy.solve_accuracy`.
    case : int
        Place in the dataset.

    Returns
    -------
    str
        One line.
    """
    row = dataset.isel(case=case)
    kappa = float(row["counterface_curvature"])
    against = "rail" if kappa == 0.0 else f"roller {1e3 / kappa:g} mm"
    return (
        f"{row['counterface_profile'].item()} {row['inclination'].item()}, {against}, shift "
        f"{1e3 * float(row['shift']):g} mm, yaw {1e3 * float(row['yaw']):g} mrad, "
        f"{1e-3 * float(row['wheel_load']):g} kN"
    )


def _worst(dataset: xr.Dataset, model: int) -> str:
    """Table of the cases with the largest errors of strip work."""
    errors = dataset["error_strip_work"].values[model]
    answered = np.flatnonzero(dataset["refusal"].values[model] == "")
    order = answered[np.argsort(-errors[answered], kind="stable")][:_WORST]
    lines = [
        f"`{dataset['model'].values[model]}`\n",
        "| case | patches | slip share | " + " | ".join(_TITLES[name] for name in ERRORS) + " |",
        "|---|---|---|" + "---|" * len(ERRORS),
    ]
    for case in order:
        values = [100.0 * float(dataset[f"error_{name}"].values[model, case]) for name in ERRORS]
        told = " | ".join(f"{value:+.1f}" for value in values)
        patches = int(dataset["reference_patches"].values[case])
        slip = float(dataset["reference_slip_share"].values[case])
        lines.append(f"| {case_name(dataset, int(case))} | {patches} | {slip:.2f} | {told} |")
    return "\n".join(lines)


def _refusals(dataset: xr.Dataset) -> Sequence[str]:
    lines = []
    for k, model in enumerate(dataset["model"].values):
        told = dataset["refusal"].values[k]
        refused = np.flatnonzero(told != "")
        if refused.size:
            lines.append(
                f"- `{model}` refuses {refused.size} of {told.size} cases, the first: {told[refused[0]]}"
            )
    return ["## Refusals", "\n".join(lines)] if lines else []
