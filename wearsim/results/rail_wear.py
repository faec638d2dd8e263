"""Wear of the rails under a traffic of wheels such as those of a campaign."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearsim.contact.friction import FLANGE_ANGLE
from wearsim.errors import ResultError
from wearsim.quantities import GRAVITY, QUANTITIES
from wearsim.results.checks import group_names
from wearsim.results.file import loaded

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]

GROSS_TONNES = 1e8
"""Traffic to which rail wear refers [t]: 100 MGT."""

FACES = ("head", "gauge_face")
RAILS = ("outer", "inner")
NO_CO_EVOLUTION = (
    "The rail keeps its profile: it is passed by wheels of all ages, and a rail that "
    "wore under the wheel of this campaign alone would take the shape of that wheel. "
    "Read the depths as rates of a rail of this shape, not as its later shape."
)
"""Sentence that goes with every table of rail wear."""

_SPACING = 0.1e-3  # of the places along the rail [m]
# Curvature up to which track is straight [1/m], a radius of 10 km: the noise of a
# record does not decide which rail is the outer one.
_STRAIGHT = 1e-4


class _Patches(NamedTuple):
    """Patches of one row of a result, of all points of a class."""

    outer: NDArray[np.bool_]  # (m,) on the outer rail, on straight track the right one
    gauge_face: NDArray[np.bool_]  # (m,)
    place: FloatArray  # (m,) lateral position on the rail [m]
    area: FloatArray  # (m,) worn off the rail's section in one passage, weighted [m2]
    depth: FloatArray  # (m,) largest depth in one passage, weighted [m]
    width: FloatArray  # (m,) lateral extent of the strip of this depth and area [m]


def rail_wear(
    results: str | Path | xr.Dataset, axle_load: float | None = None
) -> xr.Dataset:
    r"""Wear depth [m] and area [m2] of rails per 100 million gross tonnes, by class.

    Parameters
    ----------
    results : str, Path or Dataset
        Result of a campaign in the field, its file or as `wearsim.open_results` gives
        it.
    axle_load : float, optional
        Load of an axle [N] by which gross tonnes are counted; by default that of the
        operating points of each class. The depth of a passage is that of the campaign.

    Returns
    -------
    xarray.Dataset
        `rail_wear_depth` (class, rail, face), the largest depth along the normal on
        head and gauge face [m]; `rail_worn_area` (class, rail) [m2]; `axle_load`
        (class) [N], `passages` (class), and `track_curvature` (class), that of the
        track itself [1/m], 0 from a radius of 10 km on. Rails are the outer and the
        inner one, on straight track the right and the left one.

    Raises
    ------
    ResultError
        If the result is none of rails, or the axle load is out of its range.

    Notes
    -----
    A rail is passed, a wheel revolves: the depth of the active law in one passage is
    not divided by a circumference. In terms of the stored rates per metre run, a patch
    takes :math:`2 \pi r\,dA/ds` of the rail's section, by the same law and
    coefficients as of the wheel, times the environment factor of its point. It is laid
    on the rail about `rail_y` as a strip of its largest depth along the normal that has
    this area; along y it extends by the cosine of its contact angle. From the angle of
    flange friction on, 40 degrees, a patch lies on the gauge face.
    Passages of 100 MGT are :math:`10^{11}\,\mathrm{kg}\,g / W` with the axle load W.
    Rows are averaged over the distance, so that the wheels are those of all ages of the
    campaign; the rail does not wear with them. Of vehicles a class has the leading and
    the trailing axles by their shares.

    Examples
    --------
    >>> import wearsim
    >>> wear = wearsim.rail_wear("out/field.nc")
    >>> wear["rail_wear_depth"].dims
    ('class', 'rail', 'face')
    """
    import xarray as xr

    dataset = loaded(results)
    if float(dataset.attrs.get("counterface_curvature", 0.0)) != 0.0:
        raise ResultError(
            "rail wear is that of a result in the field; this one is of a rig, whose "
            "rollers wear by [counterface.wear]"
        )
    if axle_load is not None and (fault := QUANTITIES["axle_load"].fault(axle_load)):
        raise ResultError(fault)
    weight = dataset["weight"].values
    named = _classes(dataset)
    classes = list(dict.fromkeys(named[weight > 0.0]))
    loads = 2.0 * dataset["wheel_load"].values
    curvature = _curves_of(dataset)
    shares = _shares_of_rows(dataset)
    depth = np.zeros((len(classes), len(RAILS), len(FACES)))
    area = np.zeros((len(classes), len(RAILS)))
    load, bend = np.zeros(len(classes)), np.zeros(len(classes))
    for k, name in enumerate(classes):
        part = np.where((named == name) & (weight > 0.0), weight, 0.0)
        part = part / part.sum()
        load[k] = float(part @ loads) if axle_load is None else axle_load
        bend[k] = float(part @ np.abs(curvature))
        depth[k], area[k] = _of_passage(dataset, part, shares)
    passages = GROSS_TONNES * 1e3 * GRAVITY / load
    about = {"units": "m", "long_name": "largest rail wear depth per 100 MGT"}
    return xr.Dataset(
        {
            "rail_wear_depth": (
                ("class", "rail", "face"),
                depth * passages[:, None, None],
                {**about, "comment": "along the normal of the rail"},
            ),
            "rail_worn_area": (
                ("class", "rail"),
                area * passages[:, None],
                {"units": "m2", "long_name": "worn area of the rail per 100 MGT"},
            ),
            "axle_load": ("class", load, {"units": "N", "long_name": "axle load"}),
            "passages": (
                "class",
                passages,
                {"units": "1", "long_name": "passages of an axle in 100 MGT"},
            ),
            "track_curvature": (
                "class",
                bend,
                {"units": "m-1", "long_name": "track curvature, magnitude"},
            ),
        },
        coords={"class": classes, "rail": list(RAILS), "face": list(FACES)},
        attrs={"comment": NO_CO_EVOLUTION},
    )


def track_of(dataset: xr.Dataset) -> FloatArray:
    """Curvature of the track at each operating point (n,) of a result [1/m].

    Results of version 0.2.0 hold that of the path of the wheelset alone.
    """
    held = "curve_curvature" in dataset
    values: FloatArray = dataset[
        "curve_curvature" if held else "track_curvature"
    ].values
    return values


def _curves_of(dataset: xr.Dataset) -> FloatArray:
    """Curvature of the track at each operating point (n,), 0 if straight [1/m]."""
    curvature = track_of(dataset)
    return np.where(np.abs(curvature) > _STRAIGHT, curvature, 0.0)


def _classes(dataset: xr.Dataset) -> NDArray[np.str_]:
    """Class of each operating point (n,), one for both axles of a bogie in a curve."""
    names = group_names(dataset).astype(str)
    if "vehicle" not in dataset.attrs:
        return names
    axles = (" leading", " trailing")
    return np.array(
        [name.removesuffix(axles[0]).removesuffix(axles[1]) for name in names]
    )


def _shares_of_rows(dataset: xr.Dataset) -> FloatArray:
    """Share of the distance that each row (n,) stands for: half of both steps at it."""
    run = dataset["distance"].values
    if run[-1] <= run[0]:
        return np.eye(1, run.size)[0]
    half = 0.5 * np.diff(run)
    shares: FloatArray = np.append(half, 0.0) + np.insert(half, 0, 0.0)
    return shares / shares.sum()


def _of_passage(
    dataset: xr.Dataset, part: FloatArray, shares: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Depth (rail, face) [m] and area (rail,) [m2] of a mean passage of a class."""
    ends = dataset["counterface_y"].values
    first, last = float(ends.min()) - 5e-3, float(ends.max()) + 5e-3
    grid = np.arange(first, last + _SPACING, _SPACING)
    along = np.zeros((len(RAILS), len(FACES), grid.size))
    area = np.zeros(len(RAILS))
    for share, patches in _rows(dataset, part, shares):
        for rail, on_rail in enumerate((patches.outer, ~patches.outer)):
            area[rail] += share * patches.area[on_rail].sum()
            for face, on_face in enumerate((~patches.gauge_face, patches.gauge_face)):
                at = on_rail & on_face
                along[rail, face] += share * _strip_depth(grid, patches, at)
    return along.max(axis=2), area


