"""Warnings on what was read: headers that contradict its use or its points, hollowing that is noise."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path

from wearsim.errors import ProfileError
from wearsim.profile.files.points import number_fault
from wearsim.profile.inspection.inputs import ProfileInput
from wearsim.profile.measures import hollowing
from wearsim.profile.smoothing import smoothed

NOISE_WAVELENGTH = 5e-3
"""Waves shorter than this are no hollowing: a contact band is ten times as wide [m]."""

MOST_NOISE = 50e-6
"""Share of the hollowing that such waves may have without a warning [m]."""

_HEADER_MEASURES = {
    # key: name of the measure, difference that smoothing in an instrument does not make [m]
    "Sh": ("flange_height", 0.3e-3),
    "Sd": ("flange_thickness", 0.3e-3),
    "qR": ("flange_gradient", 0.5e-3),
}
_SAME_WHEEL = ("Stock", "CarNo", "AxleNo", "Side", "WheelID")  # keys that measurements of one wheel share
_SIDES = {
    **dict.fromkeys(("l", "left", "li", "links", "g", "gauche", "i", "izq"), "left"),
    **dict.fromkeys(("r", "right", "re", "rechts", "d", "droite", "der"), "right"),
}
_SHOWN = 40  # characters of a header value


def side_of(given: ProfileInput) -> str:
    """Side given by the header of a file: "left", "right", or "" if it has none."""
    return _SIDES.get(given.key("Side").strip(" %.").lower(), "")


def axle_notes(right: ProfileInput, left: ProfileInput) -> tuple[str, ...]:
    """Contradictions between the sides of an axle and the headers of their files.

    Parameters
    ----------
    right, left : ProfileInput
        Wheels as they are used.

    Returns
    -------
    tuple of str
        One sentence for each file that says the other side, and one if both are the same file.
    """
    same = right.measured and left.measured and Path(right.given).resolve() == Path(left.given).resolve()
    one = (f"{right.given} is given for both wheels",) if same else ()
    return one + tuple(
        f"used as the {role} wheel, but the header of {each.given} says Side = {each.key('Side')[:_SHOWN]}"
        for role, each in (("right", right), ("left", left))
        if side_of(each) not in ("", role)
    )


def comparison_notes(given: ProfileInput, reference: ProfileInput) -> tuple[str, ...]:
    """Contradictions between the headers of two measurements that are compared.

    Parameters
    ----------
    given, reference : ProfileInput
        Profiles.

    Returns
    -------
    tuple of str
        One sentence with all keys that both headers hold and that differ; none on standard shapes.
    """
    differ = []
    for name in _SAME_WHEEL:
        here, there = (" ".join(each.key(name).split()) for each in (given, reference))
        if name == "Side" and side_of(given) and side_of(reference):
            here, there = side_of(given), side_of(reference)
        if here and there and here.lower() != there.lower():
            differ.append(f"{name} {here[:_SHOWN]!r} against {there[:_SHOWN]!r}")
    return (f"is it the same {given.kind}? The headers differ: {', '.join(differ)}",) if differ else ()


def header_notes(
    given: ProfileInput, values: Mapping[str, float], elsewhere: Collection[str] = ()
) -> tuple[str, ...]:
    """Contradictions between the gauge values of a header and those of the points below it.

    Parameters
    ----------
    given : ProfileInput
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
    differ = []
    for key, (name, most) in _HEADER_MEASURES.items():
        text = given.key(key).replace(",", ".")
        if name not in values or name in elsewhere or number_fault(text) is not None:
            continue
        header = 1e-3 * float(text)
        # instruments write 0 for what they did not measure
        if header > 0.0 and abs(header - values[name]) > most:
            differ.append((key, f"{1e3 * header:g}", f"{1e3 * values[name]:.2f}"))
    if not differ:
        return ()
    keys, stated, measured = (", ".join(words) for words in zip(*differ, strict=True))
    return (
        f"the header says {keys} = {stated} mm, the points give {measured} mm: it is old, of another wheel "
        "or taken at other distances",
    )


def hollowing_notes(given: ProfileInput, values: Mapping[str, float]) -> tuple[str, ...]:
    """Warning on a hollowing that is noise for a good part.

    Parameters
    ----------
    given : ProfileInput
        A wheel, as it was measured.
    values : mapping of str to float
        Its measures [m].

    Returns
    -------
    tuple of str
        One sentence; none if the hollowing stays without short waves.
    """
    whole = values.get("hollowing", 0.0)
    if whole <= MOST_NOISE or not given.measured:
        return ()
    try:
        profile = smoothed(given.profile, NOISE_WAVELENGTH)
        rest = hollowing(profile.y, profile.z)
    except ProfileError:
        return ()  # points too few to see short waves
    if whole - rest <= MOST_NOISE:
        return ()
    wavelength = f"{1e3 * NOISE_WAVELENGTH:g}"
    return (
        f"of {1e3 * whole:.3f} mm hollowing {1e3 * rest:.3f} mm are left without waves shorter than "
        f"{wavelength} mm: noise or dents (--smooth-mm {wavelength} takes them out)",
    )
