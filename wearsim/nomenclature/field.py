"""Quantities of cells and strips of one patch, and of sections across the track."""

from __future__ import annotations

from wearsim.nomenclature.row import INDEX, LATERAL, MICRON, ON_WHEEL, Row

_TRACK = "in the axes of the track, positive to the right"
_FORWARD = "positive in rolling direction"

ROWS: tuple[Row, ...] = (
    (
        "lateral",
        "y",
        "m",
        "lateral position in the contact plane",
        f"from the pressure-weighted centre of the patch, {_TRACK}",
        None,
    ),
    ("strip_wheel_y", "y", "m", "position of the strip on the wheel profile", LATERAL, None),
    ("strip_wheel_y_edges", "y", "m", "edges of the strips on the wheel profile", LATERAL, None),
    ("strip_rail_y_edges", "y", "m", "edges of the strips on the rail or roller profile", LATERAL, None),
    ("strip_work", "e", "J m-2", "frictional work per area and passage", "", ("J/m²", 1.0)),
    ("cell_pressure", "p", "Pa", "contact pressure on the grid of the normal model", "", None),
    ("grid_lead", "x", "m", "leading end of the grid of the normal model", _FORWARD, None),
    ("grid_trail", "x", "m", "trailing end of the grid of the normal model", _FORWARD, None),
    ("strip_width", "Δy", "m", "width of a strip", "", None),
    (
        "longitudinal",
        "x",
        "m",
        "longitudinal position in the contact plane",
        f"from the contact line, {_FORWARD}",
        None,
    ),
    ("x_lead", "x", "m", "leading end of the strip", _FORWARD, None),
    ("x_trail", "x", "m", "trailing end of the strip", _FORWARD, None),
    ("cells_lead", "x", "m", "leading end of the strip's row of cells", _FORWARD, None),
    ("cells_trail", "x", "m", "trailing end of the strip's row of cells", _FORWARD, None),
    ("pressure", "p", "Pa", "contact pressure", "", None),
    ("shear_x", "τx", "Pa", "longitudinal shear stress", ON_WHEEL, None),
    ("shear_y", "τy", "Pa", "lateral shear stress", f"acting on the wheel, {_TRACK}", None),
    ("slip_x", "sx", "1", "longitudinal slip velocity over the speed", _FORWARD, None),
    ("slip_y", "sy", "1", "lateral slip velocity over the speed", _TRACK, None),
    ("slipping", "", "1", "whether the cell slips", "1 slip, 0 stick", None),
    ("work_density", "w", "Pa", "frictional work per area and distance run", "", INDEX),
    (
        "section_y",
        "y",
        "m",
        "lateral position in the track",
        "from the origin line of the wheel profile at rest, positive to the right",
        None,
    ),
    (
        "section_z",
        "z",
        "m",
        "height in the track",
        "positive down, 0 at the top of the counterface",
        None,
    ),
    ("gap", "g", "m", "gap of the unloaded profiles along the normal", "0 where they touch first", MICRON),
)
