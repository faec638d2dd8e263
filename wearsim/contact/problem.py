"""Input of a contact problem and its solution."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from wearsim.contact.equilibrium import RULES, TORQUE_RULES
from wearsim.contact.geometry import (
    CounterfaceProfile,
    WheelSurface,
    counterface_profile,
    wheel_surface,
)
from wearsim.contact.patch import FloatArray, IntArray, Patch, Resolution, SurfaceFields
from wearsim.contact.registry import unknown
from wearsim.errors import ContactError, Fault, SceneError, brief, listed, suggestion
from wearsim.profile.shape import Profile
from wearsim.quantities import QUANTITIES

PAIRS: Mapping[str, tuple[str, str]] = {
    "fast": ("kik_piotrowski", "fastsim"),
    "standard": ("coupled_strips", "coupled_strips"),
    "accurate": ("half_space", "half_space"),
}
"""Normal and tangential model by pair name, as used in [contact] and commands."""

# Messages on removed settings, which scenes also give.
AUTO_REMOVED = (
    'contact.model = "auto" was removed in 0.3.0: write "standard" or "accurate"; '
    "depths change by up to 5 % in the shipped scenes"
)
TOLERANCE_REMOVED = (
    "contact.tolerance was removed in 0.3.0: contact models are no longer corrected; "
    "delete it"
)

PLACED = 5
"""Unknowns of the equilibrium of a wheelset in a given position.

