"""Normal contact models by name: from gap and load to patch, pressure and approach."""

from wearsim.contact.normal import half_space, hertz, kik_piotrowski, knothe_le_the
from wearsim.contact.normal.border import guarded
from wearsim.contact.normal.model import NormalModel, NormalSolution

NORMAL_MODELS: dict[str, NormalModel] = {
    "half_space": guarded(half_space.solve),
    "hertz": guarded(hertz.solve),
    "kik_piotrowski": guarded(kik_piotrowski.solve),
    "knothe_le_the": guarded(knothe_le_the.solve),
}

NEVER_LEADS: frozenset[str] = frozenset({"hertz"})
"""Normal models that must not lead a profile update.

An ellipse from the curvatures under one point neither sees nor damps a wave shorter than itself: the wear
of a small bump is that of the smooth profile around it, and what a step adds to the bump stays. The first
noise in the profile would grow or freeze instead of being worn away.
"""

ANSWERS_BY_STRIP: frozenset[str] = frozenset({"kik_piotrowski"})
"""Normal models in which each strip answers to its own depth only.

Their stability number S, the sum of depth over interpenetration, tells how a step acts on a wave of any
length, so that it can be damped by it.
"""

__all__ = ["ANSWERS_BY_STRIP", "NEVER_LEADS", "NORMAL_MODELS", "NormalModel", "NormalSolution"]
