"""Tables of measured wheels: profiles, gauge values and masses at distances.

A table (CSV) has a row for each measurement of a wheel. The wear since the first one,
at `from_km` of [uncertainty.measured], is what a calibration learns from.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field
from scipy.interpolate import PchipInterpolator

from wearsim.errors import Fault, ProfileError, ResultError, raise_any
from wearsim.profile.alignment import align
from wearsim.profile.files import read_profile
from wearsim.profile.shape import Profile, arc_length, resample, vertex_normals
from wearsim.profile.worn import cut_along_normals
from wearsim.quantities import QUANTITIES
from wearsim.scene import FieldScene, RigScene
from wearsim.scene.inputs import inputs_of
from wearsim.scene.models import find_file
from wearsim.scene.point_files import statements_of, with_keys
from wearsim.scene.section import Section, Text, read_rows
from wearsim.scene.uncertainty import MeasuredSection
from wearsim.studies.posterior import (
    FloatArray,
    Whitener,
    alignment_modes,
    difference_covariance,
    noise_covariance,
    shape_covariance,
    whitener,
)

WHEELS = ("right", "left")
GAUGES: Mapping[str, tuple[str, float, str]] = {
    "Sh_mm": ("flange_height", 1e-3, "Sh_sd_mm"),
    "Sd_mm": ("flange_thickness", 1e-3, "Sd_sd_mm"),
    "qR_mm": ("flange_gradient", 1e-3, "qR_sd_mm"),
    "mass_kg": ("worn_mass", 1.0, "mass_sd_kg"),
}
"""Columns beside the profile: variable of results, its unit, column of the standard
deviation."""

_RANGES = {
    **{column: variable for column, (variable, _, _) in GAUGES.items()},
    "mass_kg": "measured_mass",
}
"""Quantities whose range the values of a column have."""

_SPACING = 1e-3  # of the points that are compared [m]: noise is correlated over 2 mm
_CUT = 0.1e-3  # of measured profiles, before they are cut with normals [m]
_UNLIKE = 1e-3  # from the new wheel, from which on it is another one [m]
_FEWEST = 20  # points of a profile
_LEAST_PIVOT = 1e-12  # of a covariance, over its variance: above rounding

Number = Annotated[float | None, Field(gt=0.0)]


class MeasuredRow(Section):
    """A row of a table of measured wheels."""

    campaign: Literal["rig", "field"] | None = None
    distance_km: float = Field(ge=0.0, le=1e7)
    wheel: Literal["right", "left", "both"]
    profile: Text | None = None
    Sh_mm: Number = None
    Sh_sd_mm: Number = None
    Sd_mm: Number = None
    Sd_sd_mm: Number = None
    qR_mm: Number = None
    qR_sd_mm: Number = None
    mass_kg: Number = None
    mass_sd_kg: Number = None

    @property
    def line(self) -> int:
        """Line in the table."""
        assert self._place is not None
        return self._place[1][()]


@dataclass(frozen=True)
class Curves:
    """Wear depths [m] and measures [SI] of a campaign over its distance [m]."""

    distance: FloatArray  # (t,) rising [m]
    depth: FloatArray  # (t, 2, p) wear depth at the points of the new wheels [m]
    measures: Mapping[str, FloatArray]  # (t, 2) of each wheel, by variable [SI]


@dataclass(frozen=True)
class Block:
    """Changes of a quantity of a wheel since its first measurement [SI]."""

    campaign: str
    wheel: str  # right, left, or both: their sum
    quantity: str  # wear_depth, or a measure of each wheel
    start: float  # distance of the first measurement [m]
    distance: FloatArray  # (m,) of the others, rising [m]
    arc: FloatArray  # (n,) along the new wheel, of the points that are compared [m]
    y: FloatArray  # (n,) their places [m]
    points: FloatArray  # (n,) their numbers; one 0 for a measure
    values: FloatArray  # (m, n) changes [SI]
    single: FloatArray  # (n, n) covariance of a single measurement [SI]
    # (n, k) what a bad place of the profile feigns, part of `single` [SI]
    modes: FloatArray
    counts: FloatArray  # (m,) measurements at each distance, in variances of `single`
    first: float  # the same at the start
    share: float  # standard deviation of the error of shape over the change
    length: float  # along the profile [m]

    def predicted(self, curves: Curves, scale: float = 1.0) -> FloatArray:
        """Predict changes (m, n) by a campaign, its wear made faster by a factor."""
        at = np.concatenate([[self.start], self.distance])
        if self.quantity == "wear_depth":
            points = self.points.astype(np.int64)
            side = WHEELS.index(self.wheel)
            along = curves.depth[:, side][:, points]
        else:
            both = curves.measures[self.quantity]
            measure = (
                both.sum(axis=1)
                if self.wheel == "both"
                else both[:, WHEELS.index(self.wheel)]
            )
            along = measure[:, None]
        if not np.isfinite(along).all():
            raise ResultError(
                f"the predicted wheel has no {self.quantity} ({self.campaign}, "
                f"{self.wheel} wheel); leave its measurements out"
            )
        at = np.minimum(scale * at, curves.distance[-1])
        values = PchipInterpolator(curves.distance, along, axis=0)(at)
        return np.asarray(values[1:] - values[0])

    def placed(self, predicted: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Give the changes (m, n) with the profiles where they most probably lay.

        Returned with their standard deviations (m, n) there, about the prediction.
        """
        total_covariance = self.covariance(predicted)
        between = difference_covariance(self.counts, self.first)
        moved = np.kron(between, self.modes @ self.modes.T)
        left = (self.values - predicted).reshape(-1)
        displacement = (moved @ np.linalg.solve(total_covariance, left)).reshape(
            predicted.shape
        )
        deviation = np.sqrt(np.diag(total_covariance - moved)).reshape(predicted.shape)
        return self.values - displacement, deviation

    def covariance(self, predicted: FloatArray) -> FloatArray:
        """Covariance of the changes (m n, m n), where these are predicted."""
        noise = np.kron(difference_covariance(self.counts, self.first), self.single)
        return noise + shape_covariance(predicted, self.arc, self.share, self.length)

    def root(self, predicted: FloatArray) -> FloatArray:
        """Lower triangular root of this covariance (m n, m n)."""
        covariance = self.covariance(predicted)
        with suppress(np.linalg.LinAlgError):
            root = np.asarray(np.linalg.cholesky(covariance))
            if (np.diag(root) ** 2 > _LEAST_PIVOT * np.diag(covariance)).all():
                return root
        if self.quantity == "wear_depth":
            raise ResultError(
                "noise_um and white_um of [uncertainty.measured] are negligible beside "
                "align_mm and shape_percent, which leaves no solution; state the noise "
                "of the instrument, some 10 and 3 um"
            )
        deviation = next(
            column for name, _, column in GAUGES.values() if name == self.quantity
        )
        wheels = "both wheels" if self.wheel == "both" else f"the {self.wheel} wheel"
        raise ResultError(
            f"{deviation} of {wheels} of the {self.campaign} is negligible beside that "
            "of the first measurement, or beside shape_percent of "
            "[uncertainty.measured], which leaves no solution; state the standard "
            "deviation of the instrument"
        )


