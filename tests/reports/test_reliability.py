"""The siege goes on where it stopped, and attacks that broke a rule are made again."""

from collections import Counter
from concurrent.futures import ThreadPoolExecutor

import pytest
import reliability


@pytest.fixture
def attacked(monkeypatch):
    """Seeds attacked so far; those of `broken` break a rule."""
    seeds, broken = [], {3, 14}

    def besiege(kind, some):
        seeds.extend(some)
        faults = {seed: f"fault of {kind} {seed}" for seed in some if seed in broken}
        kept = [
            reliability.siege.way_of(kind, seed)[1]
            for seed in some
            if seed not in faults
        ]
        return Counter((way, "refused") for way in kept), faults

    monkeypatch.setattr(
        reliability,
        "ProcessPoolExecutor",
        lambda jobs, mp_context: ThreadPoolExecutor(1),
    )
    monkeypatch.setattr(reliability.siege, "besiege", besiege)
    return seeds, broken


def test_a_run_goes_on_where_it_stopped_and_attacks_faults_again(
    attacked, monkeypatch, tmp_path
):
    seeds, broken = attacked
    monkeypatch.setenv("WEARSIM_SIEGE", "0.0016")
    reliability.main(["--kind", "profiles", "--out", str(tmp_path)])
    rows = reliability.rows_in(tmp_path / "reliability.csv")
    assert seeds == list(range(16))
    assert rows["count"].sum() == 16
    assert rows["seed"].dropna().tolist() == [3, 14]
    seeds.clear()
    broken.discard(3)  # mended meanwhile
    monkeypatch.setenv("WEARSIM_SIEGE", "0.002")
    reliability.main(["--kind", "profiles", "--out", str(tmp_path)])
    rows = reliability.rows_in(tmp_path / "reliability.csv")
    assert seeds == [3, 14, 16, 17, 18, 19]
    assert rows["count"].sum() == 20
    assert rows["seed"].dropna().tolist() == [14]
    page = (tmp_path / "reliability.md").read_text()
    assert "| profiles | 10000 | 20 | 9980 | 1 |" in page


def test_the_report_is_what_its_table_says(reports, tmp_path):
    (tmp_path / "reliability.csv").write_bytes(
        (reports / "reliability.csv").read_bytes()
    )
    reliability.main(["--from-csv", "--out", str(tmp_path)])
    written, text = (
        (folder / "reliability.md").read_text() for folder in (tmp_path, reports)
    )
    assert written == text
