"""Shipped scenes and definitions with lines changed, through `wearsim check` in this
process.
"""

import json
import re
import shutil
from unittest import mock

from siege import ACCEPTED, ROOT, chosen, command, damaged, judged, require, strict_json

from wearsim.errors import WearsimError
from wearsim.studies import plan

SCENES = {
    path.stem: path.read_text()
    for path in sorted(
        [
            *(ROOT / "workflows").glob("*.toml"),
            *(ROOT / "tests/data").glob("scene_*.toml"),
        ]
    )
}
DEFINITIONS = {
    "vehicle": (
        ROOT / "profiles/vehicles/regional_multiple_unit.toml",
        "field",
        "file =",
    ),
    "rig": (ROOT / "profiles/rigs/full_scale.toml", "rig", "rig ="),
    "limits": (ROOT / "profiles/limits/TSI.toml", "limits", "file ="),
}
SHIPPED = str(ROOT / "profiles")
"""Where a file that a scene names may be found: a fault of it begins with its path."""
NAMED = ("rig.toml", "field.toml", "field_given.toml", "recorded.csv")
"""Files of `workflows` that scenes name."""
WAYS = ("a value", "a key", "a table", "bytes", "several", "a definition")
WHOLE = 40
"""In one of so many scenes the trial steps that foresee the length of a campaign are
made, one per block.
"""

VALUES = (
    "nan",
    "-nan",
    "inf",
    "-inf",
    "0",
    "-0.0",
    "-1",
    "1e-300",
    "1e300",
    "1e308",
    "9" * 400,
    "0x7fffffffffffffff",
    "true",
    '""',
    '"x"',
    "'S1002'",
    '"\\u0000"',
    '"µ ≤ ½"',
    '"\\u202e"',
    f'"{"a" * 500}"',
    "[]",
    "[[]]",
    "[1, 2]",
    "[nan]",
    '["x"]',
    "{}",
    "{a = 1}",
    "1979-05-27",
    "07:32:00",
    "1979-05-27T07:32:00Z",
    '"/dev/zero"',
    '"/dev/null"',
    '"/"',
    '"."',
    '".."',
    '"~"',
    '"nan"',
    '"0.35"',
    "1e-3",
    "1",
    "2",
    "3.5",
    "100",
    "1e6",
)
FACTORS = (
    -1,
    0,
    0.1,
    0.3,
    0.5,
    0.7,
    0.9,
    1.1,
    1.5,
    2,
    5,
    10,
    1e3,
    1e-3,
    1e6,
    1e-6,
    10**400,
)
OF_TABLES = (
    "removed",
    "head removed",
    "renamed",
    "doubled",
    "emptied",
    "list",
    "many",
    "moved",
)
NAMES = (
    "x",
    "µ",
    '"a b"',
    "a.b",
    '""',
    "scene",
    "kind",
    "a" * 500,
    "=",
    "é",
    "__class__",
    "0",
    '"\\u0000"',
)
KEY = re.compile(r"^(\s*)([A-Za-z_][\w.-]*)(\s*=\s*)(.*)$")
NUMBER = re.compile(r"(?<![\w\".])-?\d+\.?\d*(?:e-?\d+)?(?![\w\".:])")


def places(lines, pattern):
    """Numbers of the lines that match."""
    return [number for number, line in enumerate(lines) if re.match(pattern, line)]


def change_value(lines, random):
    """Another value of a key: of another type, scaled, not finite, that of another
    key.
    """
    at = chosen(random, places(lines, KEY))
    indent, key, equals, value = KEY.match(lines[at]).groups()
    numbers = list(NUMBER.finditer(value.partition("#")[0]))
    how = chosen(
        random, ("other", "scaled", "scaled", "scaled", "stolen", "quoted", "listed")
    )
    if how == "scaled" and numbers:
        number = chosen(random, numbers)
        factor = chosen(random, FACTORS)
        scaled = f"{float(number[0]) * factor:.10g}" if abs(factor) < 1e300 else "1e400"
        value = value[: number.start()] + scaled + value[number.end() :]
    elif how == "stolen":
        value = KEY.match(lines[chosen(random, places(lines, KEY))])[4]
    elif how == "quoted":
        value = json.dumps(value)
    elif how == "listed":
        value = f"[{value.partition('#')[0]}]"
    else:
        value = chosen(random, VALUES)
    lines[at] = f"{indent}{key}{equals}{value}"


