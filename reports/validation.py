"""What wearsim gives and what was published, in one table.

    python reports/validation.py [--out DIR] [--from-csv]

writes validation.md and validation.csv; some ten minutes of one core. Tables of the
paper and solutions of CONTACT are taken from seed_tables.csv and seed_tables_cases.csv,
which seed_tables.py writes.
"""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from writing import HERE, Table, options, write_csv, write_report

import wearsim
from wearsim.contact.patch import Patch
from wearsim.contact.tangential import coupled_strips
from wearsim.damage.coefficients import COEFFICIENT_SETS
from wearsim.damage.fatigue import wlrm
from wearsim.damage.wear import brr
from wearsim.profile.conicity import running
from wearsim.profile.standard import rail, wheel

TITLE = "What was published, and what wearsim gives"
DATA = HERE.parent / "tests" / "data"

INTRODUCTION = """\
Each row compares a published value with ours, with what their agreement proves and what
it does not. The first rows are solutions, which test the arithmetic; laws test that
coefficients were copied well; the last rows are observations in service, and the only
ones that say anything about wheels. None of them is a campaign whose inputs were
measured with its wear: absolute depths are not validated, see limit 1 of the README.
"""

NOTES = """\
Curves: passenger_coach, S1002 on 60E1 1:40, new wheels, friction 0.35, cant
deficiency 60 mm, model `standard`; a surface index above 0 means that the surface
ratchets (shear yield stress of `ekberg_kabo_andersson_2002`). High-speed wheels:
straight track and curves of 9000 m, positions of a standard deviation of 1.5 mm,
wheel load 72 kN, 300 km/h, law `archard`, environment factor 0.18, which is an
assumption.

Rail wear is that of the same coach in the curve of 500 m by the law `usfd` with an
environment factor of 0.18, on new wheels and rails. The area is what depths of the
published size take from a head of 70 mm. The largest depth is not of that size: all
wheels have one shape here and touch a rail of one shape at one place; worn wheels of
all ages do not.
"""


class Row(NamedTuple):
    """Row of the report but for its numbers."""

    what: str
    source: str
    proves: str
    not_proved: str


