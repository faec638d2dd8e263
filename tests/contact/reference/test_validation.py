"""What closed forms refuse: shapes that do not fit, numbers outside the domain, and what are no numbers."""

import numpy as np
import pytest

from wearsim.contact.reference import creep_forces, hertzian, partial_slip
from wearsim.errors import ContactError


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: hertzian.hertz([1.0, 2.0], [1.0, 2.0, 3.0], 80e3, 115e9),
         r"^shapes do not fit together: longitudinal curvature \(2,\), lateral curvature \(3,\)$"),
        (lambda: hertzian.hertz(1.0, 1.0, np.nan, 115e9),
         r"^normal force = nan N must be above 0 and finite$"),
        (lambda: hertzian.hertz([[1.0], [1.0, 2.0]], 1.0, 80e3, 115e9),
         r"^longitudinal curvature A must be numbers in rows of equal length$"),
        (lambda: hertzian.line_hertz("x", 1e6, 115e9),
         r"^longitudinal curvature A must be numbers in rows of equal length$"),
        (lambda: hertzian.hertz(1.0, 1.0, 80e3, 115e9).pressure([0.0, np.inf], 0.0), r"^x = inf m must be"),
        (lambda: creep_forces.kalker_linear([0.001, 0.0, 0.1], 5e-3, 5e-3, 8e10, 0.3),
         r"^creepage has the shape \(3,\) and must have \(m, 3\): a row for each contact$"),
        (lambda: creep_forces.kalker_linear([[0.001, 0.0, 0.1]], [5e-3, 6e-3], 5e-3, 8e10, 0.3),
         r"^semi-axis a has the shape \(2,\) and must be a number or have \(1,\): one for each row"),
        (lambda: creep_forces.kalker_linear([[0.001, 0.0, 0.1]], 5e-3, 5e-3, [8e10, 8e10], 0.3),
         r"^shear modulus G has the shape \(2,\) and must be one number for all contacts$"),
        (lambda: creep_forces.full_slip([[0.0, 0.0]], 0.3, 80e3), r"^both creepages are 0: sliding"),
        (lambda: creep_forces.frictional_power([[1.0, 2.0]], [[1.0, 2.0, 3.0]], 20.0),
         r"^force has the shape \(1, 2\) and creepage \(1, 3\): they must be the same$"),
        (lambda: creep_forces.reduced_creepage(np.zeros((2, 2)), 5e-3, 5e-3, 8e10, 0.3, 0.3, 80e3),
         r"^creepages and semi-axes have the shape \(2, 2\) and must have one axis$"),
        (lambda: partial_slip.carter([1e-3, 2e-3], [5e-3, 5e-3, 5e-3], 1e9, 0.3, 115e9),
         r"^shapes do not fit together: creepage \(2,\), half length \(3,\)$"),
    ],
)  # fmt: skip
def test_refusals_name_the_argument_and_its_domain(call, message):
    with pytest.raises(ContactError, match=message):
        call()


def test_the_row_of_a_refusal_is_that_of_the_contact():
    """Creepages (m, 3): the row, not the place in the flattened array."""
    creepage = np.zeros((4, 3))
    creepage[2, 1] = np.nan
    with pytest.raises(ContactError) as fault:
        creep_forces.kalker_linear(creepage, 5e-3, 5e-3, 8e10, 0.3)
    assert fault.value.row == 2