@dataclass(frozen=True)
class Measured:
    """All that was measured, as one vector of changes."""

    blocks: tuple[Block, ...]
    files: tuple[tuple[str, str], ...] = ()  # names of the files and their SHA-256

    @property
    def values(self) -> FloatArray:
        """Changes (N,) of all blocks [SI]."""
        return np.concatenate([block.values.reshape(-1) for block in self.blocks])

    @property
    def memory(self) -> float:
        """Memory of the covariances of all blocks and their factors [bytes]."""
        squares = [8.0 * block.values.size**2 for block in self.blocks]
        return 2.0 * sum(squares) + 4.0 * max(squares)

    @property
    def campaigns(self) -> tuple[str, ...]:
        """Measured campaigns, the rig first."""
        measured = {block.campaign for block in self.blocks}
        return tuple(name for name in ("rig", "field") if name in measured)

    def farthest(self, campaign: str) -> float:
        """Largest distance of a measurement [m]."""
        distances = [
            block.distance[-1] for block in self.blocks if block.campaign == campaign
        ]
        return float(max(distances))

    def nearest(self, campaign: str) -> float:
        """Smallest distance of a measurement after the first ones [m]."""
        distances = [
            block.distance[0] for block in self.blocks if block.campaign == campaign
        ]
        return float(min(distances))

    def predicted(
        self, curves: Mapping[str, Curves], scales: Mapping[str, float]
    ) -> FloatArray:
        """Predict changes (N,) by campaigns, their wear made faster by factors."""
        parts = [
            block.predicted(curves[block.campaign], scales.get(block.campaign, 1.0))
            for block in self.blocks
        ]
        return np.concatenate([part.reshape(-1) for part in parts])

    def split(self, vector: FloatArray) -> list[FloatArray]:
        """Parts (..., m, n) of a vector (..., N) by block."""
        sizes = [block.values.size for block in self.blocks]
        parts = np.split(vector, np.cumsum(sizes)[:-1], axis=-1)
        return [
            part.reshape(*vector.shape[:-1], *block.values.shape)
            for part, block in zip(parts, self.blocks, strict=True)
        ]

    def noise(self, predicted: FloatArray) -> Whitener:
        """Whitener of residuals, where changes (N,) are predicted.

        Raises
        ------
        ResultError
            If single points or gauge values are stated to have practically no noise.
        """
        parts = zip(self.blocks, self.split(predicted), strict=True)
        return whitener([block.root(part) for block, part in parts])

    def again(self, block: Block, index: int) -> Measured:
        """Return these with one more measurement of a block's distance."""
        counts = block.counts.copy()
        counts[index] += 1.0
        more = replace(block, counts=counts)
        return replace(
            self, blocks=tuple(more if b is block else b for b in self.blocks)
        )


