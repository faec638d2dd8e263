"""Rig against field.

All factors of two campaigns as one dataset, one file, one table.
"""

from __future__ import annotations

import hashlib
from collections.abc import Hashable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from wearsim.errors import ResultError, brief
from wearsim.quantities import QUANTITIES
from wearsim.results.file import UNREADABLE, load_derived, load_results
from wearsim.results.index import INDEXES
from wearsim.results.settings import SETTINGS, Setting
from wearsim.translation import compare, factors
from wearsim.translation.compare import CAMPAIGN, STAGES, STATIONS
from wearsim.translation.factors import STATUS
from wearsim.whole_files import require_utf8, write_netcdf

Result = str | Path | xr.Dataset
"""A result file, or its Dataset."""

BASIS = ("equal distance", "equal worn depth", "equal worn area")
WHEELS = ("right", "left", "both")

POINT_STATES = (
    ("new wheels", 0, 0),
    ("equal distance", 0, -1),
    ("equal worn depth", 1, -1),
)
"""States for which equal operating points are listed: name, basis, progress."""

_WHERE = {"rig": "on the rig", "field": "in the field"}
_COUNTERFACES = {"rig": "rollers", "field": "rails"}
_STATUS_NAMES = {number: name for name, number in STATUS.items()}
_SAME_PLACE = 1e-7  # [m]
_FILL = (
    9.969209968386869e36  # the netCDF library's own fill value: every viewer knows it
)
_CAUSES = (
    "power_cause_name",
    "power_cause_factor",
    "power_factor",
    "way",
    "cause_name",
    "cause_factor",
    "cause_zone_factor",
    "rate_factor",
    "rate_zone_factor",
)
"""Variables of the causes of a factor, where a comparison has looked for them."""
_NEEDED = (
    "distance",
    "max_wear_depth",
    "arc_length",
    "wear_depth_by_regime",
    "side",
    "weight",
)


def translate(
    rig: Result, field: Result, count: int = 41, reach: Sequence[float] | None = None
) -> xr.Dataset:
    """Compare a rig campaign with a field campaign.

    No single factor leads from rig to field: each one is given as a function, at equal
    distance, at equal worn depth and at equal worn area.

    Parameters
    ----------
    rig, field : str, Path or Dataset
        Result files, or results as `wearsim.open_results` gives them.
    count : int
        Number of stations along each axis; a multiple of 4 plus 1, so that the quarters
        are met.
    reach : sequence of float, optional
        Distance [m], largest depth [m] and worn area of both wheels [m2] at the last
        station, by default as far as both campaigns come.

    Returns
    -------
    Dataset
        Dimensions: `basis` (equal distance, equal worn depth, equal worn area),
        `progress` (0 = new wheel, 1 = as far as both campaigns come), `campaign` (rig,
        field), `matched_point`, `wheel`, `wheel_group` (right, left, both), `zone` of
        the wheel profile, `stage` and `arc` for values along the profile. Every
        `x_factor` is rig over field of `x`, NaN where undefined, with the reason in
        `x_factor_status`.

    Raises
    ------
    ResultError
        If a file cannot be read, a variable is missing or wheels were reprofiled; also
        if the results are exchanged, or one result is given twice.

    Examples
    --------
    >>> import wearsim
    >>> factors = wearsim.translate("out/rig.nc", "out/field.nc")
    >>> factors["worn_area_factor"].dims
    ('basis', 'progress', 'wheel_group')
    """
    rig, field = (
        result if isinstance(result, xr.Dataset) else load_results(result)
        for result in (rig, field)
    )
    require_whole((rig, field))
    if [data.attrs.get("scene_kind") for data in (rig, field)] == ["field", "rig"]:
        raise ResultError(
            "the results are exchanged: that of the rig is of a field campaign, and "
            "that of the field of a rig campaign; give the rig first"
        )
    for role, data in zip(CAMPAIGN, (rig, field), strict=True):
        if is_reprofiled(data):
            raise ResultError(
                f"{role} result: its wheels were reprofiled, and factors are of the "
                "wear since new; compare a campaign without [campaign.reprofiling]"
            )
    factors_of_both = compared(compare.Comparison(rig, field, count, reach))
    if factors_of_both.attrs["rig_sha256"] == factors_of_both.attrs["field_sha256"]:
        raise ResultError(
            "rig and field are the same result twice; give the results of two "
            "campaigns, the rig first"
        )
    return factors_of_both


def require_whole(
    pair: Sequence[xr.Dataset], names: tuple[str, str] = CAMPAIGN
) -> None:
    """Raise `ResultError` for the first of two results that lacks what is compared."""
    for role, data in zip(names, pair, strict=True):
        if missing := [name for name in _NEEDED if name not in data]:
            raise ResultError(
                f"{role} result: variable {missing[0]} is missing; give a file of "
                "`wearsim run`"
            )


