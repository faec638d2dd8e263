"""The command line as a whole: start-up, help, exit codes, one line per fault."""

import importlib.metadata
import re
import subprocess
import sys

import pytest

import wearsim
from wearsim import cli
from wearsim.cli import check
from wearsim.errors import Fault, NumericalError, SceneError


def run(*arguments, **options):
    return subprocess.run(
        [sys.executable, "-m", "wearsim", *arguments],
        capture_output=True,
        text=True,
        timeout=60,
        **options,
    )


@pytest.mark.parametrize("words", [["--help"], ["--version"], ["run", "--help"]])
def test_help_starts_without_the_heavy_packages(words):
    """Start-up below 0.15 s is only possible without them; the time itself depends on
    the machine.
    """
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "wearsim", *words],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0
    imported = {
        line.rsplit("|", 1)[1].strip().split(".")[0]
        for line in done.stderr.splitlines()
        if "|" in line
    }
    assert "argparse" in imported
    assert not imported & {
        "numpy",
        "scipy",
        "numba",
        "pydantic",
        "xarray",
        "pandas",
        "matplotlib",
        "rich",
    }


def test_the_version_is_that_of_the_package(capsys):
    with pytest.raises(SystemExit) as caught:
        cli.main(["--version"])
    assert caught.value.code == 0
    assert capsys.readouterr().out == f"wearsim {wearsim.__version__}\n"
    assert wearsim.__version__ == importlib.metadata.version("wearsim")


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_every_command_has_a_help_with_an_example(command, capsys):
    with pytest.raises(SystemExit) as caught:
        cli.main([command, "--help"])
    assert caught.value.code == 0
    message = capsys.readouterr().out
    assert f"example:\n  wearsim {command} " in message


def test_the_help_of_report_names_every_folder_it_takes(capsys):
    """As `wearsim.report.html.write_report` distinguishes them."""
    with pytest.raises(SystemExit):
        cli.main(["report", "--help"])
    text = " ".join(capsys.readouterr().out.split())
    for kind in (
        "rig and field, with their bands",
        "two campaigns of one kind",
        "sweep",
        "calibration",
    ):
        assert kind in text


def test_the_help_lists_every_command_and_an_example(capsys):
    with pytest.raises(SystemExit):
        cli.main(["--help"])
    message = capsys.readouterr().out
    for command in cli.COMMANDS:
        assert f"\n    {command}" in message
    assert "wearsim run workflows/rig_vs_field.toml --out out" in message


@pytest.mark.parametrize(
    "words", [[], ["nothing"], ["check"], ["check", "a", "b"], ["check", "a", "--jsn"]]
)
def test_a_wrong_command_line_is_one_line_and_exit_code_2(words, capsys):
    with pytest.raises(SystemExit) as caught:
        cli.main(words)
    assert caught.value.code == 2
    message = capsys.readouterr()
    assert message.out == ""
    (line,) = message.err.splitlines()
    assert re.search(r"see `wearsim( check)? --help`$", line)


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (
            SceneError([Fault("a = 1", "x.toml", 3), Fault("b", "x.toml", 4)]),
            2,
            "x.toml:3: a = 1\nx.toml:4: b\n",
        ),
        (NumericalError("no convergence"), 3, "no convergence\n"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (KeyError("spin"), 3, "internal error, KeyError: 'spin'"),
        (ValueError("two\nlines"), 3, "internal error, ValueError: two lines;"),
    ],
)
def test_errors_become_lines_and_exit_codes(error, code, message, monkeypatch, capsys):
    def fail(arguments):
        raise error

    monkeypatch.setattr(check, "execute", fail)
    assert cli.main(["check", "x.toml"]) == code
    printed = capsys.readouterr()
    assert printed.out == ""
    assert message in printed.err
    assert "Traceback" not in printed.err


def test_a_current_folder_that_was_deleted_is_no_fault_of_wearsim(
    monkeypatch, tmp_path, capsys
):
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert cli.main(["inspect", "rig.nc"]) == 2
    assert (
        "the current folder was deleted; change to one that exists"
        in capsys.readouterr().err
    )


@pytest.mark.parametrize(
    "words", [["--debug", "check", "x.toml"], ["check", "x.toml", "--debug"]]
)
def test_debug_shows_where_an_internal_error_arose(words, monkeypatch):
    def fail(arguments):
        raise KeyError("spin")

    monkeypatch.setattr(check, "execute", fail)
    with pytest.raises(KeyError):
        cli.main(words)


def test_the_command_line_is_kept_for_the_history_of_results(monkeypatch):
    kept = []
    monkeypatch.setattr(
        check, "execute", lambda arguments: kept.append(arguments.command_line) or 0
    )
    assert cli.main(["check", "my scene.toml"]) == 0
    assert kept == ["wearsim check 'my scene.toml'"]


def test_open_results_is_found_in_the_package():
    from wearsim.results import open_results

    assert wearsim.open_results is open_results
    assert "open_results" in dir(wearsim)
    with pytest.raises(AttributeError, match="no attribute 'open_result'"):
        wearsim.open_result  # noqa: B018
