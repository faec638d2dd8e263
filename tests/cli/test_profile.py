"""`wearsim profile`: what it prints and writes, and that all faults are listed at
once.
"""

from __future__ import annotations

import csv
import io
import json
import os
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from wearsim.cli import main
from wearsim.profile import standard
from wearsim.profile.files import read_profile, write_profile

MEASURED = Path(__file__).parents[2] / "profiles" / "measured"
RIGHT, LEFT = (
    str(MEASURED / "wheel_worn_right.whl"),
    str(MEASURED / "wheel_worn_left.whl"),
)
RAIL = str(MEASURED / "rail_worn_outer.ban")


def printed(capsys, *words):
    assert main(["profile", *words]) == 0
    return capsys.readouterr().out


def message(capsys, *words):
    return json.loads(printed(capsys, *words, "--json"))


def error_of(capsys, *words):
    """Lines on stderr of a command that is refused."""
    assert main(["profile", *words]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "Traceback" not in captured.err
    return captured.err.splitlines()


# profiles.md, sections 8 and 6.3: own values, by other code; printed digits
@pytest.mark.parametrize("name", ["S1002", "EPS", "1/40"])
def test_measures_of_new_wheels(name, capsys):
    measures = message(capsys, name)["measures"]
    assert measures["flange_height"] == pytest.approx(28.0e-3, abs=0.5e-7)
    assert measures["flange_thickness"] == pytest.approx(32.5e-3, abs=0.5e-7)
    assert measures["flange_gradient"] == pytest.approx(10.7938e-3, abs=0.5e-7)
    assert measures["hollowing"] == 0.0


def test_conicity_of_the_usual_pair(capsys):
    """Section 6.3: 0.354 0.219 0.174 0.155 0.149 0.266 at 1 .. 6 mm, three printed
    digits.
    """
    running = message(capsys, "S1002")["running"]
    values = [each["value"] for each in running["equivalent_conicity"]]
    np.testing.assert_allclose(
        values, [0.354, 0.219, 0.174, 0.155, 0.149, 0.266], atol=5.1e-4
    )
    at = {
        round(1e3 * each["shift"]): each["value"]
        for each in running["rolling_radius_difference"]
    }
    assert at[3] == pytest.approx(0.940e-3, abs=0.5e-6)
    assert at[6] == pytest.approx(4.27e-3, abs=5e-6)


def test_a_benchmark_pair_of_en_15302_by_the_flags(capsys):
    """Pair A/A of the standard at 1 .. 6 mm, to its three digits and 0.0005 of the step
    of the grid.
    """
    value = message(capsys, "EN15302_A", "--rail", "EN15302_rail_A")
    conicity = [each["value"] for each in value["running"]["equivalent_conicity"]]
    np.testing.assert_allclose(
        conicity, [0.125, 0.155, 0.188, 0.216, 0.254, 0.303], atol=1e-3
    )


def test_rail_and_wheel_tell_the_same_pair(capsys):
    from_wheel, from_rail = (
        message(capsys, "S1002"),
        message(capsys, "60E1", "--wheel", "S1002"),
    )
    assert from_wheel["running"] == from_rail["running"]
    assert from_rail["measures"] is None
    assert "judgements" not in from_rail


def test_the_story_of_a_file_is_told(capsys):
    text = printed(capsys, LEFT)
    for part in (
        "MiniProf",
        "70 mm subtracted",
        "order reversed",
        "CarNo 1",
        "AxleNo 2",
        "536 over",
    ):
        assert part in text
    text = printed(capsys, "S1002")
    assert "source" in text
    assert "certainty" in text


def test_limits_depend_on_the_diameter(capsys):
    def sd_minimum(*flags):
        result = message(capsys, RIGHT, *flags)["judgements"]
        return next(
            each
            for each in result
            if (each["measure"], each["bound"]) == ("flange_thickness", "min")
        )

    assert sd_minimum()["limit"] == pytest.approx(
        27.5e-3
    )  # the strictest, which it fulfils
    assert sd_minimum()["exceeded"] is False
    assert sd_minimum("--diameter-mm", "900")["limit"] == pytest.approx(22e-3)
    assert sd_minimum("--diameter-mm", "800")["limit"] == pytest.approx(25e-3)
    text = printed(capsys, RIGHT)
    assert "min -  not checked: diameter not given (--diameter-mm)" in text
    assert "\nlimits left open: flange height Sh (" in text


def test_what_is_beyond_limits_comes_first(thin, capsys):
    first, second, *_ = printed(capsys, thin, "--diameter-mm", "900").splitlines()
    start = "BEYOND LIMITS (TSI): flange thickness Sd 20.5"
    assert first.startswith(start)
    assert ", min 22, by 1.5" in first
    assert "BEYOND" not in second
    first = printed(capsys, RIGHT, "--diameter-mm", "900").splitlines()[0]
    assert first.startswith(
        "within the limits (TSI); nearest: flange thickness Sd 32.35"
    )
    assert first.endswith(" mm, max 33, 0.646 left")


@pytest.mark.parametrize(
    "words", [("S1002",), (RIGHT, "--left", LEFT), (RIGHT, "--against", "S1002")]
)
def test_lines_keep_to_100_columns(words, capsys):
    assert max(map(len, printed(capsys, *words).splitlines())) <= 100


@pytest.fixture
def thin(tmp_path):
    """New S1002 but for a flange 12 mm too thin: Sd = 20.5 mm."""
    shape = standard.wheel("S1002")
    y = shape.y - np.where(
        shape.y < -36e-3, 12e-3, 12e-3 * np.clip((-20e-3 - shape.y) / 16e-3, 0.0, 1.0)
    )
    file = tmp_path / "thin.csv"
    file.write_text(
        "# wheel profile, mm\ny,z\n"
        + "".join(
            f"{1e3 * a:.6f},{1e3 * b:.6f}\n" for a, b in zip(y, shape.z, strict=True)
        )
    )
    return str(file)


def test_a_condemned_wheel_is_condemned_without_its_diameter(thin, capsys):
    flags = (thin, "--back-to-back-mm", "1340", "--limits", "TSI")
    value = message(capsys, *flags)
    assert value["measures"]["flange_thickness"] == pytest.approx(20.5e-3, abs=0.01e-3)
    # 1340 + 2 * 20.5 = 1381 mm, less than 1410
    assert set(value["exceeded"]) == {
        "flange_thickness",
        "back_to_back",
        "front_to_front",
    }
    assert value["not_judged"] == [
        "flange_height"
    ]  # 28 mm: too low below D = 760 mm only
    text = printed(capsys, *flags)
    for name, by in (
        ("flange thickness Sd", "1.5"),
        ("back-to-back distance AR", "17.0"),
        ("active flanks SR", "29.0"),
    ):
        (line,) = [
            line for line in text.splitlines() if name in line and "EXCEEDED" in line
        ]
        assert f"EXCEEDED by {by}" in line
        assert "for any diameter listed" in line
    assert len(re.findall("not checked", text)) == 1


def test_the_axle_is_judged_by_its_smaller_wheel(capsys):
    for right, left in (("842", "838"), ("838", "842")):
        flags = (
            "--diameter-mm",
            right,
            "--left-diameter-mm",
            left,
            "--back-to-back-mm",
            "1357.5",
        )
        judged = {
            (each["wheel"], each["measure"], each["bound"]): each
            for each in message(capsys, "S1002", *flags)["judgements"]
        }
        back = judged["axle", "back_to_back", "min"]
        assert back["exceeded"] is True
        assert back["limit"] == pytest.approx(1.358)
        assert judged["right", "flange_thickness", "min"]["condition"] == (
            "D > 840 mm" if right == "842" else "760 < D <= 840 mm"
        )
        assert ("right", "back_to_back", "min") not in judged
    assert "EXCEEDED by 0.500" in printed(capsys, "S1002", *flags)


def test_a_wheelset_is_judged_by_its_stated_distance(capsys):
    text = printed(capsys, RIGHT, "--diameter-mm", "900", "--back-to-back-mm", "1356")
    (line,) = [
        line
        for line in text.splitlines()
        if "distance AR" in line and "EXCEEDED" in line
    ]
    assert "EXCEEDED by 1.000" in line
    nothing_stated = message(capsys, RIGHT)
    assert nothing_stated["measures"]["back_to_back"] is None
    assert not any(
        each["measure"] == "back_to_back" for each in nothing_stated["judgements"]
    )


def test_own_limits(tmp_path, capsys):
    file = tmp_path / "strict.toml"
    file.write_text(
        'title = "strict"\nsource = "house rule"\ncertainty = "made up"\n'
        '[[limit]]\nmeasure = "flange_height"\nmax_mm = 29\n'
    )
    text = printed(capsys, RIGHT, "--limits", str(file))
    assert "EXCEEDED by 0.601" in text
    assert "house rule" in text
    assert "made up" in text


def test_left_and_right_that_differ(capsys):
    value = message(capsys, RIGHT, "--left", LEFT, "--back-to-back-mm", "1360")
    right, left = value["measures"], value["left_measures"]
    assert left["flange_height"] - right["flange_height"] == pytest.approx(
        0.5e-3, abs=0.01e-3
    )  # as made
    front = 1.360 + right["flange_thickness"] + left["flange_thickness"]
    assert value["axle_measures"]["front_to_front"] == pytest.approx(front, abs=1e-12)
    shifts = [each["shift"] for each in value["running"]["rolling_radius_difference"]]
    assert min(shifts) == pytest.approx(-6e-3)


def test_a_diameter_difference_shifts_the_radius_difference(capsys):
    usual = message(capsys, "S1002")["running"]["rolling_radius_difference"]
    flags = ("--diameter-mm", "900", "--left-diameter-mm", "899")
    other = message(capsys, "S1002", *flags)
    more = {
        round(each["shift"], 6): each["value"]
        for each in other["running"]["rolling_radius_difference"]
    }
    for each in usual:
        assert more[round(each["shift"], 6)] == pytest.approx(
            each["value"] + 0.5e-3, abs=1e-9
        )
    assert other["axle_measures"]["wheel_diameter_difference"] == pytest.approx(1e-3)


def test_wear_against_the_new_wheel(capsys):
    """Tread 1.6 mm deep as made; noise of 3 um and the fit leave less than 10 um."""
    value = message(capsys, RIGHT, "--against", "S1002")
    against = value["against"]
    assert against["alignment"]["rule"] == "best_fit"
    assert against["max_wear_depth"] == pytest.approx(1.6e-3, abs=0.01e-3)
    assert sum(against["zone_areas"].values()) == pytest.approx(
        against["worn_area"], rel=1e-9
    )
    assert against["measures"]["flange_height"] == pytest.approx(28e-3, abs=1e-7)
    text = printed(capsys, RIGHT, "--against", "S1002", "--align", "none")
    assert "none: as measured, nothing moved" in text
    assert "+1.6" in text  # Sh, worn minus new


def test_a_tilted_wheel_is_told_and_turned_back(tmp_path, capsys):
    shape = read_profile(RIGHT, "wheel").profile
    c, s = np.cos(0.01), np.sin(0.01)
    tilted = tmp_path / "tilted.csv"
    y, z = c * shape.y - s * shape.z, s * shape.y + c * shape.z
    write_profile(replace(shape, y=y, z=z), tilted, "two-column")
    flags = (str(tilted), "--kind", "wheel", "--against", "S1002")
    left = message(capsys, *flags)["against"]
    assert left["alignment"]["rms"] > 50e-6
    assert any("--rotate" in each for each in left["warnings"])
    turned = message(capsys, *flags, "--rotate")["against"]
    assert turned["warnings"] == []
    assert turned["alignment"]["angle"] == pytest.approx(
        -0.01, abs=1e-3
    )  # noise of the points
    (fault,) = error_of(capsys, *flags, "--align", "none", "--rotate")
    assert "--rotate belongs to --align best_fit" in fault


def test_a_measured_rail_is_found_wherever_its_origin_is(tmp_path, capsys):
    """The example stands in the track as it was made; noise of 5 um moves the fit by 12
    um.
    """
    made = message(capsys, RAIL, "--against", "60E1", "--align", "none")["against"]
    moved = tmp_path / "moved.ban"
    head, _, points = Path(RAIL).read_text().partition("\n\n")
    rows = [line.split() for line in points.splitlines()]
    moved.write_text(
        head
        + "\n\n"
        + "\n".join(f"{float(x) + 12.3:.4f} {float(y) + 3.0:.4f}" for x, y in rows)
    )
    for file in (RAIL, str(moved)):
        fitted = message(capsys, file, "--against", "60E1")["against"]
        assert fitted["alignment"]["rule"] == "best_fit"
        assert fitted["max_wear_depth"] == pytest.approx(
            made["max_wear_depth"], abs=0.02e-3
        )
        assert fitted["worn_area"] == pytest.approx(
            made["worn_area"], abs=0.02e-3 * 0.09
        )


def test_measures_do_not_depend_on_what_a_wheel_is_compared_with(capsys):
    """A worn wheel laid on a shape it never had must not get another flange thickness
    by that.
    """
    alone = message(capsys, RIGHT)
    for other, rule in (("S1002", "best_fit"), ("P8", "best_fit"), ("P8", "none")):
        compared = message(capsys, RIGHT, "--against", other, "--align", rule)
        assert compared["measures"] == alone["measures"]
        assert compared["running"] == alone["running"]


def test_the_aligned_profile_can_be_written(tmp_path, capsys):
    file = tmp_path / "laid.csv"
    flags = (
        "--against",
        "S1002",
        "--align",
        "best_fit",
        "--convert",
        "two-column",
        "--out",
        str(file),
    )
    assert "aligned as stated" in printed(capsys, RIGHT, *flags)
    laid = read_profile(file, "wheel").profile
    moved = message(capsys, RIGHT, "--against", "S1002")["against"]["alignment"]
    measured = read_profile(RIGHT, "wheel").profile
    np.testing.assert_allclose(laid.y, measured.y + moved["dy"], atol=1e-15)
    np.testing.assert_allclose(laid.z, measured.z + moved["dz"], atol=1e-15)


def test_nothing_is_worn_off_itself(capsys):
    """As measured to rounding; the fit itself stops at steps far below the noise of 3
    um.
    """
    for rule, depth in (("none", 1e-15), ("best_fit", 0.1e-6)):
        against = message(capsys, RIGHT, "--against", RIGHT, "--align", rule)["against"]
        assert abs(against["max_wear_depth"]) <= depth
        assert abs(against["worn_area"]) <= depth * 0.165


def test_smoothing_is_told_and_takes_the_noise_out(capsys):
    text = printed(capsys, RIGHT, "--smooth-mm", "4")
    assert "waves shorter than 4 mm taken out" in text
    rough, smooth = (
        message(capsys, RIGHT, "--against", "S1002", *flags)
        for flags in ((), ("--smooth-mm", "6"))
    )
    assert smooth["against"]["alignment"]["rms"] < rough["against"]["alignment"]["rms"]
    assert "waves" not in printed(
        capsys, "S1002", "--smooth-mm", "4"
    )  # a definition has no noise


@pytest.mark.parametrize(
    ("format", "wheel", "rail"),
    [
        ("two-column", ".csv", ".csv"),
        ("miniprof", ".whl", ".ban"),
        ("simpack", ".prw", ".prr"),
    ],
)
def test_conversion_gives_the_same_bits(
    format, wheel, rail, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    for name, extension, kind in (
        (RIGHT, wheel, "wheel"),
        (RAIL, rail, "rail"),
        ("60E1", rail, "rail"),
    ):
        before = (
            standard.definition(name, "rail")
            if name == "60E1"
            else read_profile(name, kind).profile
        )
        text = printed(capsys, name, "--convert", format)
        target = Path(f"{before.name}{extension}")
        assert f"wrote {target} ({format}" in text
        after = read_profile(target, kind).profile
        y, z = (
            standard.sample(before, 0.25e-3) if name == "60E1" else (before.y, before.z)
        )
        np.testing.assert_array_equal(after.y, y)
        np.testing.assert_array_equal(after.z, z)


def test_nothing_is_overwritten_unasked(tmp_path, capsys):
    target = tmp_path / "wheel.whl"
    target.write_text("precious")
    table = tmp_path / "table.csv"
    table.write_text("precious")
    faults = error_of(
        capsys,
        RIGHT,
        "--convert",
        "miniprof",
        "--out",
        str(target),
        "--csv",
        str(table),
    )
    assert len(faults) == 2
    assert all("exists already" in fault and "--overwrite" in fault for fault in faults)
    assert {target.read_text(), table.read_text()} == {"precious"}
    printed(capsys, RIGHT, "--convert", "miniprof", "--out", str(target), "--overwrite")
    assert read_profile(target, "wheel").format == "miniprof"


def test_csv_of_points_and_of_wear(tmp_path, capsys):
    file = tmp_path / "points.csv"
    printed(capsys, "S1002", "--csv", str(file))
    rows = list(csv.DictReader(io.StringIO(file.read_text())))
    assert list(rows[0]) == ["arc_length_mm", "y_mm", "z_mm"]
    assert float(rows[0]["y_mm"]) == pytest.approx(-70.0)
    text = printed(capsys, RIGHT, "--against", "S1002", "--csv", "-")
    rows = list(csv.DictReader(io.StringIO(text)))
    assert list(rows[0]) == ["arc_length_mm", "y_mm", "z_mm", "depth_mm"]
    assert max(float(row["depth_mm"]) for row in rows) == pytest.approx(1.6, abs=0.01)


@pytest.mark.parametrize(
    "ending",
    ["svg", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("png", "pdf"))],
)
def test_plot(ending, tmp_path, capsys):
    file = tmp_path / f"figure.{ending}"
    text = printed(capsys, RIGHT, "--against", "S1002", "--plot", str(file))
    assert f"wrote {file}" in text
    start = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}[ending]
    assert file.read_bytes().startswith(start)