def is_reprofiled(data: xr.Dataset) -> bool:
    """Return True if wheels of a campaign were reprofiled."""
    return "last_reprofiling" in data and bool(
        (data["last_reprofiling"].values > 0).any()
    )


def compared(comparison: compare.Comparison) -> xr.Dataset:
    """Compare two campaigns: all parts, with what is equal in both, see `translate`."""
    axes, count = comparison.axes, comparison.axes.distance.shape[1]
    comparison.add(
        "basis_name", "basis", list(BASIS), "what is equal in both campaigns"
    )
    comparison.add("campaign_name", "campaign", list(comparison.names), "campaign")
    comparison.add("wheel_name", "wheel", list(WHEELS[:2]), "wheel")
    comparison.add(
        "wheel_group_name", "wheel_group", list(WHEELS), "wheel, or both together"
    )
    meaning = "largest wear depth of both wheels where the campaigns are compared"
    comparison.add("worn_depth", STATIONS, axes.depth, meaning, "m")
    meaning = "whether both campaigns reach this distance or depth"
    comparison.add_flags(
        "reachable", STATIONS[:2], axes.reachable, meaning, ("no", "yes")
    )
    for add in compare.PARTS:
        add(comparison)
    share = {"units": "1", "long_name": "share of the range both campaigns cover"}
    arc = {"units": "m", "long_name": "arc length of the new wheel"}
    return xr.Dataset(
        comparison.variables,
        coords={
            "progress": ("progress", np.linspace(0.0, 1.0, count), share),
            "stage": ("stage", np.array(STAGES), share),
            "arc": ("arc", comparison.pair[0]["arc_length"].values, arc),
        },
        attrs=_attributes(comparison),
    )


def with_known_causes(dataset: xr.Dataset, file: Path) -> xr.Dataset:
    """Return a dataset of `translate` with the causes.

    That a file of the same two results holds, if any.
    """
    if not file.is_file():
        return dataset
    try:
        stored = load_derived(file)
    except UNREADABLE:
        return dataset
    if any(
        stored.attrs.get(f"{role}_sha256") != dataset.attrs[f"{role}_sha256"]
        for role in CAMPAIGN
    ):
        return dataset
    if "causes" in stored.attrs:
        dataset = dataset.assign_attrs(causes=stored.attrs["causes"])
    same_points = stored.attrs.get("matched_points") == dataset.attrs["matched_points"]
    names = [name for name in _CAUSES if same_points or not name.startswith("power")]
    return dataset.assign(
        {name: stored[name].variable for name in names if name in stored}
    )


def write(dataset: xr.Dataset, out: str | Path) -> Path:
    """Write a dataset of `translate` as netCDF-4 (CF).

    With fill values where a factor is undefined.

    The file is replaced as a whole, never half written.
    """
    out = Path(out)
    encoding: dict[Hashable, dict[str, Any]] = {}
    for name, variable in dataset.variables.items():
        if variable.dtype.kind == "f":
            encoding[name] = {"_FillValue": None if name in dataset.coords else _FILL}
            if variable.ndim > 1:
                encoding[name] |= {"zlib": True, "complevel": 4, "shuffle": True}
    require_utf8(out)
    write_netcdf(dataset, out, "choose another folder", encoding)
    return out


def table(dataset: xr.Dataset) -> pd.DataFrame:
    """Factors where both campaigns end, for a terminal or the report.

    Parameters
    ----------
    dataset : Dataset
        From `translate` or read back from its file.

    Returns
    -------
    DataFrame
        Columns basis, variable, quantity, unit, rig, field, factor, status; values in
        the unit people read, NaN where undefined. Wear of both wheels together; contact
        values are means of both. Nothing is computed here: values, factors and statuses
        are those of the dataset. Its warnings are in `attrs["warnings"]`, a list of
        str.
    """
    variables = {"distance_run": "distance"}
    variables |= {
        f"{n}_change" if rule == "change" else n: n
        for n, rule in factors.WEAR_QUANTITIES.items()
    }
    variables |= {"equivalent_conicity": "equivalent_conicity"}
    variables |= {f"{name}_collective": name for name in factors.POINT_QUANTITIES}
    frame = pd.DataFrame(
        {"basis": basis}
        | _entry(
            dataset,
            variable,
            name,
            b,
            -1,
            *((2,) if "wheel_group" in dataset[variable].dims else ()),
        )
        for b, basis in enumerate(BASIS)
        for variable, name in variables.items()
    )
    frame.attrs["warnings"] = str(dataset.attrs.get("warnings", "")).splitlines()
    return frame


