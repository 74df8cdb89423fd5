"""Ribeiro 2010, chapter 5 and Appendix E: four robots on one part in three modes, and two planar arms."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from cellplan import Report, load_cell, solve
from reproduction.joints import joint_numbers
from reproduction.runs import PAPERS, Array, Numbers, paper_cell
from reproduction.sheet import Sheet, draw, draw_joints

TASKS = {"circle": "kuka", "rhombus": "abb", "rectangle": "staubli"}
MODES = {1: "all four robots", 2: "two at a time", 3: "part at rest"}
LOW_GAIN = 15.0  # [1/s] beside 650
WORN = ("D4", "F4")  # joints of the STAUBLI that break their limits in mode 3


def measure_modes() -> Numbers:
    """Solve all three modes and say how far the tools stray and how hard each robot works."""
    reports = {mode: [run.report for run in solve(paper_cell(f"ribeiro_mode_{mode}")).runs] for mode in MODES}
    _draw_errors(reports)
    _draw_components(reports)
    _draw_positioner(reports[1][0])
    _draw_worn(reports[3][0])
    numbers: Numbers = {f"mode_{mode}": _of_mode(report) for mode, report in reports.items()}
    uses = {use.joint: use for use in reports[3][0].joints if use.robot == "staubli"}
    numbers["worn"] = {
        name: {
            "beyond_deg": math.degrees(max(uses[name].lower - uses[name].min, uses[name].max - uses[name].upper)),
            "speed_share": uses[name].peak_velocity / uses[name].velocity_limit,
        }
        for name in WORN
    }
    numbers["abb"] = {f"mode_{mode}": _of_joints(reports[mode], "abb") for mode in (1, 2, 3)}
    numbers["joints"] = joint_numbers(reports)
    numbers["components"] = _components(reports)
    (low,) = solve(paper_cell("ribeiro_mode_1", values={"solver.gain_per_s": LOW_GAIN})).runs
    numbers["low_gain_mm"] = max(_errors(low.report).values())
    numbers["worn"]["wrist_deg"] = np.rad2deg(np.abs(reports[3][0].q["staubli"][:, 4]).min())
    return numbers


def measure_first_layout() -> Numbers:
    """The first layout at 6 s: which joints break their limits, and how near the floor is."""
    (run,) = solve(paper_cell("ribeiro_first_layout")).runs
    report = run.report
    uses = {use.joint: use for use in report.joints}
    b2, c4 = uses["B2"], uses["C4"]
    highest = int(np.argmax(report.q["kuka"][:, 1]))
    (floor,) = (value for kind, value in report.clearance.minima.items() if str(kind) == "environment")
    _draw_layout(report)
    return {
        "b2_deg": math.degrees(b2.max),
        "b2_at_s": report.times[highest],
        "c4_deg": math.degrees(c4.max),
        "broken": [f"{use.robot} {use.joint}" for use in report.joints if use.margin < 0.0],
        "floor_mm": math.inf if floor.minimum is None else 1e3 * floor.minimum,
        "floor_pair": " and ".join(floor.pair or ()),
        "errors_mm": _errors(report),
    }


def measure_appendix() -> Numbers:
    """Two planar arms on one plate (figures 108 to 110)."""
    (run,) = solve(paper_cell("ribeiro_appendix_e")).runs
    report = run.report
    (accuracy,) = report.accuracy
    error = np.linalg.norm(accuracy.position_error, axis=1)
    turn = np.linalg.norm(accuracy.orientation_error, axis=1)
    sheet = Sheet(2, 2)
    for robot, q in report.q.items():
        draw_joints(
            sheet.panel(f"joint positions, {robot} arm", "time [s]", "[deg]"), report.times, np.rad2deg(q), "ABC"
        )
    draw(sheet.panel("position error", "time [s]", "[mm]"), report.times, {"": 1e3 * error})
    draw(sheet.panel("orientation error", "time [s]", "[rad]"), report.times, {"": turn})
    sheet.save("ribeiro_appendix_e")
    return {"error_mm": 1e3 * error.max(), "turn_below_1e_12_rad": bool(turn.max() < 1e-12)}


def measure_load_sharing() -> Numbers:
    """Two holders of one part (section 4.5): how far the second one's grasp moves in the part."""
    (run,) = solve(load_cell(PAPERS.parent / "load_sharing_planar.yaml")).runs
    (closure,) = run.report.closures
    return {
        "position_mm": 1e3 * np.linalg.norm(closure.position_error, axis=1).max(),
        "turn_deg": np.rad2deg(np.linalg.norm(closure.orientation_error, axis=1).max()),
        "travel_deg": {robot: _travel(run.report, robot) for robot in run.report.q},
    }