def _rows(
    dataset: xr.Dataset, part: FloatArray, shares: FloatArray
) -> Iterator[tuple[float, _Patches]]:
    """Share of the distance of each row, and the patches of the points of a class."""
    radius = float(dataset.attrs["wheel_radius"])
    factor = part * dataset["environment"].values
    to_the_right = _curves_of(dataset) > 0.0
    names = (
        "wear_area_rate",
        "wear_depth_rate_max",
        "rail_y",
        "wheel_y",
        "contact_angle",
        "side",
    )
    for row in np.flatnonzero(shares > 0.0):
        values = {name: dataset[name].values[row] for name in names}
        rate = values["wear_area_rate"]
        acting = np.isfinite(rate) & (factor > 0.0)[:, None] & (rate > 0.0)
        point, slot = np.nonzero(acting)
        patches = {name: value[point, slot] for name, value in values.items()}
        left = patches["side"] == 1
        y, z = (dataset[f"profile_{axis}"].values[row] for axis in "yz")
        height = np.where(
            left,
            np.interp(patches["wheel_y"], y[1], z[1]),
            np.interp(patches["wheel_y"], y[0], z[0]),
        )
        turn = 2.0 * np.pi * (radius + height)
        area, depth = (
            turn * factor[point] * patches[name]
            for name in ("wear_area_rate", "wear_depth_rate_max")
        )
        yield (
            float(shares[row]),
            _Patches(
                # a curve to the right has the left rail outside
                np.where(to_the_right[point], left, ~left),
                np.abs(patches["contact_angle"]) >= FLANGE_ANGLE,
                patches["rail_y"],
                area,
                depth,
                # the area over the depth is a length along the inclined surface
                area / depth * np.cos(patches["contact_angle"]),
            ),
        )


def _strip_depth(
    grid: FloatArray, patches: _Patches, at: NDArray[np.bool_]
) -> FloatArray:
    """Depth (n,) along the rail of the strips of some patches [m]."""
    edges = np.concatenate((grid - 0.5 * _SPACING, grid[-1:] + 0.5 * _SPACING))
    half = 0.5 * patches.width[at]
    low, high = patches.place[at] - half, patches.place[at] + half
    depth = patches.depth[at]
    # depth times extent up to each edge; its differences keep that of every strip
    reached = np.clip(edges[:, None], low, high) - low
    total: FloatArray = np.diff(reached @ depth) / _SPACING
    return total
