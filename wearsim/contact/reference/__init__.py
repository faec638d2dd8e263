"""Closed solutions of contact mechanics, for anybody's use and for the tests of the numerical models.

``hertz``, ``line_hertz``, ``axis_ratio``
    Normal contact of ellipses and lines.
``carter``, ``cattaneo_mindlin``
    Partial slip of rolling cylinders, and of pressed bodies that do not roll.
``kalker_linear``, ``full_slip``, ``full_slip_spin_moment``, ``frictional_power``
    Creep forces at very small and very large creepage.
``fastsim_*``, ``reduced_creepage``, ``parabolic_reduced_creepage``
    What simplified theory gives for pure longitudinal creepage.
``normal_ratios`` and the other ``*_ratio*`` functions
    Roller rig against field.
"""

from wearsim.contact.reference.fastsim import (
    fastsim_elliptic_force,
    fastsim_elliptic_slip_border,
    fastsim_parabolic_force,
    fastsim_strip_work,
    parabolic_reduced_creepage,
    reduced_creepage,
)
from wearsim.contact.reference.hertzian import (
    EllipticContact,
    LineContact,
    axis_ratio,
    hertz,
    line_hertz,
)
from wearsim.contact.reference.linear_theory import (
    frictional_power,
    full_slip,
    full_slip_spin_moment,
    kalker_linear,
)
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
    lateral_creepage_ratio,
    load_ratio_for_equal_area,
    load_ratio_for_equal_pressure,
    longitudinal_creepage_ratio,
    mild_ellipticity_area_ratio,
    normal_exponents,
    normal_ratios,
    saturated_power_ratio,
    small_creepage_power_ratio,
    spin_ratio,
    wear_depth_ratio,
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
    "fastsim_parabolic_force",
    "fastsim_strip_work",
    "frictional_power",
    "full_slip",
    "full_slip_spin_moment",
    "hertz",
    "kalker_linear",
    "lateral_creepage_ratio",
    "line_hertz",
    "load_ratio_for_equal_area",
    "load_ratio_for_equal_pressure",
    "longitudinal_creepage_ratio",
    "mild_ellipticity_area_ratio",
    "normal_exponents",
    "normal_ratios",
    "parabolic_reduced_creepage",
    "reduced_creepage",
    "saturated_power_ratio",
    "small_creepage_power_ratio",
    "spin_ratio",
    "wear_depth_ratio",
]
