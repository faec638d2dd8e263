"""Run directories frozen by earlier versions: their files open, what is finished stays
a success.

`tests/data/frozen/freeze.py` writes them at each release. Here they state a version
that is never the present one.
"""

import hashlib
import json
import shutil
import tarfile
from pathlib import Path

import netCDF4
import pytest

import wearsim
from wearsim.campaign.run import resume
from wearsim.cli import main
from wearsim.report.inspect import summary
from wearsim.results import load_results, schema
from wearsim.results.schema import COORDINATES, LAYOUT
from wearsim.translation.translate import translate

ARCHIVES = sorted((Path(__file__).parents[1] / "data" / "frozen").glob("*/*.tar.xz"))
FINISHED = [
    archive for archive in ARCHIVES if not archive.name.startswith("unfinished")
]
UNFINISHED = sorted(set(ARCHIVES) - set(FINISHED))
OTHER = "0.0.1"


def label(archive):
    return f"{archive.parent.name}-{archive.name.removesuffix('.tar.xz')}"


def unpacked(archive, folder):
    """Run directory of an archive, as if another version had begun it."""
    with tarfile.open(archive) as tar:
        tar.extractall(folder, filter="data")
    out = folder / archive.name.removesuffix(".tar.xz")
    manifest = out / "scene" / "manifest.json"
    manifest.write_text(
        json.dumps({**json.loads(manifest.read_text()), "version": OTHER})
    )
    return out


@pytest.fixture(scope="module")
def directory(tmp_path_factory):
    """Function that gives the run directory of an archive, which a test does not
    change.
    """
    made = {}

    def of(archive):
        if archive not in made:
            made[archive] = unpacked(archive, tmp_path_factory.mktemp("frozen"))
        return made[archive]

    return of


def contents(out):
    """Bytes of all files but the report, which is written anew, and the lock."""
    files = [
        path
        for path in out.rglob("*")
        if path.is_file() and path.name not in ("report.html", ".lock")
    ]
    return {str(path.relative_to(out)): path.read_bytes() for path in files}


def scene_of(out):
    return (
        out
        / "scene"
        / json.loads((out / "scene" / "manifest.json").read_text())["main"]
    )


def test_every_kind_of_campaign_is_frozen():
    names = {archive.name.removesuffix(".tar.xz") for archive in ARCHIVES}
    assert names >= {
        "fast",
        "auto",
        "compare",
        "reprofiled",
        "forced",
        "vehicle",
        "unfinished",
    }
    assert (
        sum(
            archive.stat().st_size
            for archive in ARCHIVES
            if archive.parent.name == "0.2.0"
        )
        < 1_000_000
    )


@pytest.mark.parametrize("archive", ARCHIVES, ids=label)
def test_frozen_results_open_and_are_summarised(directory, archive):
    out = directory(archive)
    paths = [path for path in out.glob("*.nc") if path.name != "translation.nc"]
    for path in paths:
        data = load_results(path)
        assert data["max_wear_depth"].values[-1].max() > 0.0
        assert summary(data)["finished"] == (archive in FINISHED)
    if len(paths) == 2:
        factors = translate(out / "rig.nc", out / "field.nc")
        assert factors["worn_area_factor"].notnull().any()


@pytest.mark.parametrize("archive", FINISHED, ids=label)
def test_what_is_finished_stays_a_success_and_unchanged(
    directory, archive, capsys, undrawn
):
    out = directory(archive)
    before = contents(out)
    kinds = []
    paths = resume(out, observer=lambda event: kinds.append(event.kind))
    assert set(kinds) == {"complete"}
    assert [path.suffix for path in paths] == [".nc"] * len(paths)
    for command in (["resume", str(out)], ["status", str(out)]):
        assert main(command) == 0
    assert "finished" in capsys.readouterr().out
    assert contents(out) == before


@pytest.mark.slow
@pytest.mark.parametrize("archive", FINISHED, ids=label)
def test_scene_of_a_finished_directory_runs_into_it_again_and_its_report_is_written(
    directory, archive
):
    """But for a scene of contact models that were removed: it is not read any more, its
    results are.
    """
    out = directory(archive)
    before = contents(out)
    removed = 'model = "auto"' in scene_of(out).read_text()
    assert main(["run", str(scene_of(out)), "--out", str(out)]) == (2 if removed else 0)
    (out / "report.html").unlink(missing_ok=True)
    assert main(["report", str(out)]) == 0
    assert (out / "report.html").stat().st_size > 10_000
    assert contents(out) == before


