"""Where the tools, further holders and bodies of a played program are: against all that its cell demands of them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final, NamedTuple, TypeVar

import numpy as np

from cellplan.certify.bound import Bound
from cellplan.certify.certify import certify
from cellplan.certify.lever_arms import LeverArms
from cellplan.certify.run_pairs import scene_of_rows, scene_of_run
from cellplan.checks.clearance.mounting import check_mounting
from cellplan.checks.clearance.tool_depth import check_depths
from cellplan.checks.joints.locked import check_locked, with_locked_joints
from cellplan.checks.tools.between_checks import (
    check_between_rows,
    check_closures_between,
    check_task_between,
    with_between,
)
from cellplan.checks.tools.tracking import check_accuracy, check_closure
from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.measures.tool_depth import task_depth, tool_reach
from cellplan.measures.tool_errors import closure_accuracy, part_poses, relative_to_task_frame, task_accuracy
from cellplan.model.cell.cell import Relation, stacked_positions
from cellplan.model.motion.motion import Clock, Schedule, TaskSchedule
from cellplan.model.report.report import Check, ClosureAccuracy, TaskAccuracy, ToolDepth
from cellplan.model.task.task import Frame, Task
from cellplan.model.units import MM
from cellplan.programs.rows.margins import (
    all_corners,
    in_steps,
    movers_of,
    off_chords,
    raised,
    tool_corners,
    tool_margins,
    tubes_at,
)
from cellplan.programs.rows.played import ExecutedProgram, ExecutedStretch
from cellplan.programs.shared import Shared, motion_digest
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

LOOKED_AT: Final = 400  # rows of a motion at which pairs are looked for that may be too near

Errors = TypeVar("Errors", TaskAccuracy, ClosureAccuracy)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathRows:
    """Joint positions of a phase, straight between times."""

    shared: Shared  # what exports of the run share
    place: int  # place of the phase among the motions of the run
    schedule: Schedule  # desired tool poses at the rows of the run
    times: Array  # times in [s] on the phase's own time, shape (M,)
    q: Mapping[str, Array]  # positions of all robots there in [rad] or [m], shape (M, n), by robot
    is_row: Flags  # which of them are rows of the run, where what the cell demands of rows holds, shape (M,)
    is_break: Flags  # which of them are needed, the joints being straight between these already, shape (M,)
    off: Array  # how far each joint may be from the straight motion by itself in each step, shape (M - 1, nq)
    # how far all joints may be off together at each time by rounding, with sign, shape (M, nq); see
    # ``margins.corners_at``
    corners: Array
    # how far tools and joints may be from straight motion on seams in each step, shape (M - 1, 4 + n), by robot; see
    # ``margins.tubes_at``
    tubes: Mapping[str, Array] = field(default_factory=dict)

    @property
    def scene(self) -> Scene:
        """The cell as it is in the phase."""
        return self.shared.scenes[self.place]

    @property
    def stacked(self) -> Array:
        """Positions of all robots, shape (M, nq)."""
        return stacked_positions(self.scene.cell, self.q)

    @property
    def is_off(self) -> bool:
        """Whether joints may be off the straight motion at all."""
        return bool(self.tubes or np.any(self.off) or np.any(self.corners))

    @property
    def joints_off(self) -> Array:
        """How far all joints may be off in each step, in [rad] or [m], shape (M - 1, nq)."""
        off = self.off + in_steps(self.corners)
        for name, tube in self.tubes.items():
            off[:, self.scene.cell.columns(name)] += tube[:, 4:]
        return off

    @property
    def tips_off(self) -> dict[str, Array]:
        """How far tips of tools may be in each step in [m] and turned in [rad], shape (M - 1, 2), by robot.

        Infinite where it follows from the joints alone.
        """
        is_off = self.off + in_steps(self.corners) > 0.0
        columns = {name: self.scene.cell.columns(name) for name in self.tubes}
        return {
            name: np.where(np.any(is_off[:, columns[name]], axis=1)[:, None], np.inf, tube[:, 2:4])
            for name, tube in self.tubes.items()
        }

    def tool_off(self, relation: Relation) -> Array:
        """By how much a tool may be off on the part at each time in [m], and turned in [rad], shape (M, 2).

        Between two times it is no more than the value between both values.
        """
        deviations = np.zeros((len(self.times), 2))
        if not self.is_off:
            return deviations
        if relation.robot in self.tubes:
            steps = np.pad(self.tubes[relation.robot][:, :2], ((1, 1), (0, 0)))
            deviations += np.maximum(steps[:-1], steps[1:])
        if not (np.any(self.off) or np.any(self.corners)):
            return deviations
        arms = LeverArms(self.scene, self.stacked)
        if np.any(self.off):
            steps = np.pad(tool_margins(arms, self.scene, relation, self.off), ((1, 1), (0, 0)))
            deviations += np.maximum(steps[:-1], steps[1:])
        return deviations + tool_corners(arms, self.scene, relation, self.stacked, self.corners)

    def depth_off(self, task: Task) -> Array:
        """By how much deeper a tool may be for it at each time in [m], shape (M,): as far as any point of it moves."""
        off = self.tool_off(task)
        return off[:, 0] + tool_reach(self.scene.cell, task.robot) * off[:, 1]


def path_rows(played: ExecutedProgram, stretch: ExecutedStretch, shared: Shared) -> PathRows:
    """The path of a program in one of its phases."""
    times = played.grid(stretch.begin, stretch.end, with_corners=True)
    return PathRows(
        shared=shared,
        place=stretch.place,
        schedule=stretch.motion.schedule,
        times=times - stretch.begin,
        q=played.at(times),
        is_row=played.is_row(times),
        is_break=played.is_break(times),
        off=off_chords(played, times),
        corners=all_corners(played, times),
        tubes=tubes_at(played, times),
    )


def path_findings(rows: PathRows) -> Iterator[str]:
    """What the cell demands of the places of tools, holders and bodies, and the rows do not keep."""
    for check in _checks(rows):
        if not check.passed:
            yield check.message
    yield from (_on_seam(rows, finding) for finding in clearance_findings(rows))


def keeps_tools(rows: PathRows) -> bool:
    """Whether tools and further holders are where they have to be."""
    return all(check.passed for check in _checks(rows))


def keeps_clearance(rows: PathRows) -> bool:
    """Whether bodies keep the distances that are demanded of them."""
    scene = _demanding(rows)
    return certify(scene, rows.stacked[rows.is_break], with_minimum=False).is_met


def _checks(rows: PathRows) -> list[Check]:
    """Tool errors at the rows and between them, depth, further holders, locked joints and mounted bodies."""
    scene, cell, q = rows.scene, rows.scene.cell, rows.q
    schedule = relaxed(schedule_at(rows.schedule, rows.times))
    tools = [rows.tool_off(scheduled.task) for scheduled in schedule.tasks]
    holders = [rows.tool_off(grasp) for grasp in cell.closures]
    X_WP = part_poses(cell, scene.chains, q)
    accuracy = tuple(
        task_accuracy(task, scene.chains[task.task.robot], q=q[task.task.robot], X_WP=X_WP) for task in schedule.tasks
    )
    closures = closure_accuracy(cell, scene.chains, q, X_WP)
    strict_accuracy = accuracy
    accuracy, closures = check_between_rows(
        scene, schedule, q, accuracy=accuracy, closures=closures, off=[*tools, *holders]
    )
    accuracy = tuple(with_off(errors, off) for errors, off in zip(accuracy, tools, strict=True))
    closures = tuple(with_off(errors, off) for errors, off in zip(closures, holders, strict=True))
    checks: list[Check] = []
    for scheduled, given, errors, plain in zip(
        schedule.tasks, rows.schedule.tasks, accuracy, strict_accuracy, strict=True
    ):
        tolerance = scheduled.task.tolerance
        accuracy_checks = with_between(
            check_accuracy(schedule, errors, scheduled.task), check_task_between(errors, tolerance)
        )
        strict = _at_rows(rows, given, plain) if all(check.passed for check in accuracy_checks) else ()
        both = [*accuracy_checks, *strict]
        checks += with_locked_joints(both, errors, tolerance, times=schedule.times, locked=cell.motion.locked)
    checks += with_between(check_closure(cell, schedule.times, closures), check_closures_between(cell, closures))
    checks += check_depths(cell, _depths(rows))
    checks += check_locked(cell, schedule.times, q)
    checks += check_mounting(scene, stacked_positions(cell, q), schedule.times)
    return checks


def relaxed(schedule: Schedule) -> Schedule:
    """The schedule with what is allowed between rows everywhere."""
    tasks = []
    for scheduled in schedule.tasks:
        tolerance = scheduled.task.tolerance
        allowed = tolerance.changed(
            position_mm=tolerance.between_rows_mm or tolerance.position_mm,
            orientation_deg=tolerance.between_rows_deg or tolerance.orientation_deg,
        )
        tasks.append(replace(scheduled, task=replace(scheduled.task, tolerance=allowed)))
    return replace(schedule, tasks=tuple(tasks))


def with_off(errors: Errors, off: Array) -> Errors:
    """Errors at times that are as much larger as the tool may be off there, shape (M, 2)."""
    position, orientation = (
        _longer(vectors, off[:, kind]) for kind, vectors in enumerate((errors.position_error, errors.orientation_error))
    )
    return replace(errors, position_error=position, orientation_error=orientation)


def _longer(vectors: Array, by: Array) -> Array:
    """Vectors of shape (M, 3) that are longer by something, shape (M,); those without a length along the first axis."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    along = np.where(lengths > 0.0, vectors / np.maximum(lengths, np.finfo(float).tiny), np.eye(3)[0])
    return vectors + by[:, None] * along


