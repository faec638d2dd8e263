"""`wearsim new`: each scene is read without faults where it is written; nothing is
lost.
"""

import re
import shlex

import pytest

from wearsim.cli import main
from wearsim.cli.new import SHIPPED
from wearsim.profile.standard import shipped_path


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("kind", SHIPPED)
def test_each_scene_checks_without_faults(kind, folder, capsys, untried):
    """By `wearsim check` of the line that is printed, with the scenes next to it and no
    shipped ones.
    """
    assert main(["new", kind]) == 0
    printed = capsys.readouterr().out
    assert f"wrote {kind}.toml\n" in printed
    written = {file.name for file in folder.iterdir()}
    assert written == {f"{kind}.toml", *SHIPPED[kind][1:]}
    assert not re.search(
        r"workflows/", "".join((folder / name).read_text() for name in written)
    )
    words = shlex.split(re.search(r"`wearsim (check .*?)`", printed)[1])
    assert main(words) == 0
    output = capsys.readouterr()
    assert f"{kind}.toml: no faults" in output.out
    assert "warning" not in output.out + output.err


def test_the_commands_in_the_scene_name_the_file(folder):
    (folder / "my study").mkdir()
    assert main(["new", "compare", "--out", "my study/first.toml"]) == 0
    assert (
        "wearsim run 'my study/first.toml' --out"
        in (folder / "my study" / "first.toml").read_text()
    )
    assert (
        "wearsim run 'my study/rig_given.toml' --out"
        in (folder / "my study" / "rig_given.toml").read_text()
    )


def test_scenes_that_exist_are_taken_and_nothing_is_replaced_unasked(folder, capsys):
    (folder / "rig.toml").write_text("mine")
    assert main(["new", "rig"]) == 2
    assert capsys.readouterr().err == (
        "--out = 'rig.toml' exists already; choose another name or add --force\n"
    )
    (folder / "rig_given.toml").write_text("mine")
    assert main(["new", "sweep"]) == 0
    assert "takes rig_given.toml, which exists" in capsys.readouterr().out
    assert (folder / "rig_given.toml").read_text() == "mine"
    assert (folder / "rig.toml").read_text() == "mine"
    assert main(["new", "rig", "--force"]) == 0
    assert 'kind = "rig"' in (folder / "rig.toml").read_text()


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (
            ["compare", "--out", "rig_given.toml"],
            "is the name of a scene that it takes; choose another name",
        ),
        (["rig", "--out", "."], "must be the name of a file"),
        (["rig", "--out", "kept"], "is a folder; give the name of a file in it"),
        (["rig", "--out", "none/rig.toml"], "its folder does not exist; make it first"),
        (["rig", "--out", "a\nb.toml"], "must be the name of a file"),
        (["rig", "--out", ""], "must be the name of a file"),
    ],
)
def test_one_line_for_each_fault(words, fault, folder, capsys):
    (folder / "kept").mkdir()
    assert main(["new", *words]) == 2
    assert capsys.readouterr().err == f"--out = {words[-1]!r} {fault}\n"
    assert [file.name for file in folder.iterdir()] == ["kept"]


def test_an_unknown_kind_lists_the_known_ones(capsys):
    with pytest.raises(SystemExit) as caught:
        main(["new", "bogie"])
    assert caught.value.code == 2
    assert "field_given" in capsys.readouterr().err


def test_what_is_named_is_what_the_shipped_scenes_name():
    for name, *named in SHIPPED.values():
        text = shipped_path("workflows", name).read_text(encoding="utf-8")
        assert (
            re.findall(r'^(?:rig|field|base) = "(.*\.toml)"', text, flags=re.MULTILINE)
            == named
        )