def measure_search() -> Numbers:
    """Cooperating robots by recursive search, which Nicolato 2007 leaves to later work: the two arms of Appendix E."""
    cell = paper_cell("ribeiro_appendix_e", values={"solver.method": "recursive_search"})
    (run,) = solve(cell).runs
    return {"passed": run.report.passed, "error_mm": max(_errors(run.report).values())}


def _of_mode(reports: Sequence[Report]) -> Numbers:
    """Errors by task, and by robot the travel of all joints and the largest speed, each of the hardest run."""
    errors: dict[str, float] = {}
    for report in reports:
        errors |= _errors(report)
    robots = list(reports[0].q)
    return {
        "passed": all(report.passed for report in reports),
        "errors_mm": errors,
        "turn_deg": math.degrees(
            max(
                float(np.linalg.norm(task.orientation_error, axis=1).max())
                for report in reports
                for task in report.accuracy
            )
        ),
        "margin_deg": math.degrees(min(use.margin for report in reports for use in report.joints)),
        "speed_share": max(use.peak_velocity / use.velocity_limit for report in reports for use in report.joints),
        "collision_free": all(
            check.passed for report in reports for check in report.checks if check.name == "collision"
        ),
        "travel_deg": {robot: max(_travel(report, robot) for report in reports) for robot in robots},
        "speed_deg_s": {robot: max(_speed(report, robot) for report in reports) for robot in robots},
        "share": {robot: max(report.motion_share[robot][0] for report in reports) for robot in robots},
    }


def _errors(report: Report) -> dict[str, float]:
    """Largest position error of each task in [mm]."""
    return {
        accuracy.task: 1e3 * float(np.linalg.norm(accuracy.position_error, axis=1).max())
        for accuracy in report.accuracy
    }


def _of_joints(reports: Sequence[Report], robot: str) -> Numbers:
    """Range and largest speed of each joint of a robot in the run in which it works."""
    report = next(report for report in reports if np.any(report.qd[robot]))
    return {
        use.joint: {"range_deg": math.degrees(use.max - use.min), "speed_deg_s": math.degrees(use.peak_velocity)}
        for use in report.joints
        if use.robot == robot
    }


def _travel(report: Report, robot: str) -> float:
    """Travel of all joints of a robot added up, in [deg]."""
    return math.degrees(sum(use.travel for use in report.joints if use.robot == robot))


def _speed(report: Report, robot: str) -> float:
    """Largest speed of a joint of a robot in [deg/s]."""
    return math.degrees(max(use.peak_velocity for use in report.joints if use.robot == robot))


def _joints(report: Report, robot: str) -> list[str]:
    """Names of a robot's joints."""
    return [use.joint for use in report.joints if use.robot == robot]


def _draw_errors(reports: Mapping[int, Sequence[Report]]) -> None:
    """Total position error of each task in each mode, as in figures 37 to 39, 51 to 53 and 69 to 71."""
    sheet = Sheet(3, 3)
    for mode, report in reports.items():
        curves = {
            accuracy.task: (report.times, accuracy.position_error) for report in report for accuracy in report.accuracy
        }
        for task, robot in TASKS.items():
            times, error = curves[task]
            axes = sheet.panel(f"mode {mode} ({MODES[mode]}): {task}, {robot.upper()}", "time [s]", "[mm]")
            draw(axes, times, {"": 1e3 * np.linalg.norm(error, axis=1)})
    sheet.save("ribeiro_errors")


