"""Start postures given in the cell are examined before anything is solved: within limits, tool on the task's start."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from cellplan.errors import (
    HomeOutsideLimitsError,
    InputError,
    InvalidFileError,
    StartOffGraspError,
    StartOffTaskError,
    StartOutsideLimitsError,
)
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.cell import Cell, Grasp, Relation, Robot
from cellplan.model.cell.doubts import doubt_about_limits
from cellplan.model.robot.robot import Joint
from cellplan.model.solver import METHODS
from cellplan.model.task.task import Frame, Task
from cellplan.model.task.toolpath import Toolpath
from cellplan.planning.tracking.cooperation_jacobian import pose_errors
from cellplan.planning.tracking.task_constraints import constraint_rows
from cellplan.scene.kinematics.screw_chain import ScrewChain


def start_place(cell: Cell, robot: Robot) -> str:
    """Where a robot's start posture stands in the cell file, or would stand."""
    if robot.path is not None:
        return cell.origin.at(f"robots.{robot.name}.path")
    place = f"robots.{robot.name}" if (task := _task_begun(cell, robot)) is None else f"tasks.{task.name}"
    by_joint, as_list = f"{place}.start", f"{place}.start_deg"
    return cell.origin.at(by_joint if by_joint in cell.origin.lines else as_list)


def _task_begun(cell: Cell, robot: Robot) -> Task | None:
    """The task whose key states the start posture of a robot; None where it is the robot's."""
    begun = (it for it in cell.tasks if it.robot == robot.name and it.start_posture is not None)
    return next((it for it in begun if np.array_equal(np.asarray(it.start_posture), np.asarray(robot.start))), None)


def home_key(robot: Robot) -> str:
    """Key of a robot's home: a list of angles, or a mapping where a joint slides."""
    return "home_deg" if all(joint.is_revolute for joint in robot.model.joints) else "home"


def home_place(cell: Cell, robot: Robot) -> str:
    """Where a robot's home stands in the cell file, or would stand."""
    by_joint = f"robots.{robot.name}.home"
    return cell.origin.at(by_joint if by_joint in cell.origin.lines else f"robots.{robot.name}.{home_key(robot)}")


def examine_given_starts(cell: Cell, toolpaths: Mapping[str, Toolpath]) -> None:
    """Refuse start postures and homes that no solve could be right with.

    Raises:
        StartOutsideLimitsError: A joint starts outside its limits.
        HomeOutsideLimitsError: A joint is outside its limits at home.
        StartOffGraspError: A further holder's tool is not where it holds the part.
        StartOffTaskError: A tool does not start on its task.
        InvalidFileError: More than one of these.
    """
    findings: list[InputError] = [finding for robot in cell.robots for finding in _outside(cell, robot)]
    if not findings:
        relations: list[Relation] = [*cell.closures, *cell.tasks]
        for relation in relations:
            if (off := _off(cell, relation, toolpaths)) is not None:
                error = StartOffGraspError if isinstance(relation, Grasp) else StartOffTaskError
                findings.append(error(off_words(cell, relation, off)))
    if len(findings) == 1:
        raise findings[0]
    if findings:
        raise InvalidFileError(findings)


def without_far_starts(cell: Cell, toolpaths: Mapping[str, Toolpath]) -> Cell:
    """The cell of one block without the starts that are too far off their tasks; they are missing then."""
    far = {task.robot for task in cell.tasks if _off(cell, task, toolpaths) is not None}
    robots = (replace(robot, start=None) if robot.name in far else robot for robot in cell.robots)
    return replace(cell, robots=tuple(robots))


def _off(cell: Cell, relation: Relation, toolpaths: Mapping[str, Toolpath]) -> tuple[float, float] | None:
    """How far a given start puts a tool from where it is desired, in [m] and [rad]; None where that is allowed."""
    X_PT = relation.X_PT if isinstance(relation, Grasp) else toolpaths[relation.name].X_PT_start
    off = _distance(cell, relation, X_PT)
    may_settle = isinstance(relation, Task) and relation.settle > 0.0  # such a tool may start beside its path
    return None if off is None or may_settle or not is_off(cell, relation, off) else off


def part_pose(cell: Cell, holder_start: Array | None) -> Array | None:
    """The part at the start; None while its holder's configuration is still to be found."""
    if cell.carrier is None:
        return cell.part.X_CP
    if holder_start is None:
        return None
    return ScrewChain(cell.robots[cell.carrier]).tool_poses(holder_start[None])[0] @ cell.part.X_CP


def tool_error(chain: ScrewChain, relation: Relation, q: Array, X_PT_desired: Array, *, X_WR: Array) -> Array:
    """By how much a configuration, shape (n,), puts a tool off where it is desired, in [m] and [rad], shape (6,).

    Args:
        X_PT_desired: Reference tool tip, shape (4, 4), in the frame that the relation refers to.
        X_WR: That frame in the world, shape (4, 4).
    """
    X_PT, desired = inverse(X_WR) @ chain.tool_poses(q[None]), X_PT_desired[None]
    rows = constraint_rows(relation, desired)[0]
    return np.asarray(rows.T @ (rows @ pose_errors(desired, X_PT, [relation.is_spin_free])[0]))


