"""The three cases of Vargas 2012 with his arm, gains and start postures."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from builders.planar_arms import planar_cell, tip_jacobians, tip_schedule, tips
from cellplan.geometry.transforms import Array
from cellplan.model.settings.solver import DampedLeastSquaresEntry, FilteredInverseEntry, SolverEntry
from cellplan.model.solver import MethodName
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.tracking.motion_task import MotionTask

LENGTHS: Final = (2.0, 1.0, 1.0)
DURATION: Final = 35.0
TRANSIENT: Final = 5.0  # [s] 25 times the time constant of the feedback: a start error of 2 m is below 1e-9 m


@dataclass(frozen=True, slots=True, kw_only=True)
class VargasCase:
    """Path of the tip with its velocity, start posture and gain of the filter."""

    point: Callable[[Array], Array]
    velocity: Callable[[Array], Array]
    start: Array
    gain: float


CASES: Final[Mapping[str, VargasCase]] = {
    "I": VargasCase(
        point=lambda t: np.stack([2.0 + 0.5 * np.sin(0.4 * t), 0.5 * np.cos(0.2 * t)], axis=1),
        velocity=lambda t: np.stack([0.2 * np.cos(0.4 * t), -0.1 * np.sin(0.2 * t)], axis=1),
        start=np.array([-np.pi / 8, np.pi / 3, np.pi / 3]),
        gain=25.0,
    ),
    "II": VargasCase(
        point=lambda t: np.stack([1.1 + np.sin(0.2 * t), 0.35 * np.cos(0.2 * t)], axis=1),
        velocity=lambda t: np.stack([0.2 * np.cos(0.2 * t), -0.07 * np.sin(0.2 * t)], axis=1),
        start=np.array([-np.pi / 4, np.pi / 3, np.pi / 3]),
        gain=25.0,
    ),
    "III": VargasCase(
        point=lambda t: np.stack([2.0 - 0.1 * t, 2.0 - 0.1 * t], axis=1),
        velocity=lambda t: np.full((len(t), 2), -0.1),
        start=np.array([-np.pi / 4, np.pi / 3, np.pi / 3]),
        gain=100.0,
    ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class VargasRun:
    """Instants, joint angles, distance of the tip from its path, manipulability and largest joint speed."""

    times: Array
    q: Array
    error: Array
    manipulability: Array
    speed: float


def vargas_run(name: str, method: MethodName, step: float) -> VargasRun:
    """One case by one method."""
    case = CASES[name]
    solver = SolverEntry(
        integrator="euler",
        method=method,
        gain_per_s=5.0,
        damping=0.3,
        seed=0,
        damped_least_squares=DampedLeastSquaresEntry(measure="manipulability", region=1.0),
        filtered_inverse=FilteredInverseEntry(gain_per_s=case.gain, start="zero"),
    )
    cell = planar_cell(LENGTHS, solver, settle=DURATION)
    schedule = tip_schedule(cell, case.point, velocity=case.velocity, duration=DURATION, step=step)
    motion = integrate_schedule(MotionTask(cell, schedule, ["arm"], case.start))
    J = tip_jacobians(LENGTHS, motion.q)
    return VargasRun(
        times=motion.times,
        q=motion.q,
        error=np.linalg.norm(case.point(motion.times) - tips(LENGTHS, motion.q), axis=1),
        manipulability=np.sqrt(np.linalg.det(J @ np.swapaxes(J, 1, 2))),
        speed=float(np.max(np.abs(np.diff(motion.q, axis=0)))) / step,
    )