def _components(reports: Mapping[int, Sequence[Report]]) -> Numbers:
    """Largest component of the position and of the orientation error of each task, in modes 1 and 2."""
    return {
        f"mode_{mode}": {
            accuracy.task: {
                "position_mm": 1e3 * np.abs(accuracy.position_error).max(),
                "orientation_deg": np.rad2deg(np.abs(accuracy.orientation_error).max()),
            }
            for report in reports[mode]
            for accuracy in report.accuracy
        }
        for mode in (1, 2)
    }


def _draw_components(reports: Mapping[int, Sequence[Report]]) -> None:
    """Components of the errors in the frame of the part, as in figures 40 to 42, 54, 59 and 64."""
    sheet = Sheet(3, 4)
    for task in TASKS:
        for mode in (1, 2):
            report = next(report for report in reports[mode] if task in report.tasks)
            (result,) = [accuracy for accuracy in report.accuracy if accuracy.task == task]
            title = f"mode {mode}: {task}"
            axes = sheet.panel(f"{title}, position", "time [s]", "[mm]")
            draw(axes, report.times, dict(zip("xyz", 1e3 * result.position_error.T, strict=True)))
            axes = sheet.panel(f"{title}, orientation", "time [s]", "[deg]")
            draw(axes, report.times, dict(zip("xyz", np.rad2deg(result.orientation_error.T), strict=True)))
    sheet.save("ribeiro_components")


def _draw_positioner(report: Report) -> None:
    """Positions and speeds of the positioner in mode 1, as in figures 43 and 44."""
    sheet = Sheet(1, 2)
    q = np.rad2deg(report.q["reis"])
    draw_joints(sheet.panel("REIS in mode 1: positions", "time [s]", "[deg]"), report.times, q, _joints(report, "reis"))
    axes = sheet.panel("REIS in mode 1: speeds", "time [s]", "[deg/s]")
    draw_joints(axes, report.times[1:], np.rad2deg(report.qd["reis"]), _joints(report, "reis"))
    sheet.save("ribeiro_positioner")


def _draw_worn(report: Report) -> None:
    """The STAUBLI's wrist in mode 3 with its limits, as in figures 76 and 77."""
    sheet = Sheet(2, 2)
    for use in [use for use in report.joints if use.joint in WORN]:
        column = _joints(report, "staubli").index(use.joint)
        axes = sheet.panel(f"STAUBLI {use.joint} in mode 3: position", "time [s]", "[deg]")
        _draw_limited(axes, report.times, np.rad2deg(report.q["staubli"][:, column]), (use.lower, use.upper))
        axes = sheet.panel(f"STAUBLI {use.joint} in mode 3: speed", "time [s]", "[deg/s]")
        limits = (-use.velocity_limit, use.velocity_limit)
        _draw_limited(axes, report.times[1:], np.rad2deg(report.qd["staubli"][:, column]), limits)
    sheet.save("ribeiro_wrist")


def _draw_layout(report: Report) -> None:
    """The two joints that break their limits in the first layout, as in figures 32 to 34."""
    sheet = Sheet(1, 2)
    for use in [use for use in report.joints if use.joint in {"B2", "C4"}]:
        column = _joints(report, use.robot).index(use.joint)
        axes = sheet.panel(f"first layout: {use.robot.upper()} {use.joint}", "time [s]", "[deg]")
        _draw_limited(axes, report.times, np.rad2deg(report.q[use.robot][:, column]), (use.upper,))
    sheet.save("ribeiro_first_layout")


def _draw_limited(axes: Axes, x: Array, y: Array, limits: Sequence[float]) -> None:
    """One curve with its limits."""
    draw(axes, x, {"": y})
    for limit in limits:
        axes.axhline(math.degrees(limit), color="#c03a4b", linewidth=0.9)
