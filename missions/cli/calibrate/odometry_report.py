"""Printer of `treepilot calibrate odometry`."""

from math import degrees, pi
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from missions.commissioning.odometry import Round
    from missions.commissioning.odometry_fit import Estimate, OdometryFit
    from stack.drivetrain.description import RobotDescription


def progress(state: "Round") -> str:
    """Return the line about a round of the drive."""
    worst = 100.0 * state.fit.worst
    return f"round {state.number}, {state.seconds:.0f} s: lengths are known to {worst:.2f} %"


def report(robot: "RobotDescription", fit: "OdometryFit") -> list[str]:
    """Return the lines about a calibration."""
    turns = (fit.turned / (2.0 * pi)).tolist()
    lines = [
        f"{robot.name}: {fit.segments} segments, {fit.straight:.0f} m straight, "
        f"{turns[0]:.1f} turns to the left and {turns[1]:.1f} to the right",
        "",
        f"{'':26}{'robot file':>14}{'fitted':>14}{'deviation':>14}{'change':>10}",
    ]
    lines += [_line(estimate) for estimate in fit.estimates]
    lines += [
        f"  ✘ {estimate.label} is not determined; missing: {estimate.missing}"
        for estimate in fit.estimates
        if not estimate.is_determined
    ]
    lines += ["", "residuals of a segment (RMS)    before     after   expected by slip and lidar"]
    names = (
        ("forward", 1000.0, "mm"),
        ("sideways", 1000.0, "mm"),
        ("heading", degrees(1.0), "deg"),
    )
    for (name, factor, unit), *values in zip(
        names, fit.before.tolist(), fit.after.tolist(), fit.expected.tolist(), strict=True
    ):
        before, after, expected = (factor * value for value in values)
        lines.append(f"  {name:10}{unit:>6}{before:20.2f}{after:10.2f}{expected:11.2f}")
    return [*lines, ""]


def _line(estimate: "Estimate") -> str:
    name, unit = estimate.label, estimate.unit
    if unit == "m":
        change = f"{100.0 * (estimate.value / estimate.before - 1.0):+.2f} %"
        numbers = [f"{100.0 * estimate.before:.3f} cm", f"{100.0 * estimate.value:.3f} cm",
                   f"± {100.0 * estimate.deviation / estimate.value:.2f} %"]  # fmt: skip
    else:
        change = f"{estimate.value - estimate.before:+.4f}"
        suffix = f" {unit}" if unit else ""
        numbers = [f"{estimate.before:.4f}{suffix}", f"{estimate.value:.4f}{suffix}",
                   f"± {estimate.deviation:.5f}"]  # fmt: skip
    sign = "✔" if estimate.is_determined else "✘"
    return f"{sign} {name:24}" + "".join(f"{number:>14}" for number in numbers) + f"{change:>10}"
