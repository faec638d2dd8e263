"""Closed forms of contact mechanics, for users, documents and the tests of the numerical models.

`axis_ratio`, `hertz`, `line_hertz`
    Normal contact of ellipses and lines.
`carter`, `cattaneo_mindlin`
    Partial slip of rolling cylinders, and of pressed bodies that do not roll.
`kalker_linear`, `full_slip`, `full_slip_spin_moment`, `frictional_power`
    Creep forces at very small and very large creepage.
`reduced_creepage`, `fastsim_elliptic_force`, `fastsim_elliptic_slip_border`, `fastsim_strip_work`
    Simplified theory for pure longitudinal creepage.
`linear_creepage`
    Creepages of a wheelset on a track or on rollers, to second order.
`normal_ratios`, `normal_exponents`, `spin_ratio`, `longitudinal_creepage_ratio`, `creep_stiffness_ratios`,
`load_ratio_for_equal_pressure`, `load_ratio_for_equal_area`
    Roller rig against field.
"""

from wearsim.contact.reference.creep_forces import (
    fastsim_elliptic_force,
    fastsim_elliptic_slip_border,
    fastsim_strip_work,
    frictional_power,
    full_slip,
    full_slip_spin_moment,
    kalker_linear,
    reduced_creepage,
)
from wearsim.contact.reference.hertzian import EllipticContact, LineContact, axis_ratio, hertz, line_hertz
from wearsim.contact.reference.linear_creepage import linear_creepage
from wearsim.contact.reference.partial_slip import (
    RollingCylinders,
    TangentialLoading,
    carter,
    cattaneo_mindlin,
)
from wearsim.contact.reference.rig_ratios import (
    NormalRatios,
    StiffnessRatios,
    creep_stiffness_ratios,
    load_ratio_for_equal_area,
    load_ratio_for_equal_pressure,
    longitudinal_creepage_ratio,
    normal_exponents,
    normal_ratios,
    spin_ratio,
)

__all__ = [
    "EllipticContact",
    "LineContact",
    "NormalRatios",
    "RollingCylinders",
    "StiffnessRatios",
    "TangentialLoading",
    "axis_ratio",
    "carter",
    "cattaneo_mindlin",
    "creep_stiffness_ratios",
    "fastsim_elliptic_force",
    "fastsim_elliptic_slip_border",
    "fastsim_strip_work",
    "frictional_power",
    "full_slip",
    "full_slip_spin_moment",
    "hertz",
    "kalker_linear",
    "line_hertz",
    "linear_creepage",
    "load_ratio_for_equal_area",
    "load_ratio_for_equal_pressure",
    "longitudinal_creepage_ratio",
    "normal_exponents",
    "normal_ratios",
    "reduced_creepage",
    "spin_ratio",
]
