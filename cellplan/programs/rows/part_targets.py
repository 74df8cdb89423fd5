"""Targets on the part: poses of the tools for rows that a program states so, and the joints that move a tool there."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.errors import InputError, NotVerifiedError
from cellplan.geometry.transforms import Array, inverse, rotation_exp, rotation_vector
from cellplan.measures.tool_errors import error_lengths
from cellplan.model.cell.cell import Cell, Relation
from cellplan.model.report.exported import ExportFrame, ProgramRows, RobotRows
from cellplan.model.task.task import Frame, Task
from cellplan.model.units import MM
from cellplan.programs.elements.frames import part_pose
from cellplan.programs.elements.joints import Axes, to_numbers
from cellplan.programs.formats.rapid.targets import QUARTER, configuration
from cellplan.programs.formats.rapid.units import part_frame, works_on_part
from cellplan.scene.kinematics.screw_chain import ScrewChain

LEFT_OVER: Final = 0.8  # [-] of what a cell allows between rows; the rest is for the run itself and for rounding
ITERATIONS: Final = 12  # Newton steps: rows are written beside the solution, so that three are enough
POSE_TOL: Final = 1e-9  # [m] and [rad] in which the joints that are found must meet a pose
DAMPING: Final = 1e-12  # [m^2] and [rad^2] added to J J^T, against steps without limit at a singular configuration
STEP_TOL: Final = 1e-3  # [rad] by which joints that are found may differ from the written ones
STRAIGHT_TOL: Final = 1e-4  # [m] between the straight line of a tool on the part and its path by even joint motion
STRAIGHT_TURN_TOL: Final = np.deg2rad(0.1)  # [rad] likewise of its orientation
EDGE_TOL: Final = 1e-3  # [deg] from the edge of a quarter turn within which either of its sides is right


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ToolsOnPart:
    """Tasks that are worked on and closures of a cell, as far as a set of robots takes part in them."""

    cell: Cell  # the cell, as it is in a phase
    chains: Mapping[str, ScrewChain]  # kinematics by robot
    relations: tuple[Relation, ...]  # the tasks, and the grasps of further holders
    names: tuple[str, ...]  # what each is called in messages
    movers: tuple[frozenset[str], ...]  # names of the robots that move each
    allowed: tuple[tuple[float, float], ...]  # largest errors that the cell allows between rows, in [m] and [rad]

    @classmethod
    def of(
        cls, cell: Cell, chains: Mapping[str, ScrewChain], *, tasks: Collection[str], robots: Collection[str]
    ) -> "ToolsOnPart":
        """The relations of the tasks of a phase that some robots move; the cell is as it is in the phase."""
        holder = {grasp.robot for grasp in cell.part.held_by[:1]}
        limits = cell.checks.closure_mm.si, cell.checks.closure_deg.si
        related: list[tuple[Relation, str, frozenset[str], tuple[float, float]]] = []
        for task in cell.tasks:
            robots_at_work = {task.robot} if task.relative_to is Frame.WORLD else {task.robot, *holder}
            if task.name in tasks:
                related.append(
                    (task, f"the tool of task '{task.name}'", frozenset(robots_at_work), task.tolerance.between)
                )
        related += [
            (grasp, f"'{grasp.robot}' on the part", frozenset({grasp.robot, *holder}), limits)
            for grasp in cell.closures
        ]
        related = [entry for entry in related if entry[2] & set(robots)]
        relations, names, movers, allowed = zip(*related, strict=True) if related else ((), (), (), ())
        return cls(cell=cell, chains=chains, relations=relations, names=names, movers=movers, allowed=allowed)

    def tips(self, q: Mapping[str, Array]) -> dict[str, Array]:
        """Tool tips in the world, shape (N, 4, 4), of robots that take part; joints in [rad] or [m], shape (N, n)."""
        taking_part = frozenset[str]().union(*self.movers)
        return {name: self.chains[name].tool_poses(positions) for name, positions in q.items() if name in taking_part}

    def poses(self, X_WT: Mapping[str, Array]) -> list[Array]:
        """Pose of each tool in the frame of its task, or on the part, shape (N, 4, 4) each.

        ``X_WT`` has the tool tips in the world of all robots that take part, shape (N, 4, 4).
        """
        part = self.cell.part
        X_PW = inverse(X_WT[part.held_by[0].robot] @ part.X_CP if self._is_carried else part.X_CP[None])
        return [
            X_WT[relation.robot]
            if isinstance(relation, Task) and relation.relative_to is Frame.WORLD
            else X_PW @ X_WT[relation.robot]
            for relation in self.relations
        ]

    @property
    def _is_carried(self) -> bool:
        """Whether one of the tools is seen from a part that a robot carries."""
        holders = self.cell.part.held_by
        return bool(holders) and any(holders[0].robot in movers for movers in self.movers)

    def errors(self, desired: Sequence[Array], poses: Sequence[Array]) -> list[Array]:
        """Position errors in [m] and orientation errors in [rad] of each, shape (N, 2); open components are zero."""
        return [
            error_lengths(other, one, relation)
            for relation, one, other in zip(self.relations, desired, poses, strict=True)
        ]

    def shares(self, desired: Sequence[Array], poses: Sequence[Array], *, most: float) -> list[Array]:
        """Errors as shares of what is allowed, the larger one of each row, shape (N,).

        Desired poses as in the run and those of the thinned rows have the shape (N, 4, 4); no position error may exceed
        ``most`` in [m], also where the cell allows more.
        """
        return [
            np.maximum(errors[:, 0] / min(most, LEFT_OVER * position), errors[:, 1] / (LEFT_OVER * orientation))
            for errors, (position, orientation) in zip(self.errors(desired, poses), self.allowed, strict=True)
        ]


def with_part_poses(frame: ExportFrame, programs: Sequence[ProgramRows]) -> tuple[ProgramRows, ...]:
    """Programs with the poses of the rows that are stated as targets on the part.

    These are the rows to which a tool moves while it is in process; all rows but the first where no process is stated.

    ``InputError`` where no robot has a task on a part that is held, or the robots are not synchronised.
    """
    part_frame(frame)
    if not any(works_on_part(frame, name) for name in frame.robots):
        raise InputError("--moves linear: expected a robot with an arm and a task on the part, got none")
    return tuple(
        replace(
            program,
            robots={
                name: replace(rows, X_PT=_poses(frame, program, rows)) if works_on_part(frame, name) else rows
                for name, rows in program.robots.items()
            },
        )
        for program in programs
    )


def joints_of_part_poses(
    frame: ExportFrame, written: Sequence[ProgramRows], read: Sequence[ProgramRows]
) -> tuple[ProgramRows, ...]:
    """Programs that were read, with the joints of all rows that state a target on the part.

    The joints follow from the pose that was read and from the joints of the holder that were read, by Newton's method
    from the row that was written; external axes are as read.

    A target moves the tool straight on the part from row to row, while all that is judged moves the joints evenly. The
    two must agree in the middle between rows, where they are farthest apart.

    Raises:
        NotVerifiedError: A target is not met near the written joints, states another configuration, or is so far from
            the one before that a straight line there is another path.
        InputError: The programs have other rows.
    """
    programs = tuple(
        replace(
            given,
            robots={
                name: rows if rows.X_PT is None else _with_joints(frame, given, rows, program.robots[name])
                for name, rows in given.robots.items()
            },
        )
        for program, given in zip(written, read, strict=True)
    )
    for program in programs:
        for rows in program.robots.values():
            _require_straight(frame, program, rows)
    return programs


def _require_straight(frame: ExportFrame, program: ProgramRows, rows: RobotRows) -> None:
    """The straight motion of a tool to each of its targets is that of the joints, in the middle between two rows."""
    if rows.X_PT is None:
        return
    ends = np.flatnonzero(np.all(np.isfinite(rows.X_PT), axis=(1, 2)))
    holder = frame.cell.part.held_by[0].robot
    arm, held = rows.q, program.robots[holder].q
    before, after, middle = (
        _tool_on_part(frame, rows.robot, q=mine, q_holder=others)
        for mine, others in (
            (arm[ends - 1], held[ends - 1]),
            (arm[ends], held[ends]),
            (0.5 * (arm[ends - 1] + arm[ends]), 0.5 * (held[ends - 1] + held[ends])),
        )
    )
    half_turn = 0.5 * rotation_vector(np.swapaxes(before[:, :3, :3], 1, 2) @ after[:, :3, :3])
    R = before[:, :3, :3] @ rotation_exp(half_turn)
    off = np.linalg.norm(0.5 * (before + after)[:, :3, 3] - middle[:, :3, 3], axis=1)
    turned = np.linalg.norm(rotation_vector(np.swapaxes(R, 1, 2) @ middle[:, :3, :3]), axis=1)
    far = (off > STRAIGHT_TOL) | (turned > STRAIGHT_TURN_TOL)
    if np.any(far):
        place = int(np.argmax(far))
        finding = (
            f"robot '{rows.robot}': row {ends[place]}: a straight line to its target on the part is off the motion "
            f"of the joints by {off[place] * MM:.3g} mm and {np.rad2deg(turned[place]):.3g} deg, allowed "
            f"{STRAIGHT_TOL * MM:g} mm and {np.rad2deg(STRAIGHT_TURN_TOL):g} deg"
        )
        raise NotVerifiedError([finding])


def _poses(frame: ExportFrame, program: ProgramRows, rows: RobotRows) -> Array:
    """Poses of a tool on the part, shape (N, 4, 4), NaN in rows that are stated as joints."""
    holder = frame.cell.part.held_by[0].robot
    X_PT = _tool_on_part(frame, rows.robot, q=rows.q, q_holder=program.robots[holder].q)
    is_stated = np.ones(len(rows), dtype=bool)
    if rows.process is not None and np.any(rows.process):
        is_stated[1:] = rows.process[:-1]
    is_stated[0] = False
    return np.where(is_stated[:, None, None], X_PT, np.nan)


def _tool_on_part(frame: ExportFrame, robot: str, *, q: Array, q_holder: Array) -> Array:
    """A tool in the part frame, shape (N, 4, 4), for joints of its robot and of the holder."""
    return inverse(_part_poses(frame, q_holder)) @ ScrewChain(frame.robot(robot)).tool_poses(q)


def _part_poses(frame: ExportFrame, q_holder: Array) -> Array:
    """The part in the world, shape (N, 4, 4), for joints of its holder."""
    holder = frame.robot(frame.cell.part.held_by[0].robot)
    return ScrewChain(holder).tool_poses(q_holder) @ frame.cell.part.X_CP


def _with_joints(frame: ExportFrame, program: ProgramRows, rows: RobotRows, written: RobotRows) -> RobotRows:
    """Rows that were read of one robot, with the joints of targets on the part."""
    if len(rows) != len(written) or rows.X_PT is None or rows.configuration is None:
        raise InputError(f"robot '{rows.robot}': expected {len(written)} rows, got {len(rows)}")
    at = np.flatnonzero(np.all(np.isfinite(rows.X_PT), axis=(1, 2)))
    robot = frame.robot(rows.robot)
    holder = frame.cell.part.held_by[0].robot
    X_WT = _part_poses(frame, program.robots[holder].q[at]) @ rows.X_PT[at]
    first = written.q[at].copy()
    external = list(Axes.of(robot).external)
    first[:, external] = rows.q[at][:, external]
    solutions, misses = solved_joints(ScrewChain(robot), X_WT, first, arm=list(Axes.of(robot).arm))
    far = (misses > POSE_TOL) | (np.max(np.abs(solutions - first), axis=1) > STEP_TOL)
    if np.any(far):
        place = int(at[np.argmax(far)])
        raise NotVerifiedError([f"robot '{rows.robot}': row {place}: its target on the part is not met by its joints"])
    stated = configuration(robot, solutions)
    same = _same_configuration(stated, rows.configuration[at], to_numbers(robot, solutions, decimals=9))
    if not np.all(same):
        place = int(np.argmin(same))
        expected, got = stated[place].tolist(), rows.configuration[at[place]].tolist()
        finding = f"robot '{rows.robot}': row {at[place]}: expected configuration {expected}, got {got}"
        raise NotVerifiedError([finding])
    q = rows.q.copy()
    q[at] = solutions
    return replace(rows, q=q)


def tip_jacobians(chain: ScrewChain, q: Array) -> Array:
    """Twists of a tool at its tip in the world for each joint, linear part first, shape (N, 6, n)."""
    X, screws = chain.tool_motion(q)
    J = screws.copy()  # its linear part at the origin of the world, then at the tool tip
    J[:, :3] += np.swapaxes(np.cross(np.swapaxes(J[:, 3:], 1, 2), X[:, None, :3, 3]), 1, 2)
    return J


def solved_joints(chain: ScrewChain, X_WT: Array, first: Array, *, arm: list[int]) -> tuple[Array, Array]:
    """Joints that bring a tool to poses, shape (N, n), and by how much they miss them in [m] or [rad], shape (N,).

    Newton's method moves the joints ``arm`` from the ``first`` ones, shape (N, n).
    """
    q, misses = first.copy(), np.full(len(first), np.inf)
    for _ in range(ITERATIONS):
        X = chain.tool_poses(q)
        offset = X_WT[:, :3, 3] - X[:, :3, 3]
        turn = rotation_vector(X_WT[:, :3, :3] @ np.swapaxes(X[:, :3, :3], 1, 2))
        error = np.concatenate([offset, turn], axis=1)
        misses = np.max(np.abs(error), axis=1)
        if np.all(misses <= 0.1 * POSE_TOL):
            break
        J = tip_jacobians(chain, q)[:, :, arm]
        J_T = np.swapaxes(J, 1, 2)
        q[:, arm] += (J_T @ np.linalg.solve(J @ J_T + DAMPING * np.eye(6), error[..., None]))[..., 0]
    return q, misses


def with_joints_of_arcs(frame: ExportFrame, program: ProgramRows) -> ProgramRows:
    """A program whose rows within arcs have the joints that bring the tool to the pose through which the arc leads."""
    robots = dict(program.robots)
    for name, rows in program.robots.items():
        if rows.X_PT is None or rows.middles is None:
            continue
        chain, q = ScrewChain(frame.robot(name)), rows.q.copy()
        for seam in rows.seams:
            inside = seam.first + np.flatnonzero(rows.middles[seam.first : seam.last])
            X_WP = part_pose(
                frame, name, seam.task, {other.robot: other.q[inside] for other in program.robots.values()}
            )
            arm = list(Axes.of(frame.robot(name)).arm)
            q[inside], _ = solved_joints(chain, X_WP @ rows.X_PT[inside], q[inside], arm=arm)
        robots[name] = replace(rows, q=q)
    return replace(program, robots=robots)


def _same_configuration(configuration: NDArray[np.int_], read: NDArray[np.int_], numbers: Array) -> NDArray[np.bool_]:
    """Whether configuration data are those of the joints, either side of an edge being right on it, shape (N,)."""
    axes = numbers[:, [-6, -3, -1]]
    is_at_edge = np.abs(axes - np.rint(axes / QUARTER) * QUARTER) < EDGE_TOL
    turns = (configuration[:, :3] == read[:, :3]) | (is_at_edge & (np.abs(configuration[:, :3] - read[:, :3]) <= 1))
    is_straight = np.abs(numbers[:, -2]) < EDGE_TOL
    sides = (configuration[:, 3] == read[:, 3]) | (is_straight & (configuration[:, 3] // 2 == read[:, 3] // 2))
    return np.all(turns, axis=1) & sides
