"""Killing, interrupting, damaging: nothing finished is lost and the continued result
has the same bits.
"""

import contextlib
import os
import signal
import subprocess
import sys
import time
from dataclasses import fields, is_dataclass, replace
from pathlib import Path

import netCDF4
import numpy as np
import pytest

from wearsim.campaign import run as run_module
from wearsim.campaign.control import reached
from wearsim.campaign.directory import locked, read_status
from wearsim.campaign.record import write_atomically
from wearsim.campaign.run import run_evolution
from wearsim.campaign.state import State, flattened, rebuilt
from wearsim.errors import NumericalError, ResultError
from wearsim.results import ROW, Header, open_results, row_count

STEPS = 8
PROGRAM = Path(__file__).with_name("synthetic_campaign.py")
RUN = """
import runpy, sys
sys.argv = ["", {out!r}, "{steps}", "{pause}"]
runpy.run_path({program!r}, run_name="__main__")
"""


@pytest.fixture(scope="module")
def uninterrupted(synthetic, tmp_path_factory):
    return run_evolution(
        synthetic.SyntheticEvolution(STEPS), tmp_path_factory.mktemp("whole"), "rig"
    )


@pytest.fixture
def each_step_is_appended(monkeypatch):
    monkeypatch.setattr("wearsim.campaign.record.APPEND_INTERVAL", 0.0)


def program(out, pause=0.0):
    return RUN.format(out=str(out), steps=STEPS, pause=pause, program=str(PROGRAM))


def assert_same_bits(path, reference):
    with netCDF4.Dataset(path) as one, netCDF4.Dataset(reference) as other:
        for file in (one, other):
            file.set_auto_maskandscale(False)
        for name in ROW:
            assert np.array_equal(one[name][:], other[name][:]), name


def assert_tidy(directory):
    """Only the result, its last state, the mark of completion and the status are
    left.
    """
    left = [".rig.finished.json", ".rig.last.record", "rig.nc", "status.json"]
    assert sorted(p.name for p in directory.iterdir()) == left


def test_finished_run_is_tidy_and_repeating_it_computes_nothing(
    synthetic, tmp_path, uninterrupted
):
    kinds = []
    path = run_evolution(
        synthetic.SyntheticEvolution(STEPS),
        tmp_path,
        "rig",
        lambda e: kinds.append(e.kind),
    )
    assert_same_bits(path, uninterrupted)
    assert_tidy(tmp_path)
    assert kinds == ["started", *["step"] * (STEPS + 1), "finished"]
    before = path.read_bytes()
    events = []
    run_evolution(synthetic.SyntheticEvolution(STEPS), tmp_path, "rig", events.append)
    assert [event.kind for event in events] == ["complete"]
    assert (events[0].step, events[0].distance) == (STEPS, STEPS * 1000.0)
    assert path.read_bytes() == before


@pytest.mark.parametrize("appended", [False, True])
def test_stopped_after_each_step_resumes_to_the_same_bits(
    synthetic, tmp_path, uninterrupted, appended, monkeypatch
):
    """With the result file up to date, and with records only; nothing finished is
    computed again.
    """
    monkeypatch.setattr(
        "wearsim.campaign.record.APPEND_INTERVAL", 0.0 if appended else 1e9
    )
    begun = []

    for step in range(STEPS + 1):
        with synthetic.stopped_at(step) as stop:
            run_evolution(
                synthetic.SyntheticEvolution(STEPS),
                tmp_path,
                "rig",
                lambda event, stop=stop: (
                    begun.append((event.kind, event.step)),
                    stop(event),
                ),
            )
        if appended:
            assert row_count(tmp_path / "rig.nc") == step + 1
    path = run_evolution(
        synthetic.SyntheticEvolution(STEPS),
        tmp_path,
        "rig",
        lambda e: begun.append((e.kind, e.step)),
    )
    resumed = [step for kind, step in begun if kind == "resumed"]
    assert resumed == list(range(STEPS + 1))
    assert [step for kind, step in begun if kind == "step"] == list(range(STEPS + 1))
    assert "rebuilt" not in [
        kind for kind, _ in begun
    ]  # what was appended is what the records hold
    assert_same_bits(path, uninterrupted)
    assert_tidy(tmp_path)


