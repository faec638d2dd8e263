"""The figures of a report: which axes stand together.

Captions are in `templates/texts.toml`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.damage.titles import law_title
from wearsim.report.figures import campaign, translation
from wearsim.report.figures import wheels as page_one
from wearsim.report.figures.campaign import WHEELS
from wearsim.report.shares import wear_shares
from wearsim.report.style import (
    COLOURS,
    capital,
    colour_of,
    panels,
    plain,
    role_of,
    role_title,
    shown,
)
from wearsim.report.texts import caption, wears, words
from wearsim.results.checks import depth_by_regime, last_worn_row
from wearsim.translation.bands import PER_KM, asked_of
from wearsim.translation.compare import CAMPAIGN

BASES = ("Equal distance", "Equal worn depth", "Equal worn area")
COUNTERFACE_MEASURES = (
    "counterface_max_wear_depth",
    "counterface_worn_area",
    "counterface_redressed_depth",
)

Datasets = Sequence[xr.Dataset]


@dataclass(frozen=True)
class Plate:
    """A finished figure, its name (unique in the report, file name) and its caption."""

    name: str
    figure: Figure
    caption: str

    macro = "figure"


def plate(
    draw: Callable[..., Figure | None], datasets: Datasets, of: xr.Dataset | None = None
) -> Plate | None:
    """Draw one of the figures below, of its function's name.

    None if there is nothing to draw.

    Figures of factors or bands are drawn from the dataset `of`; others add to theirs
    what it has.
    """
    figure, name = draw(datasets) if of is None else draw(datasets, of), draw.__name__
    text = caption("figure", name, datasets=datasets, of=of)
    return None if figure is None else Plate(name, figure, text)


def _range(
    places: list[np.ndarray], depths: list[np.ndarray], margin: float
) -> tuple[float, float]:
    """Limits of an axis around what is worn, with a margin besides 8 %."""
    worn = [
        x[d > 0.005 * d.max()] if d.max() > 0.0 else x
        for x, d in zip(places, depths, strict=True)
    ]
    low, high = min(float(x.min()) for x in worn), max(float(x.max()) for x in worn)
    margin += 0.08 * (high - low)
    return low - margin, high + margin


def worn_range(datasets: Datasets, wheel: int) -> tuple[float, float]:
    """Limits of a lateral axis around what is worn [shown unit]."""
    places = [campaign.new_place(data, wheel) for data in datasets]
    depths = [
        data["wear_depth"].values[last_worn_row(data), wheel] for data in datasets
    ]
    low, high = shown("profile_y", _range(places, depths, 1e-3))
    return float(low), float(high)


def _by_wheel(
    rows: Sequence[tuple[xr.Dataset, Callable[..., Axes], str]],
    *,
    sharey: bool | str = "row",
    key_columns: int = 4,
    alike: bool = False,
) -> Figure:
    """Draw both wheels in each row of (dataset, function, more in the title).

    `alike`: all on one range.
    """

    def draw(ax: Axes, row: int, wheel: int) -> None:
        data, plot, more = rows[row]
        plot(data, ax, wheel=wheel).set_xlim(
            worn_range([dataset for dataset, *_ in rows] if alike else [data], wheel)
        )
        ax.set_title(f"{role_title(data)}, {WHEELS[wheel]} wheel{more}")

    return panels(
        len(rows), 2, draw, height=1.8, gap=0.3, sharey=sharey, key_columns=key_columns
    )


def _by_campaign(
    datasets: Datasets,
    plot: Callable[..., object],
    names: Sequence[str] | None = None,
    **options: Any,
) -> Figure:
    """Draw one column per campaign (distances may differ a hundredfold).

    Also one row per quantity, if any.
    """

    def draw(ax: Axes, row: int, column: int) -> None:
        quantity = (names[row],) if names else ()
        plot(datasets[column], *quantity, ax)
        if not row:
            ax.set_title(role_title(datasets[column]))

    usual: dict[str, Any] = {
        "height": 1.75,
        "gap": 0.3,
        "between": 0.2,
        "sharey": "row",
        "sharex": "col",
    }
    return panels(len(names or "1"), len(datasets), draw, **usual | options)


def wheels(datasets: Datasets, bands: xr.Dataset | None = None) -> Figure:
    """Profiles of both wheels in true scale, and the wear depth on the same axis."""

    def draw(ax: Axes, row: int, _: int) -> None:
        if row:
            page_one.plot_depths(datasets, ax, bands=bands)
            for line in ax.lines:  # the legend has them from the shapes
                line.set_label("_")
        else:
            page_one.plot_shapes(datasets, ax)

    lines = 1 + len(datasets) + (bands is not None)
    return panels(
        2,
        1,
        draw,
        sharex=True,
        width=5.6,
        height=1.95,
        between=0.15,
        edges=(0.75, 0.1, 0.45, 0.1 + 0.17 * lines),
        key_columns=2,
    )


def main_causes(datasets: Datasets, factors: xr.Dataset | None = None) -> Figure | None:
    """Draw the causes of the factor, else the blocks or classes that wear most."""
    if factors is not None and "cause_factor" in factors:
        return panels(
            1,
            1,
            lambda ax, *_: translation.plot_causes(factors, ax),
            width=5.6,
            height=0.3 + 0.24 * factors.sizes["cause"],
            edges=(0.1, 0.1, 0.45, 0.1),
            keys=(),
        )
    worn = [data for data in datasets if len(wear_shares(data))]
    if not worn:
        return None
    shares = [wear_shares(data) for data in worn]

    def draw(ax: Axes, row: int, _: int) -> None:
        page_one.plot_shares(shares[row], ax, colour=colour_of(worn[row]))
        if len(worn) > 1:
            ax.set_title(role_title(worn[row]))

    return panels(
        len(worn),
        1,
        draw,
        width=5.6,
        height=0.2 + 0.24 * max(map(len, shares)),
        sharex=True,
        between=0.3,
        edges=(0.1, 0.1, 0.45, 0.45),
        keys=(0,),
    )


def profiles(datasets: Datasets, factors: xr.Dataset) -> Figure:
    """Wear depth of both campaigns at equal distance and at equal worn depth.

    With its difference, rig minus field.
    """

    def draw(ax: Axes, wheel: int, basis: int) -> None:
        distances = list(map(float, factors["distance_run"].values[basis, -1]))
        for data, distance in zip(datasets, distances, strict=True):
            campaign.plot_wear_depth(data, ax, wheel=wheel, distance=distance)
            # the title names the wheel
            ax.lines[-1].set(label=role_of(data), linestyle="-")
        _difference(datasets, distances, ax, wheel)
        ax.set_ylim(auto=True)
        end = plain(translation.basis_axis(factors, basis)[-1], 3)
        ax.set_title(
            f"{WHEELS[wheel].capitalize()} wheel. {BASES[basis]}: {end} "
            f"{('km', 'mm')[basis]} each"
        )
        ax.set_xlim(worn_range(datasets, wheel))

    options: dict[str, Any] = {"sharex": "col", "outer": True}
    return panels(2, 2, draw, between=0.42, gap=0.6, key_columns=3, **options)


def _difference(
    datasets: Datasets, distances: Sequence[float], ax: Axes, wheel: int
) -> None:
    """Draw the wear depth of the rig minus that of the field, on the rig's points."""
    rig, field = (
        campaign.along(data, "wear_depth", distance)[wheel]
        for data, distance in zip(datasets, distances, strict=True)
    )
    arc = [data["arc_length"].values for data in datasets]
    x = shown("profile_y", datasets[0]["profile_y"].values[0, wheel])
    difference = shown(
        "wear_depth", rig - np.interp(arc[0], arc[1], field, left=np.nan, right=np.nan)
    )
    ax.plot(x, difference, color=COLOURS["difference"], lw=0.9, label="rig minus field")