def straight_depths(rows: PathRows) -> Iterator[tuple[Task, ToolDepth]]:
    """Depth of the tool of each task on the part in straight motion, once for the same motion of tool and part."""
    is_needed, scene = rows.is_row | rows.is_break, rows.scene
    times = rows.times[is_needed]
    for task in (scheduled.task for scheduled in rows.schedule.tasks if scheduled.task.relative_to is Frame.PART):
        q = {name: rows.q[name][is_needed] for name in sorted(movers_of(scene, task))}
        evaluate = partial(task_depth, scene.cell, task, times, chains=scene.chains, q=q)
        yield task, rows.shared.once((rows.place, task.name, motion_digest(times, *q.values())), evaluate)


def _depths(rows: PathRows) -> tuple[ToolDepth, ...]:
    """The largest depth of the tool of each task, with what it may be deeper by rounding."""
    depths = straight_depths(rows)
    return tuple(replace(depth, depth=depth.depth + float(rows.depth_off(task).max())) for task, depth in depths)


def _at_rows(rows: PathRows, given: TaskSchedule, errors: TaskAccuracy) -> tuple[Check, ...]:
    """Errors at the rows of the run, where the cell demands more of them than of what lies between."""
    task: Task = given.task
    tolerance = task.tolerance
    if tolerance.between == (tolerance.position_mm.si, tolerance.orientation_deg.si) or not np.any(rows.is_row):
        return ()
    at_rows = replace(
        errors,
        position_error=np.where(rows.is_row[:, None], errors.position_error, 0.0),
        orientation_error=np.where(rows.is_row[:, None], errors.orientation_error, 0.0),
    )
    return check_accuracy(replace(rows.schedule, times=rows.times), at_rows, task)


