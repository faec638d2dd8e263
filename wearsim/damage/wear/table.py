r"""Wear law given by a user's table of a wear rate over an index.

It serves laws whose constants are too uncertain to ship, and a user's own measurements.
One index gives a line; sliding speed and pressure together give a map over a grid. The
column names define index and rate with their units, see `INDEX_COLUMNS` and
`RATE_COLUMNS`. Between rows the rate is linear, or constant from a row to the next.
Beyond the last row it stays constant or continues with the last slope. Below a first
row that is not at 0 it is proportional to the index, constant or zero. The table states
each of these rules. Without sliding there is no wear, whatever the first row states.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

from wearsim.contact.patch import FloatArray, IntArray, SurfaceFields
from wearsim.damage.coefficients.record import CoefficientSet
from wearsim.damage.wear.law import Form, WearLaw
from wearsim.damage.wear.sliding import (
    along_strips,
    mean_of,
    patch_total,
    relative_slip,
    spread,
)

REGIMES = ("below", "within", "beyond")
"""Regimes of a table: below the first row, between the rows, beyond the last row.

Below the first row the rate is an assumption that the table states. Beyond the last row
of a linear table it is an extrapolation; a step table is constant there by intention.
"""

INDEX_COLUMNS: dict[str, float] = {
    "T_gamma_A_N_mm2": 1e6,
    "power_density_W_mm2": 1e6,
    "slip_speed_m_s": 1.0,
    "pressure_MPa": 1e6,
}
"""Index columns and their SI unit.

They are frictional work per area and distance (local T-gamma/A), frictional power per
area, sliding speed and contact pressure. The last two together form a map.
"""

RATE_COLUMNS: dict[str, float] = {
    "mass_rate_ug_m_mm2": 1e-3,
    "energy_coefficient_mm3_kJ": 1e-12,
    "wear_coefficient": 1.0,
}
"""Rate columns and their SI unit.

