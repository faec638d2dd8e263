"""The figures of a report: which axes stand together, what the caption says."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.report.figures import campaign, translation
from wearsim.report.figures.campaign import WHEELS
from wearsim.report.style import COLOURS, panels, plain, role_of, role_title, shown, values_of
from wearsim.results.checks import last_worn_row, reprofiled_rows

_FACTOR_POINTS = (
    "area", "max_pressure", "spin", "creepage_x", "force_x", "force_y", "power", "wear_area_rate",
    "wear_depth_rate_max",
)  # fmt: skip
_FACTOR_COLLECTIVE = ("area", "max_pressure", "spin", "power", "wear_index_max")
BASES = ("Equal distance", "Equal worn depth")
COUNTERFACE_MEASURES = ("counterface_max_wear_depth", "counterface_worn_area", "counterface_redressed_depth")

Datasets = Sequence[xr.Dataset]


@dataclass(frozen=True)
class Plate:
    """A finished figure, its name (unique in the report, file name of the figure) and its caption."""

    name: str
    figure: Figure
    caption: str


def environment_text(dataset: xr.Dataset) -> str:
    """Environment factor of the points that wear, as a range where they differ."""
    factor = dataset["environment"].values[dataset["weight"].values > 0.0]
    if factor.size == 0:
        return "none: no point wears"
    low, high = float(factor.min()), float(factor.max())
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def environment_note(datasets: Datasets) -> str:
    """One sentence with the environment factors of all campaigns."""
    parts = ", ".join(f"{environment_text(data)} ({role_of(data)})" for data in datasets)
    return f"Wear depths contain the environment factor: {parts}."


def wears(dataset: xr.Dataset) -> bool:
    """Whether the counterface of a campaign wears."""
    return "counterface_name" in dataset


def rolls(dataset: xr.Dataset) -> bool:
    """Whether the counterface that wears is a pair of rollers."""
    return "roller" in str(dataset["counterface_name"].values[0])


def _range(places: list[np.ndarray], depths: list[np.ndarray], margin: float) -> tuple[float, float]:
    """Limits of an axis around what is worn, with a margin besides 8 %."""
    worn = [x[d > 0.005 * d.max()] if d.max() > 0.0 else x for x, d in zip(places, depths, strict=True)]
    low, high = min(float(x.min()) for x in worn), max(float(x.max()) for x in worn)
    margin += 0.08 * (high - low)
    return low - margin, high + margin


def worn_range(datasets: Datasets, wheel: int, name: str = "profile_y") -> tuple[float, float]:
    """Limits of a lateral (or arc length) axis around what is worn [shown unit]."""
    places = [campaign.new_place(data, wheel, against=name) for data in datasets]
    depths = [data["wear_depth"].values[last_worn_row(data), wheel] for data in datasets]
    low, high = shown(name, _range(places, depths, 1e-3))
    return float(low), float(high)


def _run(dataset: xr.Dataset) -> str:
    return f"{plain(values_of(dataset, 'distance', -1))} km"


def _by_wheel(
    rows: Sequence[tuple[xr.Dataset, Callable[..., Axes], str]],
    *,
    sharey: bool | str = "row",
    key_columns: int = 4,
    alike: bool = False,
) -> Figure:
    """Draw both wheels in each row of (dataset, function, more in the title); `alike`: all on one range."""

    def draw(ax: Axes, row: int, wheel: int) -> None:
        data, plot, more = rows[row]
        plot(data, ax, wheel=wheel).set_xlim(
            worn_range([one for one, *_ in rows] if alike else [data], wheel)
        )
        ax.set_title(f"{role_title(data)}, {WHEELS[wheel]} wheel{more}")

    return panels(len(rows), 2, draw, height=1.8, gap=0.3, sharey=sharey, key_columns=key_columns)


def _by_campaign(
    datasets: Datasets, plot: Callable[..., object], names: Sequence[str] | None = None, **options: Any
) -> Figure:
    """Draw one column per campaign (distances may differ a hundredfold) and one row per quantity, if any."""

    def draw(ax: Axes, row: int, column: int) -> None:
        quantity = (names[row],) if names else ()
        plot(datasets[column], *quantity, ax)
        if not row:
            ax.set_title(role_title(datasets[column]))

    usual: dict[str, Any] = {"height": 1.75, "gap": 0.3, "between": 0.2, "sharey": "row", "sharex": "col"}
    return panels(len(names or "1"), len(datasets), draw, **usual | options)


def profiles(datasets: Datasets, factors: xr.Dataset | None = None) -> Plate:
    """Profiles of both wheels overlaid, new and worn, with the wear depth and its difference below."""
    ends: list[tuple[str, list[float | None]]] = [(f"After {_run(datasets[0])}", [None])]
    if factors is not None:
        ends = [
            (
                f"{BASES[b]}: {plain(translation.basis_axis(factors, b)[-1])} {('km', 'mm')[b]} each",
                [float(distance) for distance in factors["distance_run"].values[b, -1]],
            )
            for b in (0, 1)
        ]

    def draw(ax: Axes, row: int, column: int) -> None:
        wheel, lower = divmod(row, 2)
        title, distances = ends[column]
        for index, (data, distance) in enumerate(zip(datasets, distances, strict=True)):
            if lower:
                campaign.plot_wear_depth(data, ax, wheel=wheel, distance=distance)
                # the colours are those of the axes above
                ax.lines[-1].set(label="_worn", linestyle="-")
            else:
                campaign.plot_profile(data, ax, wheel=wheel, distance=distance, new=index == 0)
        if not lower:
            ax.set_title(f"{WHEELS[wheel].capitalize()} wheel. {title}")
        elif len(datasets) == 2:
            _difference(datasets, distances, ax, wheel)

    figure = panels(
        4, len(ends), draw, height=1.6, between=0.42, sharex="col", keys=(slice(2), 0), key_columns=5
    )
    text = (
        "Profiles of both wheels, new and worn, flange down, each with the wear depth along the normal below"
    )
    if len(datasets) == 2:
        text += " and the difference rig minus field at the same place of the wheel"
    return Plate("profiles", figure, f"{text}. {environment_note(datasets)}")


def _difference(datasets: Datasets, distances: list[float | None], ax: Axes, wheel: int) -> None:
    """Draw the wear depth of the rig minus that of the field, on the rig's points."""
    rig, field = (
        campaign.along(data, "wear_depth", distance)[wheel]
        for data, distance in zip(datasets, distances, strict=True)
    )
    arc = [data["arc_length"].values for data in datasets]
    x = shown("profile_y", datasets[0]["profile_y"].values[0, wheel])
    difference = shown("wear_depth", rig - np.interp(arc[0], arc[1], field, left=np.nan, right=np.nan))
    ax.plot(x, difference, color=COLOURS["difference"], lw=0.9, label="rig minus field")


