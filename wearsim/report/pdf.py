"""Reports as PDF: pages printed by a Chromium without a window."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from wearsim.errors import ResultError, printable
from wearsim.whole_files import write_whole

VARIABLE = "WEARSIM_BROWSER"
"""Environment variable that names the browser."""

PROGRAMS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "msedge",
)
"""Browsers that are looked for, the first one that is found prints."""

_SECONDS = 120.0
_OPTIONS = ("--headless", "--disable-gpu", "--no-pdf-header-footer")


def browser() -> str | None:
    """Return the path of the browser that prints, None without one.

    It is the program that the environment variable `VARIABLE` names, if it is set; else
    the first one of `PROGRAMS` on the search path.
    """
    named = os.environ.get(VARIABLE)
    names = (named,) if named else PROGRAMS
    return next(filter(None, map(shutil.which, names)), None)


def write_pdf(page: Path, program: str) -> Path:
    """Print a page (HTML) as PDF next to it.

    Parameters
    ----------
    page : Path
        The page.
    program : str
        Browser, from `browser`.

    Returns
    -------
    Path
        The PDF, with page numbers in its margins.

    Raises
    ------
    ResultError
        If the browser fails or writes no file.
    """
    # a browser refuses its sandbox to the superuser, as in a container
    options = [*_OPTIONS, "--no-sandbox"] if _superuser() else list(_OPTIONS)
    with TemporaryDirectory() as folder:
        target = Path(folder) / "page.pdf"
        options += [f"--user-data-dir={folder}/user", f"--print-to-pdf={target}"]
        command = [program, *options, page.resolve().as_uri()]
        try:
            done = subprocess.run(
                command, capture_output=True, text=True, timeout=_SECONDS, check=False
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise _failure(page, program, str(error)) from error
        if done.returncode or not target.is_file():
            messages = done.stderr.strip().splitlines() or [
                f"exit code {done.returncode}"
            ]
            raise _failure(page, program, messages[-1])
        content = target.read_bytes()
    path = page.with_suffix(".pdf")
    write_whole(path, content, "make room, or make the directory writable")
    return path


def _superuser() -> bool:
    return hasattr(os, "geteuid") and os.geteuid() == 0


def _failure(page: Path, program: str, reason: str) -> ResultError:
    return ResultError(
        f"{program} wrote no PDF ({printable(reason)}); open {page} in a browser and "
        f"print it, or name another browser in {VARIABLE}"
    )