They are rotation speed, loads of both wheels, roll, and the difference of the rotation
speeds.
"""
NEARBY = PLACED + PLACED**2
"""Values per point from which a nearby solution starts, see `ContactPatches.nearby`."""


@dataclass(frozen=True)
class ContactConditions:
    """Operating conditions of a wheelset at `n` points.

    Parameters
    ----------
    shift : (n,) array
        Lateral shift of the wheelset at the height of the axle, or at `shift_depth`
        below it, positive to the right [m].
    yaw, roll : (n,) array
        Yaw about z (down) and roll about x [rad].
    wheel_load : (n,) or (n, 2) array
        Vertical load of each wheel, or of the right and the left one, which its normal
        and creep forces carry together [N].
    box_moment : (n,) array, optional
        Moment of the axle boxes about the longitudinal axis, right side down
        positive [N m]: the loads of both wheels are those that balance it, of which
        `wheel_load` is the mean. NaN: they are given.
    speed : (n,) array
        Peripheral speed V of the counterface at its profile top [m/s].
    friction : (n,) array
        Coulomb coefficient [-]; that of the tread where `friction_flange` is given.
    track_curvature : (n,) array
        1/R, positive to the right [1/m].
    rotation : str or (n,) array
        "free", "independent", "centred", "nominal", or the wheel's rotation speed,
        positive when it rolls forwards [rad/s].
    torque : float or (n,) array
        Torque applied to the axle in the rolling direction (rules "free" and
        "independent", where each wheel has half of it) [N m].
    torque_difference : (n,) array, optional
        Torque on the right wheel less that on the left one (rule "independent"), by
        default 0; `torque` is their sum [N m].
    free_roll : bool
        Whether the roll follows from the axle resting on both wheels; `roll` is then
        the first guess.
    creepage : (n, 3) array, optional
        Longitudinal, lateral creepage and spin [-, -, 1/m] of the single patch of each
        wheel, instead of those that follow from the motion; `rotation` then is without
        effect.
    friction_flange : (n,) array, optional
        Coulomb coefficient of patches from a contact angle of 40 degrees on; from 20
        degrees on it goes linearly from that of the tread to it. One coefficient acts
        in a patch [-].
    drift : (n,) array, optional
        Lateral velocity of a wheelset that moves, over V, positive to the right:
        creepages are those of the yaw less the drift, the geometry is that of the
        yaw [-].
    speed_difference : (n,) array, optional
        Peripheral speed of the left roller less that of the right one, over their mean
        V [-].
    shift_depth : (n,) array, optional
        Depth below the axle of the point whose shift is given, which the roll does not
        move sideways; by default the axle itself [m]. At the height of the rails (the
        wheel radius) the wheels do not move sideways as the axle rolls, so that a
        flange of more than 60 degrees rests in one place alone.
    rail : (n,) int array, optional
        Which of the pairs of rails of the counterface each point runs on, by default
        the first.
    nearby : (n, 30) array, optional
        Equilibria of like points to begin with, as solutions have them: saves work and
        changes nothing beyond the tolerance, or what the cells of a `half_space` leave
        open, as they lie otherwise, but that where two equilibria carry the loads it is
        the one begun with; in a campaign that of the first of equal points. A
        point where it leads nowhere, or is not finite, begins anew.
    """

    shift: FloatArray
    yaw: FloatArray
    roll: FloatArray
    wheel_load: FloatArray
    speed: FloatArray
    friction: FloatArray
    track_curvature: FloatArray
    rotation: str | FloatArray = "free"
    torque: float | FloatArray = 0.0
    free_roll: bool = False
    creepage: FloatArray | None = None
    friction_flange: FloatArray | None = None
    drift: FloatArray | None = None
    speed_difference: FloatArray | None = None
    shift_depth: FloatArray | None = None
    rail: IntArray | None = None
    nearby: FloatArray | None = None
    box_moment: FloatArray | None = None
    torque_difference: FloatArray | None = None

    def at(self, index: IntArray) -> ContactConditions:
        """Return the conditions of the operating points at `index`, in that order."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        chosen: dict[str, Any] = {
            name: value[index]
            for name, value in values.items()
            if isinstance(value, np.ndarray)
        }
        return replace(self, **chosen)

    def axle_shift(self, roll: FloatArray | None = None) -> FloatArray:
        """Lateral shift (n,) of the axle at rolls (n,) [m].

        The default rolls are those of the conditions.
        """
        if self.shift_depth is None:
            return self.shift
        return self.shift + self.shift_depth * np.sin(
            self.roll if roll is None else roll
        )

    @property
    def independent(self) -> bool:
        """True if the torque of each wheel follows from its own patches."""
        return isinstance(self.rotation, str) and self.rotation == "independent"

    @property
    def torque_apart(self) -> float | FloatArray:
        """Torque on the right wheel less that on the left one [N m]."""
        return 0.0 if self.torque_difference is None else self.torque_difference

    @property
    def rotates_freely(self) -> bool:
        """True if rotation speeds follow from torques."""
        free = isinstance(self.rotation, str) and self.rotation in TORQUE_RULES
        return free and self.creepage is None

    @cached_property
    def loads(self) -> FloatArray:
        """Vertical load (n, 2) of the right and the left wheel [N]."""
        load = self.wheel_load
        return load if load.ndim == 2 else np.repeat(load[:, None], 2, axis=1)

    @cached_property
    def traction(self) -> FloatArray:
        """Friction x mean wheel load (n,) [N].

        This is approximately the largest creep force of a wheel.
        """
        highest = (
            self.friction if self.friction_flange is None else self.friction_flange
        )
        return np.maximum(self.friction, highest) * self.loads.mean(axis=1)

    @cached_property
    def traction_scale(self) -> FloatArray:
        """Value of `traction`, above 0 also without friction (n,) [N]."""
        return np.maximum(self.traction, 1e-3 * self.loads.mean(axis=1))

    @classmethod
    def of(
        cls,
        shift: Any = 0.0,
        *,
        yaw: Any = 0.0,
        wheel_load: Any = 80e3,
        speed: Any = 20.0,
        friction: Any = 0.35,
        rotation: Any = "free",
        **others: Any,
    ) -> ContactConditions:
        """Operating points from numbers and arrays, which broadcast to (n,).

        Parameters
        ----------
        shift, yaw, wheel_load, speed, friction : float or (n,) array
            See the class [m, rad, N, m/s, -].
        rotation : str, float or (n,) array
            See the class.
        **others
            The other fields of the class; `roll` and `track_curvature` are 0 if not
            given. A `wheel_load` of two columns holds those of the right and the left
            wheel.

        Returns
        -------
        ContactConditions
            Of n operating points.

        Raises
        ------
        ContactError
            A name is unknown, a value is no number or out of its range in `QUANTITIES`,
            or arrays differ in length.

        Examples
        --------
        >>> import wearsim
        >>> points = wearsim.ContactConditions.of([0.0, 3e-3, 6e-3], friction=0.3)
        >>> points.friction.tolist()
        [0.3, 0.3, 0.3]
        """
        given = {
            "roll": 0.0,
            "track_curvature": 0.0,
            "shift": shift,
            "yaw": yaw,
            "wheel_load": wheel_load,
        }
        given |= {"speed": speed, "friction": friction, "rotation": rotation, **others}
        names = [field.name for field in fields(cls)]
        if unknown := [name for name in given if name not in names]:
            raise ContactError(
                f"{unknown[0]} is not a contact condition; known: {', '.join(names)}"
            )
        whole: dict[str, Any] = {
            name: given.pop(name) for name in ("free_roll", "rail") if name in given
        }
        if isinstance(rotation, str):
            whole["rotation"] = given.pop("rotation")
            if rotation not in RULES:
                rule_names = ", ".join(RULES)
                raise ContactError(
                    f"rotation = {rotation!r} must be a number [rad/s] or one of "
                    f"{rule_names}"
                )
        needed = [field.name for field in fields(cls) if field.default is MISSING]
        arrays = {
            name: _numbers(name, value)
            for name, value in given.items()
            if value is not None or name in needed
        }
        # Values per point: three creepages, and the loads of both wheels if they
        # differ.
        columns = {"creepage": 3, "nearby": NEARBY}
        if arrays["wheel_load"].ndim == 2:
            columns["wheel_load"] = 2
        shape = _common_shape(arrays, columns)
        _check_ranges(arrays)
        if "torque_difference" in arrays and rotation != "independent":
            raise ContactError(
                "a difference of the torques of both wheels needs wheels that rotate "
                'independently, rotation = "independent"'
            )
        for name, array in arrays.items():
            size = (columns[name],) if name in columns else ()
            whole[name] = np.array(np.broadcast_to(array, (*shape, *size)))
        return cls(**whole)


