"""The guide as a user follows it: its tutorials print what it quotes."""

import re
import shlex
from pathlib import Path

import pytest

from wearsim.cli import main

ROOT = Path(__file__).parents[1]
GUIDE = (ROOT / "workflows" / "README.md").read_text(encoding="utf-8")
TUTORIALS = re.findall(
    r"^## (Tutorial \d.*?)\n(.*?)(?=^## )", GUIDE, flags=re.MULTILINE | re.DOTALL
)
APART = r"(?<=\d) (?=\d{3}\b)"  # thousands
NUMBER = r"[-+−]?\d+(?:\.\d+)?(?:e[-+]\d+)?"


def quoted(line, printed):
    """Whether the line is part of what was printed: "..." is any text, numbers agree
    within 1 %.

    That is what another processor's rounding may leave of a campaign on measured
    profiles.
    """
    line, printed = (re.sub(APART, "", text) for text in (line, printed))
    parts = re.split(
        rf"(\.\.\.|{NUMBER}|\s+)", re.sub(r"\s*\.\.\.\s*", "...", line.strip())
    )
    numbers = [float(part) for part in parts if re.fullmatch(NUMBER, part)]
    pattern = ""
    for part in parts:
        if re.fullmatch(NUMBER, part):
            pattern += f"({NUMBER})"
        else:
            pattern += (
                r".*(?<![\w.+-])"
                if part == "..."
                else r"\s+"
                if part.isspace()
                else re.escape(part)
            )
    return any(
        [float(number) for number in match.groups()] == pytest.approx(numbers, rel=0.01)
        for row in printed.splitlines()
        for match in re.finditer(pattern, row)
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("title", "text"), TUTORIALS, ids=[title for title, _ in TUTORIALS]
)
def test_a_tutorial_prints_what_the_guide_quotes(
    title, text, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    for folder in ("workflows", "profiles"):
        Path(folder).symlink_to(ROOT / folder)
    missing, printed = [], ""
    for language, block in re.findall(
        r"^```(\w+)\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL
    ):
        if language == "python":
            exec(compile(block, title, "exec"), {})
            printed = "".join(capsys.readouterr())
        for line in block.splitlines() if language in ("console", "text") else ():
            if line.startswith("$ wearsim "):
                assert main(shlex.split(line)[2:]) == 0, line
                printed = "".join(capsys.readouterr())
            elif not quoted(line, printed):
                missing.append(line)
    assert missing == []


def test_there_are_eight_tutorials_and_a_quote_can_miss():
    assert [title.split(":")[0] for title, _ in TUTORIALS] == [
        f"Tutorial {number}" for number in range(1, 9)
    ]
    printed = "rig: finished, 1260 km, worst depth 0.257 mm, step 18, in 2 s\nother"
    assert quoted("finished, 1260 km, ... depth 0.258 mm ...", printed)
    for line in (
        "finished, 1260 km, ... depth 0.27 mm",
        "depth 0.257 mm ... other",
        "field: finished",
    ):
        assert not quoted(line, printed)


def test_the_bands_of_the_guide_stand_in_the_report():
    """Each with the input that decides the largest share of its variance."""
    head, *report = [
        [cell.strip() for cell in line.split("|")[1:-1]]
        for line in (ROOT / "reports" / "translation.md")
        .read_text(encoding="utf-8")
        .split("Bands of")[1]
        .splitlines()
        if line.startswith("| ") and "---" not in line
    ]
    rows = re.findall(
        r"^\| (.*) \| (\S+) \| (\S+) \| (\S+) \| (.*) \((\S+)\) \|$",
        GUIDE,
        flags=re.MULTILINE,
    )
    assert len(rows) == 5
    for quantity, *band, name, share in rows:
        (row,) = (cells for cells in report if cells[0] == quantity)
        assert row[1:4] == band
        shares = dict(zip(head[4:], row[4:], strict=True))
        assert name == max(shares, key=lambda key: float(shares[key]))
        assert shares[name] == share
