"""What makes the measures of a wheel doubtful: a header that says otherwise, noise taken for hollowing."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from wearsim.errors import ProfileError
from wearsim.profile.formats.points import number_fault
from wearsim.profile.measures import hollowing
from wearsim.profile.noise import smoothed
from wearsim.studies.profile_subject import Subject

_HEADER = {
    # key: name of the measure, difference that smoothing in an instrument does not make [m]
    "Sh": ("flange_height", 0.3e-3),
    "Sd": ("flange_thickness", 0.3e-3),
    "qR": ("flange_gradient", 0.5e-3),
}
NOISE_WAVELENGTH = 5e-3
"""Waves shorter than this are no hollowing: a contact band is ten times as wide [m]."""

MOST_NOISE = 50e-6
"""Share of the hollowing that such waves may have without a word [m]."""


def header_notes(
    subject: Subject, values: Mapping[str, float], elsewhere: Collection[str] = ()
) -> tuple[str, ...]:
    """Contradictions between the gauge values of a header and those of the points below it.

    Parameters
    ----------
    subject : Subject
        A wheel.
    values : mapping of str to float
        Its measures [m].
    elsewhere : collection of str
        Measures taken at other distances than the usual ones, which no header means.

    Returns
    -------
    tuple of str
        One sentence on all of them; none if there are none.
    """
    told = []
    for key, (name, most) in _HEADER.items():
        text = subject.key(key).replace(",", ".")
        if name not in values or name in elsewhere or number_fault(text) is not None:
            continue
        said = 1e-3 * float(text)
        # instruments write 0 for what they did not measure
        if said > 0.0 and abs(said - values[name]) > most:
            told.append((key, f"{1e3 * said:g}", f"{1e3 * values[name]:.2f}"))
    if not told:
        return ()
    keys, said_so, measured = (", ".join(words) for words in zip(*told, strict=True))
    return (
        f"the header says {keys} = {said_so} mm, the points give {measured} mm: it is old, of another wheel "
        "or taken at other distances",
    )


def hollowing_notes(subject: Subject, values: Mapping[str, float]) -> tuple[str, ...]:
    """Tell a hollowing that is noise for a good part.

    Parameters
    ----------
    subject : Subject
        A wheel, as it was measured.
    values : mapping of str to float
        Its measures [m].

    Returns
    -------
    tuple of str
        One sentence; none if the hollowing stays without short waves.
    """
    found = values.get("hollowing")
    if found is None or found <= MOST_NOISE or not subject.measured:
        return ()
    try:
        profile = smoothed(subject.profile, NOISE_WAVELENGTH)
        rest = hollowing(profile.y, profile.z)
    except ProfileError:
        return ()  # points too few to tell short waves
    if found - rest <= MOST_NOISE:
        return ()
    wavelength = f"{1e3 * NOISE_WAVELENGTH:g}"
    return (
        f"of {1e3 * found:.3f} mm hollowing {1e3 * rest:.3f} mm are left without waves shorter than "
        f"{wavelength} mm: noise or dents (--smooth-mm {wavelength} takes them out)",
    )
