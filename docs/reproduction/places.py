"""A search for places of the STAUBLI in mode 3: does any break the published limits with the published error?"""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cellplan import Cell, Report
from cellplan.errors import NoSolutionError
from cellplan.geometry.transforms import pose
from cellplan.model.progress import silent
from cellplan.runs.solve import solve_motion
from reproduction.runs import Numbers, paper_cell

PLACES = 101
SEED = 2010
SHIFT = 0.2  # [m] along each axis
TURN = math.radians(15.0)
WORN = ("D4", "F4")
TASK = "rectangle"


def measure() -> Numbers:
    """How many places follow the path, how many of these break limits of D4 or F4, and their smallest error."""
    reports = [report for report in map(_report, _places()) if report is not None]
    errors = [_error(report) for report in reports if _is_broken(report)]
    return {
        "places": PLACES,
        "followed": len(reports),
        "broken": len(errors),
        "least_error_mm": 1e3 * min(errors, default=math.inf),
        "least_error_of_all_mm": 1e3 * min(map(_error, reports), default=math.inf),
    }


def _places() -> Iterator[Cell]:
    """The cell with the base of the STAUBLI moved and turned about the vertical; its start posture is searched."""
    cell = paper_cell("ribeiro_mode_3")
    robot = cell.robot("staubli")
    rng = np.random.default_rng(SEED)
    for _ in range(PLACES):
        shift, turn = rng.uniform(-SHIFT, SHIFT, size=3), rng.uniform(-TURN, TURN)
        X_WB = robot.X_WB.copy()
        X_WB[:3, 3] += shift
        moved = replace(robot, X_WB=X_WB @ pose(rpy=(0.0, 0.0, turn)), start=None)
        yield replace(cell, robots=tuple(moved if entry is robot else entry for entry in cell.robots))


def _report(cell: Cell) -> Report | None:
    """The rectangle at one place, judged but for collisions; None where it cannot be followed."""
    try:
        _, solution = solve_motion(cell, task=TASK, progress=silent)
    except NoSolutionError:
        return None
    return solution.runs[0].report


def _is_broken(report: Report) -> bool:
    """Whether D4 and F4 break limits of position or speed."""
    uses = [use for use in report.joints if use.joint in WORN]
    return any(use.margin < 0.0 or use.peak_velocity > use.velocity_limit for use in uses)


def _error(report: Report) -> float:
    """Largest position error in [m]."""
    (accuracy,) = report.accuracy
    return float(np.linalg.norm(accuracy.position_error, axis=1).max())