_PAPER = "Liu & Bruni (2016), tables 2 to 5"
_CONTACT = "CONTACT (github.com/eve70a/CONTACT), cells of 0.1 mm"
_PROGRAM = "contact geometry and kinematics of rail and rollers"
_NO_WEAR = "nothing of wear: no published case has a depth"
ROWS: dict[str, Row] = {
    "creepage": Row(
        "longitudinal creepage at 3 mm on the rail and rollers of 1 and 0.5 m [10⁻³]",
        _PAPER,
        _PROGRAM,
        _NO_WEAR,
    ),
    "spin": Row("spin creepage, the same cases [1/m]", _PAPER, _PROGRAM, _NO_WEAR),
    "area": Row(
        "contact area, the same cases [mm²], `fast`",
        _PAPER,
        "the normal model of the paper is the same",
        "that this model is right: the half-space has other pressures",
    ),
    "power_ratio": Row(
        "frictional power on both rollers over that on the rail",
        _PAPER,
        "rig against field at given positions",
        "absolute power, wear",
    ),
    "contact_power": Row(
        "frictional power at zero shift on the rail and both rollers [W], half-space",
        _CONTACT,
        "the half-space pair solves the same equations",
        "that a half-space and Coulomb's friction are right for steel",
    ),
    "contact_area": Row(
        "contact area, the same cases [mm²], half-space",
        _CONTACT,
        "the half-space pair solves the same equations",
        "contact on worn, conformal or rough surfaces",
    ),
    **{
        f"kalker_{key}": Row(
            f"Kalker's coefficient {key} of ellipses of a/b = 0.2, 0.5, 1, 2, 5, "
            "Poisson's ratio 0.25, `coupled_strips`",
            "Kalker, Three-dimensional elastic bodies in rolling contact (1990), "
            "table E.3",
            f"the slope of the {force} of the default model at small creepage",
            "creep forces of contaminated surfaces, whose slope is less "
            "(`kalker_factor`)",
        )
        for key, force in (
            ("C11", "longitudinal creep force"),
            ("C22", "lateral creep force"),
            ("C23", "lateral force of spin"),
        )
    },
    "creep_curve": Row(
        "creep force over friction x load at creepages of 0.04, 0.12 and 0.24 %, "
        "`coupled_strips`",
        "CONTACT, ellipse of 6.3 x 12.6 mm, 106.7 kN",
        "creep forces of the default model from linear creep to full slip",
        "friction of real surfaces, which falls with speed and water",
    ),
    "en15302_equal": Row(
        "equivalent conicity of equal wheels A, B, C, H, I: largest difference",
        "EN 15302, annex E; tolerance 0.05 or half",
        "rolling radii and conicity by the standard's method",
        "running of vehicles",
    ),
    "en15302_unequal": Row(
        "equivalent conicity of unequal wheels, E5 to E9: largest difference",
        "EN 15302, annex E; tolerance 0.05 or half",
        "the same with other diameters and profiles on both sides",
        "running of vehicles",
    ),
    "brr": Row(
        "British wear law at 10, 40, 99, 100, 150, 200, 300, 500 N [mm²/km x mm]",
        "Pearce & Sherratt (1991), as quoted",
        "that the coefficients were copied as quoted",
        "wear of any wheel; the original was not read",
    ),
    "wlrm": Row(
        "damage of the Whole Life Rail Model at 15, 40, 65, 120, 175, 230 N [10⁻⁶]",
        "Burstow (2004), as quoted",
        "that the break points were copied as quoted",
        "cracks in wheels: the function is of rail steel",
    ),
    "rcf_field_side": Row(
        "surface index of the inner leading wheel at R 300, 500, 1000, 2500 m, its "
        "place [mm], and the index of the outer wheel",
        "Molyneux-Berry & Bevan, Veh. Syst. Dyn. 50 Suppl. 1 (2012) 335-347, abstract",
        "field side, in sharp curves and not in moderate ones, for one vehicle",
        "which zone cracks first: the flange root of the outer wheel has the larger "
        "index, and wears more; the number of passages to a crack",
    ),
    "rcf_leading": Row(
        "tangential over normal force of the worse wheel, leading and trailing "
        "wheelset at R 500 m",
        "wheel impact detectors of North America, WDPRC, ASME RTDF2008, abstract",
        "that leading wheelsets are loaded higher in curves, here a coach",
        "three-piece freight bogies, braking heat",
    ),
    "high_speed": Row(
        "largest depth of high-speed wheels at 190 000 km [mm], `standard`, `fast`",
        "Ye et al. (2022), measured S1002CN wheels, second hand; Hou et al. (2022), "
        "doi:10.1108/RS-04-2022-0019: 0.05 to 0.06 mm per 10 000 km on three lines",
        "the order of magnitude, with an assumed environment factor",
        "the depth: `standard`, which is near the half-space, has less than half of "
        "it, and that `fast` agrees is an accident of the factor",
    ),
    "high_speed_place": Row(
        "place of the largest depth from the running circle [mm], `standard`, `fast`",
        "Ye et al. (2022), second hand",
        "that the deepest wear is on the tread",
        "the shape of the hollow: positions are a made-up normal distribution",
    ),
    "high_speed_root": Row(
        "largest depth of the flange root of these wheels [mm], `standard`, `fast`",
        "Ye et al. (2022), second hand",
        "nothing: ours wears to more than half of the depth of the tread",
        "that positions and curves are those of the measured trains",
    ),
    "rail_wear": Row(
        "wear of outer and inner rail per 100 MGT at R 500 m, rail R260",
        "a public rail-wear calculator citing Belgian track, second hand",
        "the order of magnitude, with an assumed environment factor",
        "the depth of rail wear, lubrication, grinding",
    ),
}
"""Rows of the table in its order."""

FRICTION, SHEAR_MODULUS = 0.33, 82e9
"""Of elliptic contacts [-], [Pa]; slopes at small creepage depend on neither."""

KALKER = {
    "a_over_b": [0.2, 0.5, 1.0, 2.0, 5.0],
    "C11": [3.37, 3.62, 4.12, 5.10, 7.78],
    "C22": [2.63, 3.01, 3.67, 4.90, 8.14],
    "C23": [0.603, 0.929, 1.47, 2.62, 6.63],
}
"""Kalker's coefficients at Poisson's ratio 0.25 by the axis ratio, a along rolling."""

RADII = {300: 60.0, 500: 80.0, 1000: 110.0, 2500: 160.0}
"""Curve radii [m] and speeds [km/h] of the coach."""