def wear_depth(datasets: Datasets, bands: xr.Dataset | None = None) -> Figure:
    """Wear depth of both wheels over lateral position.

    At the end of each campaign, with its band.
    """

    def draw(ax: Axes, _: int, wheel: int) -> None:
        for data in datasets:
            campaign.plot_wear_depth(data, ax, wheel=wheel, history=True)
            if bands is not None:
                translation.plot_depth_band(bands, data, ax, wheel=wheel)
        ax.set_xlim(worn_range(datasets, wheel))
        ax.set_title(f"{WHEELS[wheel].capitalize()} wheel")

    top = 0.6 if bands is None else 0.8  # for the legend
    return panels(1, 2, draw, gap=0.3, sharey=True, edges=(0.95, 0.15, 0.5, top))


def positions(datasets: Datasets) -> Figure | None:
    """Lateral position of the operating points over the distance.

    Of campaigns whose forces decide it.
    """
    moved = [
        data
        for data in datasets
        if "lateral_stiffness" in data and (data["lateral_stiffness"] > 0.0).any()
    ]

    def draw(ax: Axes, row: int, _: int) -> None:
        campaign.plot_positions(moved[row], ax)
        ax.set_title(role_title(moved[row]))

    return panels(len(moved), 1, draw, height=2.2) if moved else None