# Each file whose kind or axes nobody can tell names the flags of this command that
# settle it.
def test_statements_act_on_the_file(tmp_path, capsys):
    wheel = standard.wheel("S1002")
    file = tmp_path / "odd.csv"
    np.savetxt(
        file, np.column_stack((-wheel.y, -wheel.z)) / 0.0254, delimiter=",", fmt="%.9f"
    )
    flags = (
        "--kind",
        "wheel",
        "--units",
        "in",
        "--mirror",
        "--z-up",
        "--origin",
        "running_circle",
    )
    value = message(capsys, str(file), *flags, "--format", "two-column")
    assert value["measures"]["flange_height"] == pytest.approx(28e-3, abs=1e-7)
    assert any("as stated" in note for note in value["profile"]["notes"])
    assert error_of(capsys, str(file), "--kind", "wheel", "--no-mirror")
    assert error_of(capsys, str(file), "--kind", "wheel", "--z-down")
    assert error_of(capsys, str(file), "--kind", "wheel", "--units", "m")
    (fault,) = error_of(capsys, str(file))
    assert "state --kind wheel or rail" in fault


def test_all_faults_at_once(capsys):
    faults = error_of(
        capsys,
        "no.whl",
        "--against",
        "no.prw",
        "--left",
        "no.csv",
        "--rail",
        "61E1",
        "--smooth-mm",
        "ten",
        "--gauge-mm",
        "1,435",
        "--inclination",
        "5",
        "--mirror",
        "--no-mirror",
        "--units",
        "ft",
        "--align",
        "eye",
        "--plot",
        "x.jpg",
        "--out",
        "y.whl",
        "--diameter-mm",
        "9",
        "--limits",
        "none",
        "--format",
        "xls",
        "--kind",
        "wheel",
    )
    text = "\n".join(faults)
    for part in (
        "no.whl",
        "no.prw",
        "no.csv",
        "61E1",
        "--smooth-mm",
        "--gauge-mm",
        "--inclination",
        "--mirror",
        "--units",
        "--align",
        "--plot",
        "--out",
        "--diameter-mm",
        "--limits",
        "--format",
    ):
        assert part in text, part
    assert len(faults) == len(set(faults))


