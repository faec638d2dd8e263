"""The figures of a report: which axes stand together, what the caption says."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.report import figures, figures_translation
from wearsim.report.style import COLOURS, grid, legend, plain, role_of, shown, style
from wearsim.results.turnings import last_worn_row, turned_rows
from wearsim.translation.axes import at_distances

_FACTOR_POINTS = (
    "area", "max_pressure", "spin", "creepage_x", "force_x", "force_y", "power", "wear_area_rate",
    "wear_depth_rate_max",
)  # fmt: skip
_FACTOR_COLLECTIVE = ("area", "max_pressure", "spin", "power", "wear_index_max")


@dataclass(frozen=True)
class Plate:
    """A finished figure with what is said about it.

    Parameters
    ----------
    name : str
        Unique in the report; file name of the figure.
    section : str
        Section of the report it stands in.
    figure : Figure
        Drawn axes.
    caption : str
        One or two sentences under the figure.
    """

    name: str
    section: str
    figure: Figure
    caption: str


def environment_text(dataset: xr.Dataset) -> str:
    """Environment factor of the points that wear, as a range where they differ."""
    factor = dataset["environment"].values[dataset["weight"].values > 0.0]
    if factor.size == 0:
        return "none: no point wears"
    low, high = float(factor.min()), float(factor.max())
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def environment_note(datasets: list[xr.Dataset]) -> str:
    """One sentence with the environment factors of all campaigns."""
    parts = ", ".join(f"{environment_text(data)} ({role_of(data)})" for data in datasets)
    return f"Wear depths contain the environment factor: {parts}."


def turning_note(datasets: list[xr.Dataset]) -> str:
    """One sentence on what wear depths count from, where wheels of any campaign were turned; else empty."""
    return "Depth counts from the last turning of the wheels." if any(map(turned_rows, datasets)) else ""


def worn_range(datasets: list[xr.Dataset], wheel: int, name: str = "profile_y") -> tuple[float, float]:
    """Limits of a lateral (or arc length) axis around what is worn [shown unit]."""
    low, high = np.inf, -np.inf
    for data in datasets:
        depth = data["wear_depth"].values[last_worn_row(data), wheel]
        x = figures.new_place(data, wheel, against=name)
        worn = x[depth > 0.005 * depth.max()] if depth.max() > 0.0 else x
        low, high = min(low, worn.min()), max(high, worn.max())
    margin = 0.08 * (high - low) + 1e-3
    ends = shown(name, [low - margin, high + margin])
    return float(ends[0]), float(ends[1])


def _ends(datasets: list[xr.Dataset], translation: xr.Dataset | None) -> list[tuple[str, list[float | None]]]:
    """Title of each comparison and the distance of each campaign in it."""
    if translation is None:
        run = shown("distance", datasets[0]["distance"].values[-1])
        return [(f"After {plain(run)} km", [None])]
    pairs: list[tuple[str, list[float | None]]] = []
    for basis, what in enumerate(("Equal distance", "Equal worn depth")):
        end = figures_translation.basis_axis(translation, basis)[-1]
        values = [float(v) for v in translation["distance_run"].values[basis, -1]]
        pairs.append((f"{what}: {plain(end)} {('km', 'mm')[basis]} each", list(values)))
    return pairs


def profiles(datasets: list[xr.Dataset], translation: xr.Dataset | None) -> Plate:
    """Profiles of both wheels overlaid, new and worn, with the difference below."""
    ends = _ends(datasets, translation)
    with style():
        figure, axes = grid(4, len(ends), height=1.6, between=0.42, sharex="col")
        for (column, (title, distances)), wheel in itertools.product(enumerate(ends), (0, 1)):
            top, bottom = axes[2 * wheel : 2 * wheel + 2, column]
            for index, (data, distance) in enumerate(zip(datasets, distances, strict=True)):
                figures.plot_profile(data, top, wheel=wheel, distance=distance, new=index == 0)
                figures.plot_wear_depth(data, bottom, wheel=wheel, distance=distance)
                # the colours are told by the axes above
                bottom.lines[-1].set(label="_worn", linestyle="-")
            if len(datasets) == 2:
                _difference(datasets, distances, bottom, wheel)
            top.set_title(f"{figures.WHEELS[wheel].capitalize()} wheel. {title}")
            top.set_xlabel("")
            if not wheel:
                bottom.set_xlabel("")
        legend(figure, axes[:2, 0], columns=5)
    text = (
        "Profiles of both wheels, new and worn, flange down, each with the wear depth along the normal below"
    )
    if len(datasets) == 2:
        text += " and the difference rig minus field at the same place of the wheel"
    return Plate("profiles", "profiles", figure, f"{text}. {environment_note(datasets)}")


def _difference(datasets: list[xr.Dataset], distances: list[float | None], ax: Axes, wheel: int) -> None:
    """Draw the wear depth of the rig minus that of the field, on the rig's points."""
    rig, field = (
        at_distances(
            np.asarray(data["distance"].values),
            np.asarray(data["wear_depth"].values),
            np.array([data["distance"].values[-1] if distance is None else distance]),
        )[0, wheel]
        for data, distance in zip(datasets, distances, strict=True)
    )
    arc = [data["arc_length"].values for data in datasets]
    x = shown("profile_y", datasets[0]["profile_y"].values[0, wheel])
    difference = shown("wear_depth", rig - np.interp(arc[0], arc[1], field, left=np.nan, right=np.nan))
    ax.plot(x, difference, color=COLOURS["difference"], lw=0.9, label="rig minus field")


