"""`wearsim contact`: one contact solution of one wheel."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from wearsim.cli import Commands, add_command

if TYPE_CHECKING:
    from wearsim.contact.solve import ContactSolution


@dataclass(frozen=True)
class _Number:
    """A flag with a number: its default, factor to SI, allowed range and meaning."""

    flag: str
    default: float | None
    factor: float
    low: float
    high: float
    meaning: str
    above: bool = False  # whether the lower limit itself is excluded


_NUMBERS = (
    _Number("--gauge-mm", 1435.0, 1e-3, 1000.0, 1700.0, "gauge, 14 mm below the top"),
    _Number("--flange-back-mm", 1360.0, 1e-3, 900.0, 1600.0, "distance of the flange backs"),
    _Number("--wheel-radius-mm", 460.0, 1e-3, 150.0, 1500.0, "wheel radius at the tape circle"),
    _Number("--roller-radius-mm", None, 1e-3, 50.0, 10000.0, "roller radius at its top; without it: rail"),
    _Number(
        "--curve-radius-m", None, 1.0, -1e6, 1e6, "curve radius, positive to the right; without it: tangent"
    ),
    _Number("--shift-mm", 0.0, 1e-3, -100.0, 100.0, "lateral shift of the wheelset, positive to the right"),
    _Number("--yaw-mrad", 0.0, 1e-3, -100.0, 100.0, "yaw of the wheelset, positive to the right"),
    _Number("--wheel-load-kN", None, 1e3, 0.0, 300.0, "vertical load of the wheel (default 80)", True),
    _Number("--normal-force-kN", None, 1e3, 0.0, 300.0, "normal force of the single patch, instead", True),
    _Number("--friction", 0.35, 1.0, 0.0, 1.0, "friction coefficient"),
    _Number("--speed-km-h", 72.0, 1.0 / 3.6, 0.0, 500.0, "speed", True),
    _Number("--youngs-GPa", 210.0, 1e9, 0.0, 1000.0, "Young's modulus of both bodies", True),
    _Number("--poisson", 0.3, 1.0, 0.0, 0.5, "Poisson's ratio of both bodies"),
    _Number("--strips", 50.0, 1.0, 4.0, 512.0, "strips across the patch"),
    _Number("--cells", 50.0, 1.0, 4.0, 1000.0, "cells along each strip"),
)

_PRINTED = (
    # column, attribute, factor to the shown unit, format
    ("wheel y [mm]", "wheel_y", 1e3, ".3f"),
    ("angle [mrad]", "contact_angle", 1e3, ".2f"),
    ("load [kN]", "normal_force", 1e-3, ".3f"),
    ("area [mm2]", "area", 1e6, ".1f"),
    ("pressure [MPa]", "max_pressure", 1e-6, ".0f"),
    ("creepage x", "creepage_x", 1.0, ".3e"),
    ("creepage y", "creepage_y", 1.0, ".3e"),
    ("spin [1/m]", "spin", 1.0, ".4f"),
    ("Fx [kN]", "force_x", 1e-3, ".3f"),
    ("Fy [kN]", "force_y", 1e-3, ".3f"),
    ("power [W]", "power", 1.0, ".1f"),
)

_PATCH_NAMES = (
    "wheel_y", "rail_y", "x", "contact_angle", "area", "max_pressure", "length", "width", "approach",
    "normal_force", "creepage_x", "creepage_y", "spin", "force_x", "force_y", "spin_moment", "slip_area",
    "power", "power_balance",
)  # fmt: skip


def add_parser(commands: Commands) -> None:
    """Add the command."""
    parser = add_command(
        commands,
        "contact",
        "solve the contact of one wheel with a rail or roller",
        "wearsim contact --wheel S1002 --rail 60E1 --inclination 1:40 --shift-mm 3\n"
        "wearsim contact --shift-mm 3 --roller-radius-mm 1000 --json",
    )
    parser.add_argument("--wheel", default="S1002", help="wheel profile, name or file (default S1002)")
    parser.add_argument("--rail", default="60E1", help="rail or roller profile, name or file (default 60E1)")
    parser.add_argument("--inclination", default="1:40", help="of the rail, 1:N or none (default 1:40)")
    for number in _NUMBERS:
        default = "" if number.default is None else f" (default {number.default:g})"
        parser.add_argument(
            number.flag, metavar="X", dest=number.flag, default=None, help=number.meaning + default
        )
    parser.add_argument(
        "--rotation",
        default="free",
        metavar="RULE",
        help="free (axle torque balance of both wheels), centred, nominal, or rad/s (default free)",
    )
    parser.add_argument(
        "--side", default="right", choices=("right", "left"), help="which wheel (default right)"
    )
    parser.add_argument(
        "--roll-mrad", metavar="X", dest="--roll-mrad", help="roll of the wheelset (default 0)"
    )
    parser.add_argument("--normal", default="kik_piotrowski", help="normal model (default kik_piotrowski)")
    parser.add_argument("--tangential", default="fastsim", help="tangential model (default fastsim)")
    parser.add_argument("--json", action="store_true", help="print JSON, SI units")


def execute(arguments: argparse.Namespace) -> int:
    """Solve and print."""
    import json

    solution, inputs = solved(arguments)
    if arguments.json:
        print(json.dumps(as_json(solution, inputs), indent=2))
    else:
        print(_text(solution, inputs))
    return 0


def solved(arguments: argparse.Namespace) -> tuple[ContactSolution, dict[str, Any]]:
    """Contact solution the flags ask for, and the operating point as JSON values.

    Parameters
    ----------
    arguments : argparse.Namespace
        Parsed flags.

    Returns
    -------
    solution : ContactSolution
        Of one point and one side.
    inputs : dict
        Shift, yaw, load, curvature and the models, SI units.

    Raises
    ------
    SceneError
        All faulty flags at once.
    """
    import numpy as np

    from wearsim.contact.normal import NORMAL_MODELS
    from wearsim.contact.solve import ContactConditions, ContactModels, Counterface, Wheelset, solve
    from wearsim.contact.tangential import TANGENTIAL_MODELS
    from wearsim.errors import Fault, ProfileError, SceneError
    from wearsim.profile.files import load_profile

    faults: list[str] = []
    values = {n.flag: _value(n, vars(arguments)[n.flag], faults) for n in _NUMBERS}
    roll = _value(
        _Number("--roll-mrad", 0.0, 1e-3, -100.0, 100.0, ""), vars(arguments)["--roll-mrad"], faults
    )
    inclination = _inclination(arguments.inclination, faults)
    rotation = _rotation(arguments.rotation, faults)
    for flag, name, table in (
        ("--normal", arguments.normal, NORMAL_MODELS),
        ("--tangential", arguments.tangential, TANGENTIAL_MODELS),
    ):
        if name not in table:
            faults.append(f"{flag} = {name!r} is not one of {', '.join(sorted(table))}")
    force, load = values["--normal-force-kN"], values["--wheel-load-kN"]
    if force is not None and load is not None:
        faults.append("--normal-force-kN and --wheel-load-kN exclude each other; give one of them")
    if values["--curve-radius-m"] == 0.0:
        faults.append("--curve-radius-m = 0 must not be 0 m; leave it out on tangent track")
    half_span = 0.5 * (values["--flange-back-mm"] or 0.0) + 0.070
    wheel = rail = None
    try:
        wheel = load_profile(arguments.wheel, "wheel")
    except ProfileError as error:
        faults.append(f"--wheel: {error}")
    if inclination is not None and values["--gauge-mm"]:
        try:
            rail = load_profile(
                arguments.rail,
                "rail",
                inclination=inclination,
                gauge=values["--gauge-mm"],
                half_span=half_span,
            )
        except ProfileError as error:
            faults.append(f"--rail: {error}")
    if faults or wheel is None or rail is None:
        raise SceneError([Fault(line) for fault in faults for line in fault.splitlines()])
    roller, curve = values["--roller-radius-mm"], values["--curve-radius-m"]
    curvature = 0.0 if roller is None else 1.0 / roller

    def one(value: float | None) -> Any:
        return np.array([0.0 if value is None else value])

    conditions = ContactConditions(
        shift=one(values["--shift-mm"]),
        yaw=one(values["--yaw-mrad"]),
        roll=one(roll),
        wheel_load=one(80e3 if force is None and load is None else force or load),
        speed=one(values["--speed-km-h"]),
        friction=one(values["--friction"]),
        track_curvature=one(None if curve is None else 1.0 / curve),
        rotation=rotation if isinstance(rotation, str) else one(rotation),
    )
    models = ContactModels(
        normal=arguments.normal,
        tangential=arguments.tangential,
        strips=int(values["--strips"] or 0),
        cells=int(values["--cells"] or 0),
        youngs_modulus=values["--youngs-GPa"] or 0.0,
        poisson_ratio=values["--poisson"] or 0.0,
    )
    solution = solve(
        conditions,
        Wheelset(wheel, wheel, values["--wheel-radius-mm"] or 0.0, half_span),
        Counterface(rail, curvature),
        models,
        sides=(0 if arguments.side == "right" else 1,),
        vertical=force is None,
    )
    inputs = {
        "shift": float(conditions.shift[0]),
        "yaw": float(conditions.yaw[0]),
        "wheel_load": None if force is not None else float(conditions.wheel_load[0]),
        "counterface_curvature": curvature,
        "models": {"normal": models.normal, "tangential": models.tangential},
        "side": arguments.side,
    }
    return solution, inputs


def as_json(solution: ContactSolution, inputs: dict[str, Any]) -> dict[str, Any]:
    """JSON values of a solution, SI units: one point with its patches."""
    patches = []
    for k in range(solution.point.size):
        patch: dict[str, Any] = {"side": inputs["side"]}
        patch |= {name: float(getattr(solution, name)[k]) for name in _PATCH_NAMES}
        patches.append(patch | inputs["models"])
    point = {name: inputs[name] for name in ("shift", "yaw", "wheel_load", "counterface_curvature")}
    point["rotation_speed"] = float(solution.rotation_speed[0])
    return {"points": [point | {"patches": patches}]}


def _text(solution: ContactSolution, inputs: dict[str, Any]) -> str:
    width = [max(len(title), 10) for title, *_ in _PRINTED]
    lines = ["  ".join(title.rjust(w) for (title, *_), w in zip(_PRINTED, width, strict=True))]
    for k in range(solution.point.size):
        cells = [
            format(getattr(solution, name)[k] * factor, style).rjust(w)
            for (_, name, factor, style), w in zip(_PRINTED, width, strict=True)
        ]
        lines.append("  ".join(cells))
    against = "rail" if inputs["counterface_curvature"] == 0.0 else "roller"
    count = "1 patch" if solution.point.size == 1 else f"{solution.point.size} patches"
    lines.append(
        f"{inputs['side']} wheel on {against}, {count}; rotation {solution.rotation_speed[0]:.4f} rad/s; "
        f"{inputs['models']['normal']}, {inputs['models']['tangential']}; forces act on the wheel"
    )
    return "\n".join(lines)


def _value(number: _Number, text: str | None, faults: list[str]) -> float | None:
    """SI value of a flag; what is wrong with it goes to `faults`."""
    import math

    if text is None:
        return None if number.default is None else number.default * number.factor
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    above = value > number.low if number.above else value >= number.low
    if not (above and value <= number.high):
        low = f"above {number.low:g}" if number.above else f"{number.low:g}"
        faults.append(
            f"{number.flag} = {text} must be a number from {low} to {number.high:g} ({number.meaning})"
        )
        return number.default
    if number.flag in ("--strips", "--cells") and value != int(value):
        faults.append(f"{number.flag} = {text} must be a whole number")
    return value * number.factor


def _inclination(text: str, faults: list[str]) -> float | None:
    """Slope of the rail's axis from 1:N or none."""
    if text == "none":
        return 0.0
    first, _, second = text.partition(":")
    if first.strip() == "1" and second.strip().isdigit() and 10 <= int(second) <= 100:
        return 1.0 / int(second)
    faults.append(
        f"--inclination = {text} must be 1:N with N from 10 to 100, or none; 60E1 mostly lies at 1:40"
    )
    return None


def _rotation(text: str, faults: list[str]) -> str | float:
    """Rule or rotation speed [rad/s]."""
    import math

    from wearsim.contact.rotation import RULES

    if text in RULES:
        return text
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < 1000.0:
        faults.append(
            f"--rotation = {text} must be {', '.join(RULES)}, or a speed above 0 and below 1000 rad/s"
        )
        return "free"
    return value