LMA = str(Path(__file__).parents[1] / "data" / "profile_lma.csv")
CHINESE = (LMA, "--kind", "wheel", "--back-to-back-mm", "1353")


def test_a_wheelset_of_1353_mm_is_not_compared_with_european_limits(capsys):
    """The set that applies is named, and what it says of Sd is at 12 mm."""
    text = printed(capsys, *CHINESE)
    assert text.startswith("no limits compared: those of TSI are for a back-to-back")
    assert "EXCEEDED" not in text
    assert "Sd 10 mm above it" in text
    assert re.search(r"flange thickness Sd +32\.90", text)
    text = printed(capsys, *CHINESE, "--measuring-height-mm", "12")
    assert "Sd 12 mm above it; qR from 10 mm above it" in text
    assert re.search(r"flange thickness Sd +31\.97", text)
    text = printed(capsys, *CHINESE, "--limits", "Chinese")
    assert text.startswith("within the limits (Chinese, some left out); nearest")
    assert "  left out   the largest Sd, qR, rim width" in text
    assert re.search(r"flange thickness Sd +31\.97", text)
    assert "BEYOND LIMITS (TSI)" in printed(capsys, *CHINESE, "--limits", "TSI")
    value = message(capsys, *CHINESE)
    assert "judgements" not in value
    assert value["no_limits"].startswith("those of TSI")
    assert value["measuring"] == {"measuring_height": 0.01, "running_circle": 0.07}


