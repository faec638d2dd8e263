"""Files of a run directory with far more than a campaign writes: not read whole, not
continued from.
"""

import hashlib
import json

import numpy as np
import pytest

from wearsim.campaign.directory import read_manifest, read_status
from wearsim.campaign.record import Writer
from wearsim.campaign.run import run_evolution
from wearsim.errors import ResultError
from wearsim.results import row_count

STEPS = 3


@pytest.fixture
def stopped(synthetic, tmp_path):
    """Evolution, its directory and the records of its two steps."""
    with synthetic.stopped_at(1) as stop:
        run_evolution(synthetic.SyntheticEvolution(STEPS), tmp_path, "rig", stop)
    evolution = synthetic.SyntheticEvolution(STEPS)
    return (
        evolution,
        tmp_path,
        Writer(evolution.header, tmp_path, "rig", evolution.digest).records,
    )


def goes_on_from(evolution, out):
    begun = []
    run_evolution(
        evolution, out, "rig", lambda event: begun.append((event.kind, event.step))
    )
    assert row_count(out / "rig.nc") == STEPS + 1
    return begun[0]


def test_a_state_of_a_million_points_is_computed_again(stopped):
    evolution, out, records = stopped
    row = {**records.row(1), "wear_depth": np.zeros((2, 1_000_000))}
    records.write(records.state(1), row, "wearsim")
    assert goes_on_from(evolution, out) == ("resumed", 0)


@pytest.mark.parametrize(
    "stated",
    [
        ("<f8", [2, 10**9]),
        ("<f8", [2, 10**30]),
        ("<f8", [-1]),
        ("|O", []),
        ("none", []),
        (1, 2),
        None,
    ],
)
def test_a_state_of_arrays_that_it_does_not_hold_is_computed_again(stated, stopped):
    """A record of its own digest, in which an array states gigabytes, or no type of
    numbers.
    """
    evolution, out, records = stopped
    path = records.path(1)
    text, _, values = path.read_bytes()[32:].partition(b"\n")
    label = json.loads(text)
    label["arrays"]["/wear_depth"] = stated
    content = json.dumps(label).encode() + b"\n" + values
    path.write_bytes(hashlib.sha256(content).digest() + content)
    assert goes_on_from(evolution, out) == ("resumed", 0)


def test_a_record_of_gigabytes_is_computed_again(stopped):
    """It is not read: a hole in the file takes no room on the disk."""
    evolution, out, records = stopped
    with open(records.path(1), "r+b") as file:
        file.truncate(3_000_000_000)
    assert goes_on_from(evolution, out) == ("resumed", 0)


@pytest.mark.parametrize(
    "content", ["[" * 100_000, '{"campaigns": ' + " " * 21_000_000 + "{}}"]
)
def test_files_of_a_directory_that_are_too_deep_or_too_large(content, tmp_path):
    (tmp_path / "status.json").write_text(content)
    assert read_status(tmp_path) == {}
    (tmp_path / "scene").mkdir()
    (tmp_path / "scene" / "manifest.json").write_text(content)
    with pytest.raises(
        ResultError,
        match=r"manifest\.json cannot be read \((larger than 20 MB|lists nested)",
    ):
        read_manifest(tmp_path)


@pytest.mark.parametrize(
    "content", ["{}", '{"campaigns": 3}', '{"campaigns": {"rig": 1e6}}', "1e999"]
)
def test_a_status_of_another_program_is_none(content, tmp_path):
    (tmp_path / "status.json").write_text(content)
    assert read_status(tmp_path) == {}


@pytest.mark.parametrize("cut", [slice(0), slice(3), slice(-8), slice(25)])
def test_a_record_of_other_values_than_it_states_is_refused(cut, stopped):
    _, _, records = stopped
    path = records.path(1)
    content = path.read_bytes()[32:][cut]
    path.write_bytes(hashlib.sha256(content).digest() + content)
    with pytest.raises(ResultError, match="was changed while the campaign ran"):
        records.state(1)