def _common_shape(
    arrays: Mapping[str, FloatArray], columns: Mapping[str, int]
) -> tuple[int]:
    """Broadcast arrays, of which some have columns, to the points (n,)."""
    rows = [
        array.shape[: array.ndim - (name in columns)] for name, array in arrays.items()
    ]
    try:
        shape = np.broadcast_shapes((1,), *rows)
    except ValueError:
        shape = ()
    wide = all(
        arrays[name].shape[-1:] == (size,)
        for name, size in columns.items()
        if name in arrays
    )
    if len(shape) != 1 or 0 in shape or not wide:
        shapes = (
            f"{name} {array.shape}" for name, array in arrays.items() if array.ndim
        )
        raise ContactError(
            "contact conditions must be numbers or arrays (n,) of points, creepage "
            f"(n, 3), nearby (n, {NEARBY}): {listed(shapes)}"
        )
    return (shape[0],)


def _check_ranges(arrays: Mapping[str, FloatArray]) -> None:
    """Raise an error for the first value of conditions that is out of its range."""
    others = {
        "rotation": "rotation_speed",
        "torque": "axle_torque",
        "torque_difference": "axle_torque",
    }
    for name, array in arrays.items():
        if name in ("creepage", "nearby", "box_moment"):
            continue
        for value in (float(array.min()), float(array.max())):
            if fault := QUANTITIES[others.get(name, name)].fault(value, name):
                raise ContactError(fault)
    if not np.isfinite(arrays.get("creepage", 0.0)).all():
        raise ContactError("creepage must be finite")
    if np.isinf(arrays.get("box_moment", 0.0)).any():
        raise ContactError(
            "box moments must be finite, or NaN where wheel loads are given"
        )


def _numbers(name: str, value: Any) -> FloatArray:
    """Convert to an array of numbers; raise an error that names other values."""
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        given = brief(str(value))
        raise ContactError(
            f"{name} = {given} must be a number, or an array of numbers for points"
        ) from None


