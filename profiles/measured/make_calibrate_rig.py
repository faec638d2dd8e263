"""Write the measured wheels of workflows/calibrate_rig.toml.

A campaign of it, and an instrument.

Run as ``python make_calibrate_rig.py [FOLDER [TABLE]]``. The inputs of the campaign are
hidden here; the noise has fixed seeds, so the same files come out each time, within the
rounding of the campaign.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from make_measured import miniprof

import wearsim
from wearsim.profile.shape import resample, vertex_normals

HERE = Path(__file__).parent
SCENE = HERE.parents[1] / "workflows" / "calibrate_rig.toml"
TRUTH = {
    "wear coefficient": 1.37,
    "friction": 0.38,
    "yaw bias": 0.15,
    "shift bias": 0.2,
    "load": 1.02,
}
SEED = 7  # of the noise of the shipped files
AT_KM = (0, 300, 600, 1000)
NOISE, LENGTH, WHITE = 10e-6, 2e-3, 3e-6  # [m]
SHIFT, TILT = 0.05e-3, 0.5e-3  # of the instrument on the wheel [m, rad]
SPACING = 0.3e-3  # of the points [m]
MADE = "made by {} of wearsim, not measured"


def truth(folder: Path) -> Path:
    """Run the campaign with the hidden inputs; returns its result file."""
    scene = wearsim.load_scene(SCENE)
    overrides: dict[str, object] = {"uncertainty": None}
    for number, block in enumerate(scene.operation.blocks, start=1):
        of = f"operation.block.{number}"
        overrides |= {
            f"{of}.environment": TRUTH["wear coefficient"],
            f"{of}.friction": TRUTH["friction"],
            f"{of}.yaw_mrad": block.yaw_mrad + TRUTH["yaw bias"],
            f"{of}.shift_mm": block.shift_mm + TRUTH["shift bias"],
            f"{of}.load_kN": block.load_kN * TRUTH["load"],
        }
    (path,) = wearsim.run(SCENE, folder, overrides=overrides)
    return path


def noise(arc: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Noise along the normal with exponential correlation, and white noise [m]."""
    keep = np.exp(-np.diff(arc) / LENGTH)
    white = random.standard_normal(arc.size)
    made = [white[0]]
    for share, fresh in zip(keep, white[1:], strict=True):
        made.append(share * made[-1] + math.sqrt(1.0 - share**2) * fresh)
    return NOISE * np.array(made) + WHITE * random.standard_normal(arc.size)


def measured(profile: wearsim.Profile, random: np.random.Generator) -> np.ndarray:
    """Points (2, n) of a measurement in the axes of the instrument [m]."""
    even = resample(profile, SPACING)
    normal_y, normal_z = vertex_normals(even.y, even.z)
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(even.y), np.diff(even.z)))])
    off = noise(arc, random)
    y, z = even.y + normal_y * off, even.z + normal_z * off
    dy, dz = SHIFT * random.standard_normal(2)
    angle = TILT * random.standard_normal()
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * y - s * z + dy, s * y + c * z + dz])


def measure(
    result: Path,
    seed: int,
    folder: Path,
    table: Path,
    prefix: str = "",
    at_km: Sequence[int] = AT_KM,
    sides: Sequence[str] = ("right", "left"),
    program: str = "make_calibrate_rig.py",
) -> list[Path]:
    """Write the files of all measurements of a campaign, and their table.

    `prefix` is where the table names the files, `program` what their headers name as
    their origin; the table is the last of what is returned.
    """
    written = []
    rows = ["distance_km,wheel,profile"]
    for number, km in enumerate(at_km):
        for side in sides:
            worn = wearsim.worn_profile(result, side, 1e3 * km)
            random = np.random.default_rng([2 * number + (side == "left"), seed])
            y, z = 1e3 * measured(worn, random)
            name = f"{side}_{km}km.whl"
            header = {
                "ProgramName": program,
                "Side": side[0].upper(),
                "WheelID": f"{side} wheel at {km} km",
                "UOF1": MADE.format(program),
            }
            text = miniprof(y + 70.0, z, header)
            (folder / name).write_text(text, encoding="utf-8")
            written.append(folder / name)
            rows.append(f"{km},{side},{prefix}{name}")
    table.write_text("\n".join([*rows, ""]), encoding="utf-8")
    return [*written, table]


def make(folder: Path, table: Path) -> list[Path]:
    """Write the shipped files and their table; returns what was written."""
    with tempfile.TemporaryDirectory() as scratch:
        result = truth(Path(scratch) / "truth")
        return measure(result, SEED, folder, table, "measured/calibrate_rig/")


if __name__ == "__main__":
    given = [Path(argument) for argument in sys.argv[1:]]
    make(
        *(
            given
            if len(given) == 2
            else (HERE / "calibrate_rig", SCENE.with_suffix(".csv"))
        )
    )