def cause_table(dataset: xr.Dataset) -> pd.DataFrame:
    """Causes of the rate of worn area.

    A row each and their product, a column for each share of the way.

    Then a column for each zone of the wheel that wears on both, where the campaigns
    end.

    Without rows where a comparison has not looked for them, see `[compare] causes`.
    """
    if "cause_factor" not in dataset:
        return pd.DataFrame()
    names = [*map(str, dataset["cause_name"].values), "all causes: rig over field"]
    values = np.vstack(
        [dataset["cause_factor"].values.T, dataset["rate_factor"].values]
    )
    ways = ["new wheels", *(f"{way:.0%}" for way in dataset["way"].values[1:])]
    frame = pd.DataFrame(values, index=pd.Index(names, name="cause"), columns=ways)
    zones = np.vstack(
        [
            dataset["cause_zone_factor"].values[-1],
            dataset["rate_zone_factor"].values[-1],
        ]
    )
    for zone, column in zip(dataset["zone_name"].values, zones.T, strict=True):
        if np.isfinite(column).all():
            frame[str(zone)] = column
    return frame


def power_cause_table(dataset: xr.Dataset) -> pd.DataFrame:
    """Causes of the frictional power at equal operating points, new wheels.

    A row for each point and wheel.

    Columns point, shift [mm], wheel, a factor of each cause, and their product; without
    rows where a comparison has not looked for them, and without wheels that have
    several patches.
    """
    if "power_cause_factor" not in dataset:
        return pd.DataFrame()
    names = [str(name) for name in dataset["power_cause_name"].values]
    causes, factor = (
        dataset["power_cause_factor"].values,
        dataset["power_factor"].values,
    )
    rows = [
        [*point.values(), *causes[at], factor[at]]
        for at, point in _points(dataset)
        if np.isfinite(factor[at])
    ]
    return pd.DataFrame(
        rows, columns=["point", "shift", "wheel", *names, "all: rig over field"]
    )


def point_table(dataset: xr.Dataset) -> pd.DataFrame:
    """Factors at equal operating points: new wheels, and where both campaigns end.

    Returns
    -------
    DataFrame
        Columns state (a name of `POINT_STATES`), point (its label on the rig),
        shift [mm], wheel, and those of `table` from `variable` on; points in the order
        of their shift. Without rows where no point is equal.
    """
    columns = [
        "state",
        "point",
        "shift",
        "wheel",
        "variable",
        "quantity",
        "unit",
        *CAMPAIGN,
        "factor",
    ]
    rows = [
        {"state": state, **point}
        | _entry(dataset, f"{name}_point", name, basis, progress, *at)
        for state, basis, progress in POINT_STATES
        for at, point in _points(dataset)
        for name in factors.POINT_QUANTITIES
    ]
    return pd.DataFrame(rows, columns=[*columns, "status"])


def _points(dataset: xr.Dataset) -> list[tuple[tuple[int, int], dict[str, Any]]]:
    """Place and names of equal points and wheels, in the order of their shift."""
    if not int(dataset.attrs["matched_points"]):
        return []
    shift = dataset["shift"].values * QUANTITIES["shift"].shown_factor
    labels = dataset["rig_label"].values
    return [
        (
            (int(i), w),
            {"point": str(labels[i]), "shift": float(shift[i]), "wheel": wheel},
        )
        for i in np.argsort(shift, kind="stable")
        for w, wheel in enumerate(WHEELS[:2])
    ]


def _entry(
    dataset: xr.Dataset, variable: str, name: str, basis: int, *at: int
) -> dict[str, Any]:
    """Factor and values of a variable at a place, in the unit people read.

    `at` begins with the progress.
    """
    shown, place = QUANTITIES[name], (basis, *at)
    meaning = (
        shown.meaning
        if variable == "distance_run"
        else str(dataset[variable].attrs["long_name"])
    )
    values = dataset[variable].values[basis, at[0]] * shown.shown_factor
    return {
        "variable": variable,
        "quantity": meaning.removesuffix(" at equal operating points"),
        "unit": shown.shown_unit,
        **{role: float(values[(c, *at[1:])]) for c, role in enumerate(CAMPAIGN)},
        "factor": float(dataset[f"{variable}_factor"].values[place]),
        "status": _STATUS_NAMES[
            int(dataset[f"{variable}_factor_status"].values[place])
        ],
    }


def content_hash(dataset: xr.Dataset) -> str:
    """SHA-256 over names and values.

    Equal for equal results, however the file was put together.
    """
    digest = hashlib.sha256()
    for name in sorted({str(name) for name in dataset.variables}.difference(INDEXES)):
        values = dataset[name].values
        digest.update(name.encode())
        digest.update(
            "\0".join(map(str, values.ravel())).encode()
            if values.dtype.kind in "OUST"
            else values.tobytes()
        )
    return digest.hexdigest()