@dataclass(frozen=True)
class ContactModels:
    """Models, grid and material of a contact problem.

    Parameters
    ----------
    normal, tangential : str
        Names in `wearsim.NORMAL_MODELS` and `wearsim.TANGENTIAL_MODELS`.
    strips, cells : int
        Strips across a patch and cells along each strip, at least.
    cell_size : float
        Largest width of a strip and length of a cell [m]: wider and longer patches have
        more of them.
    most_cells : int
        Strips across a patch, and cells along each, at most, unless `strips` or `cells`
        is larger.
    youngs_modulus : float
        Of both bodies [Pa].
    poisson_ratio : float
        Of both bodies [-].
    kalker_factor : float
        Creep stiffness over that of clean surfaces, k [-]: contaminated surfaces have
        less than 1.
    friction_ratio : float
        Friction coefficient at large slip velocity over that at rest, A [-].
    friction_decrease : float
        Coefficient B of its exponential decrease with the slip velocity [s/m]; 0: it
        does not fall.
    parameters : tuple of (str, float)
        Of the normal models, each takes its own, such as ("virtual_penetration_factor",
        0.55); names and defaults stand in `wearsim.NORMAL_MODELS[name].parameters`.
    """

    normal: str = PAIRS["standard"][0]
    tangential: str = PAIRS["standard"][1]
    strips: int = 30
    cells: int = 30
    cell_size: float = 0.5e-3
    most_cells: int = 120
    youngs_modulus: float = 210e9
    poisson_ratio: float = 0.3
    kalker_factor: float = 1.0
    friction_ratio: float = 1.0
    friction_decrease: float = 0.0
    parameters: tuple[tuple[str, float], ...] = ()

    @classmethod
    def of(cls, model: str, **others: Any) -> ContactModels:
        """Contact models by the name of their pair.

        Parameters
        ----------
        model : str
            "fast", "standard" or "accurate".
        **others
            Grid, material and parameters, see the class.

        Raises
        ------
        SceneError
            If the pair is not known, or was removed.
        ContactError
            If one of the others is not known, or is a model: the pair has both.

        Examples
        --------
        >>> ContactModels.of("accurate", strips=50).normal
        'half_space'
        """
        if str(model) not in PAIRS:
            removed = Fault(AUTO_REMOVED) if model == "auto" else None
            raise SceneError(
                [removed or unknown("pair of contact models", model, PAIRS)]
            )
        names = [field.name for field in fields(cls)]
        for name in others:
            if name in ("normal", "tangential"):
                raise ContactError(
                    f'the pair "{model}" has a {name} model; leave {name} out, or '
                    "write ContactModels(normal=..., tangential=...) for other models"
                )
            if name == "tolerance":
                raise ContactError(TOLERANCE_REMOVED)
            if name not in names:
                parameter_names = ", ".join(names[2:])
                raise ContactError(
                    f"{name} is unknown; there is {parameter_names}"
                    f"{suggestion(name, names[2:])}"
                )
        normal, tangential = PAIRS[model]
        return cls(normal, tangential, **others)

    @property
    def resolution(self) -> Resolution:
        """Resolution of patches."""
        return Resolution(self.cell_size, self.strips, self.cells, self.most_cells)

    @property
    def shear_modulus(self) -> float:
        """G = E / (2 (1 + nu)) [Pa]."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def friction_falls(self) -> bool:
        """True if friction falls with the slip velocity."""
        return self.friction_ratio < 1.0 and self.friction_decrease > 0.0

    @property
    def creep_modulus(self) -> float:
        r"""Shear modulus k G of the tangential problem [Pa].

        With the Kalker factor k the elastic displacements of the tangential problem are
        1/k times those of the bodies: creep forces at little creepage are k times as
        large, those in full slip and the rigid slip are unchanged. Creep forces at a
        creepage are those of clean surfaces at k times the creepage, the reduction of
        the initial slope of [1]_ with k_A = k_S = k.

        References
        ----------
        .. [1] O. Polach, Wear 258 (2005) 992-1000, doi:10.1016/j.wear.2004.03.046.
        """
        return self.kalker_factor * self.shear_modulus

    @property
    def effective_modulus(self) -> float:
        """E* = E / (2 (1 - nu^2)) of two equal bodies [Pa]."""
        return self.youngs_modulus / (2.0 * (1.0 - self.poisson_ratio**2))


@dataclass(frozen=True)
class Wheelset:
    """Two wheels on an axle.

    Parameters
    ----------
    right, left : Profile
        Both in the axes of a right wheel.
    radius : float
        Of the running circle [m].
    half_span : float
        From the track centre to the origin of the wheel profile [m]; 0.750 at
        back-to-back 1360 mm.
    diameter_difference : float
        Diameter of the right wheel less that of the left one; the mean is 2
        `radius` [m].
    """

    right: Profile
    left: Profile
    radius: float
    half_span: float
    diameter_difference: float = 0.0

    @cached_property
    def surfaces(self) -> tuple[WheelSurface, WheelSurface]:
        """Circles of the right and the left wheel."""
        more = 0.25 * self.diameter_difference
        return wheel_surface(self.right, self.radius + more), wheel_surface(
            self.left, self.radius - more
        )


@dataclass(frozen=True)
class Counterface:
    """Rails, or rollers with a rail's profile.

    Parameters
    ----------
    profile : Profile
        Placed (inclined, gauged), in the axes of the right side.
    curvature : float
        1/s0, s0 the roller's radius at the profile's top when new [1/m]; a rail has 0.
    left : Profile, optional
        Of the left side, if it differs; in the axes of a right side, too.
    rolling_curvature : float, optional
        Curvature as the motion of the surfaces sees it, where creepages shall be those
        of another roller than the gap is; by default `curvature` [1/m].
    further : tuple of Counterface
        Other pairs of rails, on which points with a `rail` of 1 and more run.
    left_curvature : float, optional
        Of the left side, if it differs [1/m].
    """

    profile: Profile
    curvature: float
    left: Profile | None = None
    rolling_curvature: float | None = None
    further: tuple[Counterface, ...] = ()
    left_curvature: float | None = None

    @property
    def profiles(self) -> tuple[Profile, Profile]:
        """Profiles of the right and the left side."""
        return self.profile, self.profile if self.left is None else self.left

    @property
    def curvatures(self) -> tuple[float, float]:
        """Curvatures of the right and the left side [1/m]."""
        return (
            self.curvature,
            self.curvature if self.left_curvature is None else self.left_curvature,
        )

    @property
    def seen_in_motion(self) -> tuple[float, float]:
        """Curvature of right and left side for the motion of surfaces [1/m]."""
        curvature = self.rolling_curvature
        return self.curvatures if curvature is None else (curvature, curvature)

    @property
    def coupled_difference(self) -> float:
        r"""Speed difference of coupled rollers, left less right, over their mean [-].

        :math:`2 (s_L - s_R) / (s_L + s_R)`; 0 for rails.
        """
        right, left = self.curvatures
        return 2.0 * (right - left) / (right + left) if right != left else 0.0

    @cached_property
    def surfaces(self) -> tuple[CounterfaceProfile, CounterfaceProfile]:
        """Profiles of the right and the left side on the grid of the contact search."""
        right = counterface_profile(self.profile)
        return right, right if self.left is None else counterface_profile(self.left)


@dataclass(frozen=True)
class ContactPatches:
    """All patches of a batch, without fields.

    The leading axis `m` of every array is the patch. `point` is the index of the
    operating point and `side` 0 for the right, 1 for the left wheel; patches are
    ordered by point, side and falling normal force. Angles, lateral creepage, spin,
    lateral force and moment of a left wheel have the signs of the track axes (mirrored
    from the right wheel's). wheel_y and rail_y are profile coordinates and have the
    same sign for both.
    """

    point: IntArray
    side: IntArray
    wheel_y: FloatArray
    rail_y: FloatArray
    x: FloatArray
    z: FloatArray  # from the middle of the axle, down [m]
    contact_angle: FloatArray
    area: FloatArray
    max_pressure: FloatArray
    length: FloatArray
    width: FloatArray
    approach: FloatArray
    normal_force: FloatArray
    # Factor on the forces of the wheel to carry its load, 1 unless a load jumps [-].
    load_scale: FloatArray
    # 1 for a substitute model, used if the model has no solution of the wheel, else 0.
    stood_in: IntArray
    creepage_x: FloatArray
    creepage_y: FloatArray
    spin: FloatArray
    force_x: FloatArray
    force_y: FloatArray
    spin_moment: FloatArray
    slip_area: FloatArray
    # Forces on the wheel in the axes of the track; moments about axes through the
    # middle of the axle.
    track_lateral: FloatArray  # to the right [N]
    track_vertical: FloatArray  # upward [N]
    track_longitudinal: FloatArray  # forward [N]
    track_yaw_moment: FloatArray  # steers to the right where positive [N m]
    track_roll_moment: FloatArray  # sum of y x vertical + z x lateral force [N m]
    power: FloatArray
    power_balance: FloatArray
    roll: FloatArray  # roll of the wheelset [rad]
    # (m, 30) start of nearby solutions of its point: unknowns of its equilibrium and
    # slopes (5 x 5) of `axle` [-].
    nearby: FloatArray
    # of its wheel, positive when it rolls forwards; V/r0 if creepages were given
    # [rad/s]
    rotation_speed: FloatArray
    strip_edges_wheel_y: (
        FloatArray  # (m, ny + 1) strip edges on the wheel profile, rising y [m]
    )
    strip_edges_rail_y: (
        FloatArray  # (m, ny + 1) strip edges on the counterface's profile [m]
    )
    patch: Patch


@dataclass(frozen=True)
class ContactSolution(ContactPatches):
    """All patches of a batch, with the fields in their cells."""

    fields: SurfaceFields

    def patches(self) -> ContactPatches:
        """Return the solution without its cells."""
        kept = {
            field.name: getattr(self, field.name) for field in fields(ContactPatches)
        }
        return ContactPatches(**{**kept, "patch": replace(self.patch, grid=None)})