def wear_depth(datasets: Datasets) -> Plate:
    """Wear depth of both wheels over lateral position and over arc length, at the end of each campaign."""

    def draw(ax: Axes, row: int, wheel: int) -> None:
        against = ("profile_y", "arc_length")[row]
        for data in datasets:
            campaign.plot_wear_depth(data, ax, wheel=wheel, against=against, history=True)
        ax.set_xlim(worn_range(datasets, wheel, against))
        ax.set_title(f"{WHEELS[wheel].capitalize()} wheel")

    figure = panels(2, 2, draw, gap=0.3, sharey=True)
    ends = ", ".join(f"{role_of(data)} after {_run(data)}" for data in datasets)
    text = (
        f"Wear depth along the profile: {ends}; faint lines at a quarter, half and three quarters of the way."
    )
    if any(map(reprofiled_rows, datasets)):
        text += " Depth counts from the last reprofiling of the wheels."
    return Plate("wear_depth", figure, f"{text} {environment_note(datasets)}")


def positions(datasets: Datasets) -> Plate | None:
    """Lateral position of the operating points over the distance, where results hold it."""
    if not all("lateral_position" in data for data in datasets):
        return None
    text = "Where the wheelset runs: its lateral position in the operating points that wear most"
    return Plate("positions", _by_campaign(datasets, campaign.plot_positions, sharey=False), f"{text}.")


