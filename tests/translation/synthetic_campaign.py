"""Small result files with known wear, written through the real schema."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from wearsim.damage.fatigue import WEAR_NUMBERS
from wearsim.profile.shape import arc_length, polygon_area_between, vertex_normals
from wearsim.results import FILL_FLOAT, FILL_INT, PATCH_SLOTS, Header, create

POINTS = 181
RADIUS = 0.46
MONITORS = (-3e-3, 0.0, 3e-3, 5e-3)


def wheel_profile():
    """A wheel in outline: flange of 28 mm at -50 mm, tread of 1:40."""
    y = np.linspace(-70e-3, 60e-3, POINTS)
    z = -y / 40.0 + 28e-3 * np.exp(-(((y + 52e-3) / 9e-3) ** 2))
    return y, z - np.interp(0.0, y, z)


def campaign_header(kind, steps):
    y, z = wheel_profile()
    shifts = {"rig": (-3e-3, 0.0, 3e-3), "field": (-2e-3, 0.0, 2e-3)}[kind]
    shift = np.array([*shifts, *MONITORS])
    weight = np.array([0.25, 0.5, 0.25, 0.0, 0.0, 0.0, 0.0])
    n = len(shift)
    rail_y = np.linspace(-36e-3, 36e-3, 61)
    static = {
        "wheel_name": ("right", "left"),
        "regime_name": ("mild", "severe"),
        "operating_point_name": [f"{kind} {1e3 * s:+.0f} mm" for s in shifts]
        + [f"monitor {1e3 * s:+.0f} mm" for s in MONITORS],
        "arc_length": arc_length(y, z),
        "counterface_y": rail_y,
        "counterface_z": rail_y**2 / 0.6,
        "shift": shift,
        "yaw": np.zeros(n),
        "roll": np.zeros(n),
        "wheel_load": np.full(n, 80e3),
        "speed": np.full(n, 20.0),
        "friction": np.full(n, 0.35),
        "track_curvature": np.zeros(n),
        "curve_curvature": np.zeros(n),
        "environment": np.where(weight > 0, 1.0 if kind == "rig" else 0.2, 1.0),
        "weight": weight,
        "block_length": np.where((weight > 0) & (kind == "rig"), 1e3 * weight, 0.0),
    }
    attributes = {
        "title": f"Synthetic {kind} <campaign>",
        "history": f"wearsim run {kind}.toml --out out",
        "source": "wearsim 0.1.0, numpy 2",
        "scene_text": f'[scene]\nkind = "{kind}"\n',
        "scene_kind": kind,
        "input_hashes": "S1002 0123abcd",
        "wear_law": "usfd",
        "wear_coefficients": "lewis_dwyer_joyce_2004",
        "wear_coefficients_source": "Lewis and Dwyer-Joyce 2004",
        "wear_form": "local",
        "contact_normal": "kik_piotrowski",
        "contact_tangential": "fastsim",
        "strips": np.int32(50),
        "cells": np.int32(50),
        "cell_size": 0.5e-3,
        "most_cells": np.int32(120),
        "smoothing_wavelength": 2.5e-3,
        "stability_limit": 0.4,
        "depth_cap": 8e-6,
        "integrator": "rkc",
        "rotation_rule": "free",
        "roll_rule": "given",
        "axle_torque": 0.0,
        "wheel_profile_right": "S1002",
        "wheel_profile_left": "S1002",
        "counterface_profile": "60E1 1:40",
        "wheel_density": 7850.0,
        "youngs_modulus": 210e9,
        "poisson_ratio": 0.3,
        "contact_parameters": "virtual_penetration_factor = 0.55",
        "counterface_curvature": 1.0 if kind == "rig" else 0.0,
        "wheel_radius": RADIUS,
        "half_span": 0.75,
        "finished": "distance reached",
    }
    assert steps >= 1
    return Header(static, attributes)


def campaign_rows(kind, header, steps, rate, friction_free=False):
    """Rows whose largest wear depth grows by `rate` [m/m]; the band of the rig is
    narrower.
    """
    y0, z0 = wheel_profile()
    ny, nz = vertex_normals(y0, z0)
    n = len(header.static["shift"])
    width = 8e-3 if kind == "rig" else 12e-3
    spread = np.exp(-((y0 / width) ** 2))
    spread /= spread.max()
    # outside the running band nothing wears at all
    spread[np.abs(y0) > 3.0 * width] = 0.0
    severe = 0.7 if kind == "rig" else 0.2
    for k in range(steps + 1):
        distance = 10e3 * k
        depth = (
            np.stack([spread, 0.9 * spread])
            * (0.0 if friction_free else rate)
            * distance
        )
        share = np.where(np.abs(y0) < 4e-3, severe, 0.1)
        by_regime = np.stack([(1.0 - share) * depth, share * depth], axis=1)
        y, z = y0 + depth * ny, z0 + depth * nz
        area = np.array([polygon_area_between(y0, z0, y[w], z[w]) for w in (0, 1)])
        row = {
            "distance": np.array(distance),
            "step_length": np.array(10e3 if k else 0.0),
            "stability_number": np.array(0.3 if k else 0.0),
            "step_error": np.array(2e-7 if k else FILL_FLOAT),
            "rejected_steps": np.array(0, dtype=np.int32),
            "step_limit": np.array(min(k, 1), dtype=np.int32),
            "stages": np.array(2 * min(k, 1), dtype=np.int32),
            "point_length": 1.0 * header.static["weight"],
            "point_error": 0.0 * header.static["weight"],
            "point_stiffness": 0.0 * header.static["weight"],
            "active_weight": header.static["weight"] * (k > 0),
            "profile_y": y,
            "profile_z": z,
            "wear_depth": depth,
            "friction_work": depth * 1e9 + 1.0,
            "wear_depth_by_regime": by_regime,
            "flange_height": 28e-3 + depth.max(axis=1),
            "flange_thickness": 32.5e-3 - 0.5 * depth.max(axis=1),
            "flange_gradient": 10.8e-3 - 0.1 * depth.max(axis=1),
            "hollowing": np.zeros(2),
            "worn_area": area,
            "worn_mass": area * 2.0 * np.pi * RADIUS * 7850.0,
            "max_wear_depth": depth.max(axis=1),
            "tread_wear": depth.max(axis=1),
            "root_wear": np.zeros(2),
            "flange_wear": np.zeros(2),
            "wheel_diameter": 2.0 * (RADIUS - depth.max(axis=1)),
            "equivalent_conicity": np.array(
                0.17 + 100.0 * depth.max() if k < 4 else FILL_FLOAT
            ),
            "n_patch": np.full(n, 3),
        }
        row |= _patches(kind, header, 1.0 + 0.05 * k)
        yield {name: np.asarray(value) for name, value in row.items()}


def _patches(kind, header, growth):
    """Two patches on the right wheel, one on the left."""
    shift = header.static["shift"]
    n = len(shift)
    radius = 1.3 if kind == "rig" else 1.0
    used = {"side": np.array([0, 0, 1])}
    base = {
        "wheel_y": [2e-3, -30e-3, -1e-3],
        "rail_y": [1e-3, -31e-3, -2e-3],
        "x": [0.0, 1e-3, 0.0],
        "contact_angle": [0.02, -0.6, -0.02],
        "area": [90e-6, 30e-6, 110e-6],
        "max_pressure": [900e6, 1500e6, 850e6],
        "length": [12e-3, 8e-3, 12e-3],
        "width": [9e-3, 4e-3, 10e-3],
        "approach": [60e-6, 60e-6, 62e-6],
        "normal_force": [60e3, 25e3, 80e3],
        "creepage_x": [1e-3, -2e-3, -1e-3],
        "creepage_y": [0.0, 0.0, 0.0],
        "spin": [-0.2, -1.5, 0.2],
        "force_x": [5e3, -4e3, -1e3],
        "force_y": [5e3, 1e3, -5e3],
        "spin_moment": [10.0, 5.0, -10.0],
        "slip_area": [20e-6, 30e-6, 25e-6],
        "power": [200.0, 900.0, 150.0],
        "power_balance": [0.97, 1.05, 0.98],
        "wear_index_mean": [0.2e6, 1.5e6, 0.1e6],
        "wear_index_max": [0.9e6, 14e6, 0.5e6],
        "load_scale": [1.0, 1.0, 1.0],
        "wear_area_rate": [3e-12, 5e-12, 4e-12],
        "wear_depth_rate_max": [400e-12, 900e-12, 300e-12],
    }
    row = {}
    for name, values in base.items():
        slots = np.full((n, PATCH_SLOTS), FILL_FLOAT)
        factor = {
            "area": growth / radius,
            "max_pressure": radius / growth,
            "power": radius / growth,
        }.get(name, 1.0)
        factor = factor * (radius if name in ("spin", "wear_depth_rate_max") else 1.0)
        factor = factor * (radius**2 if name == "wear_area_rate" else 1.0)
        slots[:, :3] = np.array(values) * factor
        if name == "wheel_y":
            slots[:, :3] += 2.0 * shift[:, None]
        row[name] = slots
    loads = SimpleNamespace(**row)
    for name, number in WEAR_NUMBERS.items():
        there = row["area"] < FILL_FLOAT
        row[f"wear_number_{name}"] = np.where(there, number(loads), FILL_FLOAT)
    for name, values in (
        ("side", used["side"]),
        ("stood_in", [0, 0, 0]),
        ("wear_regime", [0, 0, 0]),
        ("wear_regime_highest", [0, 1 if kind == "rig" else 0, 0]),
    ):
        slots = np.full((n, PATCH_SLOTS), FILL_INT)
        slots[:, :3] = values
        row[name] = slots
    return row


def write_campaign(
    path: Path, kind: str, steps: int, rate: float, friction_free: bool = False
) -> Path:
    header = campaign_header(kind, steps)
    create(path, header, list(campaign_rows(kind, header, steps, rate, friction_free)))
    return path
