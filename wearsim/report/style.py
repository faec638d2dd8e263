"""Look of all figures.

One palette for colour-blind readers, the same colour for the same thing everywhere.
"""

from __future__ import annotations

import io
import re
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.quantities import NOT_IN_SIGHT, QUANTITIES, kilometres
from wearsim.whole_files import write_whole

COLOURS = {
    "rig": "#d55e00",
    "field": "#0072b2",
    "rail": "#6b6b6b",
    "new": "#8c8c8c",
    "difference": "#1a1a1a",
}
"""Colours with a fixed meaning (palette of Okabe and Ito)."""

REGIME_COLOURS = ("#009e73", "#e69f00", "#882255", "#44aa99", "#aa4499")
"""Wear regimes from mild to severe, apart from the colours of rig and field."""

SERIES_COLOURS = ("#1a1a1a", "#cc79a7", "#009e73", "#e69f00", "#56b4e9", "#882255")
"""Quantities that are ratios and belong neither to rig nor to field."""

WHEEL_LINES = ("-", "--")
"""Right wheel, left wheel."""

_NAME, _COLOUR = "pair_name", "pair_colour"
"""Attributes of the results of a pair, see `as_pair`."""

_SHEET = Path(__file__).with_name("templates") / "figures.mplstyle"


def style() -> Any:
    """Context in which figures are made and drawn; nothing global is changed."""
    return matplotlib.rc_context(fname=_SHEET)


def grid(
    rows: int = 1,
    columns: int = 1,
    height: float = 2.0,
    width: float = 9.6,
    gap: float = 0.85,
    between: float = 0.75,
    edges: tuple[float, float, float, float] = (0.95, 0.15, 0.5, 0.6),
    **options: Any,
) -> tuple[Figure, np.ndarray]:
    """Make a figure and its (rows, columns) array of axes, with a legend above.

    Margins are fixed: fitting them to the labels takes more time than all of the
    drawing.

    Parameters
    ----------
    rows, columns : int
        Number of axes.
    height, width : float
        Mean height of the axes, width of the figure [inch].
    gap, between : float
        Between columns and between rows [inch].
    edges : tuple of float
        Left, right, below and above the axes [inch].
    **options
        For `Figure.subplots`.
    """
    left, right, bottom, top = edges
    total = bottom + top + rows * height + (rows - 1) * between
    axes_width = (width - left - right - (columns - 1) * gap) / columns
    figure = Figure(figsize=(width, total))
    figure.subplots_adjust(
        left=left / width,
        right=1.0 - right / width,
        bottom=bottom / total,
        top=1.0 - top / total,
        wspace=gap / axes_width,
        hspace=between / height,
    )
    return figure, figure.subplots(rows, columns, squeeze=False, **options)


def legend(figure: Figure, axes: Any = None, columns: int = 4) -> None:
    """Put one legend for all axes of a figure above them."""
    entries: dict[str, Any] = {}
    for ax in figure.axes if axes is None else axes:
        for handle, text in zip(*ax.get_legend_handles_labels(), strict=True):
            entries.setdefault(text, handle)
    if entries:
        left = figure.subplotpars.left
        figure.legend(
            list(entries.values()),
            list(entries),
            loc="upper left",
            bbox_to_anchor=(left, 1.0),
            ncols=columns,
            borderaxespad=0.1,
            handlelength=1.8,
            columnspacing=1.6,
        )


def panels(
    rows: int,
    columns: int,
    draw: Callable[[Axes, int, int], object],
    *,
    outer: bool = False,
    keys: Any = ...,
    key_columns: int = 4,
    **options: Any,
) -> Figure:
    """Make a figure of rows x columns panels with one legend above them.

    Parameters
    ----------
    rows, columns : int
        Number of panels.
    draw : function
        Draws into the axes of a row and a column.
    outer : bool
        Whether only the first column has labels of the vertical axes; so if they share
        it, too.
    keys : index of the array of axes
        Panels the legend is made from, all if not given; it has `key_columns` columns.
    **options
        For `grid`. With `sharex` only the lowest row has labels of the horizontal axes.
    """
    with style():
        figure, axes = grid(rows, columns, **options)
        for (row, column), ax in np.ndenumerate(axes):
            draw(ax, row, column)
            if column and (outer or options.get("sharey")):
                ax.set_ylabel("")
            if row < rows - 1 and options.get("sharex"):
                ax.set_xlabel("")
        legend(figure, np.atleast_1d(axes[keys]).flat, key_columns)
    return figure


