"""Settings of a law with its own coefficient set and form, and changes in other
fields.
"""

from wearsim.damage.fatigue import FATIGUE_LAWS, FatigueSettings
from wearsim.damage.wear import WEAR_LAWS, WearSettings


def wear_settings(law, **changes):
    record = WEAR_LAWS[law]
    return WearSettings(
        law=law,
        **{"coefficients": record.coefficients, "form": record.forms[0], **changes},
    )


def fatigue_settings(law, **changes):
    return FatigueSettings(
        law=law, **{"coefficients": FATIGUE_LAWS[law].coefficients, **changes}
    )
