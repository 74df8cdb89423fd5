"""Where a verified motion misses what its nodes and keys promised, on the clock of the nodes."""

from collections.abc import Iterable, Iterator
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.jobs.fastest.timed_program import TimedProgram
from cellplan.measures.accelerations import joint_accelerations
from cellplan.model.report.report import ClearanceClass
from cellplan.runs.plan.retiming import row_limits
from cellplan.runs.solution import Run

EXCEEDS: Final = 0.001  # [-] share of the cycle that a joint may ask for beyond that of the nodes


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