def own_axes(ax: Axes | None) -> Axes:
    """Return the axes given, or those of a new figure."""
    if ax is None:
        with style():
            ax = grid(width=6.4, height=3.2)[1][0, 0]
    return ax


def kind_of(dataset: xr.Dataset) -> str:
    """Rig or field, from the scene behind a result."""
    kind = str(dataset.attrs.get("scene_kind", ""))
    return kind if kind in ("rig", "field") else "rail"


def role_of(dataset: xr.Dataset) -> str:
    """Rig or field, or the name of one of two campaigns of one kind."""
    return str(dataset.attrs.get(_NAME, kind_of(dataset)))


def role_title(dataset: xr.Dataset) -> str:
    """Heading of what belongs to a campaign: Rig, Field, or the name of the user."""
    name = dataset.attrs.get(_NAME)
    return capital(kind_of(dataset)) if name is None else str(name)


def colour_of(dataset: xr.Dataset) -> str:
    """Colour of a campaign, that of rig or field, or of its place in a pair."""
    return COLOURS[str(dataset.attrs.get(_COLOUR, kind_of(dataset)))]


def as_pair(datasets: Mapping[str, xr.Dataset]) -> list[xr.Dataset]:
    """Results of two campaigns of one kind with their names and colours."""
    return [
        data.assign_attrs({_NAME: name, _COLOUR: colour})
        for (name, data), colour in zip(datasets.items(), ("rig", "field"), strict=True)
    ]


def titles_of(datasets: Sequence[xr.Dataset]) -> list[str]:
    """Titles of the scenes of campaigns; where they coincide, what tables call them."""
    titles = [str(data.attrs.get("title", role_of(data))) for data in datasets]
    if len(set(titles)) == len(datasets):
        return titles
    return [role_of(data) for data in datasets]


def shown(name: str, values: Any) -> np.ndarray:
    """Values in the unit people read."""
    return np.asarray(values, dtype=np.float64) * QUANTITIES[name].shown_factor


def values_of(dataset: xr.Dataset, name: str, *at: Any) -> np.ndarray:
    """Values of a variable, at an index if one is given, in the unit people read."""
    return shown(name, dataset[name].values[at])


def with_unit(text: str, name: str) -> str:
    """Text with a capital letter and the shown unit of a quantity, if it has one."""
    unit = QUANTITIES[name].shown_unit
    return capital(text) + (f" [{unit}]" if unit not in ("", "1") else "")


def unbroken(text: str) -> str:
    """Head with units in square brackets at whose spaces lines do not break."""
    return re.sub(
        r"\[[^\]]*\]", lambda unit: unit[0].replace(" ", "\N{NO-BREAK SPACE}"), text
    )


def label(dataset: xr.Dataset, variable: str, name: str | None = None) -> str:
    """Axis label: long name of a variable.

    With the unit of quantity `name` (default: of the same name).
    """
    return with_unit(
        str(dataset[variable].attrs.get("long_name", variable)), name or variable
    )


def label_axes(
    ax: Axes, x: str, y: str, floor: float | None = None, width: int = 28
) -> Axes:
    """Label both axes, the vertical one in lines of `width` characters.

    `floor` is its lower end.
    """
    ax.set_xlabel(x)
    ax.set_ylabel(y if "\n" in y else wrapped(y, width))
    if floor is not None:
        ax.set_ylim(bottom=floor, auto=None)
    return ax


OUTWARD = "Height, outward\nis up [mm]"
"""Label of the heights of wheels, which are drawn flange up and left."""


def shape_axes(ax: Axes, x: str, y: str, **options: Any) -> Axes:
    """Label the axes of a profile, with equal scales by `options` of `set_aspect`.

    Heights of wheels, `OUTWARD`, grow upwards; those of rails and of the track, z,
    downwards.
    """
    ax.set_aspect("equal", **options)
    ax.yaxis.set_inverted(y != OUTWARD)
    return label_axes(ax, x, y)


