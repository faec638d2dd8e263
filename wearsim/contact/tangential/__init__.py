"""Tangential contact models by name: from patch, pressure and creepage to shear, slip and forces.

model                                    force                  power                  strip work
=======================================  =====================  =====================  =====================
`fastsim`                                0.7 12.0 | 2.5 4.6     2.6  6.8 | 1.4 3.9      9.0 15.1 | 2.4 4.8
flexibilities blended by creepage [1]_   0.7 10.7 | 2.2 4.0     2.6  6.4 | 1.4 3.9      9.0 14.9 | 2.4 4.4
one flexibility                          1.0  5.6 | 1.7 3.9     2.3  8.3 | 1.5 3.9     10.0 17.4 | 1.8 3.9
strip theory, after FaStrip [2]_         1.0  6.3 | 0.6 3.8     7.0 18.0 | 0.0 0.4     17.6 26.8 | 0.2 1.8
the same, tied by the half-space         0.6  3.5 | 0.4 1.2     2.4  3.8 | 0.0 0.1      8.9 13.5 | 0.2 1.8
full slip, closed form                    66   84 | 0.3 9.7     386  750 | 0.0 0.5      386  750 | 0.2 1.9
=======================================  =====================  =====================  =====================

The blend changes too little to stand beside `fastsim`. FaStrip is closer where nearly all slips and much
farther where little does: strips hand power to one another, and what one dissipates is not its own traction
times its own rigid slip. With tractions of strips that stick from the half-space instead of Kalker's
coefficients, large errors of force and power fall to about a half and less; strip work where little slips
stays as wrong, the tangential part takes some nine times as long, and where lateral creepage opposes spin
(CONTACT's example of 8 x 4 mm) its power is 24 % off, FASTSIM's 11 %.

Local power: the slip of a cell is multiplied by the mean of the tractions at its ends, and the patch scaled
to the power of its resultants. With the rigid slip less one flexibility times the change of traction instead,
strip work is 9.4 15.5 | 1.9 3.9 after scaling; without scaling it is 9.7 24.0 | 1.7 3.9, and the power is
3.8 21.7 | 1.4 3.9: with three flexibilities local and resultant power differ under spin. The scaling stays.

References
----------
.. [1] E. A. H. Vollebregt, P. Voltr, Vehicle System Dynamics 61 (2023) 309.
.. [2] M. Sh. Sichani, R. Enblom, M. Berg, Vehicle System Dynamics 54 (2016) 748-764.
=======
The contract of a model stands in `contact.tangential.model`. Candidates that were tried and left out:
`reports/contact_models.md`.
"""

from wearsim.contact.registry import models_in
from wearsim.contact.tangential.model import TangentialModel, TangentialSolution

TANGENTIAL_MODELS: dict[str, TangentialModel] = models_in(__name__, __path__)

__all__ = ["TANGENTIAL_MODELS", "TangentialModel", "TangentialSolution"]
