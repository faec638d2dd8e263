"""Scene texts with changes, and the faults they are refused with."""

from pathlib import Path

import pytest

from wearsim.errors import SceneError
from wearsim.scene import load_scene

DATA = Path(__file__).parents[1] / "data"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Working directory with a scene of each kind."""
    for kind in ("rig", "field", "compare"):
        (tmp_path / f"{kind}.toml").write_text(
            (DATA / f"scene_{kind}.toml").read_text()
        )
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def changed():
    """Function that replaces the first place of each text, which must be there."""

    def change(text, *pairs):
        for old, new in pairs:
            assert old in text
            text = text.replace(old, new, 1)
        return text

    return change


@pytest.fixture
def faults_of():
    """Function that gives the lines with which a scene text is refused."""

    def faults(text, name="scene.toml"):
        Path(name).write_text(text)
        with pytest.raises(SceneError) as caught:
            load_scene(name)
        assert caught.value.exit_code == 2
        lines = str(caught.value).splitlines()
        assert len(lines) == len(caught.value.faults)
        return lines

    return faults


@pytest.fixture
def line_with():
    """Function that gives the line of the first place of a part of a text."""

    def line(text, part):
        return text[: text.index(part)].count("\n") + 1

    return line
