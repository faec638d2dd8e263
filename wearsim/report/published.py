"""Report on published contact cases, as Markdown: published values, ours, half-space ones, differences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearsim.quantities import QUANTITIES
from wearsim.studies.published import TRENDS, trend_exceptions

FloatArray = NDArray[np.float64]

_RATIO_LIMIT = 1e-3
"""Below this share of a column's largest value a difference in per cent says nothing."""

_FIRST = " Half-space solutions are those on the first profile."
_SMALLEST_BASE = 0.01
"""Share of the largest value of a column below which the rail's value is too small for ratios."""

_TOUCH = """
Above, prescribed creepages are held at the pressure-weighted centre of the patch, as everywhere in
wearsim. Held at the point where the undeformed bodies touch, they are others at the centre: the
longitudinal creepage differs by spin times distance.
"""
_VERTICAL = " The half-space solutions carry a vertical load, not a normal force, of the same size."


def markdown(dataset: xr.Dataset, command: str, pictures: Sequence[tuple[str, str]] = ()) -> str:
    """Write the report.

    Parameters
    ----------
    dataset : Dataset
        From `wearsim.studies.published.solve_published`.
    command : str
        Command line that writes the report.
    pictures : sequence of (str, str)
        File name and caption of each figure.

    Returns
    -------
    str
        Markdown.
    """
    parts = [
        f"# {dataset.attrs['title']}",
        _introduction(dataset, command),
        *_motion(dataset),
        *_results(dataset),
        *_touch(dataset),
        *[f"![{caption}]({name})\n\n*{caption}*" for name, caption in pictures],
        *_trends(dataset),
    ]
    return "\n\n".join(parts) + "\n"


def _introduction(dataset: xr.Dataset, command: str) -> str:
    attrs = dataset.attrs
    models = f"normal model `{attrs['normal_model']}`, tangential model `{attrs['tangential_model']}`"
    return (
        f"Published values: {attrs['published_source']}. Ours: {models}, {attrs['strips']} strips of "
        f"{attrs['cells']} cells, normal force {attrs['normal_force'] * 1e-3:g} kN, "
        f"{attrs['speed'] * 3.6:g} km/h, friction {attrs['friction']:g}. Right wheel; z down, y to the "
        "right; forces on the wheel; creepage of the wheel against the counterface."
        f"{_FIRST if 'half_space_centre_area' in dataset else ''}\n\nWritten by `{command}`."
        + (f"\n\n{attrs['remarks']}" if attrs["remarks"] else "")
    )


def case_names(dataset: xr.Dataset) -> list[str]:
    """Name each case by its shift and counterface.

    Parameters
    ----------
    dataset : Dataset
        With `shift` and `counterface_curvature` over `case`.

    Returns
    -------
    list of str
        Such as "3 mm, roller 0.5 m".
    """
    return [
        f"{1e3 * shift:g} mm, " + ("rail" if curvature == 0.0 else f"roller {1.0 / curvature:g} m")
        for shift, curvature in zip(
            dataset["shift"].values, dataset["counterface_curvature"].values, strict=True
        )
    ]


def difference(value: FloatArray, reference: FloatArray) -> list[str]:
    """Differences in per cent; a dash where one is missing or the reference is too small to divide by.

    Parameters
    ----------
    value, reference : (n,) array
        NaN where missing.

    Returns
    -------
    list of str
        Such as "-3.4 %".
    """
    largest = np.nanmax(np.abs(reference), initial=0.0)

    def cell(v: float, r: float) -> str:
        if not np.isfinite(v * r) or abs(r) <= _RATIO_LIMIT * largest:
            return "-"
        return f"{100.0 * (v / r - 1.0):+.1f} %" if v * r > 0.0 else "other sign"

    return [cell(v, r) for v, r in zip(value, reference, strict=True)]


def _shown(name: str, values: FloatArray, digits: int) -> list[str]:
    scaled = values * QUANTITIES[name].shown_factor
    # Adding 0.0 after rounding turns -0.0 into 0.0.
    return [f"{round(v, digits) + 0.0:.{digits}f}" if np.isfinite(v) else "-" for v in scaled]


def _title(name: str) -> str:
    quantity = QUANTITIES[name]
    meaning = quantity.meaning[:1].upper() + quantity.meaning[1:]
    return meaning + ("" if quantity.shown_unit in ("", "1") else f" [{quantity.shown_unit}]")


def _table(head: Sequence[str], columns: Sequence[Sequence[str]]) -> str:
    rows = [head, ["---"] + ["---:"] * (len(head) - 1), *zip(*columns, strict=True)]
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def _missing(dataset: xr.Dataset) -> FloatArray:
    return np.full(dataset.sizes["case"], np.nan)


