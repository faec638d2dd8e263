"""Printing a report; the browser is a program of the tests."""

import stat
import sys

import pytest

from wearsim.cli import main
from wearsim.report.pdf import VARIABLE, browser

PRINTS = """
import sys
target = next(one for one in sys.argv if one.startswith("--print-to-pdf="))
open(target.partition("=")[2], "w").write(f"%PDF of {sys.argv[-1]}")
"""


@pytest.fixture
def run(tmp_path, write_campaign):
    write_campaign(tmp_path / "rig.nc", "rig", 2, 10e-9)
    return tmp_path


@pytest.fixture
def program(tmp_path_factory, monkeypatch):
    """Function that makes a program of Python the browser."""

    def make(text):
        path = tmp_path_factory.mktemp("bin") / "browser"
        path.write_text(f"#!{sys.executable}\n{text}")
        path.chmod(path.stat().st_mode | stat.S_IEXEC)
        monkeypatch.setenv(VARIABLE, str(path))
        return path

    return make


def test_the_browser_prints_the_page(run, program, capsys):
    path = program(PRINTS)
    assert browser() == str(path)
    assert main(["report", str(run), "--pdf"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines == [str(run / "report.html"), str(run / "report.pdf")]
    page = (run / "report.html").resolve().as_uri()
    assert (run / "report.pdf").read_text() == f"%PDF of {page}"


def test_without_a_browser_one_line_says_where_the_page_is(run, monkeypatch, capsys):
    """On standard error; only a browser that is named and missing is a fault."""
    monkeypatch.setenv("PATH", str(run))
    monkeypatch.delenv(VARIABLE, raising=False)
    for code, named in ((0, None), (2, "nowhere")):
        if named:
            monkeypatch.setenv(VARIABLE, named)
        assert main(["report", str(run), "--pdf"]) == code
        output = capsys.readouterr()
        page = str(run / "report.html")
        assert output.out.splitlines() == [page]
        (line,) = output.err.splitlines()
        assert "no PDF: " in line
        assert page in line
        assert VARIABLE in line
        assert not (run / "report.pdf").exists()


@pytest.mark.parametrize(
    "text", ["import sys; sys.exit('out of paper')", "print('done')"]
)
def test_a_browser_that_fails_is_one_line(run, program, capsys, text):
    path = program(text)
    assert main(["report", str(run), "--pdf"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"{path} wrote no PDF (" in line
    assert str(run / "report.html") in line
    assert not (run / "report.pdf").exists()
