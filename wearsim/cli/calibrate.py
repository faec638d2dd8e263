"""`wearsim calibrate`: what measured wheels tell about the inputs of a scene."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from wearsim.cli import print_json
from wearsim.cli.flags import STDIN, overrides_of
from wearsim.cli.progress import runner
from wearsim.cli.report import write_report
from wearsim.cli.streams import print_layout
from wearsim.errors import Fault, SceneError
from wearsim.studies import calibration
from wearsim.studies.learned import FILE


def execute(arguments: argparse.Namespace) -> int:
    """Run the campaigns, write the posterior and its report."""
    if arguments.scene == STDIN:
        text = (
            "calibrate reads the scene again for each campaign; give a file, not stdin"
        )
        raise SceneError([Fault(text)])
    out = Path(arguments.out or f"{Path(arguments.scene).stem}_learned")
    began = _cpu_seconds()
    try:
        with runner(arguments, "campaign", out / calibration.FOLDER) as run:
            posterior = calibration.calibrate(
                arguments.scene,
                arguments.measured,
                out,
                run.executor,
                overrides=overrides_of(arguments.set),
                jobs=run.jobs,
                command=run.command,
                report=run.report,
            )
    except KeyboardInterrupt:
        text = "interrupted; the same command goes on where the campaigns stopped"
        print(text, file=sys.stderr)
        return 130
    print_layout(arguments.measured)
    seconds = _cpu_seconds() - began
    report = write_report(out)
    if arguments.json:
        inputs = calibration.table_of(posterior)
        files = {"posterior": str(out / FILE), "report": str(report)}
        checks = calibration.checks_of(posterior)
        print_json({"inputs": inputs, **checks, "cpu_seconds": seconds, **files})
    else:
        print(calibration.text_of(posterior))
        print(f"{seconds:.0f} s of CPU time on this machine")
        print(f"report: {report}")
    return 0


def _cpu_seconds() -> float:
    """CPU time of this process and of its processes that have ended [s]."""
    return sum(os.times()[:4])