def _side_by_side(
    dataset: xr.Dataset,
    name: str,
    published: FloatArray,
    ours: FloatArray,
    reference: FloatArray,
    digits: int,
) -> str:
    """Compare published values, ours on each profile (rows of `ours`) and half-space ones of one quantity."""
    head, columns = ["case"], [case_names(dataset)]

    def add(title: str, cells: list[str]) -> None:
        if any(cell != "-" for cell in cells):
            head.append(title)
            columns.append(cells)

    profiles = [str(profile) for profile in dataset["profile"].values]
    add("paper", _shown(name, published, digits))
    for profile, row in zip(profiles, ours, strict=True):
        add(f"wearsim, {profile}", _shown(name, row, digits))
        add("difference to paper", difference(row, published))
    add("half-space", _shown(name, reference, digits))
    add("difference of paper to half-space", difference(published, reference))
    add("difference of wearsim to half-space", difference(ours[0], reference))
    return f"### {_title(name)}\n\n{_table(head, columns)}"


def _motion(dataset: xr.Dataset) -> list[str]:
    """Creepages from the motion beside the published ones."""
    prescribed = dataset["prescribed_creepage"].values
    lateral = bool(prescribed[:, 1].any() or np.abs(dataset["motion_creepage_y"].values).max() > 1e-9)
    parts = [
        "## Creepages",
        "Ours follow from the motion without yaw; the rotation speed is that without longitudinal creepage "
        "at zero shift."
        + ("" if lateral else " Lateral creepage is zero in all cases.")
        + (_VERTICAL if "half_space_kinematics_spin" in dataset else ""),
    ]
    shown = (("creepage_x", 0, 3), *((("creepage_y", 1, 3),) if lateral else ()), ("spin", 2, 4))
    for name, index, digits in shown:
        reference = dataset.get(f"half_space_kinematics_{name}")
        parts.append(
            _side_by_side(
                dataset,
                name,
                prescribed[:, index],
                dataset[f"motion_{name}"].values,
                _missing(dataset) if reference is None else reference.values,
                digits,
            )
        )
    angle = dataset["motion_contact_angle"].values
    reference = dataset.get("half_space_kinematics_contact_angle")
    parts.append(
        _side_by_side(
            dataset,
            "contact_angle",
            _missing(dataset),
            angle,
            _missing(dataset) if reference is None else reference.values,
            2,
        )
    )
    return parts


_TABLES = (
    (
        "## Normal contact",
        (("area", 1), ("max_pressure", 0), ("length", 2), ("width", 2)),
    ),
    (
        "## Tangential contact",
        (("slip_share", 3), ("force_x", 2), ("force_y", 2), ("spin_moment", 1)),
    ),
    ("## Frictional power", (("power", 1),)),
)


def _results(dataset: xr.Dataset) -> list[str]:
    """Results with the creepages prescribed and held at the pressure-weighted centre."""
    parts = []
    for heading, names in _TABLES:
        parts.append(heading)
        for name, digits in names:
            published = dataset.get(f"published_{name}")
            reference = dataset.get(f"half_space_centre_{name}")
            parts.append(
                _side_by_side(
                    dataset,
                    name,
                    _missing(dataset) if published is None else published.values,
                    dataset[name].sel(about="centre").values,
                    _missing(dataset) if reference is None else reference.values,
                    digits,
                )
            )
            if published is not None:
                parts.append(_ratios(dataset, name))
    return [part for part in parts if part]


def ratios_to_rail(dataset: xr.Dataset, values: FloatArray) -> FloatArray:
    """Values over those of the rail case at the same shift.

    NaN for rails, where there is no rail case, and where its value is too small to be divided by.

    Parameters
    ----------
    dataset : Dataset
        With `shift` and `counterface_curvature`.
    values : (..., case) array
        Of one quantity, NaN nowhere.

    Returns
    -------
    (..., case) array
        Ratio roller to rail.
    """
    ratio = np.full(values.shape, np.nan)
    shift, curvature = dataset["shift"].values, dataset["counterface_curvature"].values
    for j in range(shift.size):
        rail = np.flatnonzero((shift == shift[j]) & (curvature == 0.0))
        if rail.size > 0 and curvature[j] != 0.0:
            base = values[..., rail[0]]
            sizable = np.abs(base) > _SMALLEST_BASE * np.max(np.abs(values), axis=-1)
            ratio[..., j] = np.where(sizable, values[..., j] / np.where(sizable, base, 1.0), np.nan)
    return ratio