def wear_depth(datasets: list[xr.Dataset]) -> Plate:
    """Wear depth of both wheels over lateral position and over arc length, at the end of each campaign."""
    with style():
        figure, axes = grid(2, 2, gap=0.3, sharey=True)
        for row, against in enumerate(("profile_y", "arc_length")):
            for wheel, side in enumerate(figures.WHEELS):
                ax = axes[row, wheel]
                for data in datasets:
                    figures.plot_wear_depth(data, ax, wheel=wheel, against=against, history=True)
                ax.set_xlim(worn_range(datasets, wheel, against))
                ax.set_title(f"{side.capitalize()} wheel")
                if wheel:
                    ax.set_ylabel("")
        legend(figure)
    ends = ", ".join(
        f"{role_of(data)} after {plain(shown('distance', data['distance'].values[-1]))} km"
        for data in datasets
    )
    text = (
        f"Wear depth along the profile: {ends}; faint lines at a quarter, half and three quarters of the way."
    )
    notes = (text, turning_note(datasets), environment_note(datasets))
    return Plate("wear_depth", "wear", figure, " ".join(filter(None, notes)))


def wear_by_regime(datasets: list[xr.Dataset]) -> Plate:
    """Wear depth stacked by regime, one panel per campaign and wheel."""
    with style():
        figure, axes = grid(len(datasets), 2, height=1.8, gap=0.3, sharey="row")
        for row, data in enumerate(datasets):
            for wheel, side in enumerate(figures.WHEELS):
                ax = figures.plot_wear_by_regime(data, axes[row, wheel], wheel=wheel)
                ax.set_xlim(worn_range(datasets, wheel))
                ax.set_title(f"{role_of(data).capitalize()}, {side} wheel")
                if wheel:
                    ax.set_ylabel("")
        legend(figure)
    return Plate(
        "wear_by_regime", "wear", figure,
        "Wear depth at the end of each campaign by the wear regime behind it; the sum is the whole depth.",
    )  # fmt: skip


def _over_distance(
    datasets: list[xr.Dataset], names: tuple[str, ...], name: str, section: str, caption: str
) -> Plate:
    """One row per measure, one column per campaign: their distances may differ a hundredfold."""
    with style():
        figure, axes = grid(
            len(names), len(datasets), height=1.75, gap=0.3, between=0.2, sharey="row", sharex="col"
        )
        for column, data in enumerate(datasets):
            for row, measure in enumerate(names):
                ax = figures.plot_over_distance(data, measure, axes[row, column])
                if column:
                    ax.set_ylabel("")
                if row < len(names) - 1:
                    ax.set_xlabel("")
            axes[0, column].set_title(role_of(data).capitalize())
        legend(figure)
    return Plate(name, section, figure, caption)