def test_conicity_at_further_amplitudes(capsys):
    value = message(capsys, "S1002", "--amplitude-mm", "2.5,7")
    by_amplitude = {
        each["amplitude"]: each["value"]
        for each in value["running"]["equivalent_conicity"]
    }
    assert sorted(by_amplitude) == pytest.approx(
        [1e-3, 2e-3, 2.5e-3, 3e-3, 4e-3, 5e-3, 6e-3, 7e-3]
    )
    assert by_amplitude[3e-3] < by_amplitude[2.5e-3] < by_amplitude[2e-3]
    assert "      1      2    2.5      3" in printed(
        capsys, "S1002", "--amplitude-mm", "2.5"
    )


FAULTS = {
    "measuring height": (
        ["S1002", "--measuring-height-mm", "30"],
        "--measuring-height-mm = 30 must be 5 to 20 mm",
    ),
    "running circle": (
        ["S1002", "--running-circle-mm", "7"],
        "--running-circle-mm = 7 must be 55 to 85 mm",
    ),
    "measuring height of a rail": (
        ["60E1", "--measuring-height-mm", "12"],
        "belongs to wheels",
    ),
    "amplitude": (
        ["S1002", "--amplitude-mm", "2;3"],
        "--amplitude-mm = 2;3 must be 0.2 to 15 mm, or several",
    ),
    "amplitude of a fleet": (
        ["--fleet", ".", "--amplitude-mm", "3"],
        "--fleet and --amplitude-mm exclude each other",
    ),
    "nothing": ([], "--fleet DIR"),
    "unknown": (["S1003"], "did you mean 'S1002'"),
    "two of them": (["S1002", "--fleet", "."], "exclude each other"),
    "folder": (["."], "--fleet ."),
    "statement on a name": (["S1002", "--mirror"], "statement on a file"),
    "rail measured": (["60E1", "--limits", "TSI"], "belongs to wheels"),
    "rail on rail": (["60E1", "--rail", "60E2"], "--wheel"),
    "wheel on wheel": (["S1002", "--wheel", "EPS"], "--rail"),
    "rail against wheel": (["60E1", "--against", "S1002"], "a rail is needed"),
    "align alone": (["S1002", "--align", "none"], "--against"),
    "out alone": (["S1002", "--out", "x.whl"], "--convert"),
    "overwrite alone": (["S1002", "--overwrite"], "--convert or --csv"),
    "wrong extension": (
        ["S1002", "--convert", "miniprof", "--out", "x.ban"],
        "extension of a rail",
    ),
    "json and csv": (["S1002", "--json", "--csv", "-"], "exclude each other"),
    "left diameter alone": (["S1002", "--left-diameter-mm", "900"], "--diameter-mm"),
    "rail on the lathe": (["60E1", "--reprofile-to", "S1002"], "belongs to wheels"),
    "turned to a rail": (
        [RIGHT, "--reprofile-to", "60E1"],
        "--reprofile-to: '60E1' is a rail profile",
    ),
    "turned to nothing": (
        [RIGHT, "--reprofile-to", " "],
        "--reprofile-to = ' ' must not be empty",
    ),
    "lathe for a folder": (
        ["--fleet", ".", "--reprofile-to", "S1002"],
        "--fleet and --reprofile-to exclude each other",
    ),
    "kind": (["S1002", "--kind", "roller"], "must be one of wheel, rail"),
    "other kind": (["S1002", "--kind", "rail"], "a rail is needed"),
    "no such folder": (
        ["S1002", "--plot", "nowhere/x.png"],
        "cannot be written: No such file or directory",
    ),
    "empty name": ([" "], "must not be empty"),
    "zero byte": (["a\0b"], "zero bytes"),
    "long name": (["x" * 5000], "too long"),
    "long file": (["S1002", "--plot", "x" * 300 + ".png"], "too long"),
    "empty out": (["S1002", "--convert", "miniprof", "--out", ""], "must not be empty"),
    "parameter": (["S1002/h99"], "28, 30, 32"),
    "long waves": ([RIGHT, "--smooth-mm", "40"], "fifth"),
}