def _ratios(dataset: xr.Dataset, name: str) -> str:
    """Table of the ratios roller to rail of one quantity, or nothing where no roller has its rail."""
    profiles = [str(profile) for profile in dataset["profile"].values]
    ours = ratios_to_rail(dataset, dataset[name].sel(about="centre").values)
    rollers = np.flatnonzero(np.any(np.isfinite(ours), axis=0))
    if rollers.size == 0:
        return ""
    cases = case_names(dataset)
    head, columns = ["case"], [[cases[j] for j in rollers]]

    def add(title: str, cells: list[str]) -> None:
        head.append(title)
        columns.append(cells)

    def shown(values: FloatArray) -> list[str]:
        return [f"{value:.3f}" if np.isfinite(value) else "-" for value in values]

    published = dataset.get(f"published_{name}")
    paper = None if published is None else ratios_to_rail(dataset, published.values)[rollers]
    if paper is not None:
        add("paper", shown(paper))
    for profile, row in zip(profiles, ours[:, rollers], strict=True):
        add(f"wearsim, {profile}", shown(row))
        if paper is not None:
            add("difference to paper", difference(row, paper))
    if f"half_space_centre_{name}" in dataset:
        reference = ratios_to_rail(dataset, dataset[f"half_space_centre_{name}"].values)[rollers]
        add("half-space", shown(reference))
        if paper is not None:
            add("difference of paper to half-space", difference(paper, reference))
        add("difference of wearsim to half-space", difference(ours[0, rollers], reference))
    return f"Ratio of roller to rail:\n\n{_table(head, columns)}"


def _touch(dataset: xr.Dataset) -> list[str]:
    """Show what changes if creepages are held at the point where the undeformed bodies touch."""
    offset = dataset["touch_offset"].values[0]
    head = ["case", "touching point from centre [mm]"]
    columns = [case_names(dataset), [f"{1e3 * value:+.2f}" for value in offset]]
    for name, digits in (("force_x", 2), ("power", 1)):
        title = f"{QUANTITIES[name].symbol} [{QUANTITIES[name].shown_unit}]"
        if f"published_{name}" in dataset:
            head.append(f"{title} paper")
            columns.append(_shown(name, dataset[f"published_{name}"].values, digits))
        for about in ("centre", "touch"):
            head.append(f"{title} wearsim, {about}")
            columns.append(_shown(name, dataset[name].sel(about=about).values[0], digits))
            if f"half_space_{about}_{name}" in dataset:
                head.append(f"{title} half-space, {about}")
                columns.append(_shown(name, dataset[f"half_space_{about}_{name}"].values, digits))
    return ["## Where creepage is held", " ".join(_TOUCH.split()), _table(head, columns)]


def _trends(dataset: xr.Dataset) -> list[str]:
    if "trend_area" not in dataset:
        return []
    shifts = 1e3 * dataset["trend_shift"].values
    curvatures = dataset["trend_curvature"].values
    radii = ", ".join(f"{1.0 / value:g}" for value in curvatures[1:])
    words = ", ".join(
        f"{QUANTITIES[name].meaning} {'rises' if sign > 0 else 'falls'}" for name, sign in TRENDS.items()
    )
    exceptions = trend_exceptions(dataset)
    count = len(TRENDS) * shifts.size * (curvatures.size - 1)
    text = (
        f"Trends with the curvature of the roller: {words}. Checked from the rail to "
        f"radii of {radii} m one after the other, at shifts from {shifts.min():g} to {shifts.max():g} mm "
        f"(right wheel, all its patches, creepages from the motion, vertical load): {count} steps, "
        f"{len(exceptions)} of them exceptions."
    )
    parts = ["## Trends", text]
    if exceptions:
        patches = dataset["trend_patches"].values
        values = {name: dataset[f"trend_{name}"].values for name in TRENDS}
        parts.append(
            _table(
                ["quantity", "shift [mm]", "from", "to", "change", "patches before and after"],
                [
                    [QUANTITIES[name].meaning for name, _, _ in exceptions],
                    [f"{shifts[i]:g}" for _, i, _ in exceptions],
                    [_radius(curvatures[j - 1]) for _, _, j in exceptions],
                    [_radius(curvatures[j]) for _, _, j in exceptions],
                    [
                        f"{100.0 * (values[n][i, j] / values[n][i, j - 1] - 1.0):+.1f} %"
                        for n, i, j in exceptions
                    ],
                    [f"{patches[i, j - 1]}, {patches[i, j]}" for _, i, j in exceptions],
                ],
            )
        )
        if any(patches[i, j] < patches[i, j - 1] for _, i, j in exceptions):
            parts.append(
                "Where two patches merge into one between two radii, two flexibilities become one, and the "
                "creep forces jump."
            )
    totals = [dataset[f"trend_{name}"].values for name in TRENDS]
    smallest = [[f"{ratio:.3f}" for ratio in total[:, -1] / total[:, 0]] for total in totals]
    parts.append(f"Ratios of the smallest roller ({1.0 / curvatures[-1]:g} m) to the rail:")
    parts.append(
        _table(
            ["shift [mm]", *[QUANTITIES[name].meaning for name in TRENDS]],
            [[f"{shift:g}" for shift in shifts], *smallest],
        )
    )
    return parts


def _radius(curvature: float) -> str:
    return "rail" if curvature == 0.0 else f"{1.0 / curvature:g} m"