KILL_INSIDE = """
import os, signal, sys
sys.path.insert(0, {folder!r})
from pathlib import Path
import numpy as np
import synthetic_campaign, wearsim.campaign.record, wearsim.results
from wearsim.campaign.run import run_evolution
wearsim.campaign.record.APPEND_INTERVAL = 0.0

write_rows = wearsim.results.file._write_rows
def dying(file, first, rows):
    if first == 5:
        row = dict(rows[-1])
        names = sorted(wearsim.results.ROW, key="distance".__eq__)
        for name in names[:{cut}]:
            file.variables[name][first:first + 1] = np.asarray(row[name])[None]
        if {sync}:
            file.sync()
        os.kill(os.getpid(), signal.SIGKILL)
    write_rows(file, first, rows)
wearsim.results.file._write_rows = dying
run_evolution(synthetic_campaign.SyntheticEvolution({steps}), Path({out!r}), "rig")
"""


@pytest.mark.parametrize(
    ("cut", "sync"),
    [pytest.param(0, False, marks=pytest.mark.slow), (20, True), (len(ROW), False)],
)
def test_sigkill_in_the_middle_of_an_append(
    synthetic, tmp_path, uninterrupted, forked, cut, sync
):
    code = KILL_INSIDE.format(
        folder=str(PROGRAM.parent), cut=cut, sync=sync, steps=STEPS, out=str(tmp_path)
    )
    process, printed = forked(code)
    with printed:
        output = printed.read()
    process.join()
    assert process.exitcode == -signal.SIGKILL, output
    events = []
    path = run_evolution(
        synthetic.SyntheticEvolution(STEPS), tmp_path, "rig", events.append
    )
    assert events[0].kind == "resumed"
    assert (
        events[0].step == 5
    )  # the record of this step was whole before the append began
    assert_same_bits(path, uninterrupted)
    assert_tidy(tmp_path)


FROM_THE_COMMAND_LINE = """
from wearsim.cli import main, resume
resume.execute = lambda arguments: exec({code!r}, {{}})
raise SystemExit(main(["resume", "out"]))
"""


@pytest.mark.parametrize(
    ("number", "code"),
    [
        (signal.SIGINT, 130),
        (signal.SIGTERM, 143),
        pytest.param(signal.SIGHUP, 129, marks=pytest.mark.slow),
    ],
)
def test_signals_leave_whole_rows_and_a_status(
    tmp_path, synthetic, uninterrupted, forked, number, code
):
    """Ctrl-C, batch systems and `timeout`, closed terminals."""
    process, printed = forked(
        FROM_THE_COMMAND_LINE.format(code=program(tmp_path, pause=0.05))
    )
    with printed:
        while (line := printed.readline()).strip() != "step 3":
            assert line, "the run ended before"
        os.kill(process.pid, number)
        rest = printed.read()
    process.join()
    assert process.exitcode == code
    output = [
        int(line.split()[1]) for line in rest.splitlines() if line.startswith("step")
    ]
    last = max([3, *output])
    assert last < STEPS
    assert row_count(tmp_path / "rig.nc") == last + 1
    with open_results(tmp_path / "rig.nc") as data:
        assert data["distance"].values[last] == last * 1000.0
    status = read_status(tmp_path)["campaigns"]["rig"]
    assert (status["state"], status["step"]) == ("interrupted", last)
    path = run_evolution(synthetic.SyntheticEvolution(STEPS), tmp_path, "rig")
    assert_same_bits(path, uninterrupted)


def test_ctrl_c_that_compiled_code_swallows_stops_the_run_after_its_step(
    tmp_path, synthetic, monkeypatch
):
    """As when kernels are being loaded: Python drops what is raised in a callback."""
    evaluate = synthetic.SyntheticEvolution.evaluate

    def swallowing(evolution, state, taken):
        if state.step == 2:
            with contextlib.suppress(KeyboardInterrupt):
                os.kill(os.getpid(), signal.SIGINT)
                time.sleep(0.01)
        return evaluate(evolution, state, taken)

    monkeypatch.setattr(synthetic.SyntheticEvolution, "evaluate", swallowing)
    previous = signal.signal(
        signal.SIGINT, signal.default_int_handler
    )  # ignored where tests run in the background
    try:
        with pytest.raises(KeyboardInterrupt):
            run_evolution(synthetic.SyntheticEvolution(STEPS), tmp_path, "rig")
    finally:
        signal.signal(signal.SIGINT, previous)
    status = read_status(tmp_path)["campaigns"]["rig"]
    assert (status["state"], status["step"]) == ("interrupted", 2)


