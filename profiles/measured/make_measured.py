"""Write the measured examples of this folder.

New shapes, worn and with the noise of an instrument.

Run as ``python make_measured.py [FOLDER]``. The seeds are fixed: the same files come
out each time.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.special import expit

from wearsim.profile.alignment import prolonged
from wearsim.profile.placement import place_rail
from wearsim.profile.shape import Profile, resample
from wearsim.profile.standard import rail, wheel

FloatArray = NDArray[np.float64]
SPACING = 0.3e-3  # of the points, as instruments give them [m]
MADE = (
    "made by make_measured.py of wearsim, not measured; wear and noise are invented "
    "but plausible"
)


@dataclass(frozen=True)
class Bell:
    """Wear around one place: depth * exp(-|(at - centre)/half_width|^power).

    Parameters
    ----------
    depth, centre, half_width : float
        In mm; the depth along the inward normal.
    power : int
        2 for a groove, 4 and more for an even band.
    down : bool
        Whether the place is a height z, and the wear that of the gauge corner of a
        rail, instead of a lateral position.
    """

    depth: float
    centre: float
    half_width: float
    power: int = 2
    down: bool = False

    def __call__(self, y: FloatArray, z: FloatArray) -> FloatArray:
        """Return the depth [m] at points [m]."""
        away = (1e3 * (z if self.down else y) - self.centre) / self.half_width
        depth = 1e-3 * self.depth * np.exp(-(np.abs(away) ** self.power))
        return depth * expit(-(1e3 * y + 20.0) / 2.0) if self.down else depth


def worn(
    new: Profile, wear: tuple[Bell, ...], noise: float, length: float, seed: int
) -> Profile:
    """Worn profile with the noise of a measurement.

    Parameters
    ----------
    new : Profile
        Shape before wear.
    wear : tuple of Bell
        Added up.
    noise : float
        Its root mean square, along the normal [m].
    length : float
        Over which it is correlated (standard deviation of the Gaussian filter) [m].
    seed : int
        Of the noise.

    Returns
    -------
    Profile
        Points about `SPACING` apart.
    """
    even = resample(new, SPACING)
    y_along, z_along = np.gradient(even.y), np.gradient(even.z)
    step = np.hypot(y_along, z_along)
    # z is outward on a wheel and points into a rail, so the inward normal differs in
    # sign
    inward = -1.0 if new.kind == "wheel" else 1.0
    normal_y, normal_z = -inward * z_along / step, inward * y_along / step
    rough = gaussian_filter1d(
        np.random.default_rng(seed).standard_normal(len(even.y)), length / SPACING
    )
    depth = sum((bell(even.y, even.z) for bell in wear), start=np.zeros(len(even.y)))
    depth = depth + noise * rough / np.sqrt(np.mean(rough**2))
    return Profile(
        new.name, new.kind, even.y + normal_y * depth, even.z + normal_z * depth, MADE
    )


def miniprof(x: FloatArray, y: FloatArray, header: dict[str, str]) -> str:
    """Text of a MiniProf file from points in mm, Y towards the flange tip or up."""
    keys = {**header, "XYPoints": str(len(x)), "ColumnDef": "X,Y"}
    rows = [f"{a:.4f} {b:.4f}" for a, b in zip(x, y, strict=True)]
    return "\n".join(
        [*(f"{key}={value}" for key, value in keys.items()), "", *rows, ""]
    )


def simpack(y: FloatArray, z: FloatArray, comment: str) -> str:
    """Text of a SIMPACK wheel whose y is mirrored by its key."""
    head = f"""\
! {comment}
header.begin
  version       = 1
  type          = 1     ! 0 rail, 1 wheel
header.end
spline.begin
  comment        = '{comment}'
  shift.y        = 0
  shift.z        = 0
  rotate         = 0
  mirror.y       = 1
  mirror.z       = 0
  inversion      = 0
  units.len.f    = 1000 ! mm
  point.begin"""
    rows = [f"    {-a:.4f} {b:.4f}" for a, b in zip(y[::-1], z[::-1], strict=True)]
    return "\n".join([head, *rows, "  point.end", "spline.end", ""])


def make(folder: Path) -> list[Path]:
    """Write the examples.

    Parameters
    ----------
    folder : Path
        Where to; files of the same names are replaced.

    Returns
    -------
    list of Path
        What was written.
    """
    new = wheel("S1002")
    vehicle = {"Stock": "Example coach", "CarNo": "1", "AxleNo": "2"}
    head = {
        "ProgramName": "make_measured.py",
        "WheelDiameterTaperline": "70.0000",
        "UOF1": MADE,
    }
    tread, flank = Bell(1.6, -2.0, 24.0, 4), Bell(1.1, -38.5, 4.5)
    right = worn(new, (tread, flank), 3e-6, 0.5e-3, 1)
    left = worn(new, (Bell(2.1, 3.0, 23.0, 4), Bell(0.3, -38.0, 5.0)), 4e-6, 0.5e-3, 2)
    light = worn(new, (Bell(0.4, 0.0, 20.0, 4), Bell(0.2, -37.5, 4.0)), 2e-6, 0.6e-3, 3)
    upright = rail("60E1", 0.0, 1.435, 0.750)
    # the field side is measured less far down than the gauge side
    deep = prolonged(upright)
    inner = (deep.z < 30e-3) & ((deep.y < 0.0) | (deep.z < 13e-3))
    short = Profile("60E1", "rail", deep.y[inner], deep.z[inner])
    placed = place_rail(short, 1.0 / 40.0, 1.435, 0.750)
    outer = worn(
        placed,
        (Bell(1.2, 4.0, 20.0, 4), Bell(2.4, 5.0, 4.5, down=True)),
        5e-6,
        0.5e-3,
        4,
    )
    texts = {
        "wheel_worn_right.whl": miniprof(
            1e3 * right.y + 70.0,
            1e3 * right.z,
            {
                **head,
                **vehicle,
                "Side": "R",
                "WheelID": "example 1 right, new profile S1002",
            },
        ),
        # the instrument ran from the field side to the flange back
        "wheel_worn_left.whl": miniprof(
            1e3 * left.y[::-1] + 70.0,
            1e3 * left.z[::-1],
            {
                **head,
                **vehicle,
                "Side": "L",
                "WheelID": "example 1 left, new profile S1002",
            },
        ),
        "rail_worn_outer.ban": miniprof(
            -1e3 * outer.y[::-1],
            -1e3 * outer.z[::-1],
            {
                "ProgramName": "make_measured.py",
                "Line": "example curve, outer rail 60E1 at 1:40, gauge side at larger X",
                "UOF1": MADE,
            },
        ),
        "wheel_worn_light.prw": simpack(
            1e3 * light.y, 1e3 * light.z, f"S1002 after few kilometres, {MADE}"
        ),
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    return [folder / name for name in texts]


if __name__ == "__main__":
    make(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
