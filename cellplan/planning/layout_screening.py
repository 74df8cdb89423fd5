"""Layouts: the same job in many candidate cells at once, screened for what a layout search asks first."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Schedule
from cellplan.model.presented import Presented
from cellplan.model.task.clocked_path import distinct
from cellplan.planning.collocation.batch_targets import desired_motion
from cellplan.planning.collocation.batch_tasks import BatchTasks
from cellplan.planning.collocation.solver import Collocation, NullSpaceMotion, Precision, repeated
from cellplan.planning.collocation.start_offset import settled, settling_joints
from cellplan.planning.collocation.windows import Window, windows_between
from cellplan.planning.tracking.given_path import GivenPath, GivenVelocities
from cellplan.planning.tracking.motion_task import closures

AT_ONCE: Final = 32  # candidates that are resolved together: enough for NumPy, and their arrays stay in the cache
FIRST_DEGREE: Final = 12  # of the polynomials: enough for most windows at the accuracy of a screening
WHOLE_JOB: Final = np.inf  # time at which a candidate is lost that does the whole job


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Candidates:
    """Cells that differ in base poses, tool tips and start postures only.

    Attributes:
        X_WB: Bases in the world, shape (K, robots, 4, 4).
        X_FT: Tool tips in the flange frames, shape (K, robots, 4, 4).
        start: Start postures in [rad] or [m], shape (K, nq); the tools need only be near the starts of their paths.
    """

    X_WB: Array
    X_FT: Array
    start: Array

    def __post_init__(self) -> None:
        """Check at the door that all belong together and are finite."""
        count, robots = self.X_WB.shape[:2]
        if self.X_FT.shape != (count, robots, 4, 4) or self.X_WB.shape != self.X_FT.shape or len(self.start) != count:
            raise ValueError(
                f"candidates: expected X_WB and X_FT of shape (K, robots, 4, 4) and start of shape (K, nq), "
                f"got {self.X_WB.shape}, {self.X_FT.shape} and {self.start.shape}"
            )
        if not all(np.all(np.isfinite(part)) for part in (self.X_WB, self.X_FT, self.start)):
            raise ValueError("candidates: a pose or a start posture is not finite")

    @classmethod
    def of(cls, cells: Sequence[Cell], start: Array) -> "Candidates":
        """Those of given cells with start postures, shape (K, nq)."""
        return cls(
            X_WB=np.array([[robot.X_WB for robot in cell.robots] for cell in cells]),
            X_FT=np.array([[robot.tool.X_FT for robot in cell.robots] for cell in cells]),
            start=np.asarray(start, dtype=float),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Screening(Presented):
    """What came of each candidate; figures of one that was lost hold up to that time.

    Attributes:
        start: Start postures with the tools on their paths, shape (K, nq).
        lost_at: Time in [s] at which a tool could not follow; -inf where it did not even come to its start, inf for
            candidates that did the whole job, shape (K,).
        error: Bound of the tool error at the nodes and between them, in [m] or [rad], shape (K,).
        margins: Smallest distance of each joint from its limits in [rad] or [m], negative beyond, shape (K, nq).
        speed_ratios: Largest speed of each joint as a share of its limit, shape (K, nq).
        cell: The cell whose job was screened, in which the joints have their names; None where it is not known.
    """

    start: Array
    lost_at: Array
    error: Array
    margins: Array
    speed_ratios: Array
    cell: Cell | None = None

    @classmethod
    def unknown(cls, start: Array) -> "Screening":
        """Figures of candidates of which nothing is known but their start postures, shape (K, nq)."""
        return cls(
            start=start,
            lost_at=np.full(len(start), -np.inf),
            error=np.zeros(len(start)),
            margins=np.full(start.shape, np.inf),
            speed_ratios=np.zeros(start.shape),
        )

    def joined(self, others: Sequence["Screening"]) -> "Screening":
        """These figures, then those of others."""
        names = [field.name for field in fields(self) if field.name != "cell"]
        joined = {name: np.concatenate([getattr(screening, name) for screening in (self, *others)]) for name in names}
        return Screening(**joined, cell=self.cell)

    def worst(self, other: "Screening") -> "Screening":
        """Of two runs from the same candidates, the worse figures; the start postures of the later one."""
        return Screening(
            start=other.start,
            lost_at=np.minimum(self.lost_at, other.lost_at),
            error=np.maximum(self.error, other.error),
            margins=np.minimum(self.margins, other.margins),
            speed_ratios=np.maximum(self.speed_ratios, other.speed_ratios),
        )

    @property
    def is_followed(self) -> Flags:
        """Which candidates did the whole job, shape (K,)."""
        return self.lost_at == WHOLE_JOB

    @property
    def is_feasible(self) -> Flags:
        """Which did it within all joint limits and speeds, shape (K,); nothing is known of collisions yet."""
        within = np.all(self.margins >= 0.0, axis=1) & np.all(self.speed_ratios <= 1.0, axis=1)
        return self.is_followed & within

    def __repr__(self) -> str:
        """One line without arrays."""
        followed, feasible = (int(np.count_nonzero(flags)) for flags in (self.is_followed, self.is_feasible))
        return f"<Screening of {len(self.start)} layouts: {followed} follow the paths, {feasible} within all limits>"


def screen_layouts(
    cell: Cell, schedule: Schedule, candidates: Candidates, *, moving: Sequence[str], accuracy: float = 1e-5
) -> Screening:
    """Resolve the job of a cell in many candidates for it.

    All candidates go through the same windows together; those that need finer ones leave the others for a while. The
    redundancy is resolved as in `resolve`, by the weighted pseudo-inverse with constant weights; joints that fail and
    drifts that close a cycle are left out. Start postures are brought to the paths with the part at rest, so that
    candidates keep what was chosen for the positioner.

    Args:
        accuracy: Largest tool error that is let pass, in [m] and [rad].

    Raises:
        ValueError: The candidates are not cells of these robots.
    """
    if candidates.X_WB.shape[1] != len(cell.robots) or candidates.start.shape[1] != cell.joint_count:
        raise ValueError(f"candidates: expected {len(cell.robots)} robots with {cell.joint_count} joints in all")
    screen = _Screen(cell, schedule, moving=moving, accuracy=accuracy)
    groups = [slice(first, first + AT_ONCE) for first in range(0, len(candidates.start), AT_ONCE)]
    parts = [screen.of(candidates.X_WB[group], candidates.X_FT[group], candidates.start[group]) for group in groups]
    return parts[0].joined(parts[1:]) if parts else Screening.unknown(candidates.start)


class _Screen:
    """What all candidates share."""

    def __init__(self, cell: Cell, schedule: Schedule, *, moving: Sequence[str], accuracy: float) -> None:
        """Prepare the tasks, the windows that all go through, and the limits."""
        grasps = closures(cell, moving)
        self._tasks = BatchTasks(cell, [*(path.task for path in schedule.paths), *grasps], moving)
        self._desired_at, self._accuracy = desired_motion(schedule.paths, grasps), accuracy
        self._precision = Precision(accuracy=accuracy, shortest=cell.motion.step)
        breaks, jumps = schedule.breaks, schedule.jumps
        self._at_start = self._desired_at(breaks[:1], breaks[:1], breaks[1:2])
        self._given = GivenPath.of(cell, schedule, moving)
        self._velocities = GivenVelocities.of(cell, float(schedule.times[-1]), moving)
        if self._velocities is not None:
            jumps = distinct(np.concatenate([jumps, self._velocities.knots]))
        self._windows = windows_between(jumps, whole=float(breaks[-1]), knots=breaks, highest=FIRST_DEGREE)
        self._settling = settling_joints(cell, [path.task for path in schedule.paths])
        self._limits = cell.joint_limits

    def of(self, X_WB: Array, X_FT: Array, start: Array) -> Screening:
        """Figures of one group of candidates; see `Candidates`."""
        placement = self._tasks.chains.placements(X_WB, X_FT)
        desired = repeated(self._at_start, len(start))
        if self._given is not None:
            start = start.copy()
            start[:, self._given.columns] = self._given.spline.start
        q, arrived = settled(self._tasks, desired, placement, start.T, mobile=self._settling, accuracy=self._accuracy)
        screening = Screening.unknown(q.T.copy())
        screening.lost_at[arrived] = 0.0
        null_space = None if self._velocities is None else NullSpaceMotion(drift=self._velocities.at)
        collocation = Collocation(self._tasks, self._desired_at, placement, self._precision, null_space=null_space)

        def record(window: Window, cells: Indices, nodes: Array, errors: Array) -> None:
            everywhere = np.concatenate([nodes, nodes @ window.between.T], axis=2)
            speeds = np.abs(nodes @ window.rates.T).max(axis=2).T
            lowest, highest = everywhere.min(axis=2).T, everywhere.max(axis=2).T
            margin = np.minimum(lowest - self._limits.lower, self._limits.upper - highest)
            screening.margins[cells] = np.minimum(screening.margins[cells], margin)
            screening.speed_ratios[cells] = np.maximum(screening.speed_ratios[cells], speeds / self._limits.velocity)
            screening.error[cells] = np.maximum(screening.error[cells], errors)
            screening.lost_at[cells] = window.panels[-1].end

        screening.lost_at[collocation.carry(self._windows, q, np.flatnonzero(arrived), record)] = WHOLE_JOB
        return screening