They are mass lost per distance rolled and area, volume lost per frictional work, and
Archard's coefficient k (which needs `hardness_GPa`).
"""


@dataclass(frozen=True, eq=False)
class WearTable(CoefficientSet):
    """Table of a wear rate over one or two indices.

    Beyond the last row the rate is constant, or continues with the last slope (of a
    single linear index). Below a first row above 0 it is linear from the origin (in a
    map, proportional to each index below its first value), constant, or zero.
    """

    index: tuple[str, ...]  # one or two of `INDEX_COLUMNS`
    axes: tuple[FloatArray, ...]  # rising values (n,) of each index [SI]
    rate: str  # one of `RATE_COLUMNS`
    rates: FloatArray  # (n,) or (n, n2) at the values of the axes [SI]
    interpolation: str  # "linear", or "step": constant from a row to the next
    beyond: str  # "hold" or "slope"
    hardness: float = 0.0  # for Archard's coefficient [Pa]
    below: str = "hold"  # or "proportional" or "zero"

    @property
    def starts_above_zero(self) -> bool:
        """True if the index may lie below the first row."""
        return any(axis[0] > 0.0 for axis in self.axes)

    @property
    def numbers(self) -> tuple[str, ...]:
        """Description of the table and a hash of its rows, which may be thousands."""
        rows = hashlib.sha256()
        for array in (*self.axes, self.rates):
            rows.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
        return (
            f"{self.rate} over {' and '.join(self.index)}",
            f"{self.rates.size} rows sha256:{rows.hexdigest()[:12]}",
            f"{self.interpolation} between them",
            f"beyond the last {self.beyond}",
            *((f"below the first {self.below}",) if self.starts_above_zero else ()),
            *(
                (f"hardness = {1e-9 * self.hardness:.10g} GPa",)
                if self.hardness
                else ()
            ),
            *super().numbers,
        )


def rate_at(index: tuple[FloatArray, ...], table: WearTable) -> FloatArray:
    """Interpolate the wear rate at an index.

    Parameters
    ----------
    index : tuple of (...) arrays
        One value array for each index of the table [SI].
    table : WearTable
        With one or two indices.

    Returns
    -------
    (...) array
        [SI], never negative.
    """
    rate = _inside(index, table)
    if table.below == "hold":
        return rate
    for axis, value in zip(table.axes, index, strict=True):
        if table.below == "zero":
            rate = np.where(value < axis[0], 0.0, rate)
        elif axis[0] > 0.0:
            rate = rate * np.minimum(value / axis[0], 1.0)
    return rate


def _inside(index: tuple[FloatArray, ...], table: WearTable) -> FloatArray:
    """Rate between and beyond the rows; before the first row that of the first row."""
    if table.interpolation == "step":
        cells = tuple(
            np.clip(np.searchsorted(axis, value, side="right") - 1, 0, axis.size - 1)
            for axis, value in zip(table.axes, index, strict=True)
        )
        return np.where(np.isnan(sum(index)), np.nan, table.rates[cells])
    if len(index) == 1:
        axis, value = table.axes[0], index[0]
        rate: FloatArray = np.interp(value, axis, table.rates)
        if table.beyond == "slope" and axis.size > 1:
            slope = (table.rates[-1] - table.rates[-2]) / (axis[-1] - axis[-2])
            rate = rate + slope * np.maximum(value - axis[-1], 0.0)
        return np.maximum(rate, 0.0)
    total = np.zeros(np.broadcast_shapes(*(value.shape for value in index)))
    first, second = (
        _between(axis, value) for axis, value in zip(table.axes, index, strict=True)
    )
    for i, weight0 in first:
        for j, weight1 in second:
            total = total + weight0 * weight1 * table.rates[i, j]
    return total


def _by_regime(
    removed: FloatArray, index: tuple[FloatArray, ...], table: WearTable
) -> FloatArray:
    """Distribute rates over the `REGIMES`, along a new first axis.

    A step table has no regime beyond its last row.
    """
    below_first = np.zeros(
        np.broadcast_shapes(*(value.shape for value in index)), dtype=bool
    )
    beyond_last = below_first
    for axis, value in zip(table.axes, index, strict=True):
        below_first = below_first | (value < axis[0])
        if table.interpolation == "linear":
            beyond_last = beyond_last | (value > axis[-1])
    parts = (below_first, ~(below_first | beyond_last), beyond_last & ~below_first)
    return np.stack([np.where(part, removed, 0.0) for part in parts])


def _between(
    axis: FloatArray, value: FloatArray
) -> tuple[tuple[IntArray, FloatArray], ...]:
    """Rows below and above a value with their weights, constant beyond the axis."""
    if axis.size == 1:
        row = np.zeros(value.shape, dtype=np.int64)
        return ((row, np.where(np.isnan(value), np.nan, 1.0)),)
    low = np.clip(np.searchsorted(axis, value, side="right") - 1, 0, axis.size - 2)
    share = np.clip((value - axis[low]) / (axis[low + 1] - axis[low]), 0.0, 1.0)
    return (low, 1.0 - share), (low + 1, share)


def depth(
    fields: SurfaceFields,
    area: FloatArray,
    coefficients: CoefficientSet,
    *,
    form: Form = "local",
    density: float = 7850.0,
) -> FloatArray:
    r"""Depth removed by one passage of each patch [m], see `WearLaw`.

    `coefficients` is a `WearTable`.

    Notes
    -----
    Mass rate K: :math:`\Delta z = \frac{1}{\rho}\int K dx` over the cells that slip;
    energy coefficient: :math:`\int k_e\, |\tau \cdot s|/V\, dx`; Archard's coefficient:
    :math:`\int k\, p |s| / (V H)\, dx`. The mean of the sliding speed over a patch is
    weighted with the pressure.
    """
    if not isinstance(coefficients, WearTable):
        raise TypeError(f"law table needs a WearTable, not the set {coefficients.name}")
    local, table = form == "local", coefficients
    slip, speed = relative_slip(fields), fields.speed
    work, sliding = np.maximum(fields.work_density, 0.0), fields.pressure * slip
    if local:  # index of each cell, else the mean of each patch
        work_at, slip_at, pressure_at, speed = (
            work,
            slip,
            fields.pressure,
            speed[:, None, None],
        )
    else:
        work, sliding = along_strips(work, fields), along_strips(sliding, fields)
        load = patch_total(along_strips(fields.pressure, fields), fields)
        work_at, pressure_at = (
            mean_of(patch_total(work, fields), area),
            mean_of(load, area),
        )
        slip_at = mean_of(patch_total(sliding, fields), load)
    values = {
        "T_gamma_A_N_mm2": work_at,
        "power_density_W_mm2": work_at * speed,
        "slip_speed_m_s": slip_at * speed,
        "pressure_MPa": pressure_at,
    }
    index = tuple(values[name] for name in table.index)
    rate = rate_at(index, table)
    across = rate if local else rate[:, None]
    if table.rate == "energy_coefficient_mm3_kJ":
        removed = across * work
    elif table.rate == "wear_coefficient":
        removed = across * sliding / table.hardness
    elif local:
        removed = np.where(work == 0.0, 0.0, rate) / density
    else:
        removed = spread(rate * area / density, work, fields)
    if local:
        return along_strips(_by_regime(removed, index, table), fields)
    return _by_regime(removed, tuple(value[:, None] for value in index), table)


TABLE = WearLaw(
    "table",
    depth,
    REGIMES,
    coefficients=None,
    parameters=("density", "table"),
    needs_friction=False,
    by_slip=lambda table: "slip_speed_m_s" in table.index,
    outside=(("below", "below the first row"), ("beyond", "beyond the last row")),
)