class ClearanceFinding(NamedTuple):
    """Two bodies that do not keep their distance."""

    text: str  # what is said of them
    robots: frozenset[str | None]  # which robots carry them
    at_s: float  # when they come too near, in [s] from the beginning of the phase


def clearance_findings(rows: PathRows) -> tuple[ClearanceFinding, ...]:
    """The pairs of bodies that touch or are not proved to keep their distance, with what of it rounding takes.

    The same motion is judged once.
    """
    tubes = (rows.tubes[name] for name in sorted(rows.tubes))
    motion = motion_digest(
        rows.times, rows.stacked, rows.times[rows.is_break], rows.off, rows.corners, *tubes, is_exact=True
    )
    return rows.shared.once(("clearance", rows.place, motion), lambda: tuple(_clearance_findings(rows)))


def _clearance_findings(rows: PathRows) -> Iterator[ClearanceFinding]:
    """See ``clearance_findings``."""
    scene = _demanding(rows)
    q = stacked_positions(scene.cell, rows.q)[rows.is_break]
    verdict = certify(scene, q, with_minimum=False)
    if verdict.is_met:
        return
    suspects = _suspects(scene, q, verdict)
    bound = certify(scene_of_rows(scene, suspects), q, with_curves=False)  # the verdict ended at its first fault
    for pair in bound.pairs:
        if pair.is_met:
            continue
        first, second = bound.names(pair)
        if pair.touches:
            sample, proof = min(pair.touches), "touch"
        elif np.isfinite(pair.distance) and pair.distance < pair.demand:
            sample, proof = pair.at, f"come as near as {MM * pair.distance:.4g} mm or nearer"
        else:
            begin, proof = bound.edges[np.argmin(pair.low)], f"are proved to keep {MM * pair.proved:.4g} mm only"
            sample = min((at for at in pair.unproved if at >= begin), default=pair.at)
        at_s = float(np.interp(sample, np.arange(rows.is_break.sum()), rows.times[rows.is_break]))
        usual = rows.scene.pairs[suspects[pair.row]]
        added = pair.demand - (usual.demand if usual.rule is Rule.CLEARANCE else 0.0)
        wide, cure = "", "let them pass farther apart"
        if rows.is_off and added > 0.0:
            why = (
                "corners, weave and sensors on seams, and for rounding"
                if rows.tubes
                else "what rows may be off by rounding"
            )
            wide = f", {MM * added:.2g} mm of it for {why}"
            cure = f"leave out less (--thin-mm, --thin-deg), so that rounding takes less, or {cure}"
        demanded = f"demanded {MM * pair.demand:.4g} mm{wide}"
        text = f"clearance: {first} and {second} {proof}, at {at_s:.3f} s, {demanded}; {cure}"
        bodies = (rows.scene.bodies[index] for index in (usual.first, usual.second))
        yield ClearanceFinding(text, frozenset(body.robot for body in bodies), at_s)