def binning(datasets: Datasets) -> Figure | None:
    """Wear of the samples of records and of the operating points.

    In their place, new and worn wheels.
    """
    recorded = [data for data in datasets if "binning_y" in data]
    ended = ("binning_error_worn" in data.attrs for data in recorded)
    rows = [
        (data, worn)
        for data, end in zip(recorded, ended, strict=True)
        for worn in range(1 + end)
    ]

    def draw(ax: Axes, row: int, wheel: int) -> None:
        data, worn = rows[row]
        campaign.plot_binning(data, ax, wheel=wheel, worn=bool(worn))
        ax.set_title(
            f"{role_title(data)}, {'worn' if worn else 'new'} {WHEELS[wheel]} wheel"
        )

    return (
        panels(len(rows), 2, draw, height=2.0, gap=0.3, sharey="row") if rows else None
    )


def wear_over_distance(datasets: Datasets) -> Figure:
    """Largest depth and worn area over the distance."""
    return _by_campaign(
        datasets, campaign.plot_over_distance, ("max_wear_depth", "worn_area")
    )


def wear_by_regime(datasets: Datasets) -> Figure | None:
    """Wear depth stacked by regime, of campaigns that wear in several regimes."""
    mixed = [data for data in datasets if _in_several_regimes(data)]
    rows = [(data, campaign.plot_wear_by_regime, "") for data in mixed]
    return _by_wheel(rows, alike=True) if rows else None


def _in_several_regimes(dataset: xr.Dataset) -> bool:
    """Return True if more than 1 % of the depth is not of the main regime."""
    depth = depth_by_regime(dataset).sum(axis=0)
    return bool(depth.max(initial=0.0) < 0.99 * depth.sum())


def counterface_wear(datasets: Datasets) -> Figure | None:
    """Wear depth of rails or rollers along their profiles."""
    worn = list(filter(wears, datasets))

    def draw(ax: Axes, row: int, side: int) -> None:
        data = worn[row]
        rows = campaign.states_shown(data)
        depth = data["counterface_wear_depth"].values[rows, side].max(axis=0)
        y = shown("counterface_y", data["counterface_profile_y"].values[0, side])
        campaign.plot_counterface_depth(data, ax, side=side).set_xlim(
            _range([y], [depth], 1.0)
        )
        ax.set_title(f"{role_title(data)}, {data['counterface_name'].values[side]}")

    return (
        panels(len(worn), 2, draw, height=1.8, gap=0.3, sharey="row") if worn else None
    )


def counterface_over_distance(datasets: Datasets) -> Figure | None:
    """Largest depth and worn area of rails or rollers over the distance."""
    worn, plot = list(filter(wears, datasets)), campaign.plot_over_distance
    return (
        _by_campaign(worn, plot, COUNTERFACE_MEASURES[:2], gap=0.6, sharey=False)
        if worn
        else None
    )


def wear_laws(datasets: Datasets) -> Figure | None:
    """Wear depth by the active law and the comparison laws."""
    rows = [
        (data, campaign.plot_wear_laws, "")
        for data in datasets
        if "comparison_name" in data
    ]
    return _by_wheel(rows, key_columns=6) if rows else None


def measures(datasets: Datasets) -> Figure:
    """Flange height, thickness, gradient, hollowing and conicity over the distance."""
    names = (
        "flange_height",
        "flange_thickness",
        "flange_gradient",
        "hollowing",
        "equivalent_conicity",
    )
    # a wheel without a hollow tread has no curve to look at
    drawn_names = [
        name
        for name in names
        if any(np.nan_to_num(data[name].values).any() for data in datasets)
    ]
    keys = (0, slice(None))  # conicity is of the wheelset, in the same colours
    return _by_campaign(datasets, campaign.plot_over_distance, drawn_names, keys=keys)


def contact(datasets: Datasets) -> Figure:
    """Patches on the wheels, and pressure and wear index along them, new and worn."""
    limits = {limit for data in datasets for limit in _regime_limits(data)}

    def draw(ax: Axes, row: int, wheel: int) -> None:
        if row == 0:
            page_one.plot_patches_along(datasets, ax, wheel=wheel)
            ax.set_title(f"{WHEELS[wheel].capitalize()} wheel")
        elif row == 1:
            page_one.plot_envelope(datasets, "max_pressure", ax, wheel=wheel)
        else:
            name = "wear_index_mean"
            page_one.plot_envelope(datasets, name, ax, wheel=wheel, round_ends=False)
            ax.set_ylabel("Wear index Tγ/A, mean\nof the patch [N/mm²]")
            top = ax.get_ylim()[1]
            for limit in sorted(limit for limit in limits if limit < top):
                ax.axhline(limit, color=COLOURS["difference"], lw=0.8, ls=":")

    options: dict[str, Any] = {"sharex": True, "sharey": "row"}
    return panels(3, 2, draw, height=1.6, gap=0.3, between=0.2, **options)