def wear_over_distance(datasets: list[xr.Dataset]) -> Plate:
    """Largest depth and worn area over the distance."""
    text = (
        f"Largest wear depth and worn area of each wheel over the distance run. {environment_note(datasets)}"
    )
    return _over_distance(datasets, ("max_wear_depth", "worn_area"), "wear_over_distance", "wear", text)


def measures(datasets: list[xr.Dataset]) -> Plate:
    """Flange height, thickness, gradient and hollowing over the distance."""
    names = ("flange_height", "flange_thickness", "flange_gradient", "hollowing")
    text = (
        "Flange height Sh, flange thickness Sd, flange gradient qR and tread hollowing over the distance run."
    )
    return _over_distance(datasets, names, "measures", "measures", text)


def conicity(datasets: list[xr.Dataset]) -> Plate:
    """Equivalent conicity over the distance."""
    text = "Equivalent conicity at 3 mm amplitude over the distance run; a gap where it is undefined."
    return _over_distance(datasets, ("equivalent_conicity",), "conicity", "measures", text)


def contact(datasets: list[xr.Dataset]) -> Plate:
    """Contact positions and pressures over the shift, rig beside field, new and worn."""
    names = ("wheel_y", "max_pressure", "area", "power")
    with style():
        figure, axes = grid(
            len(names), len(datasets), height=1.75, gap=0.3, between=0.2, sharey="row", sharex=True
        )
        for row, name in enumerate(names):
            for column, data in enumerate(datasets):
                ax = axes[row, column]
                figures.plot_contact(data, name, ax, new=True)
                figures.plot_contact(data, name, ax)
                if row == 0:
                    ax.set_title(role_of(data).capitalize())
                if column:
                    ax.set_ylabel("")
                if row < len(names) - 1:
                    ax.set_xlabel("")
        # hollow and full, round and triangular are told once; the colours are those of the titles
        legend(figure, axes[0, :1])
    text = (
        "Position on the wheel, largest pressure, area and frictional power of every contact patch over the "
        "lateral shift: hollow marks the new wheel, full ones the end of the campaign; monitoring points "
        "included."
    )
    return Plate("contact", "contact", figure, text)


def factors(datasets: list[xr.Dataset], translation: xr.Dataset) -> list[Plate]:
    """All figures of factors: wear, contact of the collective, equal points, along the profile, distance."""
    wear = {"max_wear_depth": "largest wear depth", "worn_area": "worn area", "worn_mass": "worn mass"}
    contact = {}
    for name in _FACTOR_COLLECTIVE:
        text = str(translation[f"{name}_collective"].attrs["long_name"]).removesuffix(", collective mean")
        contact[name] = (f"{name}_collective", -1, text)
    plates = [
        _factor_curves(
            "factors_wear", translation, {name: (name, -1, text) for name, text in wear.items()},
            "Wear factors rig over field at equal distance and at equal worn depth, both wheels. They are "
            f"functions: no single number carries the rig to the field. {environment_note(datasets)}",
        ),
        _factor_curves(
            "factors_contact", translation,
            contact,
            "Contact factors rig over field, mean magnitudes over the load collectives and both wheels. The "
            "environment factor does not enter here.",
        ),
    ]  # fmt: skip
    with style():
        figure, axes = grid(height=2.4)
        figures_translation.plot_equivalent_distance(translation, axes[0, 0])
        legend(figure)
    text = (
        "Field distance that wears both wheels as much as the rig did; it ends where the field campaign does."
    )
    plates.append(Plate("equivalent_distance", "factors", figure, f"{text} {environment_note(datasets)}"))
    position = datasets[0]["profile_y"].values[0]
    with style():
        figure, axes = grid(2, 2, height=1.8)
        for wheel, side in enumerate(figures.WHEELS):
            for basis, what in enumerate(("equal distance", "equal worn depth")):
                ax = axes[wheel, basis]
                figures_translation.plot_depth_factor(
                    translation, position[wheel], ax, basis=basis, wheel=wheel
                )
                figures_translation.mark_one(ax)
                ax.set_xlim(worn_range(datasets, wheel))
                ax.set_title(f"{side.capitalize()} wheel, {what}")
        legend(figure)
    text = (
        "Factor of the wear depth along the profile where the field wears more than 1 % of its largest depth."
    )
    plates.append(Plate("factor_along_profile", "factors", figure, text))
    if int(translation.attrs["matched_points"]):
        plates.append(_factors_at_points(translation))
    return plates


