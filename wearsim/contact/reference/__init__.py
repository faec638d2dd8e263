"""Closed forms of contact mechanics, for users, documents and the tests of the numerical models.

`hertzian`: `axis_ratio`, `hertz`, `line_hertz`
    Normal contact of ellipses and lines.
`partial_slip`: `carter`
    Partial slip of rolling cylinders.
`creep_forces`: `kalker_linear`, `full_slip`, `full_slip_spin_moment`, `frictional_power`
    Creep forces at very small and very large creepage.
`creep_forces`: `reduced_creepage`, `fastsim_elliptic_force`, `fastsim_elliptic_slip_border`,
`fastsim_strip_work`
    Simplified theory for pure longitudinal creepage.
`linear_creepage.linear_creepage`
    Creepages of a wheelset on a track or on rollers, to second order.
"""