def wear_over_distance(datasets: Datasets) -> Plate:
    """Largest depth and worn area over the distance."""
    names = ("max_wear_depth", "worn_area")
    text = "Largest wear depth and worn area of each wheel over the distance run."
    text += f" {environment_note(datasets)}"
    return Plate("wear_over_distance", _by_campaign(datasets, campaign.plot_over_distance, names), text)


def wear_by_regime(datasets: Datasets) -> Plate:
    """Wear depth stacked by regime, one panel per campaign and wheel."""
    figure = _by_wheel([(data, campaign.plot_wear_by_regime, "") for data in datasets], alike=True)
    text = "Wear depth at the end of each campaign by the wear regime behind it; the sum is the whole depth."
    return Plate("wear_by_regime", figure, text)


def counterface_wear(datasets: Datasets) -> Plate | None:
    """Wear depth of rails or rollers along their profiles."""
    worn = [data for data in datasets if wears(data)]
    if not worn:
        return None

    def draw(ax: Axes, row: int, side: int) -> None:
        data = worn[row]
        rows = campaign.states_shown(data)
        depth = data["counterface_wear_depth"].values[rows, side].max(axis=0)
        y = shown("counterface_y", data["counterface_profile_y"].values[0, side])
        campaign.plot_counterface_depth(data, ax, side=side).set_xlim(_range([y], [depth], 1.0))
        ax.set_title(f"{role_title(data)}, {data['counterface_name'].values[side]}")

    figure = panels(len(worn), 2, draw, height=1.8, gap=0.3, sharey="row")
    rollers, rails = ([data for data in worn if rolls(data) == which] for which in (True, False))
    redressed = " or last redressed", " when it was redressed, or"
    since, earlier = redressed if rollers else ("", "")
    notes = [
        f"Wear depth of the counterface along its profile, since it was new{since}; faint lines are what it "
        f"had{earlier} a quarter, half and three quarters of the way."
    ]
    if rollers:
        notes.append(environment_note(rollers))
    if rails:
        notes.append(
            f"Rails ({', '.join(map(role_of, rails))}) lose the area that is stated, where the contacts "
            "wear: the amount is as given and contains no environment factor, its place is from the contacts."
        )
    return Plate("counterface_wear", figure, " ".join(notes))


def counterface_over_distance(datasets: Datasets) -> Plate | None:
    """Largest depth and worn area of rails or rollers over the distance."""
    worn = [data for data in datasets if wears(data)]
    if not worn:
        return None
    plot = campaign.plot_counterface_over_distance
    figure = _by_campaign(worn, plot, COUNTERFACE_MEASURES[:2], gap=0.6, sharey=False)
    text = "Largest wear depth and worn area of the counterface over the distance run"
    if any(map(rolls, worn)):
        text += "; the depth falls to 0 where rollers are redressed to their new profile"
    return Plate("counterface_over_distance", figure, f"{text}.")


def wear_laws(datasets: Datasets) -> Plate | None:
    """Wear depth by the active law and the comparison laws."""
    compared = [data for data in datasets if "comparison_name" in data]
    if not compared:
        return None
    figure = _by_wheel([(data, campaign.plot_wear_laws, "") for data in compared], key_columns=6)
    text = (
        "Wear depth at the end of each campaign by the active law and by the comparison laws, on the same "
        f"contacts: the profile wears by the active law alone. {environment_note(compared)}"
    )
    return Plate("wear_laws", figure, text)


def measures(datasets: Datasets) -> Plate:
    """Flange height, thickness, gradient and hollowing over the distance."""
    names = ("flange_height", "flange_thickness", "flange_gradient", "hollowing")
    text = (
        "Flange height Sh, flange thickness Sd, flange gradient qR and tread hollowing over the distance run."
    )
    return Plate("measures", _by_campaign(datasets, campaign.plot_over_distance, names), text)