def change_key(lines, random):
    """Remove, rename, double, move or invent a key."""
    at = chosen(random, places(lines, KEY))
    indent, key, equals, value = KEY.match(lines[at]).groups()
    how = chosen(
        random, ("removed", "renamed", "misspelt", "doubled", "moved", "invented")
    )
    if how == "removed":
        del lines[at]
    elif how == "renamed":
        lines[at] = f"{indent}{chosen(random, NAMES)}{equals}{value}"
    elif how == "misspelt":
        k = int(random.integers(len(key)))
        letter = chosen(random, ("", "x", key[k] * 2, key[k].swapcase()))
        lines[at] = f"{indent}{key[:k]}{letter}{key[k + 1 :]}{equals}{value}"
    elif how == "doubled":
        lines.insert(at, lines[at])
    elif how == "moved":
        lines.insert(int(random.integers(len(lines))), lines.pop(at))
    else:
        lines.insert(at, f"{chosen(random, NAMES)} = {chosen(random, VALUES)}")


def change_table(lines, random):
    """Remove, rename, double or empty a table, or make one of it a list of tables."""
    heads = [*places(lines, r"\s*\["), len(lines)]
    k = int(random.integers(len(heads) - 1))
    at, end = heads[k], heads[k + 1]
    how = chosen(random, OF_TABLES)
    if how == "removed":
        del lines[at:end]
    elif how == "head removed":
        del lines[at]
    elif how == "renamed":
        lines[at] = f"[{chosen(random, NAMES)}]"
    elif how in ("doubled", "many"):
        lines[at:at] = lines[at:end] * (1 if how == "doubled" else 300)
    elif how == "emptied":
        del lines[at + 1 : end]
    elif how == "list":
        name = lines[at].partition("#")[0].strip().strip("[]")
        lines[at] = f"[{name}]" if "[[" in lines[at] else f"[[{name}]]"
    else:
        block = lines[at:end]
        del lines[at:end]
        where = chosen(random, [*places(lines, r"\s*\["), len(lines)])
        lines[where:where] = block


def change_bytes(lines, random):
    """Damage the text as bytes."""
    content = damaged("\n".join(lines).encode("utf-8", "surrogateescape"), random)
    lines[:] = content.decode("utf-8", "surrogateescape").split("\n")


CHANGES = {
    "a value": change_value,
    "a key": change_key,
    "a table": change_table,
    "bytes": change_bytes,
}


def mutated(text, way, random):
    """Text of a scene with one change of a kind, or with two to four of any."""
    lines = text.splitlines()
    kinds = (
        [way]
        if way in CHANGES
        else [chosen(random, CHANGES) for _ in range(random.integers(2, 5))]
    )
    for kind in kinds:
        if not places(lines, KEY) or not places(lines, r"\s*\["):
            break
        CHANGES[kind](lines, random)
    return "\n".join([*lines, ""]).encode("utf-8", "surrogateescape")


def write_scene(name, folder, text=None):
    """Write a scene, mutated or not, and what it names; return its name."""
    for file in NAMED:
        shutil.copy(ROOT / "workflows" / file, folder)
    shutil.copy(ROOT / "tests/data/scene_rig.toml", folder)
    shutil.copy(ROOT / "tests/data/scene_field.toml", folder)
    (folder / f"{name}.toml").write_bytes(
        SCENES[name].encode() if text is None else text
    )
    return f"{name}.toml"


def attack(way, random, folder):
    """Check one scene that was changed, or one whose definition was."""
    if way == "a definition":
        source, name, key = DEFINITIONS[chosen(random, DEFINITIONS)]
        mutant = mutated(source.read_text(), chosen(random, CHANGES), random)
        (folder / "own.toml").write_bytes(mutant)
        text = re.sub(rf"(?m)^{key}.*$", f'{key} "own.toml"', SCENES[name], count=1)
        scene = write_scene(name, folder, text.encode())
    else:
        name = chosen(random, SCENES)
        scene = write_scene(name, folder, mutated(SCENES[name], way, random))
    return checked(scene, random, "own.toml")


def untried(*_):
    """Take the place of the trial step."""
    raise WearsimError("not tried")


def checked(scene, random, *names):
    """Judge what `wearsim check` says of a scene."""
    whole = random.integers(WHOLE) == 0
    tried, compared = (
        (plan.estimate, plan.compared) if whole else (untried, lambda *_: None)
    )
    with (
        mock.patch.object(plan, "estimate", tried),
        mock.patch.object(plan, "compared", compared),
    ):
        code, out, printed = command("check", scene, "--json")
    outcome = judged(code, out, printed, scene, SHIPPED, *NAMED, *names)
    if outcome == ACCEPTED:
        require(strict_json(out)["scene"] == scene, out[:300])
    return outcome
