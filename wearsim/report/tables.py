"""The tables of a report.

Data frames of numbers and words, with what it takes to show them.

Captions and heads of columns are in `templates/texts.toml`, under the name of the
table.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from wearsim.profile.shape import polygon_area_between
from wearsim.quantities import QUANTITIES
from wearsim.report.figures.campaign import WHEELS
from wearsim.report.plates import COUNTERFACE_MEASURES
from wearsim.report.style import (
    capital,
    distance_text,
    label,
    plain,
    role_title,
    shown,
    values_of,
    with_unit,
)
from wearsim.report.texts import caption, columns, environment_text, wears, words
from wearsim.results import checks
from wearsim.results.checks import last_worn_row
from wearsim.results.limits import LIMITED, LimitMet, distances_to, limits_met
from wearsim.results.rail_wear import track_of
from wearsim.results.settings import SETTINGS, Setting

UNDEFINED = "undefined"
GIVEN = 0
"""Digits of a number somebody chose, shown without digits it does not have."""
MOST_POINTS = 6
"""Operating points with a row in the table of lateral positions."""
MEASURES = words("variables")["measures"]
"""Measures of each wheel."""


@dataclass(frozen=True)
class Table:
    """A table of a report.

    Parameters
    ----------
    name : str
        Unique in the report, with the role of its campaign where it is of one; "" if
        nothing refers to it.
    frame : DataFrame
        Numbers, texts, None for an empty cell and NaN for an undefined number; the
        first column names the rows. With an index of two levels, rows of a group stand
        below its name, the second names a variable.
    caption : str
        What it holds.
    digits : int or sequence of int
        Significant digits of all or of each column, `GIVEN` for numbers as they were
        given.
    look : {"laws", "points", "regimes", "text", "numbers"}
        How it looks: "text" without columns of numbers, "numbers" with nothing but
        those.
    fold : str
        Title it is folded under, "" if it is not.
    shaded : set of int
        Rows that stand out.
    bands : sequence of (str, int)
        Heads over several columns, if there are any: text and number of columns.
    """

    name: str
    frame: pd.DataFrame
    caption: str = ""
    digits: int | Sequence[int] = 4
    look: str = "laws"
    fold: str = ""
    shaded: frozenset[int] = frozenset()
    bands: Sequence[tuple[str, int]] = ()

    macro = "table"

    @property
    def rows(self) -> list[tuple[Any, list[Any]]]:
        """Place in the index and values of each row."""
        return list(zip(self.frame.index, self.frame.to_numpy().tolist(), strict=True))

    def band(self, column: int) -> str:
        """Head over several columns if this is the first of them, else ""."""
        first = 0
        for text, count in self.bands:
            if first == column:
                return text
            first += count
        return ""

    def numeric(self, column: int) -> bool:
        """Return True for a column of numbers: any row has one there."""
        if self.look in ("text", "numbers"):
            return self.look == "numbers"
        return any(exact(value) for value in self.frame.iloc[:, column])

    def text(self, value: Any, column: int) -> str:
        """Write words, a whole number or another with the digits of its column.

        A dash for None.
        """
        if value is None:
            return "–"
        if isinstance(value, str | int | np.integer):
            return str(value)
        digits = self.digits if isinstance(self.digits, int) else self.digits[column]
        return given(value) if digits == GIVEN else plain(value, digits)

    def of(self, role: str, heading: str) -> Table:
        """Give the table of a campaign, with its role in name and caption."""
        return replace(
            self, name=f"{self.name}-{role}", caption=f"{heading}: {self.caption}"
        )


def table(
    name: str,
    rows: Iterable[Iterable[Any]],
    *more: str,
    context: Any = None,
    key: str | None = None,
    **options: Any,
) -> Table:
    """Make a table of a name in the texts.

    Rows, heads of `more` columns, what the texts need, its `key`.
    """
    heads = [*columns(name, **context or {}), *more]
    frame = pd.DataFrame([list(row) for row in rows], columns=heads, dtype=object)
    key = name.replace("_", "-") if key is None else key
    return Table(key, frame, caption("table", name, **context or {}), **options)


def exact(value: Any) -> str:
    """Give a number with all its digits, "" for words and what is undefined."""
    return (
        ""
        if value is None or isinstance(value, str) or not np.isfinite(value)
        else repr(float(value))
    )


def given(value: float) -> str:
    """Write a number somebody chose as it was given, without further digits."""
    return (
        f"{value:.6g}".replace("-", "\N{MINUS SIGN}")
        if np.isfinite(value)
        else UNDEFINED
    )


def span(values: np.ndarray, digits: int = 4) -> str:
    """Write the smallest and the largest of some numbers."""
    return f"{plain(values.min(), digits)} to {plain(values.max(), digits)}"


def running(dataset: xr.Dataset) -> list[Table]:
    """Position of the wheelset at the end, and the forces on it.

    Of the operating points that wear most; nothing of results that do not hold it.
    """
    if "lateral_position" not in dataset:
        return []
    end, names = last_worn_row(dataset), words("variables")["running"]
    active = np.flatnonzero(dataset["weight"].values > 0.0)
    share = dataset["wear_share"].values[end][active]
    most = active[np.sort(np.argsort(-share, kind="stable")[:MOST_POINTS])]
    columns = [values_of(dataset, name, end)[most] for name in names]
    points = dataset["operating_point_name"].values[most]
    columns[names.index("wear_share")] *= 100.0  # in per cent, as in other tables
    rows = [
        [name, *numbers]
        for name, numbers in zip(points, np.column_stack(columns), strict=True)
    ]
    bands = [("", len(names)), ("Y/Q by wheel", 2)]
    return [table("running", rows, digits=3, look="numbers", bands=bands)]


def settings(datasets: list[xr.Dataset]) -> Table:
    """Show what was computed, a column per campaign; rows that differ are shaded."""
    rows = [["Counterface", *map(_counterface, datasets)]]
    for name in ("shift", "yaw", "wheel_load", "speed", "friction"):
        ranges = (_range(name, _acting(data, data[name].values)) for data in datasets)
        rows.append([label(datasets[0], name), *ranges])
    rows += _curvatures(datasets)
    rows.append(
        ["Environment factor on the wear depth", *map(environment_text, datasets)]
    )
    rows += [
        _setting_row(setting, datasets)
        for setting in SETTINGS.values()
        if setting.use in ("listed", "compared")
        and any(data.attrs.get(setting.name) is not None for data in datasets)
    ]
    differ = frozenset(k for k, row in enumerate(rows) if len(set(row[1:])) > 1)
    roles = map(role_title, datasets)
    return table(
        "settings",
        rows,
        *roles,
        context={"datasets": datasets},
        look="text",
        shaded=differ,
    )


def _acting(dataset: xr.Dataset, values: np.ndarray) -> np.ndarray:
    """Values of the operating points that are run over."""
    acting: np.ndarray = values[dataset["weight"].values > 0.0]
    return acting


def _curvatures(datasets: Sequence[xr.Dataset]) -> list[list[str]]:
    """Curvature of the track, and of the path of the wheelset where it differs."""
    name = "track_curvature"
    track = [_acting(data, track_of(data)) for data in datasets]
    path = [_acting(data, data[name].values) for data in datasets]
    rows = [[label(datasets[0], name), *(_range(name, values) for values in track)]]
    if not all(map(np.array_equal, track, path)):
        text = with_unit("curvature of the path of the wheelset", name)
        rows.append([text, *(_range(name, values) for values in path)])
    return rows


def _counterface(dataset: xr.Dataset) -> str:
    names = ("counterface_curvature", "counterface_curvature_left")
    curved = [dataset.attrs[name] for name in names if dataset.attrs.get(name)]
    if not curved:
        return "rail"
    radii = " and ".join(f"{1e3 / curvature:.4g}" for curvature in curved)
    return f"roller, radius {radii} mm"


def _setting_row(setting: Setting, datasets: list[xr.Dataset]) -> list[str]:
    """Words for a setting and its value in each campaign."""
    quantity = setting.quantity
    text = (
        with_unit(setting.title, quantity.name) if quantity else capital(setting.title)
    )
    return [
        text,
        *(setting_text(data.attrs.get(setting.name), setting) for data in datasets),
    ]


def setting_text(value: Any, setting: Setting) -> str:
    """Write a value of a setting in the unit people read."""
    if value is None:
        return "not given"
    if isinstance(value, str):
        return setting.text_of(value)
    factor = setting.quantity.shown_factor if setting.quantity else 1.0
    return given(float(value) * factor)


def _range(name: str, values: np.ndarray) -> str:
    ends = (
        [
            given(float(f"{end:.5g}"))
            for end in shown(name, [values.min(), values.max()])
        ]
        if values.size
        else ["none"]
    )
    return " to ".join(dict.fromkeys(ends))


def limits(datasets: list[xr.Dataset]) -> list[Table]:
    """Limits and where each campaign meets them, for limits that any of them has."""
    met = [
        {limit.name: (data, limit) for limit in limits_met(data)} for data in datasets
    ]
    rows = []
    for name in LIMITED:
        given_to = [campaign[name] for campaign in met if name in campaign]
        if given_to:
            values = sorted({limit.limit for _, limit in given_to})
            texts = (
                _where_met(*campaign[name]) if name in campaign else "not given"
                for campaign in met
            )
            rows.append([limit_text(name, values), *texts])
    return (
        [table("limits", rows, *map(role_title, datasets), look="text")] if rows else []
    )


def limit_text(name: str, values: Sequence[float]) -> str:
    """Write a limit, or the limits of several campaigns, on one measure."""
    quantity = QUANTITIES[name]
    unit = "" if quantity.shown_unit == "1" else f" {quantity.shown_unit}"
    most = "at most" if LIMITED[name] > 0.0 else "at least"
    texts = " or ".join(f"{value:g}" for value in shown(name, values))
    return f"{capital(quantity.meaning)}, {most} {texts}{unit}"


def _where_met(dataset: xr.Dataset, limit: LimitMet) -> str:
    sides = ("right: ", "left: ") if len(limit.distance) == 2 else ("",)
    texts = []
    for at, met in zip(*distances_to(dataset, limit), strict=True):
        far = f", after about {distance_text(at, 2)}" if np.isfinite(at) else ""
        texts.append(distance_text(at) if met else f"not met{far}")
    return "; ".join(side + text for side, text in zip(sides, texts, strict=True))


def counterface(dataset: xr.Dataset) -> list[Table]:
    """Depth, area, and what was redressed, of both rails or rollers, if they wear."""
    if not wears(dataset):
        return []
    times = int(dataset["counterface_redressed_count"].values[-1])
    rows = [
        [with_unit(QUANTITIES[name].meaning, name), *values_of(dataset, name, -1)]
        for name in COUNTERFACE_MEASURES[: 3 if times else 2]
    ]
    heads = (capital(str(name)) for name in dataset["counterface_name"].values)
    return [
        table("counterface", rows, *heads, context={"data": dataset, "times": times})
    ]


def state(datasets: list[xr.Dataset]) -> Table:
    """Measures of one campaign, new, worn and change, by wheel where they differ."""
    dataset, rows = datasets[0], []
    for name in (*MEASURES, "equivalent_conicity"):
        new, worn = shown(name, dataset[name].values[[0, last_worn_row(dataset)]])
        sides = (", right", ", left") if new.ndim else ("",)
        for side, start, end in zip(
            sides, np.atleast_1d(new), np.atleast_1d(worn), strict=True
        ):
            rows.append([label(dataset, name) + side, start, end, end - start])
    return table(
        "state", rows, context={"datasets": datasets}, look="numbers", key="verdict"
    )


def quality(datasets: list[xr.Dataset]) -> Table:
    """List the checks of the computation, a column per campaign."""
    columns = [_checks(data) for data in datasets]
    names = dict.fromkeys(text for column in columns for text in column)
    rows = [[text, *(column.get(text) for column in columns)] for text in names]
    return table("quality", rows, *map(role_title, datasets), look="numbers", digits=3)


def _checks(dataset: xr.Dataset) -> dict[str, Any]:
    steps = checks.wear_steps(dataset)
    rows: dict[str, Any] = {"Wear steps": steps}
    if steps:
        rows["Largest stability number S"] = (
            dataset["stability_number"].values[1:].max()
        )
        rows["Largest depth in one step [µm]"] = (
            1e6 * np.diff(dataset["wear_depth"].values, axis=0).max()
        )
        error = shown("step_error", dataset["step_error"].values[1:])
        if np.isfinite(error).any():
            rows["Largest estimated error of one step [µm]"] = np.nanmax(error)
        rows["Steps repeated because of their error"] = int(
            dataset["rejected_steps"].values.sum()
        )
        length = np.delete(
            dataset["step_length"].values, [0, *checks.reprofiled_rows(dataset)]
        )
        rows["Shortest and longest step [km]"] = span(shown("distance", length))
    for wheel, side in enumerate(WHEELS):
        law = float(dataset["worn_area"].values[-1, wheel])
        y, z = (dataset[f"profile_{c}"].values[:, wheel] for c in "yz")
        polygon = sum(
            polygon_area_between(y[a], z[a], y[b], z[b])
            for a, b in checks.spans(dataset)
        )
        text = f"Worn area by law against profiles, {side} wheel [relative difference]"
        rows[text] = abs(polygon - law) / law if law > 0.0 else "no wear"
    scaling = checks.load_scaling(dataset)
    most = checks.percent(checks.LOAD_TOLERANCE)
    text = f"Distance with forces scaled by more than {most} [%]"
    rows[text] = 100.0 * scaling.distance_share if scaling else "none"
    tread = checks.tread_wear(dataset)
    if tread is not None:
        rows["Largest wear depth on the tread per 100 000 km [mm]"] = 1e3 * tread
    balance = dataset["power_balance"].values
    balance = balance[np.isfinite(balance)]
    if balance.size:
        rows["Local over resultant frictional power"] = span(balance, 3)
    return rows
