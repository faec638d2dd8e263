"""Many campaigns from Python: a sweep of keys, or scenes one beside the other."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import xarray as xr

from wearsim.errors import Fault, SceneError, issue_warning
from wearsim.scene import SweepScene, load_scene
from wearsim.scene.sweep import Sweep
from wearsim.studies.ensemble import Outcome, Runner, check_cases
from wearsim.studies.sweep import run_sweep, sweep_dataset, sweep_of

_LOG = logging.getLogger("wearsim")


def sweep(
    scene: str | Path | Mapping[str, Any],
    out: str | Path,
    vary: Mapping[str, Sequence[Any]] | None = None,
    *,
    jobs: int | None = 1,
) -> xr.Dataset:
    """Run a campaign for all combinations of some values, or continue where it stopped.

    Parameters
    ----------
    scene : str, Path or dict
        File of a scene to vary; or of a sweep, or its tables as dicts, which state what
        is varied.
    out : str or Path
        Directory: case 1 runs in `case_0001` in it, `sweep.csv` and `sweep.nc` have a
        row for each.
    vary : mapping, optional
        Dotted keys of the scene, each with its values: {"contact.model":
        ["fast", "standard"]}.
    jobs : int, optional
        Cases at a time, each in a process of its own, None for one per core; with 1 all
        run in this process. A script that starts processes must begin under
        ``if __name__ == "__main__":``.

    Returns
    -------
    xarray.Dataset
        Over `case`, `campaign` and `wheel`: varied values (`contact_model`), `state`
        and `fault` of each case, and the measures at its end. A case that fails is a
        row; it does not stop the others.

    Raises
    ------
    SceneError
        With the faults of all cases; nothing is run then.
    ResultError
        If `out` cannot be used.

    Examples
    --------
    >>> import wearsim
    >>> found = wearsim.sweep("rig.toml", "swept", {"wheelset.radius_mm": [420, 460]})
    >>> found["wheelset_radius_mm"].values.tolist(), found["state"].values.tolist()
    ([420.0, 460.0], ['finished', 'finished'])
    >>> found["max_wear_depth"].dims
    ('case', 'campaign', 'wheel')
    """
    if vary is not None:
        if isinstance(scene, Mapping):
            raise SceneError(
                [Fault("vary needs the file of a scene; save its tables as one")]
            )
        tables = {
            "base": str(scene),
            "vary": {key: list(values) for key, values in vary.items()},
        }
        return _run(_sweep({"title": Path(scene).stem}, tables), out, jobs)
    loaded = load_scene(scene)
    if not isinstance(loaded, SweepScene):
        raise SceneError(
            [Fault("the scene is no sweep; give what to vary", str(loaded.origin.path))]
        )
    return _run(sweep_of(loaded), out, jobs)


def run_many(
    scenes: Sequence[str | Path], out: str | Path, *, jobs: int | None = 1
) -> xr.Dataset:
    """Run several scenes, or continue where they stopped.

    Parameters
    ----------
    scenes : sequence of str or Path
        Files of rig, field or compare scenes.
    out : str or Path
        Directory, as of `sweep`.
    jobs : int, optional
        As of `sweep`.

    Returns
    -------
    xarray.Dataset
        As of `sweep`; `scene` has the files.

    Raises
    ------
    SceneError
        With the faults of all scenes; nothing is run then.
    ResultError
        If `out` cannot be used.

    Examples
    --------
    >>> import wearsim
    >>> found = wearsim.run_many(["rig.toml", "field.toml"], "several")
    >>> found["scene"].values.tolist(), found["campaign_name"].values.tolist()
    (['rig.toml', 'field.toml'], ['rig', 'field'])
    """
    if isinstance(scenes, str | Path):
        raise SceneError(
            [
                Fault(
                    f"scenes are a list of files; write [{str(scenes)!r}], or use "
                    "wearsim.run"
                )
            ]
        )
    return _run(_sweep({}, {"scenes": [str(scene) for scene in scenes]}), out, jobs)


def _sweep(header: Mapping[str, Any], tables: Mapping[str, Any]) -> Sweep:
    scene = load_scene({"scene": {"kind": "sweep", **header}, "sweep": tables})
    assert isinstance(scene, SweepScene)
    return sweep_of(scene)


def _run(cases: Sweep, out: str | Path, jobs: int | None) -> xr.Dataset:
    for warning in check_cases(cases.cases, Path(out)):
        issue_warning(warning, stacklevel=4)

    def report(count: int, outcome: Outcome) -> None:
        _LOG.info("case %d of %d: %s", outcome.number, count, outcome.state)

    command = f"wearsim sweep into {str(out)!r} from Python"
    run_sweep(cases, out, Runner(jobs=jobs, command=command, report=report))
    return sweep_dataset(out)
