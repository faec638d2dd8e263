"""Names of wear and fatigue laws, and of their coefficients, as texts write them."""

from __future__ import annotations

from wearsim.damage.coefficients import COEFFICIENT_SETS
from wearsim.damage.fatigue import FATIGUE_LAWS
from wearsim.damage.wear import WEAR_LAWS


def law_title(name: str) -> str:
    """Name of a wear or fatigue law as it is written in a text, with its form if any.

    Results name a law "usfd", and its other form "usfd (patch mean)".
    """
    short, bracket, form = name.partition(" (")
    law = WEAR_LAWS.get(short) or FATIGUE_LAWS.get(short)
    return ((law.title if law else "") or short.replace("_", " ")) + bracket + form


def set_title(name: str) -> str:
    """Name of a coefficient set as it is written in a text; the user's own as it is."""
    published = COEFFICIENT_SETS.get(name)
    return (published.title if published else "") or name
