"""Gauge values of wheel profiles."""

from __future__ import annotations

import numpy as np

from wearsim.errors import ProfileError
from wearsim.profile.shape import FloatArray, crossing, extremum


def _tread_side(y: FloatArray, z: FloatArray) -> int:
    """Vertex of the flange tip, checked to lie before the tape circle."""
    tip = int(np.argmax(z))
    if not (y[tip] < 0.0 < y[-1]):
        raise ProfileError(
            f"the wheel profile has its largest z at y = {y[tip] * 1e3:.4g} mm; a flange at negative y and a "
            "tread beyond the tape circle (y = 0) are needed"
        )
    return tip


def _tape_level(y: FloatArray, z: FloatArray) -> float:
    """Height of the profile at the tape circle y = 0 [m]."""
    tip = _tread_side(y, z)
    before = tip + int(np.flatnonzero(y[tip:] <= 0.0)[-1])
    return crossing(z, y, before, 0.0)


def flange_height(y: FloatArray, z: FloatArray) -> float:
    """Flange height Sh: from the tape circle to the flange tip.

    Parameters
    ----------
    y, z : (n,) array
        Wheel profile [m].

    Returns
    -------
    float
        Sh [m]; 28 mm for a new S1002.
    """
    tip = _tread_side(y, z)
    return extremum(y, z, tip)[1] - _tape_level(y, z)


def _flank_at_level(y: FloatArray, z: FloatArray, level: float) -> float:
    """Lateral position where the active flank has the height `level` above the tape circle [m]."""
    tip = _tread_side(y, z)
    height = z - _tape_level(y, z)
    above = np.flatnonzero((height[tip:] >= level) & (y[tip:] < 0.0))
    if level <= 0.0 or len(above) == 0:
        raise ProfileError(
            f"the flange does not reach {level * 1e3:g} mm above the tape circle, where Sd is measured"
        )
    return crossing(y, height, tip + int(above[-1]), level)


def flange_thickness(
    y: FloatArray, z: FloatArray, *, level: float = 10e-3, flange_back: float = 70e-3
) -> float:
    """Flange thickness Sd at a height above the tape circle, from the nominal flange back.

    Parameters
    ----------
    y, z : (n,) array
        Wheel profile [m].
    level : float
        Height above the tape circle [m].
    flange_back : float
        Distance of the tape circle from the flange back [m].

    Returns
    -------
    float
        Sd [m]; 32.5 mm for a new S1002.
    """
    return flange_back + _flank_at_level(y, z, level)


def flange_gradient(y: FloatArray, z: FloatArray, *, level: float = 10e-3, below_tip: float = 2e-3) -> float:
    """Flange gradient qR: lateral distance of two points of the active flank.

    Parameters
    ----------
    y, z : (n,) array
        Wheel profile [m].
    level : float
        Height of the lower point above the tape circle [m].
    below_tip : float
        Depth of the upper point below the flange tip [m].

    Returns
    -------
    float
        qR [m]; 10.794 mm for a new S1002, falling as the flank gets steeper.
    """
    tip = _tread_side(y, z)
    upper = extremum(y, z, tip)[1] - below_tip
    under = np.flatnonzero(z[tip:] < upper)
    if below_tip <= 0.0 or len(under) == 0:
        raise ProfileError(
            f"the flange has no point {below_tip * 1e3:g} mm below its tip, where qR is measured"
        )
    return _flank_at_level(y, z, level) - crossing(y, z, tip + int(under[0]) - 1, upper)


def hollowing(y: FloatArray, z: FloatArray, *, start: float = -30e-3, end: float = 60e-3) -> float:
    """Hollow wear: the largest rise of the radius towards the field side of the tread.

    Parameters
    ----------
    y, z : (n,) array
        Wheel profile [m].
    start, end : float
        Range of the tread [m].

    Returns
    -------
    float
        Maximum of z(y2) - z(y1) over y1 < y2 within the tread; 0 for a new S1002 [m].
    """
    tread = z[(y >= start) & (y <= end)]
    if len(tread) == 0:
        raise ProfileError(f"the wheel profile has no tread within {start * 1e3:g} .. {end * 1e3:g} mm")
    return float(np.max(tread - np.minimum.accumulate(tread)))