def coach() -> dict[str, object]:
    """Scene of a coach in curves, a kilometre long."""
    classes = [
        {
            "name": f"R {radius}",
            "share": 1.0 / len(RADII),
            "curve_radius_m": float(radius),
            "cant_deficiency_mm": 60.0,
            "speed_km_h": speed,
            "friction": 0.35,
            "environment": 0.18,
        }
        for radius, speed in RADII.items()
    ]
    return {
        "scene": {"kind": "field"},
        "wheelset": {"profile": "S1002"},
        "counterface": {"profile": "60E1", "inclination": "1:40"},
        "vehicle": {"file": "passenger_coach", "class": classes},
        "fatigue": {"laws": ["surface_fatigue_index"]},
        "campaign": {"distance_km": 1.0},
    }


def high_speed(model: str, distance: float = 190_000.0) -> dict[str, object]:
    """Scene of high-speed wheels on straight track and in curves of 9000 m."""
    common = {
        "shift_std_mm": 1.5,
        "load_kN": 72.0,
        "speed_km_h": 300.0,
        "friction": 0.35,
        "environment": 0.18,
    }
    curves = [
        common
        | {
            "name": f"R 9000 {name}",
            "curve_radius_m": sign * 9000.0,
            "shift_mean_mm": -0.8 * sign,
            "positions": 11,
            "share": 0.08,
        }
        for name, sign in (("right", 1.0), ("left", -1.0))
    ]
    straight = common | {
        "name": "straight",
        "shift_mean_mm": 0.0,
        "positions": 15,
        "share": 0.84,
    }
    return {
        "scene": {"kind": "field"},
        "wheelset": {"profile": "S1002"},
        "counterface": {"profile": "60E1", "inclination": "1:40"},
        "contact": {"model": model},
        "wear": {"law": "archard"},
        "operation": {"class": [straight, *curves]},
        "campaign": {"distance_km": distance},
    }


def run(scene: dict[str, object], folder: Path) -> xr.Dataset:
    """Run a field scene and load its result."""
    wearsim.run(scene, folder)
    with wearsim.open_results(folder / "field.nc") as data:
        return data.load()


def listed(values: object, form: str = "g") -> str:
    """Numbers with commas between them."""
    return ", ".join(f"{value:{form}}" for value in np.atleast_1d(values))


def of_paper() -> Iterator[tuple[str, str, str]]:
    """Key, published and own values of the paper's and CONTACT's tables."""
    ours = pd.read_csv(HERE / "seed_tables.csv")
    cases = pd.read_csv(HERE / "seed_tables_cases.csv", comment="#")
    ours = ours[ours["rail"] == "60E1_benchmark"]
    paper = cases[(cases["source"] == "paper") & (cases["shift_mm"] == 3)]
    fast = ours[(ours["model"] == "kik_piotrowski") & (ours["shift_mm"] == 3)]
    motion, centre = (fast[fast["source"] == name] for name in ("motion", "centre"))
    for key, column, factor, form in (
        ("creepage", "creepage_x", 1e3, ".2f"),
        ("spin", "spin_per_m", 1.0, ".3f"),
        ("area", "area_mm2", 1.0, ".0f"),
    ):
        pair = (factor * data[column].to_numpy() for data in (paper, motion))
        yield (key, *(listed(values, form) for values in pair))
    power = [data["power_W"].to_numpy() for data in (paper, centre)]
    yield ("power_ratio", *(listed(one[1:] / one[0], ".3f") for one in power))
    contact = cases[(cases["source"] == "contact_fine") & (cases["shift_mm"] == 0)]
    half = ours[
        (ours["model"] == "half_space")
        & (ours["shift_mm"] == 0)
        & (ours["source"] == "centre")
    ]
    for key, column in (("contact_power", "power_W"), ("contact_area", "area_mm2")):
        yield (key, *(listed(data[column], ".1f") for data in (contact, half)))


def ellipse(half_length: float, half_width: float, load: float) -> Patch:
    """Elliptic patch with Hertz's pressure, of 30 strips and cells."""
    strips = 30
    edges = np.linspace(-1.0, 1.0, strips + 1) * half_width
    y, width = 0.5 * (edges[1:] + edges[:-1]), edges[1] - edges[0]
    half = half_length * np.sqrt(1.0 - (y / half_width) ** 2)
    return Patch(
        row=np.array([0]),
        y=y[None],
        width=np.array([width]),
        x_lead=half[None],
        x_trail=-half[None],
        pressure_slope=np.full(
            (1, strips), load / (0.5 * np.pi * (half**2).sum() * width)
        ),
        interpenetration=np.zeros((1, strips)),
        strips=np.array([strips]),
        cells=np.array([30]),
    )