def read_measured(
    path: str | Path,
    parts: Mapping[str, RigScene | FieldScene],
    settings: MeasuredSection,
) -> Measured:
    """Read a table of measured wheels and the profiles that it names.

    Parameters
    ----------
    path : str or Path
        CSV with the columns distance_km, wheel (right, left, or both for masses of a
        wheelset), campaign (rig or field, where the scene has both), and profile (a
        file) or Sh_mm, Sd_mm, qR_mm, mass_kg, each with its standard deviation
        (Sh_sd_mm, mass_sd_kg).
    parts : mapping of str to scene
        Loaded scenes by campaign.
    settings : MeasuredSection
        Errors of the measurements.

    Returns
    -------
    Measured

    Raises
    ------
    SceneError
        With all faults of the table, each with its line.
    """
    path = Path(path)
    rows = read_rows(path, MeasuredRow, "measurement")
    faults = [
        Fault(message, str(path), row.line)
        for row in rows
        for message in _faults_of(row, parts, settings)
    ]
    raise_any(faults)
    only = next(iter(parts))  # where the table names none
    named = [(row, str(row.campaign or only)) for row in rows]
    groups: dict[tuple[str, str, str], list[MeasuredRow]] = {}
    for row, campaign in named:
        for column in ("profile", *GAUGES):
            if getattr(row, column) is not None:
                groups.setdefault((campaign, row.wheel, column), []).append(row)
    blocks, files = list[Block](), dict[str, str]()
    for (campaign, wheel, column), group in groups.items():
        start = min(group, key=lambda row: row.distance_km)
        if abs(start.distance_km - settings.from_km) > 1e-9:
            text = (
                f"the {wheel} wheel of the {campaign} has no {column} at "
                f"{settings.from_km:g} km, which its wear is counted from; add that "
                "measurement, or state from_km in [uncertainty.measured]"
            )
            faults.append(Fault(text, str(path), start.line))
        elif all(row.distance_km == start.distance_km for row in group):
            text = (
                f"the {wheel} wheel of the {campaign} has no {column} after "
                f"{start.distance_km:g} km, so no wear; add a measurement"
            )
            faults.append(Fault(text, str(path), start.line))
        elif column == "profile":
            part = parts[campaign]
            depths, profile_faults, hashes = _profiles(
                path, part, wheel, group, settings
            )
            faults += profile_faults
            files |= hashes
            if depths is not None:
                blocks.append(_profile_block(campaign, wheel, group, depths, settings))
        else:
            blocks.append(_gauge_block(campaign, wheel, column, group, settings))
    faults += [
        Fault(text, str(path), line) for line, text in _duplicate_measurements(groups)
    ]
    raise_any(sorted(faults, key=lambda fault: fault.line or 0))
    return Measured(tuple(blocks), tuple(files.items()))


