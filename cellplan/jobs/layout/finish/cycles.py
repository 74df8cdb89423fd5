"""The cycle of a layout: as the nodes have it, as short as the verified motion allows, and what that misses of both."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.jobs.fastest.time_laws import from_both_sides
from cellplan.jobs.fastest.timed_program import Law, TimedProgram, scaled_values, whole_steps
from cellplan.jobs.layout.trials.prepared import PreparedSearch, is_fastest, least_cycle
from cellplan.measures.accelerations import joint_accelerations
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress
from cellplan.model.report.report import ClearanceClass
from cellplan.runs.early_clearance import EarlyClearance
from cellplan.runs.greatest_feeds import OpenFeed, open_values
from cellplan.runs.plan.retiming import row_limits
from cellplan.runs.solution import Run
from cellplan.search.programs.layout_problem import LayoutProblem
from cellplan.search.programs.objective import CycleTiming, Objective

# [-] nodes for a row at most: differences of speeds over both steps beside one are then as rows see them
PER_ROW: Final = 1.4
EXCEEDS: Final = 0.001  # [-] share of the cycle that a joint may ask for beyond that of the nodes


def nodes_of(ready: PreparedSearch, x: Array, start: Array, fewest: int) -> int:
    """Number of nodes for the finish of a layout: twice as many as in trials, but no more than rows tell apart.

    Args:
        x: Variables, shape (n,).
        start: Start posture in [rad] or [m], shape (nq,).
    """
    problem, cycle = ready.coarse, None
    if isinstance(problem, LayoutProblem):
        cycle = least_cycle(ready, problem, x, start)
    return max(fewest, min(2 * ready.resolution.nodes - 1, round(PER_ROW * (cycle or 0.0) / ready.cell.motion.step)))


def is_scaled(ready: PreparedSearch) -> bool:
    """Whether the motion is made as fast as the limits allow as a whole."""
    is_cycle = ready.request.objective is Objective.CYCLE
    return is_cycle and ready.request.timing is CycleTiming.LAWS and ready.phases is None


def draft(
    ready: PreparedSearch, cell: Cell, cycle: float, progress: Progress, early: EarlyClearance | None = None
) -> TimedProgram:
    """The program of a layout in a cycle, or at the duration of the cell, or retimed; verified but for its clearance.

    Args:
        ready: The search.
        cell: The cell of the layout.
        cycle: Its cycle in [s], if that may change.
        progress: Called with the stage and the fraction done.
        early: Begins with its clearance at once, unless its duration may still change.
    """
    is_cycle = ready.request.objective is Objective.CYCLE
    if ready.phases is not None:
        law = Law.COMMON_SPEED if is_fastest(ready) else Law.AS_WRITTEN
        retimed: dict[str, object] = {"motion.timing": "fastest"} if is_fastest(ready) else {}
        return TimedProgram.solved(cell, law, retimed, task=None, progress=progress, early=early)
    if ready.request.timing is CycleTiming.RETIMED:
        timing: object = "fastest" if is_cycle else {"cycle_s": ready.duration}
        law = Law.COMMON_SPEED if is_cycle else Law.REDUCED_SPEED
        values = {"motion.timing": timing}
        return TimedProgram.solved(cell, law, values, task=None, progress=progress, early=early)
    if not is_cycle:
        return TimedProgram.solved(cell, Law.AS_WRITTEN, {}, task=None, progress=progress, early=early)
    return scaled(cell, whole_steps(cell, cycle / ready.duration), progress, ready.opened)


def shortest(ready: PreparedSearch, cell: Cell, program: TimedProgram, progress: Progress) -> TimedProgram:
    """The program in the shortest cycle that its limits allow, from that in another cycle; see ``draft``.

    Where feeds are sought it is that at the greatest ones.
    """
    if ready.opened:
        values = open_values(ready.opened)
        return TimedProgram.solved(cell, Law.TIME_LAWS, values, task=None, progress=progress)
    step = cell.motion.step

    def at(steps: int) -> TimedProgram:
        return scaled(cell, steps * step / ready.duration, progress)

    def required(program: TimedProgram) -> float:
        load, more = load_of(program), required_time(program)
        return max(load, more) if more > 1.0 else load

    best = from_both_sides(round(program.cycle / step), program, at, required)
    return program if best is None else best


def scaled(cell: Cell, factor: float, progress: Progress, opened: Sequence[OpenFeed] = ()) -> TimedProgram:
    """The program slower or faster by a factor, with the feeds that are sought, verified but for its clearance."""
    values = scaled_values(cell, factor, opened)
    return TimedProgram.solved(cell, Law.TIME_LAWS, values, task=None, progress=progress)


def load_of(program: TimedProgram) -> float:
    """Share of its time in which the limits of speed and acceleration of the joints would allow the same motion."""
    figures = program.figures
    velocity, acceleration = (figures.recorded(f"max_{it}_ratio") or 0.0 for it in ("velocity", "acceleration"))
    return max(velocity, acceleration**0.5)


def time_of(program: TimedProgram) -> float:
    """Cycle in [s] in which the limits of speed and acceleration of the joints allow the motion."""
    return program.cycle * load_of(program)


def required_time(program: TimedProgram) -> float:
    """How many times as long the motion must last for failed checks that a slower one passes."""
    checks = [check for run in program.solution.runs for check in run.report.checks if not check.passed]
    return max((check.kind.more_time(check.value, check.limit) for check in checks), default=1.0)


def exceeded_at(program: TimedProgram, cycle: float, span: float) -> tuple[float, ...]:
    """Times of the peaks at which joints ask for a longer cycle than the nodes do.

    Args:
        cycle: Shortest cycle at the nodes in [s].
        span: Time in [s] from the first node to the last.
    """
    times = list[float]()
    for run in program.solution.runs:
        loads = program.cycle * _loads(run)
        beyond = np.flatnonzero(loads > (1.0 + EXCEEDS) * cycle)
        pieces = np.split(beyond, np.flatnonzero(np.diff(beyond) > 1) + 1) if len(beyond) else []
        peaks = [run.motion.times[piece[loads[piece].argmax()]] for piece in pieces]
        times += _at_nodes(run, peaks, span)
    return tuple(times)


def margins_missed_at(program: TimedProgram, margin: float, span: float) -> tuple[float, ...]:
    """Times at which turning joints are nearest to their limits and nearer than ``margin`` in [rad]."""
    times = list[float]()
    for run in program.solution.runs:
        missed = [use.margin_at_s for use in run.report.joints if use.is_revolute and use.margin < margin]
        times += _at_nodes(run, missed, span)
    return tuple(times)


def distances_missed_at(program: TimedProgram, span: float, *, within_robot: bool) -> tuple[float, ...]:
    """Times at which bodies are nearest and nearer than the cell demands, of a robot's own bodies or of all others."""
    required, times = program.solution.cell.checks.clearance_mm.si, list[float]()
    for run in program.solution.runs:
        missed = [
            least.at_s
            for kind, least in run.report.clearance.minima.items()
            if (kind is ClearanceClass.SELF) == within_robot
            and least.minimum is not None
            and least.at_s is not None
            and least.minimum < required
        ]
        times += _at_nodes(run, missed, span)
    return tuple(times)


def _loads(run: Run) -> Array:
    """Share of its time in which the joints would allow the motion as it is at each row, shape (N,)."""
    scene, times = run.scene, run.motion.times
    bounds, loads = row_limits(scene, run.schedule).bounds, np.zeros(len(times))
    for robot in scene.cell.robots:
        positions, columns = run.report.q[robot.name], scene.cell.columns(robot.name)
        if not positions.shape[1]:
            continue
        speeds = np.abs(np.gradient(positions, times, axis=0)) / bounds.velocity[columns]
        accelerations = joint_accelerations(times, positions, cycle=robot.controller_cycle).values
        rates = np.sqrt(accelerations / bounds.acceleration[columns])
        loads = np.maximum(loads, np.maximum(speeds, rates).max(axis=1))
    return loads


def _at_nodes(run: Run, times: Iterable[float], span: float) -> Iterator[float]:
    """Times of a motion in [s] on the clock of the nodes."""
    nominal = run.motion.sigma
    for time in times:
        yield float(np.interp(time, run.motion.times, nominal)) * span / float(nominal[-1])
