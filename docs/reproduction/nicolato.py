"""Nicolato 2007, chapter 4: singular paths, limits, and a path in position and orientation."""

import numpy as np

from reproduction.runs import Curves, Numbers, curves, paper_cell
from reproduction.sheet import Sheet, draw, draw_joints

REGION = 0.04  # epsilon of Eq. 2.12: damping sets in where the smallest singular value falls below it
PRINTED = "printed_best_first"  # Algorithm 1 without what ours adds
UPWARDS = {"tasks.circle.path.circle.direction": "clockwise"}  # the circle begins towards +z
ONSET = (2.0, 3.0)  # [s] the arm comes to the singular point of the circle at 3 s


def measure_circle() -> Numbers:
    """A circle through the shoulder singularity, by the search and by damped least squares (figures 4.1, 4.2)."""
    search = curves(paper_cell("nicolato_circle"))
    damped = curves(paper_cell("nicolato_circle", method="damped_least_squares"))
    _draw_motion("nicolato_circle_search", search)
    _draw_motion("nicolato_circle_dls", damped)
    return {
        "search": _motion(search),
        "printed": _motion(curves(paper_cell("nicolato_circle", method=PRINTED))),
        "dls": _motion(damped) | {"damped_from_s": _damped_from(damped)},
        "upwards": {
            "search": _motion(curves(paper_cell("nicolato_circle", values=UPWARDS))),
            "dls": _motion(curves(paper_cell("nicolato_circle", values=UPWARDS, method="damped_least_squares"))),
        },
    }


def measure_line() -> Numbers:
    """A line of singular points, by the same two methods (figure 4.3)."""
    search = curves(paper_cell("nicolato_line"))
    damped = curves(paper_cell("nicolato_line", method="damped_least_squares"))
    _draw_motion("nicolato_line_search", search)
    _draw_motion("nicolato_line_dls", damped)
    printed = curves(paper_cell("nicolato_line", method=PRINTED))
    return {"search": _motion(search), "printed": _motion(printed), "dls": _motion(damped)}


def measure_limits() -> Numbers:
    """Limits of position, then of speed, for the fourth joint of an arm of four (figures 4.4, 4.5)."""
    position, speed = curves(paper_cell("nicolato_4r_position")), curves(paper_cell("nicolato_4r_velocity"))
    sheet = Sheet(2, 3)
    for run, what in ((position, "0.60 .. 0.85 rad"), (speed, "0.5 rad/s")):
        draw_joints(sheet.panel(f"joints, $q_4$ within {what}", "time [s]", "[rad]"), run.t, run.q, _names(run))
        axes = sheet.panel("fourth joint alone", "time [s]", "[rad]" if run is position else "[rad/s]")
        fourth = run.q[:, 3] if run is position else run.qd[:, 3]
        draw(axes, run.t if run is position else run.between, {"": fourth})
        for limit in (0.60, 0.85) if run is position else (-0.5, 0.5):
            axes.axhline(limit, color="#c03a4b", linewidth=0.9)
        draw(sheet.panel("norm of the error", "time [s]", "[m]"), run.t, {"": run.error})
    sheet.save("nicolato_limits")
    return {
        "position": {"error_m": position.error.max(), "q4_rad": [position.q[:, 3].min(), position.q[:, 3].max()]},
        "speed": {"error_m": speed.error.max(), "q4_rad_s": np.abs(speed.qd[:, 3]).max()},
    }


def measure_pose() -> Numbers:
    """An arm of the PUMA type from one pose to another (figure 4.8)."""
    run = curves(paper_cell("nicolato_pose"))
    sheet = Sheet(2, 2)
    draw_joints(sheet.panel("joint positions", "time [s]", "[rad]"), run.t, run.q, _names(run))
    draw_joints(sheet.panel("joint speeds", "time [s]", "[rad/s]"), run.between, run.qd, _names(run))
    draw(sheet.panel("position error", "time [s]", "[m]"), run.t, {"": run.error})
    draw(sheet.panel("orientation error", "time [s]", "[rad]"), run.t, {"": run.turn})
    sheet.save("nicolato_pose")
    cost = np.sqrt(run.error**2 + 0.01 * 4.0 * (1.0 - np.cos(run.turn)))  # tr(e^T e) of two rotations: 4 (1 - cos)
    return {
        "error_m": run.error.max(),
        "turn_rad": run.turn.max(),
        "cost": cost.max(),
        "end_deg": np.rad2deg(run.q[-1]),
    }


def _motion(run: Curves) -> Numbers:
    """Error, and how fast and how suddenly the joints move."""
    return {
        "passed": run.report.passed,
        "error_m": run.error.max(),
        "error_at_s": run.t[run.error.argmax()],
        "speed_rad_s": np.abs(run.qd).max(),
        "acceleration_rad_s2": np.abs(run.qdd).max(),
        "iterations": 0.0 if run.iterations is None else np.mean(run.iterations),
        "travel_rad": np.abs(np.diff(run.q, axis=0)).sum(axis=0),
    }


def _damped_from(run: Curves) -> float:
    """Instant at which the smallest singular value comes below the region on the way to the singular point, in [s]."""
    smallest = run.report.conditioning.stack
    inside = (run.t >= ONSET[0]) & (run.t <= ONSET[1]) & (smallest < REGION)
    return float(run.t[inside][0])


def _draw_motion(name: str, run: Curves) -> None:
    """Positions, speeds, accelerations and error norm, as in figures 4.1 to 4.3."""
    sheet = Sheet(2, 2)
    draw_joints(sheet.panel("joint positions", "time [s]", "[rad]"), run.t, run.q, _names(run))
    draw_joints(sheet.panel("joint speeds", "time [s]", "[rad/s]"), run.between, run.qd, _names(run))
    draw_joints(sheet.panel("joint accelerations", "time [s]", "[rad/s²]"), run.t[1:-1], run.qdd, _names(run))
    draw(sheet.panel("norm of the error", "time [s]", "[m]"), run.t, {"": run.error})
    sheet.save(name)


def _names(run: Curves) -> list[str]:
    """What the joints are called in a legend."""
    return [rf"$\theta_{i + 1}$" for i in range(run.q.shape[1])]