def _duplicate_measurements(
    groups: Mapping[tuple[str, str, str], Sequence[MeasuredRow]],
) -> Iterator[tuple[int, str]]:
    """Lines and messages of what several rows state of the same wear."""
    for (campaign, wheel, column), rows in groups.items():
        if column == "profile":
            continue
        of_mass = column == "mass_kg"
        duplicate = (
            (campaign, "both", column) if of_mass else (campaign, wheel, "profile")
        )
        if wheel != "both" and duplicate in groups:
            what = "the mass of both wheels" if of_mass else "the profile of this wheel"
            text = f"{column}: {what} is measured, too, and the same wear would count "
            yield rows[0].line, text + f"twice; leave {column} out"


def _faults_of(
    row: MeasuredRow,
    parts: Mapping[str, RigScene | FieldScene],
    settings: MeasuredSection,
) -> Iterator[str]:
    """Messages on a row by itself."""
    if row.campaign is None and len(parts) > 1:
        yield "campaign is missing: the scene has a rig and a field; write one of them"
    elif row.campaign is not None and row.campaign not in parts:
        yield f'campaign = "{row.campaign}": the scene is of kind {", ".join(parts)}'
    else:
        only = next(iter(parts))
        part = parts[str(row.campaign or only)]
        if row.distance_km > part.campaign.distance_km * (1.0 + 1e-9):
            yield (
                f"distance_km = {row.distance_km:g} is beyond the campaign, which ends "
                f"at {part.campaign.distance_km:g} km; make campaign.distance_km longer"
            )
    if row.distance_km < settings.from_km - 1e-9:
        yield (
            f"distance_km = {row.distance_km:g} is before the first measurement, "
            f"from_km = {settings.from_km:g} of [uncertainty.measured]; leave the row "
            "out"
        )
    yield from _gauge_faults(row)


def _gauge_faults(row: MeasuredRow) -> Iterator[str]:
    """Messages on the measurements of a row."""
    given = [name for name in GAUGES if getattr(row, name) is not None]
    for name, (_, _, deviation) in GAUGES.items():
        if (getattr(row, name) is None) != (getattr(row, deviation) is None):
            yield f"{name} and {deviation}, its standard deviation, need each other"
    for name in given:
        value = GAUGES[name][1] * getattr(row, name)
        if text := QUANTITIES[_RANGES[name]].fault(value, name):
            yield text
    if row.profile is None and not given:
        yield "nothing was measured: give profile, or one of " + ", ".join(GAUGES)
    gauges = [name for name in given if name != "mass_kg"]
    if row.profile is not None and gauges:
        yield (
            f"profile and {gauges[0]} of one row are one measurement, which would "
            f"count twice; leave {gauges[0]} out"
        )
    if row.wheel == "both" and (row.profile is not None or gauges):
        yield "wheel = both is for mass_kg of a wheelset; write right or left"


@dataclass(frozen=True)
class _Depths:
    """Measured depths of a wheel from the new one, at points that all profiles have."""

    y: FloatArray  # (n,) [m]
    z: FloatArray
    normal: FloatArray  # (2, n)
    arc: FloatArray  # (n,)
    points: FloatArray  # (n,)
    depth: FloatArray  # (rows, n) [m]


def _profiles(
    path: Path,
    part: RigScene | FieldScene,
    wheel: str,
    rows: Sequence[MeasuredRow],
    settings: MeasuredSection,
) -> tuple[_Depths | None, list[Fault], dict[str, str]]:
    """Read the profiles of a wheel and cut them with the normals of the new one."""
    inputs = inputs_of(part)
    new = inputs.right if wheel == "right" else inputs.left
    normal = np.stack(vertex_normals(new.y, new.z))
    faults, hashes = list[Fault](), dict[str, str]()
    depths = np.full((len(rows), new.y.size), np.nan)
    for k, row in enumerate(rows):
        assert row.profile is not None
        file = find_file(row.profile, (path.parent,), "profiles")
        if file is None:
            text = f'profile = "{row.profile}": there is no such file'
            faults.append(Fault(text, str(path), row.line))
            continue
        try:
            depths[k] = _depth(file, new, normal, settings)
        except ProfileError as error:
            lines = map(with_keys, str(error).splitlines())
            faults += [
                Fault(f'profile = "{row.profile}": {line}', str(path), row.line)
                for line in lines
            ]
            continue
        hashes[row.profile] = _sha256(file)
        deviation = float(np.nanmax(np.abs(depths[k])))
        first = min(row.distance_km for row in rows)
        if row.distance_km == first and deviation > _UNLIKE:
            text = (
                f'profile = "{row.profile}" is {1e3 * deviation:.2g} mm off the new '
                f"wheel of the scene ({new.name}), more than {1e3 * _UNLIKE:g} mm: it "
                "is of another wheel; state the new one as wheelset.profile"
            )
            faults.append(Fault(text, str(path), row.line))
    if faults:
        return None, faults, hashes
    arc = arc_length(new.y, new.z)
    step = max(round(_SPACING / float(np.mean(np.diff(arc)))), 1)
    chosen = np.flatnonzero(np.isfinite(depths).all(axis=0))[::step]
    if chosen.size < _FEWEST:
        text = f"the profiles of the {wheel} wheel have {chosen.size} points in common"
        return (
            None,
            [Fault(f"{text}; measure the same part", str(path), rows[0].line)],
            hashes,
        )
    common_depths = _Depths(
        new.y[chosen],
        new.z[chosen],
        normal[:, chosen],
        arc[chosen],
        chosen.astype(float),
        depths[:, chosen],
    )
    return common_depths, [], hashes