def _factor_curves(
    name: str, translation: xr.Dataset, series: dict[str, tuple[str, int, str]], caption: str
) -> Plate:
    """Factors over distance beside factors over worn depth."""
    with style():
        figure, axes = grid(1, 2, height=2.5)
        for basis, title in enumerate(("Equal distance", "Equal worn depth")):
            ax = axes[0, basis]
            for index, (variable, wheel, text) in enumerate(series.values()):
                figures_translation.plot_factor(
                    translation, variable, ax, basis=basis, wheel=wheel, series=index, text=text
                )
            figures_translation.mark_one(ax)
            ax.set_title(title)
        legend(figure, columns=3)
    return Plate(name, "factors", figure, caption)


def _factors_at_points(translation: xr.Dataset) -> Plate:
    with style():
        figure, axes = grid(3, 3, height=1.8, gap=0.5, between=0.6, sharex=True)
        for ax, name in zip(axes.flat, _FACTOR_POINTS, strict=True):
            for progress in (0, -1):
                figures_translation.plot_factor_at_points(translation, name, ax, progress=progress)
            figures_translation.mark_one(ax)
        for ax in axes[:-1].flat:
            ax.set_xlabel("")
        for ax in axes[:, 1:].flat:
            ax.set_ylabel("")
        legend(figure)
    text = (
        "Factors of contact and wear where both campaigns solve the same operating point: hollow for the new "
        "wheel, full at the end of the common distance. Worn area and wear depth are those of the wear law "
        "per distance run in the point, without environment factor. Where the field value is (nearly) zero "
        "there is no mark."
    )
    return Plate("factors_at_points", "factors", figure, text)


def steps(datasets: list[xr.Dataset]) -> Plate:
    """Step length, stability number and error estimate over the distance."""
    with style():
        names = ["step_length", "stability_number"]
        if any(bool(data["step_error"].notnull().any()) for data in datasets):
            names.append("step_error")
        figure, axes = grid(len(names), len(datasets), height=1.6, between=0.2, sharex="col")
        for column, data in enumerate(datasets):
            for row, name in enumerate(names):
                figures.plot_steps(data, name, axes[row, column])
            axes[0, column].set_title(role_of(data).capitalize())
            for ax in axes[:-1, column]:
                ax.set_xlabel("")
        legend(figure)
    text = (
        "Length of each wear step, its stability number S and the estimated error of its depth, with the "
        "limits the campaign set. The estimate is the difference between rules of first and second order."
    )
    return Plate("steps", "quality", figure, text)


def plates(datasets: list[xr.Dataset], translation: xr.Dataset | None = None) -> list[Plate]:
    """Draw all figures for one campaign, or for rig and field with their translation.

    Parameters
    ----------
    datasets : list of Dataset
        One result, or rig and field.
    translation : Dataset, optional
        Their comparison.

    Returns
    -------
    list of Plate
        In the order of the report.
    """
    found = [
        profiles(datasets, translation),
        wear_depth(datasets),
        wear_over_distance(datasets),
        wear_by_regime(datasets),
        measures(datasets),
        conicity(datasets),
        contact(datasets),
    ]
    if translation is not None:
        found += factors(datasets, translation)
    return [*found, steps(datasets)]