def creep_force(
    patch: Patch, creepage: tuple[float, float, float], poisson_ratio: float = 0.28
) -> np.ndarray:
    """Force (2,) on an elliptic patch by coupled strips [N]."""
    solution = coupled_strips.solve(
        patch,
        np.array([creepage]),
        np.array([FRICTION]),
        shear_modulus=SHEAR_MODULUS,
        poisson_ratio=poisson_ratio,
        fields=False,
    )
    return solution.force[0, :2]


def of_creep_curve() -> Iterator[tuple[str, str, str]]:
    """Creep forces of elliptic contacts by coupled strips.

    Their slopes at small creepage, and a curve of CONTACT.
    """
    small = 1e-6
    slopes = []
    for ratio in KALKER["a_over_b"]:
        mean = 5e-3
        patch = ellipse(mean * ratio**0.5, mean / ratio**0.5, 100e3)
        per_unit = -1.0 / (SHEAR_MODULUS * mean**2 * small)
        slopes.append(
            [
                per_unit * creep_force(patch, (small, 0.0, 0.0), 0.25)[0],
                per_unit * creep_force(patch, (0.0, small, 0.0), 0.25)[1],
                per_unit * creep_force(patch, (0.0, 0.0, small / mean), 0.25)[1],
            ]
        )
    for key, own in zip(("C11", "C22", "C23"), np.transpose(slopes), strict=True):
        yield f"kalker_{key}", listed(KALKER[key], "#.3g"), listed(own, "#.3g")
    table = pd.read_csv(DATA / "contact_creep_curve.csv", comment="#")
    table = table[table["creepage"].isin([4e-4, 1.2e-3, 2.4e-3])]
    load = 106.7e3
    patch = ellipse(6.304e-3, 12.607e-3, load)
    forces = [creep_force(patch, (one, 0.0, 0.0))[0] for one in table["creepage"]]
    own = listed(-np.array(forces) / (FRICTION * load), ".3f")
    yield "creep_curve", listed(table["half_space"], ".3f"), own


def of_conicity() -> Iterator[tuple[str, str, str]]:
    """Largest differences from the benchmark of EN 15302."""
    on = rail("EN15302_rail_A", 0.0, 1.435, 0.750)

    def conicity(right: str, left: str, difference: float, amplitude: float) -> float:
        pair = (wheel(name) for name in (right, left))
        values = running(*pair, on, "", 1e-3 * difference, (1e-3 * amplitude,))
        (only,) = values.equivalent_conicity
        assert only.value is not None
        return only.value

    equal = pd.read_csv(DATA / "profile_en15302_conicity.csv", comment="#", header=None)
    rows = [
        (f"EN15302_{letter}", float(amplitude), float(published))
        for letter, amplitude, published, *_ in equal.itertuples(index=False)
        if len(str(letter)) == 1
    ]
    off = [conicity(name, name, 0.0, at) - value for name, at, value in rows]
    yield "en15302_equal", f"{len(rows)} values", f"{np.abs(off).max():.3f}"
    unequal = pd.read_csv(DATA / "profile_en15302_unequal.csv", comment="#")
    off = [
        conicity(
            f"EN15302_{row.right}",
            f"EN15302_{row.left}",
            920.0 - row.left_diameter_mm,
            row.amplitude_mm,
        )
        - row.published
        for row in unequal.itertuples()
    ]
    yield "en15302_unequal", f"{len(off)} values", f"{np.abs(off).max():.3f}"


def of_laws() -> Iterator[tuple[str, str, str]]:
    """British wear law and Whole Life Rail Model at their published points."""
    numbers = np.array([10.0, 40.0, 99.0, 100.0, 150.0, 200.0, 300.0, 500.0])
    quoted = np.where(
        numbers < 100.0,
        0.25 * numbers,
        np.where(numbers <= 200.0, 25.0, 1.19 * numbers - 154.0),
    )
    loss = brr.area_loss(numbers, COEFFICIENT_SETS["pearce_sherratt_1991"]).sum(axis=0)
    yield "brr", listed(quoted), listed(loss)
    numbers = np.array([15.0, 40.0, 65.0, 120.0, 175.0, 230.0])
    damage = wlrm.damage_function(numbers, COEFFICIENT_SETS["burstow_2004"])
    yield "wlrm", "0, 5, 10, 5, 0, -5", listed(1e6 * damage)