def _depth(
    file: Path, new: Profile, normal: FloatArray, settings: MeasuredSection
) -> FloatArray:
    """Depth (p,) of a measured profile at points of the new wheel; NaN beyond [m]."""
    measured = read_profile(file, "wheel", **statements_of(settings)).profile
    laid = resample(align(measured, new, "best_fit").profile, _CUT)
    return cut_along_normals(new, laid, *normal)[0]


def _sha256(file: Path) -> str:
    import hashlib

    return hashlib.sha256(file.read_bytes()).hexdigest()


def _means(
    rows: Sequence[MeasuredRow], values: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Distances [m] in order, means (k, ...) of the values there, and their number."""
    places = np.array([1e3 * row.distance_km for row in rows])
    distance, which = np.unique(places, return_inverse=True)
    mean = np.stack([values[which == k].mean(axis=0) for k in range(distance.size)])
    return distance, mean, np.bincount(which).astype(float)


def _profile_block(
    campaign: str,
    wheel: str,
    rows: Sequence[MeasuredRow],
    depths: _Depths,
    settings: MeasuredSection,
) -> Block:
    distance, mean, counts = _means(rows, depths.depth)
    noise = noise_covariance(
        depths.arc,
        1e-6 * settings.noise_um,
        1e-3 * settings.noise_length_mm,
        1e-6 * settings.white_um,
    )
    modes = alignment_modes(
        depths.y,
        depths.z,
        depths.normal,
        1e-3 * settings.align_mm,
        1e-3 * settings.align_mrad,
    )
    return Block(
        campaign,
        wheel,
        "wear_depth",
        float(distance[0]),
        distance[1:],
        depths.arc,
        depths.y,
        depths.points,
        mean[1:] - mean[0],
        noise + modes @ modes.T,
        modes,
        counts[1:],
        float(counts[0]),
        1e-2 * settings.shape_percent,
        1e-3 * settings.shape_length_mm,
    )


def _gauge_block(
    campaign: str,
    wheel: str,
    column: str,
    rows: Sequence[MeasuredRow],
    settings: MeasuredSection,
) -> Block:
    name, unit, deviation = GAUGES[column]
    sign = -1.0 if column == "mass_kg" else 1.0  # of what is worn off
    values = np.array([sign * unit * getattr(row, column) for row in rows])
    deviations = np.array([unit * getattr(row, deviation) for row in rows])
    distance, mean, variances = _weighted_means(rows, values, deviations)
    typical = float(np.mean(deviations**2))
    counts = typical / variances
    share = 0.0 if column == "mass_kg" else 1e-2 * settings.shape_percent
    zero = np.zeros(1)
    return Block(
        campaign,
        wheel,
        name,
        float(distance[0]),
        distance[1:],
        zero,
        zero,
        zero,
        (mean[1:] - mean[0])[:, None],
        np.array([[typical]]),
        np.zeros((1, 1)),
        counts[1:],
        float(counts[0]),
        share,
        1e-3 * settings.shape_length_mm,
    )


def _weighted_means(
    rows: Sequence[MeasuredRow], values: FloatArray, deviations: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Distances [m] in order, means (k,) of the values there, and their variances.

    Each value is weighted with the inverse of its own variance.
    """
    places = np.array([1e3 * row.distance_km for row in rows])
    distance, which = np.unique(places, return_inverse=True)
    weights = deviations**-2
    total = np.bincount(which, weights)
    return distance, np.bincount(which, weights * values) / total, 1.0 / total