def conicity(datasets: Datasets) -> Plate:
    """Equivalent conicity over the distance."""
    figure = _by_campaign(datasets, campaign.plot_over_distance, ["equivalent_conicity"])
    text = "Equivalent conicity at 3 mm amplitude over the distance run; a gap where it is undefined."
    return Plate("conicity", figure, text)


def contact(datasets: Datasets) -> Plate:
    """Contact positions and pressures over the shift by campaign, new and worn."""

    def plot(data: xr.Dataset, name: str, ax: Axes) -> None:
        for new in (True, False):
            campaign.plot_contact(data, name, ax, new=new)

    names = ("wheel_y", "max_pressure", "area", "power")
    return Plate(
        "contact",
        # the legend explains the marks once; the colours are those of the titles
        _by_campaign(datasets, plot, names, sharex=True, keys=(0, slice(1))),
        "Position on the wheel, largest pressure, area and frictional power of every contact patch over the "
        "lateral shift: hollow marks the new wheel, full ones the end of the campaign; monitoring points "
        "included.",
    )


def shakedown(datasets: Datasets) -> Plate:
    """Shakedown map of the campaigns, which have fatigue laws."""
    figure = _by_campaign(datasets, campaign.plot_shakedown, height=3.2, gap=0.6, sharey=True, key_columns=3)
    figure.subplots_adjust(top=0.78)
    shear = "; ".join(f"{role_of(data)}: {campaign.shear_yield_text(data)}" for data in datasets)
    text = (
        "Shakedown map of point contact with every contact patch of the campaign: hollow marks the new "
        "wheel, full ones the end; monitoring points included. Above the limits the material ratchets. "
        f"Yield stress in cyclic shear, {shear}. The limits are recalled from the source; between "
        "pure rolling and flow at the surface they are a straight join of our own."
    )
    return Plate("shakedown", figure, text)


def fatigue_damage(datasets: Datasets) -> Plate:
    """Fatigue damage along the profile of campaigns with fatigue laws."""
    figure = _by_wheel([(data, campaign.plot_fatigue_damage, "") for data in datasets], sharey=True)
    text = (
        "Fatigue damage along the profile at the end of each campaign, each law over its largest value on "
        "both wheels: laws count different things, the place compares."
    )
    return Plate("fatigue_damage", figure, text)


def fatigue_cycles(datasets: Datasets) -> Plate:
    """Damage of each load cycle by every fatigue law."""
    text = (
        "Agreement of the fatigue laws: damage of each load cycle (passage of a contact patch, both wheels, "
        "worn profiles) over the largest of its law. Where marks of all laws coincide, they agree."
    )
    figure = _by_campaign(datasets, campaign.plot_passage_damage, height=2.4, sharey=True)
    return Plate("fatigue_cycles", figure, text)


def balance(datasets: Datasets) -> Plate | None:
    """Wear rate against crack growth, of the fatigue laws whose cracks have a stated depth."""
    rows = [
        (data, partial(campaign.plot_magic_wear_rate, law=int(law)), f", {data['fatigue_name'].values[law]}")
        for data in datasets
        for law in np.flatnonzero(np.isfinite(data["fatigue_crack_depth"].values))
    ]
    if not rows:
        return None
    text = (
        "Wear against fatigue at the rates of the full collective in the last state: the wear rate and "
        "the magic wear rate, at which cracks just do not grow. Where wear is above, it removes cracks as "
        "fast as they grow. The magic wear rate is in proportion to two assumptions, the depth of a crack "
        "and the width of a place."
    )
    return Plate("balance", _by_wheel(rows), text)