@pytest.mark.parametrize("archive", UNFINISHED, ids=label)
def test_what_is_unfinished_names_the_version_to_finish_it_with(
    directory, archive, capsys
):
    out = directory(archive)
    before = contents(out)
    for command in (
        ["resume", str(out)],
        ["run", str(scene_of(out)), "--out", str(out)],
    ):
        assert main(command) == 2
        message = capsys.readouterr().err
        assert (
            f"was begun by wearsim {OTHER}, this is {wearsim.__version__}: finish "
            f"it with {OTHER}"
        ) in message
        assert message.count("\n") == 1
    assert main(["status", str(out)]) == 0
    assert contents(out) == before


def test_what_another_version_finished_is_not_made_longer(directory, capsys):
    out = directory(FINISHED[0])
    before = contents(out)
    assert main(["resume", str(out), "--set", "campaign.distance_km=1e6"]) == 2
    message = capsys.readouterr().err
    assert f"was finished by wearsim {OTHER}" in message
    assert message.count("\n") == 1
    assert contents(out) == before


def test_a_finished_comparison_without_its_translation_is_unfinished(
    directory, tmp_path, capsys
):
    archive = max(one for one in FINISHED if one.name.startswith("compare"))
    out = shutil.copytree(directory(archive), tmp_path / "out")
    (out / "translation.nc").unlink()
    assert main(["resume", str(out)]) == 2
    assert f"finish it with {OTHER}" in capsys.readouterr().err


def test_variables_that_are_gone_are_ignored_and_new_ones_absent(
    directory, tmp_path, monkeypatch
):
    """Of another version only, and only those that came later: else a file without a
    variable is none.
    """
    path = shutil.copy(directory(FINISHED[0]) / "rig.nc", tmp_path / "rig.nc")
    missing = next(
        name for name in reversed(LAYOUT) if name not in {*COORDINATES, *schema.LATER}
    )
    with netCDF4.Dataset(path, "a") as file:
        file.source = f"wearsim {OTHER} (Python 3, numpy 2)"
        file.renameVariable(missing, "gone")
        file.setncattr("gone_setting", "acted once")
    with pytest.raises(wearsim.WearsimError, match=f"without {missing}"):
        load_results(path)
    monkeypatch.setattr(schema, "LATER", schema.LATER | {missing})
    data = load_results(path)
    assert "gone" in data
    assert missing not in data
    with netCDF4.Dataset(path, "a") as file:
        file.source = f"wearsim {wearsim.__version__} (Python 3, numpy 2)"
    first = next(name for name in LAYOUT if name in schema.LATER - {missing})
    with pytest.raises(wearsim.WearsimError, match=f"without {first}"):
        load_results(path)


def test_results_of_a_contact_model_that_is_gone(directory, tmp_path, capsys):
    """They open and are reported; what is unfinished is to be finished by the version
    that has the model.
    """
    gone = "knothe_le_the"
    out = shutil.copytree(directory(UNFINISHED[0]), tmp_path / "out")
    path, scene, manifest = (
        out / "rig.nc",
        scene_of(out),
        out / "scene" / "manifest.json",
    )
    with netCDF4.Dataset(path, "a") as file:
        file.contact_normal = gone
    scene.write_text(
        scene.read_text().replace("[contact]\n", f'[contact]\nnormal = "{gone}"\n')
    )
    told = json.loads(manifest.read_text())
    told["hashes"][scene.name] = hashlib.sha256(scene.read_bytes()).hexdigest()
    manifest.write_text(json.dumps(told))
    assert main(["inspect", str(path), "--all"]) == 0
    assert main(["report", str(out)]) == 0
    assert gone in capsys.readouterr().out
    assert (out / "report.html").stat().st_size > 10_000
    for command, message in (
        (["resume", str(out)], f"finish it with {OTHER}"),
        (
            ["run", str(scene), "--out", str(out)],
            f'contact.normal = "{gone}" was removed in 0.3.0',
        ),
    ):
        assert main(command) == 2
        said = capsys.readouterr().err
        assert message in said
        assert said.count("\n") == 1