def differences(
    rig: xr.Dataset, field: xr.Dataset, names: tuple[str, str] = CAMPAIGN
) -> list[str]:
    """List the settings in which two results differ, with both values [SI].

    One line for each compared setting that differs, and one for counterfaces of
    different shape under one name. The curvature of the counterface, in which rig and
    field must differ, is not listed.
    """
    notes = []
    for setting in SETTINGS.values():
        if setting.compared and (texts := _differing_values(setting, rig, field)):
            phrases = [
                f"{text} {_WHERE.get(name, f'in {name}')}"
                for text, name in zip(texts, names, strict=True)
            ]
            notes.append(
                f"{setting.name.replace('_', ' ')} differs: {', '.join(phrases)}"
            )
    notes += _counterface_differences(rig, field)
    if "counterface_name" in rig or "counterface_name" in field:
        wears = [
            "wear" if "counterface_name" in data else "stay as new"
            for data in (rig, field)
        ]
        phrases = [
            f"{_COUNTERFACES.get(name, f'counterfaces in {name}')} {how}"
            for name, how in zip(names, wears, strict=True)
        ]
        notes.append(
            f"the factors contain wear of the counterface: {', '.join(phrases)}"
        )
    return notes


def _differing_values(
    setting: Setting, rig: xr.Dataset, field: xr.Dataset
) -> list[str]:
    """Texts of both values of a setting, none if they agree."""
    values = [setting.stated_in(data.attrs) for data in (rig, field)]
    if setting.use == "numbers":
        values = _differing_numbers(rig, field, [str(value) for value in values])
    if values[0] == values[1]:
        return []
    return [_text(value, setting) for value in values]


def _counterface_differences(rig: xr.Dataset, field: xr.Dataset) -> list[str]:
    """Line on counterfaces of different shape or place under one name."""
    first, second = (data.attrs.get("counterface_profile", "") for data in (rig, field))
    if first != second:
        return []
    profiles = [
        np.stack([data[f"counterface_{c}"].values for c in "yz"])
        for data in (rig, field)
    ]
    if profiles[0].shape != profiles[1].shape:
        if "counterface_name" in rig or "counterface_name" in field:
            return []
        return [
            "the counterface profiles are sampled differently: they may differ "
            "in shape or place"
        ]
    offset = float(np.abs(profiles[0] - profiles[1]).max())
    if offset <= _SAME_PLACE:
        return []
    return [
        "the counterface profiles differ in shape or place, by up to "
        f"{1e3 * offset:.4g} mm"
    ]


def _differing_numbers(
    rig: xr.Dataset, field: xr.Dataset, values: list[str]
) -> list[str]:
    """Law numbers of two lists that differ, none if law or set differ."""
    if any(
        rig.attrs.get(key) != field.attrs.get(key)
        for key in ("wear_law", "wear_coefficients")
    ):
        return ["", ""]
    lists = [text.split(", ") for text in values]
    return [
        ", ".join(number for number in numbers if number not in others)
        for numbers, others in zip(lists, lists[::-1], strict=True)
    ]


def _text(value: Any, setting: Setting) -> str:
    """Value of a setting as a message repeats it.

    Of a list of a law's numbers the first ten.
    """
    if isinstance(value, str):
        texts = setting.text_of(value).split(", ")
        return ", ".join(map(brief, texts[:10])) or "unknown"
    unit = setting.quantity.unit.removeprefix("1") if setting.quantity else ""
    return f"{float(value):.10g} {unit}".rstrip()


def _attributes(comparison: compare.Comparison) -> dict[str, Any]:
    (rig, field), names = comparison.pair, comparison.names
    titles = [
        str(data.attrs.get("title", name))
        for data, name in zip(comparison.pair, names, strict=True)
    ]
    attrs: dict[str, Any] = {
        "Conventions": "CF-1.11",
        "title": " against ".join(titles),
        "history": "wearsim translate",
        "source": rig.attrs.get("source", "wearsim"),
        "comment": (
            f"factors are {names[0]} over {names[1]}; a fill value means undefined, "
            "the status variable says why"
        ),
        "matched_points": np.int32(len(comparison.matched)),
    }
    for role, data in zip(names, comparison.pair, strict=True):
        attrs[f"{role}_sha256"] = content_hash(data)
        for key in (
            "title",
            "counterface_curvature",
            "counterface_curvature_left",
            *(setting.name for setting in SETTINGS.values() if setting.compared),
        ):
            if str(data.attrs.get(key, "")) != "":
                attrs[f"{role}_{key}"] = data.attrs[key]
    notes = [*differences(rig, field, names), *comparison.notes]
    if not factors.rotation_matches(rig, field):
        notes.append(
            "no operating point counts as equal: the rules of rotation and roll and "
            "the axle torque are part of it, and they differ or are unknown"
        )
    elif not len(comparison.matched):
        notes.append(
            "no operating point is solved in both campaigns: give both the same "
            "[operation.monitor]"
        )
    if notes:
        attrs["warnings"] = "\n".join(notes)
    return attrs
