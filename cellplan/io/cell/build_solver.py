"""Conversion of the solver's entries to settings in metres and radians."""

from collections.abc import Mapping
from typing import Final

from cellplan.io.robots.rules import configuration_in_si
from cellplan.io.schema.solver import ConfigurationGoalEntry, SecondaryEntry, SolverEntry
from cellplan.model.robot import RobotModel
from cellplan.model.solver import GoalKind, Integrator, SecondaryGoal, SolverSettings

HALF_FEEDBACK: Final = 0.5  # gain_per_s * step_s by default: a quarter of the stability limit of Euler's steps


def build_solver(entry: SolverEntry, step: float, models: Mapping[str, RobotModel]) -> SolverSettings:
    """Method, gains and goals; the gain follows from the step in [s] when it is not given."""
    return SolverSettings(
        method=entry.method,
        gain=HALF_FEEDBACK / step if entry.gain_per_s is None else entry.gain_per_s,
        damping=None if isinstance(entry.damping, str) else entry.damping,
        seed=entry.seed,
        damped_least_squares=entry.damped_least_squares,
        filtered_inverse=entry.filtered_inverse,
        search=entry.search,
        quadratic_program=entry.quadratic_program,
        weighting=entry.weighting,
        goals=_goals(entry.secondary, models),
        integrator=None if entry.integrator == "auto" else Integrator(entry.integrator),
        accuracy=entry.accuracy_mm.si,
    )


def _goals(entry: SecondaryEntry, models: Mapping[str, RobotModel]) -> tuple[SecondaryGoal, ...]:
    """The goals that are given, in the order of the format."""
    goals: list[SecondaryGoal] = []
    if entry.manipulability is not None:
        goals.append(SecondaryGoal(kind=GoalKind.MANIPULABILITY, gain=entry.manipulability.gain))
    if entry.joint_limits is not None:
        goals.append(SecondaryGoal(kind=GoalKind.JOINT_LIMITS, gain=entry.joint_limits.gain))
    if entry.obstacles is not None:
        near = entry.obstacles
        goals.append(SecondaryGoal(kind=GoalKind.OBSTACLES, gain=near.gain, within=near.within_mm.si))
    if entry.posture is not None:
        goals.append(_configuration_goal(entry.posture, models))
    return tuple(goals)


def _configuration_goal(entry: ConfigurationGoalEntry, models: Mapping[str, RobotModel]) -> SecondaryGoal:
    """A desired configuration in [rad] and [m]."""
    configurations = {robot: configuration_in_si(models[robot], given) for robot, given in entry.at.items()}
    return SecondaryGoal(kind=GoalKind.POSTURE, gain=entry.gain, configurations=configurations)