def plain(value: Any, digits: int = 4, *, apart: bool = False) -> str:
    """Write a number with some significant digits and without exponent.

    Less than 0.0001 is said to be so. Thousands are set apart where `kilometres` does
    so, or all if `apart`, by spaces at which lines do not break.
    """
    value = float(value)
    if not np.isfinite(value):
        return "undefined"
    if value == 0.0:
        return "0"
    value = float(f"{value:.{digits - 1}e}") if abs(value) < 10.0**digits else value
    if abs(value) < 1e-4:
        return "< 0.0001" if value > 0.0 else "> \N{MINUS SIGN}0.0001"
    places = max(digits - 1 - int(np.floor(np.log10(abs(value)))), 0)
    apart = apart or abs(value) >= 9999.5
    text = f"{value:,.{places}f}" if apart else f"{value:.{places}f}"
    return text.replace("-", "\N{MINUS SIGN}").replace(",", "\N{NARROW NO-BREAK SPACE}")


def estimates(values: Iterable[float], digits: int = 3) -> list[str]:
    """Write estimates in one format: some significant digits and no more.

    Thousands of all are set apart where those of one are. Infinite ones are not in
    sight.
    """
    rounded = [float(f"{value:.{digits}g}") for value in values]
    apart = any(9999.5 <= abs(value) < np.inf for value in rounded)
    return [
        NOT_IN_SIGHT if np.isinf(value) else plain(value, digits, apart=apart)
        for value in rounded
    ]


def estimate(value: float, digits: int = 3) -> str:
    """Write one estimate, see `estimates`."""
    return estimates([value], digits)[0]


def band_text(ends: Sequence[float], unit: str = "") -> str:
    """Write the ends of a band with their unit; one number for a band without width."""
    low, high = estimates(ends)
    unit = f" {unit}" if unit else ""
    if low == NOT_IN_SIGHT:
        return NOT_IN_SIGHT
    if high == NOT_IN_SIGHT:
        return f"{low}{unit} to {high}"
    return f"{low}{unit}" if low == high else f"{low} to {high}{unit}"


def distance_text(distance: Any, digits: int = 4) -> str:
    """Write a distance [m] in km as a terminal has it, without breaks within it."""
    if not np.isfinite(distance):
        return f"{plain(distance)} km"
    text = kilometres(float(distance), digits)
    return text.replace(" ", "\N{NARROW NO-BREAK SPACE}")


def in_terminal(text: str) -> str:
    """Text with the spaces and minus signs of a terminal."""
    return text.replace("\N{MINUS SIGN}", "-").replace("\N{NARROW NO-BREAK SPACE}", " ")


def wrapped(text: str, width: int = 28) -> str:
    """Label of a vertical axis in lines short enough for it."""
    return textwrap.fill(text, width, break_long_words=False)


def capital(text: str) -> str:
    """Text with a capital first letter, the rest as it is."""
    return text[:1].upper() + text[1:]


def to_svg(figure: Figure, name: str) -> str:
    """Draw a figure as one `<svg>` element to be put into a page.

    It has no links, dates or anything else that changes from run to run. The name,
    unique on the page, keeps the ids of several figures apart.
    """
    buffer = io.StringIO()
    with style():
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.DOTALL)
    text = re.sub(r'\bid="([^"]+)"', rf'id="{name}-\1"', text)
    text = re.sub(r'(xlink:href="#|url\(#)', rf"\1{name}-", text)
    # the page sets the width; the view box keeps the shape
    for side in ("width", "height"):
        text = re.sub(rf'^<svg ([^>]*?)\b{side}="[^"]*"', r"<svg \1", text, count=1)
    return text.strip()


def save_svg(figure: Figure, path: Path) -> Path:
    """Write a figure as a file of its own; returns its path."""
    write_whole(
        path, f'<?xml version="1.0" encoding="utf-8"?>\n{to_svg(figure, path.stem)}\n'
    )
    return path


def write_figure(figure: Figure, path: Path) -> Path:
    """Write a figure as .png, .svg or .pdf by the suffix of `path`.

    Raise ResultError if that fails.
    """
    kind = path.suffix[1:].lower()
    with style():
        if kind == "svg":
            return save_svg(figure, path)
        metadata = {"CreationDate": None} if kind == "pdf" else {"Software": None}
        content = io.BytesIO()
        figure.savefig(content, format=kind, dpi=150, metadata=metadata)
    write_whole(path, content.getvalue())
    return path
