"""Draw the picture of the README from the result files of its main job."""

import argparse
from pathlib import Path

from wearsim import open_results
from wearsim.report.plates import wear_depth
from wearsim.report.style import save_svg

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("directory", type=Path, help="run directory")
parser.add_argument("picture", type=Path, help="SVG file to write")
arguments = parser.parse_args()

with (
    open_results(arguments.directory / "rig.nc") as rig,
    open_results(arguments.directory / "field.nc") as field,
):
    figure = wear_depth([rig.load(), field.load()])
save_svg(figure, arguments.picture)
