"""Whether the headers of two files fit the roles they are given."""

from __future__ import annotations

from pathlib import Path

from wearsim.studies.profile_subject import Subject

_SAME = ("Stock", "CarNo", "AxleNo", "Side", "WheelID")
"""Header keys that two measurements of one wheel share."""

_LEFT = {"l", "left", "li", "links", "g", "gauche", "i", "izq"}
_RIGHT = {"r", "right", "re", "rechts", "d", "droite", "der"}
_SHOWN = 40  # characters of a value


def side_of(subject: Subject) -> str:
    """Side that the header of a file tells.

    Parameters
    ----------
    subject : Subject
        Any profile.

    Returns
    -------
    str
        "left", "right", or "" if the header does not say.
    """
    word = subject.key("Side").strip(" %.").lower()
    return "left" if word in _LEFT else "right" if word in _RIGHT else ""


def axle_notes(right: Subject, left: Subject) -> tuple[str, ...]:
    """Contradictions between the sides of an axle and the headers of their files.

    Parameters
    ----------
    right, left : Subject
        Wheels as they are used.

    Returns
    -------
    tuple of str
        One sentence for each file that says the other side, and one if both are the same file.
    """
    roles = (("right", right), ("left", left))
    same = right.measured and left.measured and Path(right.given).resolve() == Path(left.given).resolve()
    one = (f"{right.given} is given for both wheels",) if same else ()
    return one + tuple(
        f"used as the {role} wheel, but the header of {subject.given} says Side = "
        f"{subject.key('Side')[:_SHOWN]}"
        for role, subject in roles
        if side_of(subject) not in ("", role)
    )


def comparison_notes(subject: Subject, reference: Subject) -> tuple[str, ...]:
    """Contradictions between the headers of two measurements that are compared.

    Parameters
    ----------
    subject, reference : Subject
        Profiles.

    Returns
    -------
    tuple of str
        One sentence with all keys that both headers hold and that differ; none on standard shapes.
    """
    differ = []
    for name in _SAME:
        here, there = (" ".join(each.key(name).split()) for each in (subject, reference))
        if name == "Side" and side_of(subject) and side_of(reference):
            here, there = side_of(subject), side_of(reference)
        if here and there and here.lower() != there.lower():
            differ.append(f"{name} {here[:_SHOWN]!r} against {there[:_SHOWN]!r}")
    if not differ:
        return ()
    return (f"is it the same {subject.kind}? The headers differ: {', '.join(differ)}",)