def _regime_limits(dataset: xr.Dataset) -> list[float]:
    """Limits of the regimes of a wear law that are wear indices [N/mm²]."""
    limits = []
    for number in str(dataset.attrs.get("wear_law_numbers", "")).split(", "):
        name, _, value = number.partition(" = ")
        if name.endswith("_limit") and value.endswith(" N mm-2"):
            limits.append(float(value.split()[0]))
    return limits


def shakedown(datasets: Datasets) -> Figure:
    """Shakedown map of the campaigns, which have fatigue laws."""
    figure = _by_campaign(
        datasets,
        campaign.plot_shakedown,
        height=3.2,
        gap=0.6,
        sharey=True,
        key_columns=3,
    )
    figure.subplots_adjust(top=0.78)
    return figure


def fatigue_damage(datasets: Datasets) -> Figure:
    """Fatigue damage along the profile of campaigns with fatigue laws."""
    return _by_wheel(
        [(data, campaign.plot_fatigue_damage, "") for data in datasets], sharey=True
    )


def balance(datasets: Datasets) -> Figure | None:
    """Wear rate against crack growth, of fatigue laws whose cracks have a depth."""
    rows = [
        (
            data,
            partial(campaign.plot_magic_wear_rate, law=int(law)),
            f", {law_title(str(data['fatigue_name'].values[law]))}",
        )
        for data in datasets
        for law in np.flatnonzero(np.isfinite(data["fatigue_crack_depth"].values))
    ]
    return _by_wheel(rows) if rows else None


def factors_wear(_: Datasets, factors: xr.Dataset) -> Figure:
    """Factors of wear over distance and over worn depth."""
    return _factor_curves(
        factors, {"max_wear_depth": "largest wear depth", "worn_area": "worn area"}
    )


def _factor_curves(factors: xr.Dataset, series: dict[str, str]) -> Figure:
    def draw(ax: Axes, _: int, basis: int) -> None:
        for index, (variable, text) in enumerate(series.items()):
            translation.plot_factor(
                factors, variable, ax, basis=basis, series=index, text=text
            )
        translation.mark_one(ax)
        ax.set_title(BASES[basis])

    return panels(1, len(BASES), draw, height=2.5, key_columns=3, outer=True)


def equivalent_distance(_: Datasets, factors: xr.Dataset) -> Figure:
    """Field distance that wears as much as the rig, and the reverse."""

    def draw(ax: Axes, _: int, of: int) -> None:
        translation.plot_equivalent_distance(factors, ax, of=CAMPAIGN[of])

    return panels(1, 2, draw, height=2.4)


def factors_at_points(_: Datasets, factors: xr.Dataset) -> Figure | None:
    """Factors at equal operating points, if there are any."""
    if not int(factors.attrs["matched_points"]):
        return None

    def draw(ax: Axes, row: int, column: int) -> None:
        name = words("variables")["factors_at_points"][3 * row + column]
        for progress in (0, -1):
            translation.plot_factor_at_points(factors, name, ax, progress=progress)
        translation.mark_one(ax)

    return panels(3, 3, draw, outer=True, height=1.8, gap=0.5, between=0.6, sharex=True)


def steps(datasets: Datasets) -> Figure:
    """Step length, stability number and error estimate over the distance."""
    names = ["step_length", "stability_number"]
    if any(bool(data["step_error"].notnull().any()) for data in datasets):
        names.append("step_error")
    return _by_campaign(
        datasets, campaign.plot_over_distance, names, height=2.2, gap=0.85, sharey=False
    )


def bands(_: Datasets, made: xr.Dataset) -> Figure:
    """Bands of what 1 km on the rig stands for, and of the depth over the distance."""
    roles = [role for role in CAMPAIGN if f"{role}_way" in made]
    draws = [partial(translation.plot_band, made, role) for role in roles]
    if len(roles) == len(CAMPAIGN):
        draws = [
            partial(translation.plot_per_km, made, basis) for basis in (0, 1)
        ] + draws

    def draw(ax: Axes, row: int, column: int) -> None:
        draws[len(roles) * row + column](ax=ax)

    return panels(len(draws) // len(roles), len(roles), draw, height=2.2, gap=0.85)


def sensitivity(_: Datasets, made: xr.Dataset) -> Figure:
    """Draw the sensitivity of the answers to the uncertain inputs."""
    names = asked_of(made)[: len(PER_KM)]

    def draw(ax: Axes, row: int, _: int) -> None:
        translation.plot_sensitivity(made, names[row], ax)
        ax.set_title(capital(str(made[names[row]].attrs["long_name"])))

    height = 0.2 + 0.27 * made.sizes["input"]
    edges = (3.4, 0.15, 0.5, 0.35)  # room for the names of the inputs
    return panels(
        len(names), 1, draw, height=height, between=0.4, edges=edges, sharex=True
    )
