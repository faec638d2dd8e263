"""Closed forms of contact mechanics, for users, documents and the tests of the numerical models.

`hertzian`: `axis_ratio`, `hertz`, `line_hertz`
    Normal contact of ellipses and lines.
`partial_slip`: `carter`, `cattaneo_mindlin`
    Partial slip of rolling cylinders, and of pressed bodies that do not roll.
`creep_forces`: `kalker_linear`, `full_slip`, `full_slip_spin_moment`, `frictional_power`
    Creep forces at very small and very large creepage.
`creep_forces`: `reduced_creepage`, `fastsim_elliptic_force`, `fastsim_elliptic_slip_border`,
`fastsim_strip_work`
    Simplified theory for pure longitudinal creepage.
`linear_creepage.linear_creepage`
    Creepages of a wheelset on a track or on rollers, to second order.
`rig_ratios`: `normal_ratios`, `normal_exponents`, `spin_ratio`, `longitudinal_creepage_ratio`,
`creep_stiffness_ratios`, `load_ratio_for_equal_pressure`, `load_ratio_for_equal_area`
    Roller rig against field.
"""
