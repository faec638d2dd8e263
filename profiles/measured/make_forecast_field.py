"""Write the measured wheel of workflows/forecast_field.toml, after 5000 km in service.

Run as ``python make_forecast_field.py``. The wheel is of the steel that
`make_calibrate_rig.py` hides; environment and friction of its line are hidden here.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import make_calibrate_rig as rig

import wearsim

HERE = Path(__file__).parent
SCENE = rig.SCENE.with_name("forecast_field.toml")
TRUTH = {
    "wear coefficient": rig.TRUTH["wear coefficient"],
    "environment": 0.24,
    "friction": 0.33,
}
SEED = 8  # of the noise
AT_KM = (0, 5000)


def truth(folder: Path, distance_km: float) -> Path:
    """Run the wheelset with the hidden inputs; returns its result file."""
    scene = wearsim.load_scene(SCENE)
    environment = TRUTH["wear coefficient"] * TRUTH["environment"]
    overrides: dict[str, object] = {
        "uncertainty": None,
        "campaign.distance_km": distance_km,
    }
    for number, _ in enumerate(scene.operation.classes, start=1):
        overrides |= {
            f"operation.class.{number}.environment": environment,
            f"operation.class.{number}.friction": TRUTH["friction"],
        }
    (path,) = wearsim.run(SCENE, folder, overrides=overrides)
    return path


def make(folder: Path, table: Path) -> list[Path]:
    """Write the shipped files and their table; returns what was written."""
    folder.mkdir(exist_ok=True)
    prefix = f"measured/{folder.name}/"
    with tempfile.TemporaryDirectory() as scratch:
        result = truth(Path(scratch) / "truth", AT_KM[-1])
        return rig.measure(
            result,
            SEED,
            folder,
            table,
            prefix,
            at_km=AT_KM,
            sides=["right"],
            program=Path(__file__).name,
        )


if __name__ == "__main__":
    make(HERE / "forecast_field", SCENE.with_suffix(".csv"))
