"""`wearsim profile`: measures, limits, running behaviour, wear, conversion and figures of profiles."""

from __future__ import annotations

import argparse
import re

from wearsim.cli import Commands, add_command
from wearsim.cli.profile_flags import add_flags, request_of

_EXAMPLES = """\
wearsim profile S1002
wearsim profile S1002/h30 --rail 60E2 --inclination 1:20
wearsim profile profiles/measured/wheel_worn_right.whl --against S1002 --plot worn.png
wearsim profile profiles/measured/wheel_worn_right.whl --left profiles/measured/wheel_worn_left.whl
wearsim profile profiles/measured/wheel_worn_right.whl --turn-to S1002 --diameter-mm 900
wearsim profile profiles/measured/rail_worn_outer.ban --wheel S1002 --json
wearsim profile points.csv --kind wheel --units in --convert miniprof --out wheel.whl
wearsim profile --fleet profiles/measured --against S1002 --plot fleet.pdf"""


def add_parser(commands: Commands) -> None:
    """Add the command."""
    parser = add_command(
        commands,
        "profile",
        "measure a wheel or rail profile, standard or from a file: Sh, Sd, qR, limits, conicity, wear; "
        "convert and draw it; or measure a whole folder",
        _EXAMPLES,
    )
    parser._negative_number_matcher = re.compile(r"-\.?\d")
    add_flags(parser)


def execute(arguments: argparse.Namespace) -> int:
    """Measure and print; write what is wanted."""
    from wearsim.errors import Fault, SceneError

    request, faults = request_of(arguments)
    if request is None or (faults and (request.name is None or request.fleet is not None)):
        raise SceneError([Fault(fault) for fault in faults])
    code: int
    if request.fleet is not None:
        from wearsim.cli.profile_fleet import measure_fleet

        code = measure_fleet(request)
    else:
        from wearsim.cli.profile_run import measure_one

        code = measure_one(request, faults)
    return code
