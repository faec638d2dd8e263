"""[uncertainty] of a scene.

Which inputs are uncertain and how, which steels are compared.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal

from pydantic import Field

from wearsim.errors import shown
from wearsim.scene.point_files import (
    FileFormat,
    Mirror,
    OffsetY,
    OffsetZ,
    PointOrigin,
    Units,
    ZUp,
    one_origin,
)
from wearsim.scene.section import Section, Text, quantity, text_field


class InputSection(Section):
    """[[uncertainty.input]]: one uncertain key of the scene and its distribution."""

    key: Text = text_field(
        "the dotted key, such as wear.hardness_GPa; operation.friction stands for "
        "that of every block and class, rig. or field. before it for one scene of a "
        "comparison",
    )
    name: Text | None = text_field(
        "a name for tables and figures, by default the key", None
    )
    distribution: Literal["uniform", "normal", "lognormal", "values"] = Field(
        description="uniform from low to high; normal with mean and std; lognormal "
        "with median, and 90 % from median / within to median * within; or one of "
        "values, each as likely",
    )
    low: float | None = Field(
        None, description="the lowest value of a uniform distribution"
    )
    high: float | None = Field(
        None, description="the highest value of a uniform distribution"
    )
    mean: float | None = Field(None, description="the mean of a normal distribution")
    std: float | None = Field(
        None, description="the standard deviation of a normal distribution", gt=0.0
    )
    median: float | None = Field(
        None, description="the median of a lognormal distribution", gt=0.0
    )
    within: float | None = Field(
        None,
        description="the factor that 90 % of a lognormal distribution keep to",
        gt=1.0,
        le=100.0,
    )
    values: tuple[float | int | str | dict[str, Any], ...] = Field(
        (),
        description="the values of a distribution of them; tables of keys for key = "
        "wear",
        max_length=100,
        strict=False,
    )
    acts: Literal["value", "factor", "addition"] = Field(
        "value",
        description="whether what is drawn takes the place of the scene's values, or "
        "acts on them",
    )
    shared: bool = Field(
        False,
        description="whether rig and field get one value, such as that of a steel; "
        "else each its own",
    )
    source: Text | None = text_field("where the range comes from", None)

    @property
    def label(self) -> str:
        """Name for tables."""
        return self.name or self.key


NEEDS: Mapping[str, tuple[str, ...]] = {
    "uniform": ("low", "high"),
    "normal": ("mean", "std"),
    "lognormal": ("median", "within"),
    "values": ("values",),
}
"""Keys of each distribution."""


def input_faults(section: InputSection) -> Iterator[tuple[str, str]]:
    """Keys of an input that do not fit together, with messages."""
    needed = NEEDS[section.distribution]
    for key in {key for keys in NEEDS.values() for key in keys}:
        given = getattr(section, key) not in (None, ())
        if given != (key in needed):
            does = "needs" if key in needed else "has no"
            yield (
                "distribution",
                f"distribution = {shown(section.distribution)} {does} {key}",
            )
    if (
        section.low is not None
        and section.high is not None
        and section.low >= section.high
    ):
        yield "low", f"low = {section.low:g} must be below high = {section.high:g}"
    if section.acts != "value" and any(
        isinstance(value, str | dict) for value in section.values
    ):
        yield "values", f"acts = {shown(section.acts)} needs numbers among values"


class MaterialSection(Section):
    """[[uncertainty.material]]: another steel, to be ranked against that of the
    scene.
    """

    name: Text = text_field("the name of the steel")
    wear: dict[str, Any] = Field(
        description="keys of [wear] that it changes, such as law, coefficients, "
        "hardness_GPa",
        min_length=1,
    )
    source: Text | None = text_field("where its coefficients come from", None)


def _field(
    default: float, unit: str, largest: float, meaning: str, *, above: bool = True
) -> Any:
    """Field of a number above 0, or from 0 on."""
    least: dict[str, Any] = {"gt": 0.0} if above else {"ge": 0.0}
    return Field(
        default,
        description=meaning,
        json_schema_extra={"unit": unit},
        le=largest,
        **least,
    )


class MeasuredSection(Section):
    """[uncertainty.measured]: errors of the measurements for `wearsim calibrate`, and
    what the files of measured profiles leave open.
    """

    from_km: float = _field(
        0.0,
        "km",
        1e7,
        "the distance of the first measurement, which the others are compared with; "
        "running-in before it is left out",
        above=False,
    )
    noise_um: float = _field(
        10.0,
        "um",
        1000.0,
        "the standard deviation of a measured profile along its normal: of the "
        "instrument, or of the wheel's roundness where that is more",
    )
    noise_length_mm: float = _field(
        2.0,
        "mm",
        100.0,
        (
            "the length along the profile over which the correlation of this noise "
            "falls to 1/e"
        ),
    )
    white_um: float = _field(
        3.0,
        "um",
        1000.0,
        "the standard deviation of single points, steps of the campaign included",
    )
    align_mm: float = _field(
        0.1,
        "mm",
        5.0,
        "the standard deviation of the lateral and of the vertical place of a measured "
        "profile, after its parts that do not wear were laid on the new wheel",
    )
    align_mrad: float = _field(1.0, "mrad", 50.0, "the standard deviation of its angle")
    shape_percent: float = _field(
        5.0,
        "%",
        100.0,
        "the standard deviation of an error of the shape of the predicted wear, alike "
        "at all distances, over its depth",
        above=False,
    )
    shape_length_mm: float = _field(
        5.0, "mm", 100.0, "the length along the profile over which it is correlated"
    )
    format: FileFormat = None
    units: Units = None
    mirror: Mirror = None
    z_up: ZUp = None
    origin: PointOrigin = None
    offset_y_mm: OffsetY = None
    offset_z_mm: OffsetZ = None

    _one_origin = one_origin


class UncertaintySection(Section):
    """[uncertainty]: what `--bands` draws, and what `wearsim calibrate` learns."""

    draws: int = quantity(
        "uncertainty_draws", 64, "the number of draws, 64, 128, 256, ..."
    )
    most_draws: int | None = quantity(
        "uncertainty_draws",
        None,
        "the number up to which draws are doubled until the bands are sure",
    )
    seed: int = quantity("sweep_seed", 1, "the seed of the draws")
    input: tuple[InputSection, ...] = Field(
        (), description="the uncertain inputs", max_length=30, strict=False
    )
    material: tuple[MaterialSection, ...] = Field(
        (),
        description="steels in comparison with that of the scene",
        max_length=20,
        strict=False,
    )
    measured: MeasuredSection = Field(
        default_factory=lambda: MeasuredSection.model_validate({}),
        description="the errors of measured profiles, for wearsim calibrate",
    )
