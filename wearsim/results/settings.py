"""The one list of settings: global attributes of result files.

A setting of a campaign is a record of this list. The header of result files, the check
of their attributes, the warnings of comparisons and the tables of reports follow from
it, in its order. What is changed in a scene is described in `wearsim.scene`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from wearsim.contact.titles import normal_title, tangential_title
from wearsim.damage.titles import law_title, set_title
from wearsim.errors import brief
from wearsim.quantities import QUANTITIES, Quantity

Use = Literal["", "provenance", "listed", "compared", "numbers"]


@dataclass(frozen=True)
class Setting:
    """Setting of a campaign; a number if it has a quantity, else a text.

    Parameters
    ----------
    name : str
        Name of the attribute in result files; values are SI.
    use : {"", "provenance", "listed", "compared", "numbers"}
        "listed": reports list it among the settings; "compared": comparisons warn, too,
        where two results differ, with both values; "numbers": comparisons alone warn,
        with those numbers of two lists that differ; "provenance": reports list it as
        the origin of a result.
    in_setup : str
        Attribute of the setup of a campaign (`wearsim.scene.CampaignSetup`) that holds
        the value, such as "models.strips"; "" if `wearsim.campaign.row` computes it.
    label : str
        Words for it in reports; by default the meaning of its quantity, or its name.
    measured_as : str
        Quantity that has its unit; by default the one of the same name, if any.
    bare_number : bool
        Whether it is a number without a quantity.
    absent : float, optional
        Value of results that do not state it; None if the value is unknown then. It is
        not written.
    required : bool
        Whether a result file without it is refused.
    title_of : callable
        Words for the value of a text, such as the title of a law for its name; by
        default the text itself.
    of_points : bool
        Whether it belongs to the operating points: where two results differ in it, none
        of their points is equal.
    """

    name: str
    use: Use = ""
    in_setup: str = ""
    label: str = ""
    measured_as: str = ""
    bare_number: bool = False
    absent: float | None = None
    required: bool = False
    title_of: Callable[[str], str] = str
    of_points: bool = False

    @property
    def quantity(self) -> Quantity | None:
        """Quantity with the unit of the value, None for texts."""
        return QUANTITIES.get(self.measured_as or self.name)

    @property
    def is_number(self) -> bool:
        """Return True if its value is a number."""
        return self.bare_number or self.quantity is not None

    @property
    def title(self) -> str:
        """Words for the setting in reports, without unit."""
        meaning = self.quantity.meaning if self.quantity else ""
        return self.label or meaning or self.name.replace("_", " ")

    def text_of(self, value: str) -> str:
        """Write a text of the setting as people read it."""
        return self.title_of(value)

    @property
    def compared(self) -> bool:
        """Return True if comparisons warn of results that differ in it."""
        return self.use in ("compared", "numbers")

    def stated_in(self, attributes: Mapping[Any, Any]) -> Any:
        """Value in the attributes of a result, "" if it is unknown."""
        return attributes.get(self.name, "" if self.absent is None else self.absent)


_ALL = (
    # provenance
    Setting("title", "provenance", label="Title"),
    Setting("finished", "provenance", label="Finished"),
    Setting("history"),
    Setting("source", "provenance", label="Versions"),
    Setting("plugins", "provenance", label="Plug-ins"),
    Setting("scene_text", in_setup="scene_text"),
    Setting("scene_kind", in_setup="kind"),
    Setting("input_hashes", "provenance", label="Input files"),
    Setting("vehicle", "provenance", "vehicle", "Vehicle"),
    Setting("settings_changed", "provenance", label="Changed settings"),
    Setting("warnings"),
    Setting("attribute_units"),
    # wheelset and counterface
    Setting(
        "wheel_profile_right", "compared", "wheelset.right.name", "Wheel profile, right"
    ),
    Setting(
        "wheel_profile_left", "compared", "wheelset.left.name", "Wheel profile, left"
    ),
    Setting("counterface_profile", "compared", "counterface.profile.name"),
    Setting("counterface_curvature", in_setup="counterface.curvature"),
    Setting(
        "counterface_curvature_left",
        in_setup="counterface.left_curvature",
        measured_as="counterface_curvature",
    ),
    Setting("counterface_wear_factor", "listed", "counterface_wear.factor", absent=0.0),
    Setting(
        "redress_distance",
        "listed",
        "counterface_wear.redress_distance",
        absent=math.inf,
    ),
    Setting(
        "redress_depth", "listed", "counterface_wear.redress_depth", absent=math.inf
    ),
    Setting(
        "counterface_area_rate", "listed", "counterface_wear.area_rate", absent=0.0
    ),
    Setting("wheel_radius", "compared", "wheelset.radius", required=True),
    Setting("half_span", "compared", "wheelset.half_span"),
    Setting("measuring_height", in_setup="measuring.height"),
    Setting("running_circle", in_setup="measuring.running_circle"),
    Setting("conicity_amplitude", "compared", "conicity_amplitude", absent=3e-3),
    # motion of the wheelset
    Setting(
        "rotation_rule",
        "compared",
        label="Rule of the wheel rotation",
        of_points=True,
    ),
    Setting("roll_rule", "listed", label="Roll of the wheelset", of_points=True),
    # contact models
    Setting(
        "contact_normal",
        "compared",
        "models.normal",
        "Normal contact model",
        title_of=normal_title,
    ),
    Setting(
        "contact_tangential",
        "compared",
        "models.tangential",
        "Tangential contact model",
        title_of=tangential_title,
    ),
    Setting("contact_parameters", "compared", label="Parameters of the contact models"),
    Setting("strips", "compared", "models.strips"),
    Setting("cells", "compared", "models.cells"),
    Setting("cell_size", "compared", "models.cell_size"),
    Setting("most_cells", "compared", "models.most_cells"),
    Setting("axle_torque", "compared", of_points=True),
    # material and surfaces
    Setting("youngs_modulus", "compared", "models.youngs_modulus"),
    Setting("poisson_ratio", "compared", "models.poisson_ratio"),
    Setting("kalker_factor", "compared", "models.kalker_factor", absent=1.0),
    Setting("friction_ratio", "compared", "models.friction_ratio", absent=1.0),
    Setting("friction_decrease", "compared", "models.friction_decrease", absent=0.0),
    Setting("friction_note"),
    Setting("wheel_density", "compared", "wear.density"),
    # laws and their coefficients
    Setting("wear_law", "compared", "wear.law", required=True, title_of=law_title),
    Setting("wear_form", "compared", label="Form of the wear law"),
    Setting("wear_coefficients", "compared", title_of=set_title),
    Setting("wear_coefficients_source"),
    Setting("wear_coefficients_warnings"),
    Setting("wear_coefficients_materials"),
    Setting("wear_coefficients_validity"),
    Setting("wear_coefficients_departures"),
    Setting("wear_law_numbers", "numbers"),
    Setting("seizure_cap", "compared", label="Cap that keeps out the seizure regime"),
    Setting("comparison_numbers"),
    Setting("comparison_materials"),
    Setting("comparison_validity"),
    Setting("comparison_departures"),
    Setting("fatigue_numbers"),
    Setting("fatigue_materials"),
    Setting("fatigue_validity"),
    Setting("fatigue_departures"),
    # wear steps
    Setting("integrator", "compared", "control.integrator"),
    Setting("depth_cap", "listed", "control.depth_cap"),
    Setting("first_depth", "listed", "control.first_depth", absent=math.inf),
    Setting(
        "stability_limit",
        "listed",
        "control.stability",
        "Limit of the stability number",
        "stability_number",
    ),
    Setting(
        "error_tolerance",
        "listed",
        "control.error_tolerance",
        "Tolerance of the error of a step",
        "step_error",
        absent=math.inf,
    ),
    Setting("smoothing_wavelength", "compared", "control.smoothing_wavelength"),
    Setting("target_distance", in_setup="control.distance", measured_as="distance"),
    # reprofiling; limits are attributes, too, see `wearsim.results.limits`
    Setting("end_at_limit", bare_number=True),
    Setting("reprofiling_limits"),
    Setting("reprofiling_distances"),
    Setting(
        "reprofiling_least_cut",
        in_setup="control.reprofiling.cut",
        measured_as="least_cut",
    ),
    # reduction of a record to operating points
    Setting("recorded_samples", "listed", bare_number=True),
    Setting("binning_error", "listed", "reduction.error"),
    Setting("binning_error_worn", measured_as="binning_error"),
)

SETTINGS: Mapping[str, Setting] = {setting.name: setting for setting in _ALL}
"""Settings of campaigns by name, in the order of warnings and tables."""


def attribute_fault(name: str, value: Any) -> str:
    """State the fault of a global attribute of a result file, or ""."""
    setting = SETTINGS.get(name)
    number = setting.is_number if setting else name.startswith("limit_")
    if np.size(value) != 1 or (
        number and (isinstance(value, str) or not np.isfinite(value))
    ):
        needed = "a number" if number else "one value"
        return f"attribute {name} = {brief(str(value))} must be {needed}"
    if setting and not number and not isinstance(value, str):
        return f"attribute {name} = {brief(str(value))} must be a text"
    return ""
