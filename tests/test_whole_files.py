"""What cannot be written is one line and exit code 2 from every command, and nothing is
left half written.
"""

import contextlib
import os
import resource
import signal
import stat
from pathlib import Path

import pytest
import xarray as xr
from matplotlib.figure import Figure

from wearsim.cli import main
from wearsim.errors import ResultError
from wearsim.results.file import load_derived
from wearsim.whole_files import (
    NETCDF_LOCK,
    raising_handlers,
    replacing,
    signals_wait,
    write_netcdf,
    write_whole,
)


@pytest.fixture(scope="module")
def results(tmp_path_factory, write_campaign):
    folder = tmp_path_factory.mktemp("results")
    for kind in ("rig", "field"):
        write_campaign(folder / f"{kind}.nc", kind, 3, 10e-9)
    (folder / "wheels").mkdir()
    assert (
        main(
            [
                "profile",
                "S1002",
                "--convert",
                "two-column",
                "--out",
                str(folder / "wheels/a.csv"),
            ]
        )
        == 0
    )
    return folder


@contextlib.contextmanager
def files_of_at_most(size):
    """Let no file grow beyond a size [B], as on a full disk."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


COMMANDS = {
    "convert": ("profile S1002 --convert miniprof --overwrite --out {target}", ".whl"),
    "csv": ("profile S1002 --csv {target}", ".csv"),
    "plot png": ("profile S1002 --plot {target}", ".png"),
    "plot svg": ("profile S1002 --plot {target}", ".svg"),
    "fleet csv": ("profile --fleet {results}/wheels --csv {target}", ".csv"),
    "fleet pdf": ("profile --fleet {results}/wheels --plot {target}", ".pdf"),
    "translate": (
        "translate {results}/rig.nc {results}/field.nc --out {target}",
        ".nc",
    ),
    "contact": ("contact --plot {target}", ".png"),
}


SLOW = ("csv", "plot svg", "fleet csv")


@pytest.fixture
def lightly_drawn(monkeypatch, request):
    """Figures without what is on them, which takes most of their time; whole in the
    sample "plot png".
    """
    if request.getfixturevalue("command") != "plot png":
        saved = Figure.savefig

        def save(figure, *args, **options):
            figure.clear()
            return saved(figure, *args, **options)

        monkeypatch.setattr(Figure, "savefig", save)


@pytest.mark.parametrize("place", ["a file as folder", "a folder", "full"])
@pytest.mark.parametrize(
    "command",
    [pytest.param(c, marks=pytest.mark.slow) if c in SLOW else c for c in COMMANDS],
)
def test_a_target_that_cannot_be_written_is_one_line(
    results, tmp_path, monkeypatch, capsys, command, place, lightly_drawn
):
    monkeypatch.chdir(tmp_path)
    text, suffix = COMMANDS[command]
    folder = Path("target")
    if place == "a file as folder":
        folder.write_text("")
    else:
        folder.mkdir()
    target = folder / f"written{suffix}"
    if place == "a folder":
        target.mkdir()
    if place == "full":
        target.write_text("older")
    with files_of_at_most(200 if place == "full" else resource.RLIM_INFINITY):
        code = main(text.format(results=results, target=target).split())
    told = capsys.readouterr().err.splitlines()
    assert code == 2, told
    (line,) = [line for line in told if str(target) in line]
    assert "Traceback" not in line
    if place == "full":
        assert os.listdir(folder) == [target.name]
        assert target.read_text() == "older"
    elif place == "a folder":
        assert os.listdir(folder) == [target.name]
        assert os.listdir(target) == []


@pytest.mark.parametrize("full", [False, True])
def test_a_report_that_cannot_be_written_is_one_line(results, tmp_path, capsys, full):
    (tmp_path / "rig.nc").write_bytes((results / "rig.nc").read_bytes())
    if full:
        (tmp_path / "report.html").write_text("older")
    else:
        (tmp_path / "report.html").mkdir()
    with files_of_at_most(200 if full else resource.RLIM_INFINITY):
        assert main(["report", str(tmp_path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"{tmp_path / 'report.html'} cannot be written: ")
    assert sorted(os.listdir(tmp_path)) == ["report.html", "rig.nc"]


def test_figures_that_cannot_be_written_are_one_line(results, tmp_path, capsys):
    with files_of_at_most(200):
        assert (
            main(
                [
                    "inspect",
                    str(results / "rig.nc"),
                    "--plot",
                    str(tmp_path / "figures"),
                ]
            )
            == 2
        )
    (line,) = capsys.readouterr().err.splitlines()
    assert "cannot be written: " in line
    assert os.listdir(tmp_path / "figures") == []


def test_a_link_stays_and_a_device_is_written_itself(tmp_path):
    """Else `--csv /dev/null`, run by root, would make a file of the device."""
    (tmp_path / "link").symlink_to("place")
    write_whole(tmp_path / "link", "text")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "place").read_text() == "text"
    (tmp_path / "null").symlink_to("/dev/null")
    write_whole(tmp_path / "null", "text")
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
    with pytest.raises(
        ResultError, match="/dev/full cannot be written: No space left on device"
    ):
        write_whole(Path("/dev/full"), "text")


def test_an_interruption_leaves_what_was_there(tmp_path):
    path = tmp_path / "file"
    path.write_text("older")

    def interrupted():
        with replacing(path) as part:
            part.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert path.read_text() == "older"
    assert os.listdir(tmp_path) == ["file"]


def test_a_signal_where_xarray_takes_its_lock_waits_for_the_whole_file(
    tmp_path, monkeypatch
):
    """It would leave the lock taken, and closing the file would wait for it for
    ever.
    """
    from xarray.backends.locks import SerializableLock

    own = signal.getsignal(signal.SIGINT)

    def interrupted(taken):
        def acquire(lock, *arguments, **named):
            assert taken(lock, *arguments, timeout=10.0, **named), (
                "the lock was left taken"
            )
            signal.raise_signal(signal.SIGINT)
            return True

        return acquire

    for kind in (
        SerializableLock,
        type(NETCDF_LOCK),
    ):  # that of xarray's writer, and ours
        monkeypatch.setattr(kind, "acquire", interrupted(kind.acquire))
    path = tmp_path / "factors.nc"
    with pytest.raises(KeyboardInterrupt):
        write_netcdf(xr.Dataset({"factor": 2.0}), path, "", {})
    assert signal.getsignal(signal.SIGINT) is own
    with pytest.raises(KeyboardInterrupt):
        load_derived(path)
    monkeypatch.undo()
    assert float(load_derived(path)["factor"]) == 2.0


def test_a_signal_goes_before_what_went_wrong_meanwhile():
    own = signal.getsignal(signal.SIGINT)

    @signals_wait()
    def interrupted():
        signal.raise_signal(signal.SIGINT)
        raise ResultError("no such file")

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert signal.getsignal(signal.SIGINT) is own


def test_a_signal_that_is_ignored_stays_ignored(monkeypatch):
    monkeypatch.setattr(signal, "getsignal", lambda _: signal.SIG_IGN)
    assert raising_handlers() == {}
