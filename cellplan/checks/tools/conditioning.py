"""Distance of the motion from singularities: singular values along it, from the screws of all joints."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array, skew
from cellplan.model.cell.cell import Cell, Relation, RobotRows
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.report import Conditioning
from cellplan.model.task.task import Frame
from cellplan.scene.kinematics.screw_chain import Chains

MAX_SAMPLES: Final = 2000  # [-] worked on at once, however small the stack is
WELL_CONDITIONED: Final = 1e-3  # [-] ratio of singular values down to which their squares give them to nine digits
STACK_WORK: Final = 4_000_000  # [-] entries of the stacked matrices worked on at once: 32 MB


def conditioning(
    cell: Cell, schedule: Schedule, chains: Chains, *, q: RobotRows, X_WP: Array, moving: Sequence[str]
) -> Conditioning:
    r"""Singular values of the whole stack and of every moving robot's own Jacobian, along the motion.

    The manipulability of the stack J is ``w = sqrt(det(J J^T))`` ([Ribeiro2010]_ Eq. D.45), here the product of its
    singular values: it also holds where ``det`` would lose its digits. A stack with more rows than columns has 0.

    An operator's Jacobian has the rows its task constrains, a further holder's those of its grasp; that of the robot
    that carries the part gives the twist of the part frame, or has the rows of the path it carries the part along.
    Joints that stand still are left out. The units are mixed: metres and radians, without weights.

    Args:
        X_WP: The part, shape (N, 4, 4) or (1, 4, 4).
    """
    count = len(schedule.times)
    part_frames: Array = np.broadcast_to(X_WP, (count, 4, 4))
    stack: list[Array] = []
    robots: dict[str, list[Array]] = {}
    relations = _relations(cell, schedule, moving)
    most = min(MAX_SAMPLES, max(1, STACK_WORK // (6 * cell.joint_count * max(1, len(relations)))))
    for first in range(0, count, most):
        piece = slice(first, first + most)
        positions = {name: values[piece] for name, values in q.items()}
        rows = [
            _blocks(cell, relation, chains, positions, X_WP=part_frames[piece], R_PT=R_PT[piece])
            for relation, R_PT in relations
        ]
        names = [*cell.positioners[:1], *(relation.robot for relation, _ in relations)]
        stack.append(_singular_values(_stacked(rows, names, moving)))
        for (relation, _), row in zip(relations, rows, strict=True):
            robots.setdefault(relation.robot, []).append(_smallest(row[relation.robot]))
        for name in cell.positioners[:1]:
            if name in moving and all(relation.robot != name for relation, _ in relations):
                J_WP = _at_point(chains[name].flange_screws(positions[name]), part_frames[piece])
                robots.setdefault(name, []).append(_smallest(J_WP))
    spectrum = np.concatenate(stack)
    smallest, largest = spectrum[:, -1], spectrum[:, 0]
    return Conditioning(
        stack=smallest,
        condition=smallest / np.where(largest > 0.0, largest, 1.0),
        manipulability=spectrum.prod(axis=1),
        robots={name: np.concatenate(values) for name, values in robots.items()},
    )


def _relations(cell: Cell, schedule: Schedule, moving: Sequence[str]) -> list[tuple[Relation, Array]]:
    """Tasks of the run, then grasps of further holders that move, each with desired rotations of its tool in P."""
    tasks: list[tuple[Relation, Array]] = [(task.task, task.X_PT[:, :3, :3]) for task in schedule.tasks]
    count = len(schedule.times)
    grasps = [grasp for grasp in cell.closures if grasp.robot in moving]
    return tasks + [(grasp, np.broadcast_to(grasp.X_PT[:3, :3], (count, 3, 3))) for grasp in grasps]


def _blocks(
    cell: Cell, relation: Relation, chains: Chains, q: RobotRows, *, X_WP: Array, R_PT: Array
) -> dict[str, Array]:
    """Constrained rows of one task or grasp over the joints of each robot that has a part in it, by robot name."""
    robot = relation.robot
    is_on_part = relation.relative_to is Frame.PART
    at_tip: Array = X_WP.copy() if is_on_part else np.tile(np.eye(4), (len(X_WP), 1, 1))
    at_tip[:, :3, 3] = chains[robot].tool_poses(q[robot])[:, :3, 3]
    pick = _pick(relation, R_PT)
    blocks = {robot: pick @ _at_point(chains[robot].flange_screws(q[robot]), at_tip)}
    if is_on_part and cell.positioners:
        holder = cell.positioners[0]
        blocks[holder] = -pick @ _at_point(chains[holder].flange_screws(q[holder]), at_tip)
    return blocks


def _pick(relation: Relation, R_PT: Array) -> Array:
    """Rows that a task or grasp constrains, from a twist in P, shape (N, m, 6)."""
    axes = [axis for axis in relation.axes if axis < 3 or not relation.is_spin_free]
    rows = np.zeros((len(R_PT), len(axes) + 2 * relation.is_spin_free, 6))
    rows[:, range(len(axes)), axes] = 1.0
    if relation.is_spin_free:
        rows[:, -2, 3:], rows[:, -1, 3:] = R_PT[:, :, 0], R_PT[:, :, 1]
    return rows


def _at_point(screws_W: Array, X_W: Array) -> Array:
    """Twists at the origin of a moving frame, in its axes, from screws at the world origin, shape (N, 6, n)."""
    R_T = np.swapaxes(X_W[:, :3, :3], 1, 2)
    linear = screws_W[:, :3] - skew(X_W[:, :3, 3]) @ screws_W[:, 3:]
    return np.concatenate([R_T @ linear, R_T @ screws_W[:, 3:]], axis=1)


def _stacked(rows: Sequence[Mapping[str, Array]], robots: Sequence[str], moving: Sequence[str]) -> Array:
    """Arrow matrix of all tasks and closures over the joints that may move, shape (N, rows, columns)."""
    movers = [name for name in dict.fromkeys(robots) if name in moving]
    widths = {name: block.shape[2] for row in rows for name, block in row.items()}
    stacked = []
    for row in rows:
        shape = next(iter(row.values())).shape[:2]
        blocks = [row[name] if name in row else np.zeros((*shape, widths[name])) for name in movers if name in widths]
        stacked.append(np.concatenate([*blocks, np.zeros((*shape, 0))], axis=2))
    return np.concatenate(stacked, axis=1)


def _singular_values(J: Array) -> Array:
    """Singular values of each matrix, largest first, shape (N, rows); zeros when there are fewer columns than rows.

    They are the roots of the eigenvalues of ``J J^T``, which are found in half the time; near singularities, where that
    loses digits, those of ``J`` itself.
    """
    if J.shape[2] < J.shape[1]:
        return np.zeros(J.shape[:2])
    squares = np.linalg.eigvalsh(J @ np.swapaxes(J, 1, 2))[:, ::-1]
    is_near = ~(squares[:, -1] > WELL_CONDITIONED**2 * squares[:, 0])
    values = np.sqrt(np.maximum(squares, 0.0))
    values[is_near] = np.linalg.svd(J[is_near], compute_uv=False)
    return values


def _smallest(J: Array) -> Array:
    """Smallest singular value of each matrix, shape (N,)."""
    return _singular_values(J)[:, -1]
