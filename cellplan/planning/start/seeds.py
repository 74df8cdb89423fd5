"""Seeds: a start near the one that a task asks for is moved there, on the same branch and the same turns of all joints.

The tool is led in small steps from where the seed puts it to where it is desired; a joint that would have to turn far
within one of them is about to change its branch.
"""

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.errors import NoSolutionError
from cellplan.geometry.transforms import Array, rotation_exp
from cellplan.model.cell.cell import Cell, Grasp, Relation, Robot
from cellplan.model.motion.branches import SEED_SLIDE, SEED_TURN, MovedStart
from cellplan.model.task.task import Frame, Task
from cellplan.model.task.toolpath import Toolpath
from cellplan.planning.start.given import is_off, part_pose, start_place, start_words, tool_distance, tool_error
from cellplan.planning.start.inverse_kinematics import reaching_configurations
from cellplan.scene.kinematics.screw_chain import ScrewChain

STEP_LENGTH: Final = 0.01  # [m] by which the tool is led at once
STEP_ANGLE: Final = np.radians(1.0)  # [rad] likewise
JUMP: Final = np.radians(15.0)  # [rad] or [m] that a joint moves at most in such a step


def led_to(chain: ScrewChain, relation: Relation, q: Array, X_PT: Array, *, X_WR: Array) -> Array | None:
    """The configuration on the same branch that puts a tool where it is desired, shape (n,); None where there is none.

    Args:
        q: The seed in [rad] or [m], shape (n,).
        X_PT: Desired tool tip, shape (4, 4), in the frame that the relation refers to.
        X_WR: That frame in the world, shape (4, 4).
    """
    error = tool_error(chain, relation, q, X_PT, X_WR=X_WR)
    lengths = np.linalg.norm(error[:3]) / STEP_LENGTH, np.linalg.norm(error[3:]) / STEP_ANGLE
    count = max(1, int(np.ceil(max(lengths))))
    for left in np.arange(count - 1, -1, -1) / count:
        via = X_PT.copy()
        via[:3, 3] -= left * error[:3]
        via[:3, :3] = rotation_exp(-left * error[3:]) @ X_PT[:3, :3]
        arrived = reaching_configurations(chain, relation, via, X_WP=X_WR, seeds=q[None])
        if not len(arrived) or np.abs(arrived[0] - q).max() > JUMP:
            return None
        q = arrived[0]
    return q


def seeded(chain: ScrewChain, relation: Relation, robot: Robot, X_PT: Array, *, X_WR: Array) -> Array | None:
    """The start that a given one of a robot is the seed of, shape (n,); None where it is too far off for that."""
    q = None if robot.start is None else _same_branch(chain, relation, robot, X_PT, X_WR=X_WR)
    most = np.where([joint.is_revolute for joint in robot.model.joints], SEED_TURN, SEED_SLIDE)
    return q if q is not None and np.all(np.abs(q - np.asarray(robot.start)) <= most) else None


def with_seeds(
    cell: Cell, toolpaths: Mapping[str, Toolpath], *, run: str = "", of_run: Collection[str] = ()
) -> tuple[Cell, tuple[MovedStart, ...]]:
    """The cell with every start near its task or grasp moved there, and how far each was moved.

    A given start is moved by a few degrees or millimetres only; what is farther off is left for
    ``examine_given_starts`` to refuse. One that an earlier run began at is moved as far as its branch goes. A start on
    the path of a task with an approach is moved onto the path.

    Raises:
        NoSolutionError: A branch of the earlier run does not lead to a task.
    """
    moved: list[MovedStart] = []
    carriers = cell.positioners[:1]
    for relation in sorted(cell.relations, key=lambda it: it.robot not in carriers):  # the part goes with a carrier
        robot = cell.robot(relation.robot)
        holder = cell.robot(carriers[0]).start if carriers else None
        X_WR = part_pose(cell, holder) if relation.relative_to is Frame.PART else np.eye(4)
        if robot.start is None or X_WR is None or robot.path is not None:
            continue
        if isinstance(relation, Task) and relation.settle > 0.0:
            continue
        chain = ScrewChain(robot)
        X_PT, off = _nearer_goal(cell, chain, relation, robot.start, toolpaths, X_WR)
        if not is_off(cell, relation, off):
            continue
        is_of_run = robot.name in of_run
        lead = _same_branch if is_of_run else seeded
        q = lead(chain, relation, robot, X_PT, X_WR=X_WR)
        if q is None and is_of_run:
            raise NoSolutionError(_lost_words(cell, relation, robot, off, run))
        if q is not None:
            moved.append(_moved(relation, robot, q, off, run=run if is_of_run else ""))
            robots = (replace(other, start=q) if other is robot else other for other in cell.robots)
            cell = replace(cell, robots=tuple(robots))
    return cell, tuple(moved)


def _nearer_goal(
    cell: Cell, chain: ScrewChain, relation: Relation, q: Array, toolpaths: Mapping[str, Toolpath], X_WR: Array
) -> tuple[Array, tuple[float, float]]:
    """Where a tool is desired at the start, or on the path behind an approach, and how far a start is from there."""
    begin = relation.X_PT if isinstance(relation, Grasp) else toolpaths[relation.name].X_PT_start
    goals = [begin]
    if isinstance(relation, Task) and relation.approach is not None and cell.program.is_home_to_home:
        on_path = begin.copy()
        on_path[:3, 3] += begin[:3, 2] * relation.approach.distance
        goals.append(on_path)
    offs = [tool_distance(chain, relation, q, goal, X_WR=X_WR) for goal in goals]
    nearest = min(range(len(goals)), key=lambda place: offs[place][0])
    return goals[nearest], offs[nearest]


def _same_branch(chain: ScrewChain, relation: Relation, robot: Robot, X_PT: Array, *, X_WR: Array) -> Array | None:
    """The start on the branch of an earlier one, shape (n,), however far; None where that leads beyond a limit."""
    q = led_to(chain, relation, np.asarray(robot.start), X_PT, X_WR=X_WR)
    return q if q is not None and np.all((q >= robot.model.lower) & (q <= robot.model.upper)) else None


def _moved(relation: Relation, robot: Robot, q: Array, off: tuple[float, float], *, run: str) -> MovedStart:
    moves = q - np.asarray(robot.start)
    most = robot.model.joints[int(np.argmax(np.abs(moves)))]
    return MovedStart(
        robot=robot.name,
        task=relation.name,
        position=off[0],
        orientation=off[1],
        joint=most.name,
        moved=float(moves[int(np.argmax(np.abs(moves)))]),
        is_revolute=most.is_revolute,
        run=run,
    )


def _lost_words(cell: Cell, relation: Relation, robot: Robot, off: tuple[float, float], run: str) -> str:
    """One line on a branch of an earlier run that does not lead to a task or grasp."""
    goal = f"its grasp '{relation.name}'" if isinstance(relation, Grasp) else start_words(relation)
    return (
        f"{start_place(cell, robot)}: the branch of the run '{run}' leads '{robot.name}' to {goal} within the joint "
        f"limits by no way: its tool began {1e3 * off[0]:.4g} mm and {np.degrees(off[1]):.4g} deg from there; solve "
        "without --near, or give another start"
    )
