"""Conversion of the solver's entries to settings in metres and radians."""

from collections.abc import Mapping
from typing import Final

from cellplan.io.robots.rules import configuration_in_si
from cellplan.io.schema.solver import ConfigurationGoalEntry, SecondaryEntry, SolverEntry
from cellplan.model.robot import RobotModel
from cellplan.model.solver import (
    DampedLeastSquaresSettings,
    FilteredInverseSettings,
    GoalKind,
    Integrator,
    QuadraticProgramSettings,
    SearchSettings,
    SecondaryGoal,
    SingularityMeasure,
    SolverSettings,
    WeightingSettings,
)

HALF_FEEDBACK: Final = 0.5  # gain_per_s * step_s by default: a quarter of the stability limit of Euler's steps


def build_solver(entry: SolverEntry, step: float, models: Mapping[str, RobotModel]) -> SolverSettings:
    """Method, gains and goals; the gain follows from the step in [s] when it is not given."""
    damped, filtered, search, program = (
        entry.damped_least_squares,
        entry.filtered_inverse,
        entry.search,
        entry.quadratic_program,
    )
    joints = None if search.sequence is None else tuple((joint.robot, joint.joint) for joint in search.sequence)
    return SolverSettings(
        method=entry.method,
        gain=HALF_FEEDBACK / step if entry.gain_per_s is None else entry.gain_per_s,
        damping=None if isinstance(entry.damping, str) else entry.damping,
        seed=entry.seed,
        damped_least_squares=DampedLeastSquaresSettings(
            measure=SingularityMeasure(damped.measure), region=damped.region, shapes_gain=damped.shape_gain
        ),
        filtered_inverse=FilteredInverseSettings(gain=filtered.gain_per_s, starts_at_zero=filtered.start == "zero"),
        search=SearchSettings(
            tolerance=search.tolerance_mm.si,
            orientation_weight=search.orientation_weight_m2,
            rounds=search.rounds,
            brakes=search.brakes,
            sequence=joints,
        ),
        quadratic_program=QuadraticProgramSettings(slack_weight=program.slack_weight, ramp=program.ramp_s),
        weighting=WeightingSettings(near_limits=entry.weighting.near_limits, load=entry.weighting.load),
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