def test_ctrl_c_in_the_middle_of_writing_waits_for_the_end_of_the_row(
    synthetic, tmp_path, monkeypatch, each_step_is_appended
):
    append = run_module.Writer.flush

    def interrupted(writer):
        os.kill(os.getpid(), signal.SIGINT)
        return append(writer)

    monkeypatch.setattr(run_module.Writer, "flush", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_evolution(synthetic.SyntheticEvolution(STEPS), tmp_path, "rig")
    assert row_count(tmp_path / "rig.nc") == 2
    with open_results(tmp_path / "rig.nc") as data:
        assert data["distance"].values[1] == 1000.0


def stopped(synthetic, directory, after=6):
    with synthetic.stopped_at(after) as stop:
        run_evolution(synthetic.SyntheticEvolution(STEPS), directory, "rig", stop)
    return directory / "rig.nc"


def truncate(path):
    path.write_bytes(path.read_bytes()[:-3000])


def flip_value(path):
    with netCDF4.Dataset(path, "a") as file:
        file["profile_z"][2, 0, 10] = np.nextafter(
            float(file["profile_z"][2, 0, 10]), 1.0
        )


def empty(path):
    path.write_bytes(b"")


@pytest.mark.parametrize(
    "damage",
    [truncate, flip_value, pytest.param(empty, marks=pytest.mark.slow), Path.unlink],
)
def test_damaged_or_missing_result_file_is_rebuilt(
    synthetic, tmp_path, uninterrupted, damage, each_step_is_appended, impatient
):
    damage(stopped(synthetic, tmp_path))
    kinds = []
    path = run_evolution(
        synthetic.SyntheticEvolution(STEPS),
        tmp_path,
        "rig",
        lambda event: kinds.append(event.kind),
    )
    assert kinds[0] == "resumed"
    assert ("rebuilt" in kinds) == (damage is not Path.unlink)
    assert_same_bits(path, uninterrupted)


@pytest.mark.parametrize(
    "kept", [0.0, pytest.param(0.3, marks=pytest.mark.slow), 0.999]
)
def test_torn_record_is_ignored(
    synthetic, tmp_path, uninterrupted, kept, each_step_is_appended
):
    stopped(synthetic, tmp_path)
    record = tmp_path / ".rig.records" / "00000006.record"
    content = record.read_bytes()
    record.write_bytes(content[: int(kept * len(content))])
    events = []
    path = run_evolution(
        synthetic.SyntheticEvolution(STEPS), tmp_path, "rig", events.append
    )
    assert events[0].step == 5
    assert_same_bits(path, uninterrupted)


def test_record_with_one_wrong_bit_is_ignored(synthetic, tmp_path, uninterrupted):
    stopped(synthetic, tmp_path)
    record = tmp_path / ".rig.records" / "00000003.record"
    content = bytearray(record.read_bytes())
    content[len(content) // 2] ^= 1
    record.write_bytes(bytes(content))
    events = []
    path = run_evolution(
        synthetic.SyntheticEvolution(STEPS), tmp_path, "rig", events.append
    )
    assert events[0].step == 2
    assert_same_bits(path, uninterrupted)


def test_reader_defers_the_rows_but_not_the_run(
    synthetic, tmp_path, uninterrupted, each_step_is_appended, impatient
):
    """The campaign runs to its end under the eyes of a reader, who keeps the rows it
    opened.
    """
    path = stopped(synthetic, tmp_path)
    code = (
        f"import netCDF4, sys; f = netCDF4.Dataset({str(path)!r}); "
        "sys.stdout.write('open\\n'); sys.stdout.flush(); sys.stdin.read(); "
        "sys.stdout.write(str(f['profile_z'][:].shape[0]))"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as reader:
        assert reader.stdout.readline() == "open\n"
        kinds = []
        run_evolution(
            synthetic.SyntheticEvolution(STEPS),
            tmp_path,
            "rig",
            lambda event: kinds.append(event.kind),
        )
        seen, _ = reader.communicate()
    assert kinds.count("deferred") == STEPS - 6
    assert kinds[-1] == "finished"
    assert_same_bits(path, uninterrupted)
    assert seen == "7"


def test_changed_or_removed_finished_result(synthetic, tmp_path, uninterrupted):
    evolution = synthetic.SyntheticEvolution(STEPS)
    path = run_evolution(evolution, tmp_path, "rig")
    content = path.read_bytes()
    path.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    changed = path.read_bytes()
    with pytest.raises(ResultError, match="changed after its campaign had finished"):
        run_evolution(evolution, tmp_path, "rig")
    assert path.read_bytes() == changed
    path.unlink()
    assert_same_bits(run_evolution(evolution, tmp_path, "rig"), uninterrupted)


@pytest.mark.parametrize("finished", [True, False])
def test_other_campaign_in_the_directory_is_not_touched(synthetic, tmp_path, finished):
    if finished:
        path = run_evolution(synthetic.SyntheticEvolution(STEPS), tmp_path, "rig")
    else:
        path = stopped(synthetic, tmp_path)
    before = path.read_bytes()
    other = synthetic.SyntheticEvolution(STEPS, digest="another scene")
    with pytest.raises(ResultError, match=r"another campaign.*choose another --out"):
        run_evolution(other, tmp_path, "rig")
    assert path.read_bytes() == before


def test_result_file_of_unknown_origin_is_not_touched(synthetic, tmp_path):
    (tmp_path / "rig.nc").write_text("precious")
    with pytest.raises(ResultError, match="nothing was changed"):
        run_evolution(synthetic.SyntheticEvolution(STEPS), tmp_path, "rig")
    assert (tmp_path / "rig.nc").read_text() == "precious"


def test_programs_of_all_sessions_are_named_as_source(synthetic, tmp_path):
    stopped(synthetic, tmp_path)

    class Updated(synthetic.SyntheticEvolution):
        @property
        def header(self):
            header = super().header
            header.attributes["source"] = "wearsim later"
            return header

    path = run_evolution(Updated(STEPS), tmp_path, "rig")
    with netCDF4.Dataset(path) as file:
        assert file.source == "wearsim test; from step 7 on wearsim later"
        assert file.finished == "distance reached"


def test_step_that_does_not_move_on_is_an_error_not_an_endless_loop(
    synthetic, tmp_path
):
    class Stuck(synthetic.SyntheticEvolution):
        def advance(self, state, evaluation):
            return state, None

    with pytest.raises(NumericalError, match="is too short to change the distance"):
        run_evolution(Stuck(STEPS), tmp_path, "rig")
    status = read_status(tmp_path)["campaigns"]["rig"]
    assert status["state"] == "failed"
    assert "too short" in status["message"]


def test_full_disk_is_told_and_keeps_the_finished_steps(
    synthetic, tmp_path, monkeypatch
):
    stopped(synthetic, tmp_path)

    def full(descriptor):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr("wearsim.whole_files.os.fsync", full)
        with pytest.raises(ResultError, match="No space left on device"):
            run_evolution(synthetic.SyntheticEvolution(STEPS), tmp_path, "rig")
    events = []
    run_evolution(synthetic.SyntheticEvolution(STEPS), tmp_path, "rig", events.append)
    assert events[0].step == 6


@pytest.fixture
def statuses(synthetic, tmp_path, monkeypatch):
    """Function that runs a campaign and returns step and status file at each of its
    events.
    """

    def of_run(interval):
        seen = []
        monkeypatch.setattr("wearsim.campaign.run.STATUS_INTERVAL", interval)
        with locked(tmp_path):
            run_evolution(
                synthetic.SyntheticEvolution(STEPS),
                tmp_path,
                "rig",
                lambda event: seen.append(
                    (event.step, read_status(tmp_path)["campaigns"]["rig"])
                ),
            )
        return seen

    return of_run


def test_status_tells_distance_depth_and_time_left(statuses):
    seen = [status for _, status in statuses(0.0)]
    middle = seen[5]
    assert middle["state"] == "running"
    assert (middle["step"], middle["distance"], middle["target"]) == (4, 4000.0, 8000.0)
    assert middle["worst_depth"] > 0.0
    assert middle["step_length"] == 1000.0
    assert (middle["step_limit"], middle["fastest"]) == ("error", "curve")
    # half of the way is done: at the pace of the last quarter of the steps, from 2 to 4
    # km
    np.testing.assert_allclose(
        middle["time_left"], 2.0 * (middle["elapsed"] - seen[3]["elapsed"]), rtol=1e-9
    )
    assert seen[-1]["step_limits"] == {"error": STEPS}
    assert seen[0]["time_left"] is None
    assert (seen[-1]["state"], seen[-1]["time_left"]) == ("finished", 0.0)


def test_status_is_not_written_for_each_of_fast_steps(statuses):
    seen = [(step, status["step"]) for step, status in statuses(1e9)]
    assert seen == [(0, 0), *((step, 0) for step in range(STEPS + 1)), (STEPS, STEPS)]


@pytest.mark.parametrize(
    "room", [20_000, 100_000, pytest.param(280_000, marks=pytest.mark.slow)]
)
def test_writes_that_fail_keep_the_finished_steps_and_tell_what_to_do(
    synthetic, tmp_path, uninterrupted, forked, room
):
    """Files cannot grow beyond a limit, which the record, the new file and the appended
    file meet first.
    """
    code = (
        f"import resource, wearsim.campaign.record\nwearsim.campaign.record.APPEND_INTERVAL = 0.0\n"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({room}, resource.RLIM_INFINITY))\n"
    )
    process, printed = forked(code + program(tmp_path))
    with printed:
        lines = printed.read().splitlines()
    process.join()
    assert process.exitcode != 0
    output = [line for line in lines if "ResultError: " in line][-1]
    assert "cannot be written" in output
    assert "finished steps are safe, make room" in output
    assert "run the same command again" in output
    last = max(
        [-1, *(int(line.split()[1]) for line in lines if line.startswith("step"))]
    )
    events = []
    path = run_evolution(
        synthetic.SyntheticEvolution(STEPS), tmp_path, "rig", events.append
    )
    assert (events[0].step if events[0].kind == "resumed" else -1) >= last
    assert_same_bits(path, uninterrupted)
    assert_tidy(tmp_path)


def test_full_disk_is_told_before_the_result_file_is_touched(
    synthetic, tmp_path, uninterrupted, monkeypatch, each_step_is_appended
):
    path = stopped(synthetic, tmp_path, after=3)
    before = path.read_bytes()
    with monkeypatch.context() as patched:
        usage = type("usage", (), {"free": 1_000_001})
        patched.setattr("wearsim.results.file.shutil.disk_usage", lambda place: usage)
        with pytest.raises(
            ResultError, match=r"the disk is full, 1.0 MB left; .*make room"
        ):
            run_evolution(synthetic.SyntheticEvolution(STEPS), tmp_path, "rig")
    assert path.read_bytes() == before
    status = read_status(tmp_path)["campaigns"]["rig"]
    assert status["state"] == "failed"
    assert "the disk is full" in status["message"]
    events = []
    run_evolution(synthetic.SyntheticEvolution(STEPS), tmp_path, "rig", events.append)
    assert events[0].step == 4  # its record was written, its row was not
    assert_same_bits(path, uninterrupted)


@pytest.mark.slow
def test_rows_a_reader_kept_waiting_are_read_few_at_a_time(
    synthetic, tmp_path, uninterrupted, each_step_is_appended, impatient, monkeypatch
):
    """Else each step would read all of them again, and a long campaign would not fit in
    memory.
    """
    monkeypatch.setattr("wearsim.campaign.record.APPEND_AT_MOST", 2)
    path = stopped(synthetic, tmp_path, after=1)
    code = (
        f"import netCDF4, sys; f = netCDF4.Dataset({str(path)!r}); "
        "sys.stdout.write('open\\n'); sys.stdout.flush(); sys.stdin.read()"
    )
    held, rows = [], []
    append = run_module.Writer.flush.__globals__["append"]

    def counted(path, header, rows_, first, patience=None):
        rows.append(len(rows_))
        append(path, header, rows_, first, patience)

    monkeypatch.setattr("wearsim.campaign.record.append", counted)
    with subprocess.Popen(
        [sys.executable, "-c", code],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as reader:
        assert reader.stdout.readline() == "open\n"

        def let_go(event):
            held.append(event.kind)
            if event.kind == "step" and event.step == STEPS - 2:
                reader.communicate()

        run_evolution(synthetic.SyntheticEvolution(STEPS), tmp_path, "rig", let_go)
    assert held.count("deferred") == STEPS - 3
    assert max(rows) == 2
    assert_same_bits(path, uninterrupted)


@pytest.mark.parametrize("durable", [True, False])
def test_a_file_is_complete_when_it_gets_its_name(tmp_path, monkeypatch, durable):
    replace, content = os.replace, []

    def watched(source, target):
        content.append(Path(source).read_bytes())
        replace(source, target)

    monkeypatch.setattr(os, "replace", watched)
    write_atomically(tmp_path / "status.json", b"{}", durable=durable)
    assert content == [b"{}"]


BLOCKS = (
    {"shift_mm": -3, "distance_km": 9},
    {"shift_mm": 3, "yaw_mrad": 1, "distance_km": 12},
)
SWITCH = {  # its last point, at 7 mm, has no contact solution
    "shift_mean_mm": 4,
    "shift_std_mm": 1,
    "positions": 10,
    "friction": 0.5,
    "yaw_mrad": -30,
    "share": 0.001,
}
FINELY = "point_spacing_mm = 0.5\nerror_tolerance_um = 0.02\ndistance_km ="
CAMPAIGNS = {
    "rollers": (
        BLOCKS,
        {
            "counterface": "[counterface.wear]\nfactor = 0.8\nredress_every_km = 14",
            "campaign": f"{FINELY} 26\n[campaign.reprofiling]\nat_km = [5]",
        },
    ),
    "left out": (
        (
            {"shift_mean_mm": 0, "shift_std_mm": 2, "positions": 10, "share": 1.0},
            SWITCH,
        ),
        {"kind": "field", "campaign": f"{FINELY} 60"},
    ),
}


VEHICLE = """[scene]
kind = "field"
[wheelset]
profile = "S1002"
[counterface]
profile = "60E1"
inclination = "1:40"
[contact]
model = "fast"
strips = 10
cells = 10
[vehicle]
file = "regional_multiple_unit"
leading_share = 1
[[vehicle.class]]
name = "curve"
share = 1
curve_radius_m = 600
cant_deficiency_mm = 50
speed_km_h = 90
friction = 0.35
[campaign]
distance_km = 30
point_spacing_mm = 0.5
"""


def assert_same(one, other, name=""):
    """Bit by bit, fields of fields included."""
    if is_dataclass(one):
        for field in fields(one):
            assert_same(
                getattr(one, field.name),
                getattr(other, field.name),
                f"{name}.{field.name}",
            )
    elif isinstance(one, tuple):
        assert len(one) == len(other), name
        for k, pair in enumerate(zip(one, other, strict=True)):
            assert_same(*pair, f"{name}[{k}]")
    elif isinstance(one, np.ndarray):
        assert one.tobytes() == other.tobytes(), name
    else:
        assert one == other, name


KINDS = ("rollers", "left out", "vehicle")


@pytest.mark.parametrize("kind", KINDS)
def test_a_record_is_all_that_the_next_step_needs(evolution_of, scene_text, kind):
    """From each state as it is stored, without the contact that the step before has
    solved: the same bits.

    Blocks of several steps, of rollers that are redressed and wheels that are
    reprofiled within them.
    """
    running, tables = CAMPAIGNS.get(kind, ((), {}))
    of = evolution_of(scene_text(*running, **tables) if running else VEHICLE)
    state, taken = of.start()
    reasons = []
    while not reached(state.distance, of.target):
        evaluation = of.evaluate(state, taken)
        stored = rebuilt(State, flattened(state))
        assert_same(stored, state)
        again, again_taken = of.advance(stored, of.evaluate(stored))
        state, taken = of.advance(state, evaluation)
        assert_same(again, state)
        assert_same(replace(again_taken, end=None), replace(taken, end=None))
        reasons.append(taken.reason)
    assert len(reasons) > 2
    if kind == "left out":
        assert state.points.left_out.any()
    elif running:
        assert {"first step", "block border"} < set(reasons)
    if kind == "rollers":
        assert (state.counterface.redressed_count, "redressing" in reasons) == (1, True)
        assert state.reprofiled > 0


def test_steps_of_another_version_are_kept(synthetic, tmp_path, monkeypatch):
    path = stopped(synthetic, tmp_path)
    before = path.read_bytes()
    shapes = Header.row_shapes.func
    older = property(
        lambda header: {n: s for n, s in shapes(header).items() if n != "step_error"}
    )
    monkeypatch.setattr(Header, "row_shapes", older)  # as if results did not have it
    with pytest.raises(
        ResultError, match=r"steps of another version of wearsim.*choose another --out"
    ):
        run_evolution(synthetic.SyntheticEvolution(STEPS), tmp_path, "rig")
    assert path.read_bytes() == before


def test_steps_in_another_form_are_kept(synthetic, tmp_path):
    """Records of wearsim 0.1 have another ending; what they led to is not computed anew
    on top of them.
    """
    path = stopped(synthetic, tmp_path)
    before = path.read_bytes()
    for each in (tmp_path / ".rig.records").iterdir():
        each.rename(each.with_suffix(".npz"))
    with pytest.raises(
        ResultError, match=r"steps of another version of wearsim.*choose another --out"
    ):
        run_evolution(synthetic.SyntheticEvolution(STEPS), tmp_path, "rig")
    assert path.read_bytes() == before