def factors_wear(datasets: Datasets, factors: xr.Dataset) -> Plate:
    """Factors of wear over distance and over worn depth."""
    series = {"max_wear_depth": "largest wear depth", "worn_area": "worn area", "worn_mass": "worn mass"}
    text = (
        "Wear factors rig over field at equal distance and at equal worn depth, both wheels. They are "
        f"functions: no single number carries the rig to the field. {environment_note(datasets)}"
    )
    return Plate("factors_wear", _factor_curves(factors, series), text)


def factors_contact(_: Datasets, factors: xr.Dataset) -> Plate:
    """Factors of the contact of the collectives over distance and over worn depth."""
    names = [f"{name}_collective" for name in _FACTOR_COLLECTIVE]
    texts = [str(factors[name].attrs["long_name"]).removesuffix(", collective mean") for name in names]
    text = (
        "Contact factors rig over field, mean magnitudes over the load collectives and both wheels. The "
        "environment factor does not enter here."
    )
    return Plate("factors_contact", _factor_curves(factors, dict(zip(names, texts, strict=True))), text)


def _factor_curves(factors: xr.Dataset, series: dict[str, str]) -> Figure:
    def draw(ax: Axes, _: int, basis: int) -> None:
        for index, (variable, text) in enumerate(series.items()):
            translation.plot_factor(factors, variable, ax, basis=basis, series=index, text=text)
        translation.mark_one(ax)
        ax.set_title(BASES[basis])

    return panels(1, 2, draw, height=2.5, key_columns=3)


def equivalent_distance(datasets: Datasets, factors: xr.Dataset) -> Plate:
    """Field distance that wears as much as the rig."""
    figure = panels(1, 1, lambda ax, *_: translation.plot_equivalent_distance(factors, ax), height=2.4)
    text = (
        "Field distance that wears both wheels as much as the rig did; it ends where the field campaign "
        f"does. {environment_note(datasets)}"
    )
    return Plate("equivalent_distance", figure, text)


def factor_along_profile(datasets: Datasets, factors: xr.Dataset) -> Plate:
    """Factor of the wear depth along the profile."""
    position = datasets[0]["profile_y"].values[0]

    def draw(ax: Axes, wheel: int, basis: int) -> None:
        translation.plot_depth_factor(factors, position[wheel], ax, basis=basis, wheel=wheel)
        translation.mark_one(ax)
        ax.set_xlim(worn_range(datasets, wheel))
        ax.set_title(f"{WHEELS[wheel].capitalize()} wheel, {BASES[basis].lower()}")

    text = (
        "Factor of the wear depth along the profile where the field wears more than 1 % of its largest depth."
    )
    return Plate("factor_along_profile", panels(2, 2, draw, height=1.8), text)


def factors_at_points(_: Datasets, factors: xr.Dataset) -> Plate | None:
    """Factors at equal operating points, if there are any."""
    if not int(factors.attrs["matched_points"]):
        return None

    def draw(ax: Axes, row: int, column: int) -> None:
        name = _FACTOR_POINTS[3 * row + column]
        for progress in (0, -1):
            translation.plot_factor_at_points(factors, name, ax, progress=progress)
        translation.mark_one(ax)

    figure = panels(3, 3, draw, outer=True, height=1.8, gap=0.5, between=0.6, sharex=True)
    text = (
        "Factors of contact and wear where both campaigns solve the same operating point: hollow for the new "
        "wheel, full at the end of the common distance. Worn area and wear depth are those of the wear law "
        "per distance run in the point, without environment factor. Where the field value is (nearly) zero "
        "there is no mark."
    )
    return Plate("factors_at_points", figure, text)


def steps(datasets: Datasets) -> Plate:
    """Step length, stability number and error estimate over the distance."""
    names = ["step_length", "stability_number"]
    if any(bool(data["step_error"].notnull().any()) for data in datasets):
        names.append("step_error")
    figure = _by_campaign(datasets, campaign.plot_steps, names, height=1.6, gap=0.85, sharey=False)
    text = (
        "Length of each wear step, its stability number S and the estimated error of its depth, with the "
        "limits the campaign set. The estimate is the difference between rules of first and second order."
    )
    return Plate("steps", figure, text)
