"""Explain a cell: its coupling graph, its circuits, and the blocks, rank and redundancy of its cooperation Jacobian."""

from dataclasses import dataclass

import numpy as np

from cellplan.errors import NotPlanarError
from cellplan.geometry.transforms import Array, inverse
from cellplan.jobs.explain.derivations.davies import network
from cellplan.jobs.explain.derivations.graph import (
    PLANE,
    Circuit,
    CouplingGraph,
    circuits,
    coupling_graph,
    spanning_tree,
)
from cellplan.model.cell.cell import Cell, Relation
from cellplan.model.motion.plan import Phase
from cellplan.model.task.task import Frame, PlaneName
from cellplan.planning.modes import plan_phases
from cellplan.planning.sequence.stages import program_stages
from cellplan.planning.tracking.cooperation_jacobian import cooperation_jacobian
from cellplan.planning.tracking.motion_task import closures
from cellplan.planning.tracking.task_constraints import TaskConstraints, constraint_rows
from cellplan.scene.kinematics.pinocchio_model import CombinedModel

RANK_TOL = 1e-10  # [-] singular values below this share of the largest one are zero: rounding of the matrix


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MatrixShape:
    """The cooperation Jacobian of one phase, at the start postures of the cell."""

    phase: Phase  # tasks and moving robots
    blocks: tuple[str, ...]  # names of the block rows: tasks of the phase, then grasps of further holders that move
    rows: tuple[int, ...]  # constrained components of each block row
    columns: tuple[int, ...]  # joints of each robot, in the order of the cell, that move and carry a tool or the part
    signs: Array  # sign of each block for each robot, (blocks, robots): -1 carries the part, +1 has the tool, 0 empty
    missing: tuple[str, ...]  # robots whose start posture is to be found before there is a rank
    singular_values: Array | None  # largest first, one a row or column, whichever are fewer; None without a start

    @property
    def rank(self) -> int | None:
        """Rank at the start; None while a start posture is to be found."""
        if self.singular_values is None:
            return None
        return int(np.sum(self.singular_values > RANK_TOL * self.singular_values.max(initial=0.0)))

    @property
    def redundancy(self) -> int | None:
        """Columns less rank: how many joint motions leave every tool where it is on the part."""
        return None if self.rank is None else sum(self.columns) - self.rank


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Structure:
    """The structure of a cell."""

    cell: Cell
    plane: PlaneName | None  # of the part in which everything moves, with PPR chains; None for space, with PPPS
    graph: CouplingGraph  # links and joints, virtual chains included
    circuits: tuple[Circuit, ...]  # the independent ways round, one per chord
    matrices: tuple[MatrixShape, ...]  # one per phase of the program


def explain(cell: Cell) -> Structure:
    """Take a cell apart without solving it; start postures are used where they are given and never searched."""
    plane = _plane(cell)
    graph = coupling_graph(cell, plane)
    model = CombinedModel(cell)
    return Structure(
        cell=cell,
        plane=plane,
        graph=graph,
        circuits=circuits(graph, spanning_tree(graph)),
        matrices=tuple(_matrix(arranged, model, phase) for arranged, phase in _worked_on(cell)),
    )


def _worked_on(cell: Cell) -> list[tuple[Cell, Phase]]:
    """The phases in which tasks of the cell are worked on, each with the cell as it is then."""
    if not cell.program.is_home_to_home:
        return [(cell, phase) for phase in plan_phases(cell).program]
    return [(stage.cell, stage.phase) for stage in program_stages(cell) if stage.phase.tasks and stage.move is None]


def _plane(cell: Cell) -> PlaneName | None:
    """The plane of P in which all tasks are given and all joints move, if there is one."""
    for plane, components in PLANE.items():
        if all(task.axes == components and not task.is_spin_free for task in cell.relations):
            try:
                network(cell, np.zeros(cell.joint_count), plane=plane)
            except NotPlanarError:
                return None
            return plane
    return None


def _matrix(cell: Cell, model: CombinedModel, phase: Phase) -> MatrixShape:
    """Blocks of one phase, and its singular values where all configurations that matter are known."""
    tasks: list[Relation] = [*(cell.task(name) for name in phase.tasks), *closures(cell, phase.moving)]
    constraints = TaskConstraints.of(cell, tasks, phase.moving)
    signs = constraints.column_signs(model.carries_flange)
    moves = np.any(signs != 0.0, axis=0)
    carriers = cell.positioners[:1] if any(task.relative_to is Frame.PART for task in tasks) else ()
    at_work = {*carriers, *(task.robot for task in tasks)}
    missing = tuple(robot.name for robot in cell.robots if robot.name in at_work and robot.start is None)
    places = [cell.columns(robot.name) for robot in cell.robots]
    blocks = [np.sign(signs[:, place].sum(axis=1)) for place in places]  # one robot's signs in one task are all alike
    return MatrixShape(
        phase=phase,
        blocks=tuple(task.name for task in tasks),
        rows=tuple(int(count) for count in constraints.constrained.sum(axis=1)),
        columns=tuple(int(moves[place].sum()) for place in places),
        signs=np.stack(blocks, axis=1),
        missing=missing,
        singular_values=None if missing else _singular_values(cell, model, constraints),
    )


def _singular_values(cell: Cell, model: CombinedModel, constraints: TaskConstraints) -> Array:
    """Singular values of the constrained rows over the moving joints at the start; bystanders do not matter."""
    q = np.concatenate([np.zeros(len(r.model.joints)) if r.start is None else r.start for r in cell.robots])
    state = model.state(q)
    X_WT, X_WR = state.X_WT[constraints.operators], constraints.reference_frames(state.X_WP)
    signs = constraints.column_signs(model.carries_flange)
    X_PT = inverse(X_WR) @ X_WT
    J = cooperation_jacobian(state, X_WT[:, :3, 3], signs, X_WR=X_WR)
    blocks = zip(constraints.tasks, X_PT, J, strict=True)
    picked = [constraint_rows(task, X[None])[0] @ block for task, X, block in blocks]
    rows = np.concatenate(picked)
    return np.linalg.svd(rows[:, np.any(signs != 0.0, axis=0)], compute_uv=False)
