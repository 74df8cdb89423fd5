"""Torques with which joints balance processes and weights, and what holders exert on the part, over the rows of a run.

By virtual power over all robots and holders: for every motion of the joints the powers of torques, processes and
weights add up to zero. Weights of links are not in it.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, first_peak
from cellplan.measures.forces.grips import grip_use
from cellplan.measures.forces.sharing import at_tip, closure_stiffness, load_shares, sharing_length
from cellplan.measures.forces.wrenches import Wrenches, in_part, in_world, wrenches
from cellplan.model.cell.cell import Cell, Grasp, Robot, RobotRows
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.forces import NO_FORCES, ForceReport, GripUse, HolderLoad, InternalLoad, JointLoad
from cellplan.model.report.report import ClosureAccuracy
from cellplan.model.robot.base_reaction import PeakLoad
from cellplan.scene.dynamics.loads import part_share, tool_mass
from cellplan.scene.kinematics.screw_chain import Chains

LEAST: Final = 1e-9  # [N] or [N m]: less is none


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StaticForces:
    """All that acts at the rows of a run, and how holders share it."""

    cell: Cell
    times: Array  # in [s], shape (N,)
    X_WP: Array  # the part, shape (N, 4, 4)
    acting: Wrenches
    shares: Array  # share of each holder in what acts on the part, shape (h, 6, 6); see ``load_shares``
    stiffness: Array | None  # see ``closure_stiffness``
    errors: Array  # by how much the tool of each holder is off its grasp, in P, shape (h, N, 6)

    def share(self, robot: str, on_part: Array) -> Array:
        """What a robot bears of wrenches on the part, both shape (N, 6); nothing unless it holds it."""
        holder = _place(self.cell, robot)
        if holder is None:
            return np.zeros_like(on_part)
        return in_world(self.X_WP, in_part(self.X_WP, on_part) @ self.shares[holder].T)

    def by_process(self, robot: str) -> Array:
        """What processes exert on a robot, through its tool or the part, shape (N, 6)."""
        return self.acting.on_tools[robot] + self.share(robot, self.acting.on_part)

    @property
    def by_processes(self) -> dict[str, Array]:
        """The same by robot."""
        return {robot.name: self.by_process(robot.name) for robot in self.cell.robots}

    def by_weight(self, robot: str) -> Array:
        """What the weights of tool and part exert on a robot, shape (N, 6)."""
        return self.acting.of_tools[robot] + self.share(robot, self.acting.of_part)

    def by_inertia(self, robot: str) -> Array:
        """What tool and part exert on a robot by their accelerations in the written motion, shape (N, 6)."""
        return self.acting.inertia_of_tools[robot] + self.share(robot, self.acting.inertia_of_part)

    def internal(self, holder: int) -> Array | None:
        """What a holder exerts on the part by errors of closure, at the origin of P and in it, shape (N, 6)."""
        if self.stiffness is None:
            return None
        forces: Array = np.einsum("jkl,jnl->nk", self.stiffness[holder], self.errors)
        return forces


def static_forces(
    cell: Cell,
    chains: Chains,
    schedule: Schedule,
    q: RobotRows,
    X_WP: Array,
    closures: Sequence[ClosureAccuracy] = (),
) -> StaticForces | None:
    """What acts on tools and part in a run; None for a cell that states no force.

    Args:
        q: Positions in [rad] or [m], shape (N, n), by robot.
        X_WP: The part in the world, shape (N, 4, 4), or (1, 4, 4) for a part at a fixed place.
        closures: Errors of the tools of further holders; none for exact closures.
    """
    if not states_forces(cell):
        return None
    X_WT = {robot.name: chains[robot.name].tool_poses(q[robot.name]) for robot in cell.robots}
    X_WP = np.broadcast_to(X_WP, (len(schedule.times), 4, 4))
    errors = np.zeros((len(cell.positioners), len(X_WP), 6))
    for closure in closures:
        error = np.concatenate([closure.position_error, closure.orientation_error], axis=1)
        errors[cell.positioners.index(closure.robot)] = -error
    return StaticForces(
        cell=cell,
        times=schedule.times,
        X_WP=X_WP,
        acting=wrenches(cell, schedule, X_WT, X_WP),
        shares=load_shares(cell.part) if cell.part.held_by else np.zeros((0, 6, 6)),
        stiffness=closure_stiffness(cell.part),
        errors=errors,
    )


def states_forces(cell: Cell) -> bool:
    """Whether a cell states anything that a robot has to bear."""
    has_process = any(task.process is not None and task.process.force is not None for task in cell.tasks)
    part, is_heavy = cell.part, any(robot.tool.mass for robot in cell.robots)
    return has_process or is_heavy or any(grasp.stiffness or (part.mass or grasp.grip) for grasp in part.held_by)


def force_report(forces: StaticForces | None, chains: Chains, q: RobotRows) -> ForceReport:
    """Worst values over the rows of a run.

    Args:
        q: Positions in [rad] or [m], shape (N, n), by robot.
    """
    if forces is None:
        return NO_FORCES
    cell = forces.cell
    holders = tuple(_holder(forces, place, grasp) for place, grasp in enumerate(cell.part.held_by))
    return ForceReport(
        joints=tuple(load for robot in cell.robots for load in _joints(forces, robot, chains, q)),
        holders=tuple(holder for holder in holders if holder.force.size > LEAST or holder.internal),
        grips=tuple(_grips(forces)),
        length=sharing_length(cell.part) if cell.closures else None,
    )


def joint_torques(screws: Array, wrench: Array) -> Array:
    """Torques with which joints balance a wrench on their tool at the origin of the world, shape (N, n).

    Args:
        screws: Twist of the tool by unit speed of each joint, shape (N, 6, n).
        wrench: What acts on the tool, shape (N, 6).
    """
    torques: Array = -np.einsum("nij,ni->nj", screws, wrench)
    return torques


def _joints(forces: StaticForces, robot: Robot, chains: Chains, q: RobotRows) -> Iterator[JointLoad]:
    by_process, by_weight = forces.by_process(robot.name), forces.by_weight(robot.name)
    bound = _closure_wrenches(forces, robot.name)
    if max(np.abs(by_process).max(), np.abs(by_weight).max()) < LEAST and bound is None:
        return
    screws = chains[robot.name].flange_screws(q[robot.name])
    is_known = None not in {tool_mass(robot), part_share(forces.cell, robot)}
    at = _peak_of(forces.times)
    process, weight = joint_torques(screws, by_process), joint_torques(screws, by_weight)
    moving = process + weight + joint_torques(screws, forces.by_inertia(robot.name))
    by_closure = None if bound is None else _by_closure(forces, screws, bound)
    for column, joint in enumerate(robot.model.joints):
        yield JointLoad(
            robot=robot.name,
            joint=joint.name,
            is_revolute=joint.is_revolute,
            total=at(process[:, column] + weight[:, column]),
            moving=at(moving[:, column]),
            by_process=at(process[:, column]),
            by_weight=at(weight[:, column]) if is_known else None,
            limit=joint.torque,
            by_closure=None if by_closure is None else float(by_closure[column]),
        )


def _closure_wrenches(forces: StaticForces, robot: str) -> Array | None:
    """Wrench on the tool of a holder, at the origin of P, by the stated errors at their ends, shape (h, 6, 6)."""
    holder = _place(forces.cell, robot)
    if holder is None or forces.stiffness is None:
        return None
    sizes = np.array([np.repeat(grasp.closure_error, 3) for grasp in forces.cell.part.held_by])
    if not sizes.any():
        return None
    wrenches_P: Array = -forces.stiffness[holder] * sizes[:, None, :]
    return wrenches_P


def _by_closure(forces: StaticForces, screws: Array, wrenches_P: Array) -> Array:
    """Largest torque that the stated errors of closure cause, in whatever direction, shape (n,).

    An error of size d in any direction has the torque ``a . e <= |a| d``.
    """
    columns = [
        [joint_torques(screws, in_world(forces.X_WP, np.broadcast_to(column, (len(screws), 6)))) for column in wrench.T]
        for wrench in wrenches_P
    ]
    halves = np.array(columns).reshape(len(wrenches_P), 2, 3, *screws.shape[::2])
    largest: Array = np.linalg.norm(halves, axis=2).sum(axis=(0, 1)).max(axis=0)
    return largest


def _holder(forces: StaticForces, holder: int, grasp: Grasp) -> HolderLoad:
    acting, at = forces.acting, _peak_of(forces.times)
    exerted = -in_part(forces.X_WP, acting.on_part + acting.of_part) @ forces.shares[holder].T
    tip, internal = at_tip(grasp, exerted), forces.internal(holder)
    return HolderLoad(
        robot=grasp.robot,
        force=at(np.linalg.norm(tip[:, :3], axis=1)),
        moment=at(np.linalg.norm(tip[:, 3:], axis=1)),
        internal=None if internal is None else _internal(forces, holder, at_tip(grasp, internal)),
    )


def _internal(forces: StaticForces, holder: int, tip: Array) -> InternalLoad:
    at = _peak_of(forces.times)
    force, moment = _at_error(forces, holder)
    return InternalLoad(
        force=at(np.linalg.norm(tip[:, :3], axis=1)),
        moment=at(np.linalg.norm(tip[:, 3:], axis=1)),
        force_at_error=force,
        moment_at_error=moment,
    )


def _at_error(forces: StaticForces, holder: int) -> tuple[float, float]:
    """Largest force and moment at the tip of a holder by the stated errors of closure, in whatever direction."""
    grasp, wrenches_P = forces.cell.part.held_by[holder], _closure_wrenches(forces, forces.cell.positioners[holder])
    if wrenches_P is None:
        return 0.0, 0.0
    tips = np.swapaxes(at_tip(grasp, np.swapaxes(wrenches_P, 1, 2)), 1, 2)
    blocks = tips.reshape(-1, 2, 3, 2, 3).transpose(1, 0, 3, 2, 4)  # force or moment, holder, by position or angle
    force, moment = np.linalg.norm(blocks, ord=2, axis=(3, 4)).sum(axis=(1, 2))
    return float(force), float(moment)


def _grips(forces: StaticForces) -> Iterator[GripUse]:
    """Use of the friction of each grip, with gravity, acceleration, processes and errors of closure."""
    cell, acting = forces.cell, forces.acting
    if cell.part.mass is None or not any(grasp.grip for grasp in cell.part.held_by):
        return
    on_part = acting.on_part + acting.of_part + acting.inertia_of_part
    for holder, grasp in enumerate(cell.part.held_by):
        if grasp.grip is not None:
            exerted, internal = -in_part(forces.X_WP, on_part) @ forces.shares[holder].T, forces.internal(holder)
            tip = at_tip(grasp, exerted if internal is None else exerted + internal)
            yield grip_use(grasp, grasp.grip, tip, forces.times, at_error=_at_error(forces, holder))


def _peak_of(times: Array) -> Callable[[Array], PeakLoad]:
    """What takes the largest size of values of shape (N,) at these times in [s]."""

    def peak(values: Array) -> PeakLoad:
        """Largest size and its time; rounding is nothing."""
        sizes = np.where(np.abs(values) < LEAST, 0.0, np.abs(values))
        row = first_peak(sizes)
        return PeakLoad(float(sizes.max()), float(times[row]))

    return peak


def _place(cell: Cell, robot: str) -> int | None:
    """Number of a robot among the holders."""
    return cell.positioners.index(robot) if robot in cell.positioners else None
