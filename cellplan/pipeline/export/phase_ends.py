"""Skew across the ends of phases: one robot is in the next phase already while another one is still in the last.

What is allowed within a phase is worked out with the rows of that phase alone. A timed program goes on from phase to
phase without a wait. So at each instant T at which two phases meet, with a skew s, one robot is anywhere between T - s
and T while another is anywhere between T and T + s. All of these places are certified, in the scene of every phase that
reaches into that time: over all that may be attached to a robot, and by every rule that a pair has there. A tool is off
its place at T by no more than its own way since T - s, and what it works on by no more than its way until T + s.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.certify.free_clocks import ClockRegion, certify_regions
from cellplan.certify.lever_arms import LeverArms
from cellplan.checks.clearance.skew import stands_still
from cellplan.checks.clearance.tool_depth import tool_reach
from cellplan.checks.tools.tracking import errors_on_part, part_poses, relative_to_task_frame
from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import inverse
from cellplan.model.cell import Cell, Relation
from cellplan.model.skew import MOST_SKEW
from cellplan.model.task import Frame, Task
from cellplan.model.verified_run import VerifiedMotion, VerifiedRun
from cellplan.pipeline.export.run_programs import RunPhase, RunProgram, run_programs, scenes_of
from cellplan.scene.scene import Scene

HALVINGS: Final = 14  # of a skew, from 200 ms to 12 us; below that none is proved
PARTS: Final = 4  # stretches of each robot in which the places before and after an end are certified
Allowed = tuple[float, str]
Kept = Callable[[float], bool]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _End:
    """Where a phase ends and the next one begins."""

    program: RunProgram
    scenes: Sequence[Scene]  # scene of each motion of the run
    before: RunPhase  # the phase that ends
    after: RunPhase  # the one that begins

    @property
    def at(self) -> float:
        """Its time in [s]."""
        return float(self.program.times[self.before.last])

    @property
    def name(self) -> str:
        """In words."""
        return f"end of {self.before.name}, {self.at:.3f} s"

    def phases(self, skew: float) -> list[RunPhase]:
        """Phases that reach into the time within a skew in [s] of it."""
        times = self.program.times
        return [
            phase
            for phase in self.program.phases
            if times[phase.first] < self.at + skew and times[phase.last] > self.at - skew
        ]

    def positions(self, skew: float) -> tuple[Array, Array]:
        """Times within a skew of it in [s], and all joints there in [rad] or [m]; its own time is among them."""
        times = self.program.times
        begin, end = max(times[0], self.at - skew), min(times[-1], self.at + skew)
        inner = times[(times > begin) & (times < end)]
        at = np.unique(np.concatenate([[begin], inner, [self.at], [end]]))
        return at, np.stack([np.interp(at, times, column) for column in self.program.q.T], axis=1)


def ends_allow(run: VerifiedRun, first: str, second: str, *, most: float = MOST_SKEW) -> Allowed | None:
    """The largest skew in [s], up to one, that is proved across the ends of all phases, and the end that limits it.

    Args:
        first: A robot.
        second: One on another clock.
        most: Largest skew in [s] that is asked for.

    Returns:
        None where that largest one is allowed, or no phase follows another without a wait.
    """
    if run.cell.program is None or most <= 0.0:
        return None
    found: Allowed | None = None
    for end in _ends(run):
        for reason, is_kept in _demands(run, end, (first, second)):
            limit = most if found is None else found[0]
            own = _largest(is_kept, limit)
            if own < limit:
                found = own, f"{reason}, {end.name}"
    return found


def _ends(run: VerifiedRun) -> Iterator[_End]:
    """Ends of phases at which others begin; those of further cycles, which repeat the first, only once."""
    scenes, known = scenes_of(run), set[tuple[bytes, int, int]]()
    (program,) = run_programs(run)
    phases = [phase for phase in program.phases if phase.last > phase.first]
    for before, after in pairwise(phases):
        rows = program.q[before.first : after.last + 1].tobytes()
        steps = np.diff(program.times[before.first : after.last + 1]).round(9).tobytes()
        if (rows + steps, before.place, after.place) not in known:
            known.add((rows + steps, before.place, after.place))
            yield _End(program=program, scenes=scenes, before=before, after=after)


def _largest(is_kept: Kept, most: float) -> float:
    """The largest skew in [s] of which it is kept: the most that is asked for, or else by halving."""
    if is_kept(most):
        return most
    low, high = 0.0, most
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if is_kept(middle):
            low = middle
            if high - low <= 0.1 * high:
                break
        else:
            high = middle
    return low


def _demands(run: VerifiedRun, end: _End, pair: tuple[str, str]) -> Iterator[tuple[str, Kept]]:
    """What is demanded of two robots across an end, and whether a skew keeps it."""
    cell = run.cell
    moves = [not stands_still(end.positions(MOST_SKEW)[1][:, cell.columns(name)]) for name in pair]
    if any(moves):
        yield f"clearance of '{pair[0]}' and '{pair[1]}'", partial(_keeps_clearance, end, pair)
    for phase in (end.before, end.after):
        motion, scene = run.motions[phase.place], end.scenes[phase.place]
        for relation, limits, depth in _relations(motion, scene.cell):
            tool = _Tool(end=end, scene=scene, motion=motion, relation=relation, is_before=phase is end.before)
            if {relation.robot, tool.carrier} == set(pair):
                yield f"tool of '{relation.robot}'", partial(tool.is_kept, limits=limits, depth=depth)


def _keeps_clearance(end: _End, pair: tuple[str, str], skew: float) -> bool:
    """Whether two robots keep their distances when the one is before an end and the other after it."""
    times, q = end.positions(skew)
    before, after = (np.linspace(*span, PARTS + 1) for span in ((float(times[0]), end.at), (end.at, float(times[-1]))))
    index = partial(np.interp, xp=times, fp=np.arange(len(times), dtype=float))
    spans = [
        (before[i : i + 2], after[j : j + 2])
        for i in range(PARTS)
        for j in range(PARTS)
        if after[j] - before[i + 1] < skew
    ]
    rectangles = [index(np.concatenate(each)) for span in spans for each in (span, span[::-1])]
    region = ClockRegion(first=pair[0], second=pair[1], rectangles=np.array(rectangles))
    scenes = {phase.place: end.scenes[phase.place] for phase in end.phases(skew)}
    return all(certify_regions(scene, q, [region])[0].is_kept for scene in scenes.values())


def _relations(motion: VerifiedMotion, cell: Cell) -> Iterator[tuple[Relation, tuple[float, float], float | None]]:
    """Tasks and grasps of a phase, what is allowed of their errors, and how much deeper a tool may be in [m]."""
    depths = {depth.task: depth for depth in motion.report.depths}
    for scheduled in motion.schedule.tasks:
        task = scheduled.task
        if task.relative_to is Frame.PART:
            own = depths.get(task.name)
            yield (
                task,
                (task.tolerance.position, task.tolerance.orientation),
                None if own is None else own.limit - own.depth,
            )
    for grasp in cell.closures:
        yield grasp, (cell.checks.closure_position, cell.checks.closure_orientation), None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Tool:
    """A tool that is on the part in a phase which ends, or begins, at an end of phases."""

    end: _End
    scene: Scene  # scene of that phase
    motion: VerifiedMotion
    relation: Relation  # its task or grasp
    is_before: bool  # whether it is the phase that ends

    @property
    def carrier(self) -> str | None:
        """The robot that carries the part; None for none."""
        cell = self.scene.cell
        return None if cell.carrier is None else cell.robots[cell.carrier].name

    def is_kept(self, skew: float, *, limits: tuple[float, float], depth: float | None) -> bool:
        """Whether its error and its depth are within what is allowed when one of both robots is across the end.

        Args:
            skew: In [s].
            limits: Largest position error in [m] and orientation error in [rad].
            depth: By how much it may be deeper than on one clock in [m]; None for any depth.
        """
        position, orientation = self._error()
        reach = 0.0 if depth is None else tool_reach(self.scene.cell, self.relation.robot)
        (moved, turned), (carried, swung) = self._ways(skew)
        is_deep = depth is not None and moved + carried + reach * (turned + swung) > depth
        return position + moved + carried <= limits[0] and orientation + turned + swung <= limits[1] and not is_deep

    def _error(self) -> tuple[float, float]:
        """Errors at the end itself, on one clock, in [m] and [rad]."""
        cell, row = self.scene.cell, -1 if self.is_before else 0
        q = {name: table.q[[row]] for name, table in self.motion.tables.items()}
        X_WT = self.scene.chains[self.relation.robot].tool_poses(q[self.relation.robot])
        X_WP = part_poses(cell, self.scene.chains, q)
        if isinstance(self.relation, Task):
            schedule = next(each for each in self.motion.schedule.tasks if each.task.name == self.relation.name)
            X_PT, desired = relative_to_task_frame(self.relation, X_WT, X_WP), schedule.X_PT[[row]]
        else:
            X_PT, desired = inverse(X_WP) @ X_WT, self.relation.X_PT[None]
        error = errors_on_part(X_PT, desired, self.relation)[0]
        return float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:]))

    def _ways(self, skew: float) -> tuple[Array, Array]:
        """Ways of the tool in the world, and of the part under the tool, on either side of the end, in [m] and [rad].

        The one robot is before the end and the other one after it: of each the larger of both ways counts. In a
        step no way is longer than its chord and half of the largest second derivative. The part is seen from the tool
        as it stands at the end; by its own way the tool is elsewhere, which a turn of the part carries along.
        """
        cell, chains = self.scene.cell, self.scene.chains
        times, q = self.end.positions(skew)
        arms, at = LeverArms(self.scene, q), int(np.searchsorted(times, self.end.at))
        X_WT = chains[self.relation.robot].tool_poses(q[:, cell.columns(self.relation.robot)])
        only_part = q.copy()
        only_part[:, cell.columns(self.relation.robot)] = q[at, cell.columns(self.relation.robot)]
        X_WP = part_poses(cell, chains, {robot.name: q[:, cell.columns(robot.name)] for robot in cell.robots})
        found = []
        for poses, rows, seen_by in ((X_WT, q, None), (inverse(X_WP) @ X_WT[at], only_part, self.carrier)):
            chain, steps = arms.tool(self.relation.robot, seen_by=seen_by), arms.steps(rows)
            moved = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1) + 0.5 * chain.bend(steps)
            turned = np.sqrt(0.5) * np.linalg.norm(np.diff(poses[:, :3, :3], axis=0), axis=(1, 2))
            ways = np.stack([moved, turned + 0.5 * chain.turn_bend(steps)], axis=1)
            found.append(np.maximum(ways[:at].sum(axis=0), ways[at:].sum(axis=0)))
        tool, part = found
        part[0] += part[1] * tool[0]
        return tool, part
