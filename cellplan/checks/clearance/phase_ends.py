"""Skew across the ends of phases: one robot is in the next phase already while another one is still in the last.

What is allowed within a phase is worked out with the rows of that phase alone. A timed program goes on from phase to
phase without a wait. So at each instant T at which two phases meet, with a skew s, one robot is anywhere between T - s
and T while another is anywhere between T and T + s. All of these places are certified, in the scene of every phase that
reaches into that time: over all that may be attached to a robot, and by every rule that a pair has there. A tool is off
its place at T by no more than its own way since T - s, and what it works on by no more than its way until T + s.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.certify.free_clocks.free_clocks import ClockRegion, certify_regions
from cellplan.certify.lever_arms import LeverArms
from cellplan.certify.run_pairs import scene_of_run
from cellplan.checks.clearance.skew import stands_still
from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import inverse
from cellplan.measures.tool_depth import tool_reach
from cellplan.measures.tool_errors import errors_on_part, part_poses, relative_to_task_frame
from cellplan.model.cell.cell import Cell, Relation, stacked_positions
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.report import Report
from cellplan.model.report.skew import MOST_SKEW, AllowedSkew, PairSkew, SkewLimit
from cellplan.model.task.task import Frame, Task
from cellplan.scene.scene import Scene

HALVINGS: Final = 14  # of a skew, from 200 ms to 12 us; below that none is proved
PARTS: Final = 4  # stretches of each robot in which the places before and after an end are certified
Predicate = Callable[[float], bool]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JudgedPhase:
    """A phase of a program with what was judged of it."""

    scene: Scene  # its scene, with all tools at work
    schedule: Schedule  # desired tool poses
    report: Report  # the checks of its rows, on its own time


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Placed:
    """A phase on the clock of the program."""

    place: int  # its number in the first cycle
    scene: Scene  # its scene, in which the tools of idle robots keep away from the part
    schedule: Schedule
    report: Report
    begin: float  # time of its first row in [s]

    @property
    def end(self) -> float:
        """Time of its last row in [s]."""
        return self.begin + float(self.report.times[-1])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _End:
    """Where a phase ends and the next one begins."""

    phases: Sequence[_Placed]  # all phases of the program
    times: Array  # times of its rows in [s], shape (N,)
    q: Array  # stacked joint positions in [rad] or [m], shape (N, nq)
    before: _Placed  # the phase that ends
    after: _Placed  # the one that begins

    @property
    def at(self) -> float:
        """Its time in [s]."""
        return self.after.begin

    def reached(self, skew: float) -> list[_Placed]:
        """Phases that reach into the time within a skew in [s] of it."""
        return [phase for phase in self.phases if phase.begin < self.at + skew and phase.end > self.at - skew]

    def positions(self, skew: float) -> tuple[Array, Array]:
        """Times within a skew of it in [s], and all joints there in [rad] or [m]; its own time is among them."""
        times = self.times
        begin, end = max(times[0], self.at - skew), min(times[-1], self.at + skew)
        inner = times[(times > begin) & (times < end)]
        at = np.unique(np.concatenate([[begin], inner, [self.at], [end]]))
        return at, np.stack([np.interp(at, times, column) for column in self.q.T], axis=1)


def with_phase_ends(cell: Cell, phases: Sequence[JudgedPhase]) -> list[Report]:
    """The reports of a program from home to home, with what the end of each phase allows of the skew of its clocks.

    It stands with the limits of the phase that ends, where it allows less than the phase itself.

    Args:
        cell: The cell of the whole program; reports of any other program stay as they are.
    """
    reports = [phase.report for phase in phases]
    if not cell.program.is_home_to_home or any(report.skew is None for report in reports):
        return reports
    for end in _ends(cell, phases):
        report = reports[end.before.place]
        if report.skew is not None:
            pairs = tuple(_across(end, pair) for pair in report.skew.pairs)
            reports[end.before.place] = replace(report, skew=replace(report.skew, pairs=pairs))
    return reports


def _ends(cell: Cell, phases: Sequence[JudgedPhase]) -> Iterator[_End]:
    """Ends of phases at which others begin; those of further cycles only if something else is played around them."""
    placed, rows = list[_Placed](), list[tuple[Array, Array]]()
    begin, cycles = 0.0, min(cell.program.cycles, 3)  # a third repeats the second
    for place, phase in list(enumerate(phases)) * cycles:
        report = phase.report
        if len(report.times) > 1:
            scene = scene_of_run(phase.scene, [scheduled.task.name for scheduled in phase.schedule.tasks])
            placed.append(_Placed(place=place, scene=scene, schedule=phase.schedule, report=report, begin=begin))
            rows.append((begin + report.times[:-1], stacked_positions(cell, report.q)[:-1]))
            begin = placed[-1].end
    last = stacked_positions(cell, placed[-1].report.q)[-1:]
    times, q = (np.concatenate(parts) for parts in zip(*rows, (np.array([begin]), last), strict=True))
    known = set[tuple[bytes, tuple[int, ...]]]()
    for before, after in pairwise(placed):
        end = _End(phases=placed, times=times, q=q, before=before, after=after)
        at, around = end.positions(MOST_SKEW)
        played = around.tobytes() + (at - end.at).round(9).tobytes()
        key = (played, tuple(phase.place for phase in end.reached(MOST_SKEW)))
        if key not in known:
            known.add(key)
            yield end


def _across(end: _End, pair: PairSkew) -> PairSkew:
    """A pair with what an end allows, where that is less than what is known."""
    for subject, is_met in _demands(end, (pair.first, pair.second)):
        skew = _largest(is_met, pair.allowed)
        if skew < pair.allowed:
            time = float(end.before.report.times[-1])
            limit = AllowedSkew(limit=SkewLimit.END, skew=skew, subject=subject, at_s=time)
            pair = replace(pair, limits=(*pair.limits, limit))
    return pair


def _largest(is_met: Predicate, most: float) -> float:
    """The largest skew in [s] up to the most of which it is kept, by halving."""
    if most <= 0.0 or is_met(most):
        return most
    low, high = 0.0, most
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if is_met(middle):
            low = middle
            if high - low <= 0.1 * high:
                break
        else:
            high = middle
    return low


def _demands(end: _End, pair: tuple[str, str]) -> Iterator[tuple[str, Predicate]]:
    """What is demanded of two robots across an end, and whether a skew keeps it."""
    cell = end.before.scene.cell
    moves = [not stands_still(end.positions(MOST_SKEW)[1][:, cell.columns(name)]) for name in pair]
    if any(moves):
        yield f"clearance of {pair[0]} and {pair[1]}", partial(_keeps_clearance, end, pair)
    for phase in (end.before, end.after):
        for relation, limits, depth in _relations(phase):
            tool = _ReachingTool(end=end, phase=phase, relation=relation, is_before=phase is end.before)
            if {relation.robot, tool.carrier} == set(pair):
                yield f"tool of {relation.robot}", partial(tool.is_met, limits=limits, depth=depth)


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
    rectangles = [index(np.concatenate(ordered)) for span in spans for ordered in (span, span[::-1])]
    region = ClockRegion(first=pair[0], second=pair[1], rectangles=np.array(rectangles))
    scenes = {phase.place: phase.scene for phase in end.reached(skew)}
    return all(certify_regions(scene, q, [region])[0].is_met for scene in scenes.values())


def _relations(phase: _Placed) -> Iterator[tuple[Relation, tuple[float, float], float | None]]:
    """Tasks and grasps of a phase, what is allowed of their errors, and how much deeper a tool may be in [m]."""
    depths = {depth.task: depth for depth in phase.report.depths}
    for scheduled in phase.schedule.tasks:
        task = scheduled.task
        if task.relative_to is Frame.PART:
            depth = depths.get(task.name)
            yield (
                task,
                (task.tolerance.position_mm.si, task.tolerance.orientation_deg.si),
                None if depth is None else depth.limit - depth.depth,
            )
    cell = phase.scene.cell
    for grasp in cell.closures:
        yield grasp, (cell.checks.closure_mm.si, cell.checks.closure_deg.si), None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _ReachingTool:
    """A tool that is on the part in a phase which ends, or begins, at an end of phases."""

    end: _End
    phase: _Placed  # that phase
    relation: Relation  # its task or grasp
    is_before: bool  # whether it is the phase that ends

    @property
    def carrier(self) -> str | None:
        """The robot that carries the part; None for none."""
        cell = self.phase.scene.cell
        return None if cell.carrier is None else cell.robots[cell.carrier].name

    def is_met(self, skew: float, *, limits: tuple[float, float], depth: float | None) -> bool:
        """Whether its error and its depth are within what is allowed when one of both robots is across the end.

        Args:
            skew: In [s].
            limits: Largest position error in [m] and orientation error in [rad].
            depth: By how much it may be deeper than on one clock in [m]; None for any depth.
        """
        position, orientation = self._error()
        reach = 0.0 if depth is None else tool_reach(self.phase.scene.cell, self.relation.robot)
        (moved, turned), (carried, swung) = self._travels(skew)
        is_deep = depth is not None and moved + carried + reach * (turned + swung) > depth
        return position + moved + carried <= limits[0] and orientation + turned + swung <= limits[1] and not is_deep

    def _error(self) -> tuple[float, float]:
        """Errors at the end itself, on one clock, in [m] and [rad]."""
        cell, row = self.phase.scene.cell, -1 if self.is_before else 0
        q = {name: rows[[row]] for name, rows in self.phase.report.q.items()}
        X_WT = self.phase.scene.chains[self.relation.robot].tool_poses(q[self.relation.robot])
        X_WP = part_poses(cell, self.phase.scene.chains, q)
        if isinstance(self.relation, Task):
            schedule = next(task for task in self.phase.schedule.tasks if task.task.name == self.relation.name)
            desired = schedule.X_PT[[row]]
        else:
            desired = self.relation.X_PT[None]
        error = errors_on_part(relative_to_task_frame(self.relation, X_WT, X_WP), desired, self.relation)[0]
        return float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:]))

    def _travels(self, skew: float) -> tuple[Array, Array]:
        """Ways of the tool in the world, and of the part under the tool, on either side of the end, in [m] and [rad].

        The one robot is before the end and the other one after it: of each the larger of both ways counts. In a
        step no way is longer than its chord and half of the largest second derivative. The part is seen from the tool
        as it stands at the end; by its own way the tool is elsewhere, which a turn of the part carries along.
        """
        cell, chains = self.phase.scene.cell, self.phase.scene.chains
        times, q = self.end.positions(skew)
        arms, at = LeverArms(self.phase.scene, q), int(np.searchsorted(times, self.end.at))
        X_WT = chains[self.relation.robot].tool_poses(q[:, cell.columns(self.relation.robot)])
        only_part = q.copy()
        only_part[:, cell.columns(self.relation.robot)] = q[at, cell.columns(self.relation.robot)]
        X_WP = part_poses(cell, chains, {robot.name: q[:, cell.columns(robot.name)] for robot in cell.robots})
        paths = []
        for poses, rows, seen_by in ((X_WT, q, None), (inverse(X_WP) @ X_WT[at], only_part, self.carrier)):
            chain, steps = arms.tool(self.relation.robot, seen_by=seen_by), arms.steps(rows)
            moved = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1) + 0.5 * chain.bend(steps)
            turned = np.sqrt(0.5) * np.linalg.norm(np.diff(poses[:, :3, :3], axis=0), axis=(1, 2))
            travels = np.stack([moved, turned + 0.5 * chain.turn_bend(steps)], axis=1)
            paths.append(np.maximum(travels[:at].sum(axis=0), travels[at:].sum(axis=0)))
        tool, part = paths
        part[0] += part[1] * tool[0]
        return tool, part
