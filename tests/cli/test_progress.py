import argparse
import io
import logging
import time
from dataclasses import replace

import pytest

from wearsim.campaign.directory import SceneFiles, claim, write_status
from wearsim.campaign.event import line
from wearsim.campaign.run import Event
from wearsim.cli.progress import Cases, observer, runner
from wearsim.studies.ensemble import Outcome

STEP = Event(
    "step",
    "rig",
    step=7,
    distance=36e3,
    target=1200e3,
    worst_depth=52e-6,
    elapsed=2.0,
    time_left=130.0,
)


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_line_of_a_step_has_distance_depth_and_time_left():
    assert line(STEP) == "rig: 36 of 1200 km (3 %), worst depth 0.052 mm, 2 min left"


def test_the_depth_of_reprofiled_wheels_counts_from_there():
    text = line(replace(STEP, kind="finished", reprofiled=True))
    assert text == (
        "rig: finished, 36 km, worst depth 0.052 mm since reprofiling, 7 steps, in 2 s"
    )


def test_a_campaign_that_crawls_says_where():
    """A million steps like the last one are left."""
    slow = replace(
        STEP, step_length=1.164, step_limit="stability", fastest="R 400 leading"
    )
    assert line(slow) == (
        f"{line(STEP)}; no progress in R 400 leading: steps of 1.16 m, limited by "
        "stability"
    )
    assert line(replace(slow, step_length=500.0)) == line(STEP)
    assert line(replace(slow, step_limit="block border")) == line(STEP)


def test_time_left_is_not_invented_before_the_first_step():
    assert "left" not in line(Event("step", "rig", target=1e6))


def test_without_a_terminal_lines_are_plain_and_steps_are_thinned_out():
    stream = io.StringIO()
    with observer(stream) as show:
        show(Event("started", "rig", target=1200e3))
        for _ in range(50):
            show(STEP)
            show(Event("deferred", "rig"))
        show(Event("rebuilt", "rig"))
        show(Event("resumed", "rig", step=3, distance=2e3, target=5e3))
        show(
            Event(
                "finished",
                "rig",
                step=9,
                distance=5e3,
                target=5e3,
                worst_depth=1e-4,
                elapsed=65.0,
            )
        )
        show(
            Event("complete", "rig", step=9, distance=5e3, target=5e3, worst_depth=1e-4)
        )
    message = stream.getvalue().splitlines()
    assert message == [
        "rig: started, 1200 km to run",
        line(STEP),
        (
            "rig: another program holds rig.nc open; the campaign goes on, the file "
            "follows when it is free"
        ),
        "rig: rig.nc was incomplete and is rebuilt from the records of its steps",
        "rig: continued at step 3, 2 of 5 km (40 %)",
        "rig: finished, 5 km, worst depth 0.100 mm, 9 steps, in 65 s",
        "rig: finished before, 5 km, worst depth 0.100 mm, 9 steps",
    ]
    assert "\x1b" not in stream.getvalue()


def test_every_step_is_told_when_no_interval_is_asked_for():
    stream = io.StringIO()
    with observer(stream, interval=0.0) as show:
        show(STEP)
        show(STEP)
    assert stream.getvalue().splitlines() == [line(STEP)] * 2


def test_in_a_terminal_steps_share_one_live_line(monkeypatch):
    monkeypatch.setenv("COLUMNS", "30")
    stream = Terminal()
    with observer(stream) as show:
        show(STEP)
        show(STEP)
        show(Event("deferred", "rig", target=1200e3))
        show(Event("deferred", "rig", target=1200e3))
        show(STEP)
    first, second, deferred = stream.getvalue().split("\r\x1b[K")
    assert first == second == line(STEP)[:29]
    held, _, third = deferred.partition("\n")
    assert "another program holds rig.nc open; the campaign goes on" in held
    assert third == line(STEP)[:29] + "\n"


def test_lines_of_a_first_run_that_compiles_are_shown_unless_quiet():
    log, streams = logging.getLogger("wearsim.kernels"), (io.StringIO(), io.StringIO())
    for stream, quiet in zip(streams, (False, True), strict=True):
        with observer(stream, quiet=quiet):
            log.info("compiling")
        log.info("compiling after the campaign")
    assert [stream.getvalue() for stream in streams] == ["compiling\n", ""]


@pytest.fixture
def half_done(tmp_path):
    """Cases 1 to 4: finished before, run half the way before, and two not begun."""
    for number, distance in ((1, 8e3), (2, 4e3)):
        folder = tmp_path / f"case_000{number}"
        scene = SceneFiles("rig.toml", {"rig.toml": b'[scene]\nkind = "rig"\n'})
        claim(folder, scene, "wearsim run")
        state = "finished" if number == 1 else "interrupted"
        write_status(
            folder, "rig", {"state": state, "distance": distance, "target": 8e3}
        )
    return tmp_path


def test_time_left_of_cases_is_by_the_pace_of_this_session(half_done, monkeypatch):
    """In 60 s half a case was run, one and a half are left."""
    cases = Cases("case", half_done)
    assert cases.line(with_bar=False) == ""
    cases.count(3, Outcome(1, "finished"))
    cases.count(3, Outcome(2, "finished"))
    began = time.monotonic()
    monkeypatch.setattr(cases, "_began", began - 60.0)
    assert cases.line(with_bar=True) == (
        "cases: [#############-------] 2 of 3 done, 67 %, 2 min left"
    )


@pytest.mark.parametrize("terminal", [True, False])
def test_many_cases_have_one_live_line_and_faults_above_it(
    half_done, monkeypatch, terminal
):
    stream = Terminal() if terminal else io.StringIO()
    monkeypatch.setattr("sys.stderr", stream)
    given = argparse.Namespace(quiet=False, cluster=None, jobs=1, command_line="")
    with runner(given, "case", half_done, {1: "friction = 0.2"}) as run:
        run.report(4, Outcome(1, "running"))
        run.report(4, Outcome(1, "finished"))
        run.report(4, Outcome(3, "failed", "no contact", 3))
    written = stream.getvalue()
    if not terminal:
        assert written.splitlines() == [
            "case 1: begun, friction = 0.2",
            "case 1: finished (1 of 4)",
            "case 3: failed (2 of 4); no contact",
        ]
        return
    assert written.count("\n") == 2
    first, last, _ = written.split("\n")
    assert first.endswith("\r\x1b[Kcase 3: failed (2 of 4); no contact")
    assert "cases: [########------------] 1 of 4 done, 38 %" in first
    assert "2 of 4 done, 62 %" in last