@pytest.mark.parametrize("case", FAULTS)
def test_a_fault_is_one_line_with_the_way_out(case, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words, part = FAULTS[case]
    (fault,) = error_of(capsys, *words)
    assert part in fault
    assert list(tmp_path.iterdir()) == []


def test_faults_of_a_file_have_their_lines(tmp_path, capsys):
    file = tmp_path / "cut.whl"
    text = Path(RIGHT).read_text().replace("XYPoints=536", "XYPoints=534").splitlines()
    text[99], text[199] = "3.5 x", "nan 4"
    file.write_text("\n".join(text))
    faults = error_of(capsys, str(file))
    assert [fault.split(": ")[0] for fault in faults] == [f"{file}:100", f"{file}:200"]


CONTENTS = {
    "empty": b"",
    "one point": b"1,2\n",
    "bytes": bytes(range(256)) * 30,
    "cut": Path(RIGHT).read_bytes()[:3000],
    "joined": Path(RIGHT).read_bytes() + Path(RIGHT).read_bytes(),
    "shuffled": b"\n".join(
        b"%d %d" % (k * 7919 % 135 - 70, k * 104729 % 28) for k in range(300)
    ),
    "huge numbers": b"\n".join(b"%de300 1e300" % k for k in range(100)),
    "same point": b"1 1\n" * 500,
    "line": b"\n".join(b"%d 0" % k for k in range(-70, 66)),
    "latin-1": Path(RIGHT).read_bytes().replace(b"Example", b"Stra\xdfe"),
    "html": b"<html><body>not found</body></html>" * 20,
}


@pytest.mark.parametrize("case", CONTENTS)
@pytest.mark.parametrize(
    "flags", [[], ["--kind", "wheel"], ["--against", "S1002", "--json"]]
)
def test_hostile_files_end_in_a_line_or_an_answer(case, flags, tmp_path, capsys):
    file = tmp_path / ("x.whl" if case in ("cut", "joined", "latin-1") else "x.txt")
    file.write_bytes(CONTENTS[case])
    code = main(["profile", str(file), *flags])
    captured = capsys.readouterr()
    assert code == (0 if case == "latin-1" else 2)
    assert bool(captured.out) == (code == 0)
    assert "internal error" not in captured.err


NUMBER = st.one_of(st.floats(-200.0, 200.0), st.floats()).map(lambda x: f"{x:.4g}")
POINTS = st.lists(st.tuples(NUMBER, NUMBER), max_size=60).map(
    lambda rows: "\n".join(map(",".join, rows))
)
SHAPE = (
    np.column_stack(standard.sample(standard.definition("S1002", "wheel"), 2e-3)) * 1e3
)


@st.composite
def spoilt(draw):
    """A good wheel with some points moved, repeated or taken out."""
    points = SHAPE.copy()
    for _ in range(draw(st.integers(0, 4))):
        k = draw(st.integers(0, len(points) - 1))
        points[k] += draw(st.tuples(st.floats(-40.0, 40.0), st.floats(-40.0, 40.0)))
    first = draw(st.integers(0, len(points) - 1))
    points = (
        points[first : first + draw(st.integers(1, len(points)))]
        if draw(st.booleans())
        else points
    )
    scale = draw(st.sampled_from([1.0, 1e-3, 0.1, 1 / 25.4, -1.0]))
    return "\n".join(
        f"{y:.6g} {z:.6g}"
        for y, z in points * [scale, draw(st.sampled_from([1.0, -1.0])) * scale]
    )


@pytest.mark.parametrize(
    "flags", [[], ["--kind", "wheel", "--against", "S1002"], ["--kind", "rail"]]
)
@given(text=st.one_of(st.text(max_size=300), POINTS, spoilt()))
@settings(
    max_examples=30,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
def test_any_text_ends_in_a_line_or_an_answer(flags, text, tmp_path, capsys):
    file = tmp_path / "any.txt"
    file.write_text(text, encoding="utf-8", newline="")
    code = main(["profile", str(file), *flags, "--json"])
    captured = capsys.readouterr()
    assert code in (0, 2)
    assert "Traceback" not in captured.err
    assert "internal error" not in captured.err
    if code == 0:
        assert "NaN" not in captured.out
        json.loads(captured.out)
    else:
        assert captured.err.strip()


@pytest.mark.parametrize("name", ["p.csv", "p.whl", "p.toml"])
def test_a_pipe_is_not_waited_for(name, tmp_path, capsys):
    os.mkfifo(tmp_path / name)
    (message,) = error_of(capsys, str(tmp_path / name))
    assert message.endswith("is no regular file; give the path of a profile file")
    (message,) = error_of(capsys, "S1002", "--limits", str(tmp_path / name))
    assert message.endswith("no such file of limits")


def test_a_definition_of_the_user_is_a_profile(tmp_path, capsys):
    shutil.copy(standard.shipped_path("profiles", "S1002.toml"), tmp_path / "mine.toml")
    assert (
        message(capsys, str(tmp_path / "mine.toml"))["measures"]
        == message(capsys, "S1002")["measures"]
    )


def test_turning_tells_the_loss_of_diameter_and_what_decides_it(tmp_path, capsys):
    """A wheel worn by 2 mm everywhere but at its running circle, and a flank of 70
    degrees worn by 1 mm.
    """
    new = standard.wheel("S1002")
    hollow = replace(
        new, z=new.z - np.where((new.y > 9e-3) & (new.y < 31e-3), 2e-3, 0.0)
    )
    write_profile(hollow, tmp_path / "hollow.csv", "two-column")
    value = message(
        capsys,
        str(tmp_path / "hollow.csv"),
        "--reprofile-to",
        "S1002",
        "--diameter-mm",
        "900",
    )
    (wheel,) = value["reprofiled"]["wheels"]
    # points of the definition lie about 0.1 mm apart and the tread falls by 1:15: 10 um
    assert wheel["diameter_loss"] == pytest.approx(4e-3, abs=2e-5)
    assert wheel["wheel_diameter"] == pytest.approx(
        0.9 - wheel["diameter_loss"], abs=1e-12
    )
    assert 9e-3 <= wheel["place"] <= 31e-3
    text = printed(
        capsys,
        str(tmp_path / "hollow.csv"),
        "--reprofile-to",
        "S1002",
        "--diameter-mm",
        "900",
    )
    assert "reprofiled to S1002" in text
    assert f"takes {1e3 * wheel['diameter_loss']:.3f} mm of the diameter, to " in text


def test_both_wheels_of_an_axle_are_turned_to_one_diameter(capsys):
    words = (RIGHT, "--left", LEFT, "--reprofile-to", "S1002")
    right, left = message(
        capsys, *words, "--diameter-mm", "900", "--left-diameter-mm", "901"
    )["reprofiled"]["wheels"]
    assert right["wheel_diameter"] == pytest.approx(left["wheel_diameter"], abs=1e-12)
    assert left["diameter_loss"] == pytest.approx(
        right["diameter_loss"] + 1e-3, abs=1e-12
    )
    assert min(right["slack"], left["slack"]) == 0.0
    assert (
        right["diameter_loss"]
        >= message(capsys, RIGHT, "--reprofile-to", "S1002")["reprofiled"]["wheels"][0][
            "diameter_loss"
        ]
    )
    unknown = message(capsys, *words)["reprofiled"]["wheels"]
    assert unknown[0]["diameter_loss"] == pytest.approx(
        unknown[1]["diameter_loss"], abs=1e-12
    )
    assert unknown[0]["wheel_diameter"] is None
    assert "diameters are not known" in printed(capsys, *words)
