"""Draw axes and signs of a wheelset on rails or rollers.

Views from above, behind and the right, and in a curve.
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from wearsim.profile import standard
from wearsim.report.style import save_svg

WHEEL, RAIL, AXIS, FORCE = "#444444", "#888888", "#1f4e9c", "#b03020"


def arrow(ax, start, end, text, colour, *, at=1.12):
    """Draw an arrow with its name beyond the tip."""
    (x, y), (u, v) = start, end
    ax.annotate(
        "", end, start, arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.2}
    )
    ax.text(
        x + at * (u - x),
        y + at * (v - y),
        text,
        color=colour,
        ha="center",
        va="center",
        fontsize=8,
    )


def turn(ax, centre, radius, first, last, text, colour, *, at=1.3):
    """Draw a turning arrow between two angles [degrees], and its name in the middle."""
    angle = np.radians(np.linspace(first, last, 40))
    x, y = centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)
    ax.plot(x[:-1], y[:-1], color=colour, lw=1.2)
    ax.annotate(
        "",
        (x[-1], y[-1]),
        (x[-3], y[-3]),
        arrowprops={"arrowstyle": "-|>", "color": colour},
    )
    middle = np.radians(0.5 * (first + last))
    place = (
        centre[0] + at * radius * np.cos(middle),
        centre[1] + at * radius * np.sin(middle),
    )
    ax.text(*place, text, color=colour, ha="center", va="center", fontsize=8)


def box(ax, centre, size, angle, **style):
    """Draw a turned rectangle.

    The angle turns up towards the right, as yaw does [degrees].
    """
    half = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * size
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    ax.add_patch(Polygon(half @ np.array([[c, -s], [s, c]]) + centre, **style))


def from_above(ax):
    """Draw the wheelset from above: x up, y to the right."""
    yaw, shift = 8.0, 0.1
    for side in (-0.75, 0.75):
        ax.axvspan(side - 0.035, side + 0.035, color=RAIL, alpha=0.35, lw=0)
    c, s = np.cos(np.radians(yaw)), np.sin(np.radians(yaw))
    box(ax, np.array([shift, 0.0]), (2.1, 0.09), yaw, fc="white", ec=WHEEL)
    for side in (-0.75, 0.75):
        box(
            ax,
            np.array([shift + side * c, -side * s]),
            (0.13, 0.75),
            yaw,
            fc="white",
            ec=WHEEL,
        )
        arrow(
            ax,
            (shift + side * c, -side * s + 0.42),
            (shift + side * c, -side * s + 0.72),
            "$F_x$",
            FORCE,
        )
    arrow(ax, (0.0, 0.0), (0.0, 1.0), "$x$, running", AXIS, at=1.08)
    arrow(ax, (0.0, -0.62), (0.45, -0.62), "$y$", AXIS)
    ax.plot([0, 0], [-0.75, 0], color=AXIS, lw=0.6, ls=":")
    ax.plot([shift, shift], [-0.75, 0], color=AXIS, lw=0.6, ls=":")
    ax.text(shift + 0.03, -0.76, "shift $y$", color=AXIS, fontsize=8, va="top")
    turn(ax, (shift, 0.0), 0.42, 90.0, 90.0 - 3.0 * yaw, r"yaw $\psi$", AXIS)
    turn(ax, (shift, 0.0), 0.42, 250.0, 205.0, "$M$", FORCE)
    arrow(ax, (1.25, 0.0), (1.65, 0.0), "$H$", FORCE)
    ax.set_title("from above", fontsize=9)
    ax.text(0.83, -1.02, "right rail", color=RAIL, fontsize=8)
    ax.set(xlim=(-1.35, 1.85), ylim=(-1.1, 1.25))


def from_behind(ax):
    """Draw the wheelset from behind, in running direction: y to the right, z down.

    Profiles to scale.
    """
    wheel, rail = standard.wheel("S1002"), standard.rail("60E1", 1 / 40, 1.435, 0.75)
    axle, top = 0.46, 0.92
    for sign, side in ((-1.0, "L"), (1.0, "R")):
        y = sign * (0.75 + np.r_[wheel.y, wheel.y[-1], wheel.y[0]])
        height = np.r_[-wheel.z, top, top]
        ax.add_patch(Polygon(np.c_[y, height], fc="white", ec=WHEEL, lw=1.0))
        ground = sign * (0.75 + np.r_[rail.y, rail.y[-1], rail.y[0]])
        below = np.r_[-rail.z, -0.55, -0.55]
        ax.add_patch(Polygon(np.c_[ground, below], fc="#e4e4e4", ec=RAIL, lw=0.8))
        arrow(ax, (0.98 * sign, 0.0), (0.98 * sign, 0.24), f"$Q_{side}$", FORCE)
        arrow(
            ax, (1.05 * sign, 0.78), (1.05 * sign, 0.5), f"$V_{side}$", FORCE, at=-0.25
        )
        name = "right" if sign > 0 else "left"
        ax.text(
            0.75 * sign, 0.99, f"{name} wheel", color=WHEEL, fontsize=8, ha="center"
        )
    box(ax, np.array([0.0, axle]), (2.25, 0.1), 0.0, fc="white", ec=WHEEL)
    arrow(ax, (1.2, axle), (1.5, axle), "$H$", FORCE)
    arrow(ax, (0.0, axle), (0.36, axle), "$y$", AXIS)
    arrow(ax, (0.0, axle), (0.0, 0.1), "$z$", AXIS)
    ax.add_patch(Circle((0.0, axle), 0.035, fc="white", ec=AXIS))
    for u in (-1.0, 1.0):
        ax.plot(
            [-0.022, 0.022], [axle - 0.022 * u, axle + 0.022 * u], color=AXIS, lw=0.8
        )
    ax.text(-0.08, axle + 0.1, "$x$ away", color=AXIS, fontsize=8, ha="right")
    turn(ax, (0.0, axle), 0.26, -5.0, -75.0, r"roll $\varphi$", AXIS, at=1.8)
    ax.text(
        0.0,
        -0.3,
        "rails, or rollers\nthat turn below the wheels",
        color=RAIL,
        fontsize=8,
        ha="center",
    )
    ax.set_title("from behind, in running direction", fontsize=9)
    ax.set(xlim=(-1.35, 1.85), ylim=(-0.75, 1.2))


def from_the_right(ax):
    """Draw wheel, rail and roller from the right side of the track.

    x to the right, z down.
    """
    wheel, roller = 0.46, 1.0
    for centre, name, running in (
        (-0.75, "wheel on rail", "rail"),
        (0.95, "wheel on roller", "roller"),
    ):
        ax.add_patch(Circle((centre, wheel), wheel, fc="white", ec=WHEEL))
        turn(ax, (centre, wheel), 0.3, 150.0, 30.0, "", WHEEL)
        ax.text(centre, 2.2 * wheel, name, color=WHEEL, fontsize=8, ha="center")
        ax.text(centre, -0.26, running, color=RAIL, fontsize=8, ha="center")
    ax.fill_between([-1.3, -0.2], -0.15, 0.0, fc="#e4e4e4", ec=RAIL, lw=0.8)
    angle = np.radians(np.linspace(50.0, 130.0, 40))
    x, height = 0.95 + roller * np.cos(angle), roller * (np.sin(angle) - 1.0)
    ax.plot(x, height, color=RAIL, lw=1.0)
    turn(ax, (0.95, -roller), 0.6, 60.0, 120.0, "", RAIL)
    arrow(ax, (0.95, wheel), (0.95 + wheel, wheel), "$r$", WHEEL, at=1.2)
    ax.plot(
        [0.95, 0.95 + 0.643 * roller],
        [-roller, (0.766 - 1.0) * roller],
        color=RAIL,
        lw=0.6,
        ls=":",
    )
    ax.text(1.35, -0.72, "roller radius $s_0$", color=RAIL, fontsize=8)
    arrow(ax, (-0.75, wheel), (-0.15, wheel), "$x$, running", AXIS, at=1.4)
    arrow(ax, (-0.75, wheel), (-0.75, 0.12), "$z$", AXIS, at=1.25)
    ax.set_title("from the right", fontsize=9)
    ax.set(xlim=(-1.35, 2.1), ylim=(-1.1, 1.2))


def in_a_curve(ax):
    """Draw a bogie in a right-hand curve from above.

    Its leading axle towards the outer rail, yawed to it.
    """
    centre, radius = np.array([3.4, -0.9]), 3.4
    angle = np.radians(np.linspace(138.0, 186.0, 80))
    for offset in (-0.55, 0.55):
        x, y = centre[:, None] + (radius + offset) * np.stack(
            [np.cos(angle), np.sin(angle)]
        )
        ax.plot(x, y, color=RAIL, alpha=0.35, lw=4.0)
    at = {}
    for name, degrees, out, yaw in (
        ("leading", 151.0, 0.14, -9.0),
        ("trailing", 173.0, 0.03, 1.0),
    ):
        outward = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
        place, turned = centre + (radius + out) * outward, 180.0 - degrees + yaw
        c, s = np.cos(np.radians(turned)), np.sin(np.radians(turned))
        box(ax, place, (1.5, 0.07), turned, fc="white", ec=WHEEL)
        for side in (-0.55, 0.55):
            box(
                ax,
                place + side * np.array([c, -s]),
                (0.1, 0.45),
                turned,
                fc="white",
                ec=WHEEL,
            )
        at[name] = place
    ax.text(
        at["leading"][0] + 0.95,
        at["leading"][1] - 0.42,
        "leading axle",
        color=WHEEL,
        fontsize=8,
    )
    ax.text(
        at["trailing"][0] + 0.95,
        at["trailing"][1] - 0.18,
        "trailing axle",
        color=WHEEL,
        fontsize=8,
    )
    ax.text(-1.85, -0.9, "right-hand curve:\nradius $R$ > 0", color=AXIS, fontsize=8)
    ax.text(-0.2, 1.3, "outer rail", color=RAIL, fontsize=8, ha="right")
    ax.text(
        -1.0,
        0.55,
        r"shift $y$ < 0, yaw $\psi$ < 0",
        color=AXIS,
        fontsize=8,
        ha="center",
    )
    ax.set_title("in a curve, from above", fontsize=9)
    ax.set(xlim=(-1.9, 2.5), ylim=(-1.2, 1.45))


def main():
    """Draw the four views."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "picture", type=Path, nargs="?", default=Path(__file__).with_name("axes.svg")
    )
    picture = parser.parse_args().picture
    figure = Figure(figsize=(8.6, 6.0), layout="constrained")
    views = (from_above, from_behind, from_the_right, in_a_curve)
    for ax, draw in zip(figure.subplots(2, 2).flat, views, strict=True):
        draw(ax)
        ax.set_aspect("equal")
        ax.set_axis_off()
    save_svg(figure, picture)


if __name__ == "__main__":
    main()