class Wheel(NamedTuple):
    """Most endangered patch of a wheel."""

    index: float  # surface fatigue index [-]
    y: float  # where it is [m]
    angle: float  # contact angle, magnitude [rad]
    traction: float  # tangential over normal force [-]


def worst(data: xr.Dataset, point: str, side: int) -> Wheel:
    """Patch of the largest surface index of one wheel (0 right, 1 left), new wheels."""
    k = data["operating_point_name"].values.tolist().index(point)
    rows = {
        name: data[name].values[0, k]
        for name in ("side", "contact_angle", "force_x", "force_y", "normal_force")
    }
    index = np.where(rows["side"] == side, data["fatigue_index"].values[0, k, :, 0], -9)
    at = int(np.nanargmax(index))
    force = np.hypot(rows["force_x"][at], rows["force_y"][at])
    return Wheel(
        float(index[at]),
        float(data["fatigue_index_y"].values[0, k, at, 0]),
        float(abs(rows["contact_angle"][at])),
        float(force / rows["normal_force"][at]),
    )


def of_curves(data: xr.Dataset) -> Iterator[tuple[str, str, str]]:
    """Where and in which curves wheels crack; curves are to the right."""
    inner, outer = (
        [worst(data, f"R {radius} leading", side) for radius in RADII]
        for side in (0, 1)
    )
    yield (
        "rcf_field_side",
        "field side; begun on sharp curves with the other wheel in flange contact, "
        "less on moderate ones",
        f"{listed([one.index for one in inner], '+.2f')} at y = "
        f"{listed([1e3 * one.y for one in inner], '+.0f')}; outer wheel "
        f"{listed([one.index for one in outer], '+.2f')}",
    )
    axles = [
        max(worst(data, f"R 500 {axle}", side).traction for side in (0, 1))
        for axle in ("leading", "trailing")
    ]
    yield "rcf_leading", "leading higher, more shelling there", listed(axles, ".2f")
    wear = wearsim.rail_wear(data).sel({"class": "R 500"})
    area = 1e6 * wear["rail_worn_area"].values
    depth = 1e3 * wear["rail_wear_depth"].max("face").values
    yield (
        "rail_wear",
        "depth 1.4 mm vertical, 2.8 mm lateral",
        f"area {listed(area, '.0f')} mm², largest depth {listed(depth, '.0f')} mm",
    )


def of_high_speed(folder: Path) -> Iterator[tuple[str, str, str]]:
    """Depth and place of wear of high-speed wheels."""
    depths = []
    places = []
    roots = []
    for model in ("standard", "fast"):
        data = run(high_speed(model), folder / model)
        depth, y = (data[name].values[-1, 0] for name in ("wear_depth", "profile_y"))
        depths.append(1e3 * depth.max())
        places.append(1e3 * y[depth.argmax()])
        roots.append(1e3 * data["root_wear"].values[-1, 0])
    yield "high_speed", "1.0 to 1.2", listed(depths, ".2f")
    yield "high_speed_place", "within 25", listed(places, ".1f")
    yield "high_speed_root", "mild", listed(roots, ".2f")


def computed() -> pd.DataFrame:
    """Compute all values; published and own by key."""
    rows = [*of_paper(), *of_creep_curve(), *of_conicity(), *of_laws()]
    with tempfile.TemporaryDirectory() as folder:
        rows += of_curves(run(coach(), Path(folder) / "coach"))
        rows += of_high_speed(Path(folder))
    return pd.DataFrame(rows, columns=["key", "published", "wearsim"])


def main(arguments: list[str] | None = None) -> None:
    """Write the report."""
    chosen = options(__file__, __doc__, arguments, from_csv=True)
    path = chosen.out / "validation.csv"
    if chosen.from_csv:
        values = pd.read_csv(path, dtype=str)
    else:
        values = computed()
        write_csv(values, path)
    by_key = values.set_index("key")
    head = ["", "published", "wearsim", "source", "what it proves", "what it does not"]
    rows = [
        [
            row.what,
            by_key.loc[key, "published"],
            by_key.loc[key, "wearsim"],
            row.source,
            row.proves,
            row.not_proved,
        ]
        for key, row in ROWS.items()
    ]
    table = Table(head, rows, align="llllll")
    write_report(chosen.out, __file__, TITLE, [INTRODUCTION, table, NOTES])


if __name__ == "__main__":
    main()
