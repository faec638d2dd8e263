"""Files listed as offending against a rule of ruff: none stands there for nothing."""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

TESTS = Path(__file__).resolve().parent
ROOT = TESTS.parent
FALLING = {"C901", "D205", "E501", "PLR0913"}


def test_every_file_listed_offends():
    """A file without an offence leaves its list, so that lists only get shorter."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    listed = {
        (file, rule)
        for file, rules in project["tool"]["ruff"]["lint"]["per-file-ignores"].items()
        for rule in FALLING.intersection(rules)
    }
    command = [sys.executable, "-m", "ruff", "check", "--output-format", "json"]
    command += ["--no-cache", "--select", ",".join(sorted(FALLING))]
    command += ["--config", "lint.per-file-ignores={}", "."]
    done = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, check=False
    )
    found = {
        (Path(one["filename"]).relative_to(ROOT).as_posix(), one["code"])
        for one in json.loads(done.stdout)
        if not (
            one["code"].startswith("D") and Path(one["filename"]).is_relative_to(TESTS)
        )
    }
    assert listed == found


def test_no_line_is_kept_from_the_formatter():
    found = [
        file.relative_to(ROOT).as_posix()
        for folder in ("wearsim", "tests", "reports", "workflows")
        for file in sorted((ROOT / folder).rglob("*.py"))
        if file != Path(__file__).resolve()
        and re.search(r"# fmt: *(skip|off)", file.read_text(encoding="utf-8"))
    ]
    assert found == []