def _on_seam(rows: PathRows, finding: ClearanceFinding) -> str:
    """What is said of two bodies, with task and place on its seam where a tool of theirs is on one."""
    tasks = (scheduled.task for scheduled in rows.schedule.tasks if scheduled.task.robot in finding.robots)
    places = ((task.name, place_on_seam(rows, task, finding.at_s)) for task in tasks)
    return next((f"task '{name}', {place}{finding.text}" for name, place in places if place), finding.text)


def place_on_seam(rows: PathRows, task: Task, at_s: float) -> str:
    """Where on its seam a tool is at a time in [s] of the phase, for the beginning of a message; empty beside it."""
    steps = line_steps(rows, task)
    step = int(np.searchsorted(rows.times, at_s, side="right")) - 1
    if not len(steps) or not steps[0] <= step <= steps[-1] + 1:
        return ""
    q = {name: positions[steps[0] : step + 1] for name, positions in rows.q.items()}
    X_WP = part_poses(rows.scene.cell, rows.scene.chains, q)
    X_PT = relative_to_task_frame(task, rows.scene.chains[task.robot].tool_poses(q[task.robot]), X_WP)
    return f"{MM * np.linalg.norm(np.diff(X_PT[:, :3, 3], axis=0), axis=1).sum():.1f} mm along its seam: "


def line_width(rows: PathRows, task: Task, at_s: float | None = None) -> float:
    """How far joints are off at most while a tool is on lines, in [rad] or [m], or at a time of the phase in [s]."""
    widths = rows.tubes[task.robot][:, 4:].max(axis=1, initial=0.0)
    step = slice(None) if at_s is None else min(int(np.searchsorted(rows.times, at_s, side="right")), len(widths)) - 1
    return float(np.max(widths[step]))


def line_steps(rows: PathRows, task: Task) -> Indices:
    """Steps in which the tool of a task is on a line or an arc; none where it moves by joints."""
    tube = rows.tubes.get(task.robot)
    return np.flatnonzero(np.zeros(0) if tube is None else np.any(tube > 0.0, axis=1))


def _suspects(scene: Scene, q: Array, verdict: Bound) -> list[int]:
    """Pairs that the verdict on a motion found at fault, and those that are too near in some of its rows."""
    demands = np.array([pair.least_distance for pair in scene.pairs])
    near = scene.near(q[:: max(1, len(q) // LOOKED_AT)], float(demands.max(initial=0.0)))
    at_fault = [row for row, it in enumerate(verdict.states) if it.touches or it.unproved or it.distance < it.demand]
    return sorted({*at_fault, *near.rows[near.distances < demands[near.rows]].tolist()})


def _demanding(rows: PathRows) -> Scene:
    """The scene of a phase whose pairs are to keep what joints may be off besides their clearance."""
    scene = scene_of_run(rows.scene, [scheduled.task.name for scheduled in rows.schedule.tasks])
    if not rows.is_off:
        return scene
    return raised(LeverArms(scene, rows.stacked), scene, rows.joints_off, rows.tips_off)


def schedule_at(schedule: Schedule, times: Array) -> Schedule:
    """The same tasks at other times of the same phase, from the paths that are known at any time.

    Times after the end of the phase have the poses of its end.

    Times are in [s], increasing from 0, shape (M,), M at least 2.
    """
    if not schedule.is_continuous:
        raise ValueError("schedule: expected paths that are known between the rows of a run too")
    inside = np.minimum(times, schedule.times[-1])
    nominal = inside if schedule.clock is None else schedule.clock.at(inside)
    rate = np.gradient(nominal, times)[:, None]
    clock = None if schedule.clock is None else Clock(times=times, sigma=nominal)
    tasks = []
    for task, path, X_PT in zip(schedule.tasks, schedule.paths, schedule.poses(inside), strict=True):
        _, V_PT_P, travelled = path.targets(nominal)
        tasks.append(replace(task, X_PT=X_PT, V_PT_P=rate * V_PT_P, travelled=travelled))
    return replace(schedule, times=times, tasks=tuple(tasks), clock=clock)