def tool_distance(chain: ScrewChain, relation: Relation, q: Array, X_PT: Array, *, X_WR: Array) -> tuple[float, float]:
    """The distance in [m] and the angle in [rad] of ``tool_error``."""
    error = tool_error(chain, relation, q, X_PT, X_WR=X_WR)
    return float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:]))


def is_off(cell: Cell, relation: Relation, off: tuple[float, float]) -> bool:
    """Whether a tool is farther, in [m] or [rad], from where it is desired at the start than is allowed."""
    position, orientation = _allowed(cell, relation)
    return off[0] > position or off[1] > orientation


def off_words(cell: Cell, relation: Relation, off: tuple[float, float], *, at_best: str = "") -> str:
    """One line on a start off its task or grasp, in [m] and [rad]; ``at_best`` stands before the least of several."""
    if isinstance(relation, Grasp):
        goal = f"its grasp on the part that '{cell.positioners[0]}' carries"
    else:
        goal = start_words(relation)
    position, orientation = _allowed(cell, relation)
    robot = cell.robot(relation.robot)
    cure = "`auto` finds a configuration" if _task_begun(cell, robot) is None else "without the key one is searched for"
    return (
        f"{start_place(cell, robot)}: the tool of '{relation.robot}' is {at_best}"
        f"{1e3 * off[0]:.3f} mm and {np.degrees(off[1]):.4f} deg from {goal}, allowed are {1e3 * position:g} mm and "
        f"{np.degrees(orientation):g} deg; {cure}"
    )


def start_words(task: Task) -> str:
    """The start of a task, with the approach and the run-in by which it lies before the path."""
    approach = 0.0 if task.approach is None else task.approach.distance
    run_in = 0.0 if task.process is None else task.process.runs[0]
    parts = [f"its {what} of {1e3 * by:g} mm" for what, by in (("approach", approach), ("run-in", run_in)) if by > 0.0]
    return f"the start of task '{task.name}'" + (f", with {' and '.join(parts)}" if parts else "")


def _allowed(cell: Cell, relation: Relation) -> tuple[float, float]:
    """Largest distance in [m] and angle in [rad] of a given start from its task or grasp, leaning included."""
    if isinstance(relation, Grasp):
        return cell.checks.closure_mm.si, cell.checks.closure_deg.si
    return relation.tolerance.position_mm.si, relation.tolerance.orientation_deg.si + leaning_angle(cell, relation)


def leaning_angle(cell: Cell, relation: Relation) -> float:
    """Angle in [rad] by which the axis of a tool may lean at its start; 0 where the method keeps it."""
    traits = METHODS.get(cell.solver.method)  # None of a method that users add
    return relation.tilt if traits is not None and traits.lets_axes_lean else 0.0


def _outside(cell: Cell, robot: Robot) -> list[InputError]:
    """One finding for each joint that is outside its limits at the start or at home."""
    errors: list[InputError] = [
        StartOutsideLimitsError(f"{start_place(cell, robot)}: joint '{joint.name}' starts at {words}")
        for joint, words in _outside_limits(robot, robot.start)
    ]
    if errors and robot.home is not None and np.array_equal(robot.home, np.asarray(robot.start)):
        return errors  # a parked robot, whose start is its home
    return errors + [
        HomeOutsideLimitsError(f"{home_place(cell, robot)}: joint '{joint.name}' stands at {words}")
        for joint, words in _outside_limits(robot, robot.home)
    ]


def _outside_limits(robot: Robot, q: Array | None) -> Iterator[tuple[Joint, str]]:
    """Joints that are outside their limits, each with its position and limits in words."""
    for joint, position in zip(robot.model.joints, () if q is None else q, strict=q is not None):
        if not joint.lower <= position <= joint.upper:
            limits = f"{_shown(joint, joint.lower)} .. {_shown(joint, joint.upper)}"
            doubt = doubt_about_limits(robot)
            yield joint, f"{_shown(joint, position)}, outside its limits {limits}{f'; {doubt}' if doubt else ''}"


def _distance(cell: Cell, task: Relation, X_PT_desired: Array) -> tuple[float, float] | None:
    """How far a given start puts a tool from where it is desired, in [m] and [rad]; None while a start is missing."""
    robot = cell.robot(task.robot)
    X_WR = np.eye(4)
    if task.relative_to is Frame.PART:
        holder = cell.robot(cell.positioners[0]).start if cell.positioners else None
        at_start = part_pose(cell, holder)
        if at_start is None:
            return None
        X_WR = at_start
    return None if robot.start is None else tool_distance(ScrewChain(robot), task, robot.start, X_PT_desired, X_WR=X_WR)


def _shown(joint: Joint, position: float) -> str:
    """A joint position with its unit, as people write it."""
    return f"{np.degrees(position):g} deg" if joint.is_revolute else f"{1e3 * position:g} mm"
