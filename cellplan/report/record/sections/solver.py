"""Solver in the record of a run: the method, its settings, and the effort of its steps."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Final, TypedDict

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.motion.branches import MovedStart
from cellplan.model.motion.motion import Motion, NearestSingular
from cellplan.model.settings.solver import SolverEntry
from cellplan.model.solver import Integrator
from cellplan.model.units import DEG, MM, joint_unit
from cellplan.report.record.common import Number, entry_record, number

SLACK_UNIT: Final = "norm of the twist residual, mixed units: m/s and rad/s"


class MaximumRecord(TypedDict):
    """Largest value of all steps."""

    max: Annotated[Number, "largest value of a step"]
    max_at_s: Annotated[Number, "start of that step"]


class IterationsRecord(MaximumRecord):
    """Evaluations of the tasks per step."""

    mean: Annotated[Number, "mean over all steps"]


class SlackRecord(MaximumRecord):
    """Task slack of the steps."""

    unit: Annotated[str, "its unit as text"]


class NearestSingularRecord(TypedDict):
    """The robot closest to a singular configuration."""

    robot: Annotated[str, "robot"]
    task: Annotated[str, "its task"]
    smallest_singular_value: Annotated[Number, "smallest singular value of its own Jacobian"]
    stack_smallest_singular_value: Annotated[Number, "smallest singular value of all robots together"]
    message: Annotated[str, "both as text"]


class ResolutionRecord(TypedDict):
    """Effort of the accurate mode."""

    panels: Annotated[int, "time intervals in each of which every joint is one polynomial"]
    nodes: Annotated[int, "times at which the joints were solved for"]
    sweeps: Annotated[int, "passes over all nodes of several successive panels, summed up"]
    solves: Annotated[int, "linear systems solved"]
    error_between_nodes_mm: Annotated[
        Number, "bound of the tool error at and between the nodes, angles in milliradians; null if not evaluated"
    ]
    euler_from_s: Annotated[Number, "time from which Euler steps replaced collocation; null if never"]
    lost: Annotated[NearestSingularRecord | None, "the robot closest to a singular configuration at that time"]


class _GoalRecord(TypedDict):
    gain: Annotated[Number, "gain"]


class GoalRecord(_GoalRecord, total=False):
    """A secondary goal in the null space."""

    within_mm: Annotated[Number, "range of obstacles that are considered"]


class WeightingRecord(TypedDict):
    """Change of the joint weights along the motion; 0 keeps them constant."""

    near_limits: Annotated[Number, "near joint limits"]
    load: Annotated[Number, "with the load"]


class SequenceRecord(TypedDict):
    """A joint in the sequence of the recursive search."""

    robot: Annotated[str, "robot"]
    joint: Annotated[str, "joint"]


class SettingsRecord(TypedDict, total=False):
    """Settings of the method itself, under the keys of the cell file."""

    measure: Annotated[str, "damped least squares: measure of singularity"]
    region: Annotated[Number, "damped least squares: value of the measure below which damping begins"]
    shape_gain: Annotated[bool, "damped least squares: whether the gain is reduced with the damping"]
    gain_per_s: Annotated[Number, "filtered inverse: gain"]
    start: Annotated[str, "filtered inverse: `zero` or `inverse`"]
    slack_weight: Annotated[Number, "quadratic program: cost of slack"]
    ramp_s: Annotated[Number, "quadratic program: time to stop"]
    tolerance_mm: Annotated[Number, "searches: tolerance"]
    orientation_weight_m2: Annotated[Number, "searches: weight of the orientation error"]
    rounds: Annotated[int, "searches: largest number of passes"]
    brakes: Annotated[bool, "searches: whether steps are reduced"]
    sequence: Annotated[list[SequenceRecord] | None, "recursive search: order of the joints; null for the default"]


class MovedStartRecord(TypedDict):
    """A start that was the seed of the one that was used."""

    robot: Annotated[str, "robot"]
    task: Annotated[str, "task, or `<robot>@part` for a grasp"]
    run: Annotated[str | None, "run that the seed is from; null for a start that the cell gives"]
    tool_mm: Annotated[Number, "distance of the tool from the start of the task"]
    tool_deg: Annotated[Number, "angle of the tool to it"]
    joint: Annotated[str, "joint that was moved most"]
    joint_moved: Annotated[Number, "by how much, in `unit`"]
    unit: Annotated[str, "`deg` or `mm`"]


class SolverRecord(TypedDict):
    """How the motion was computed, under the keys of the cell file."""

    method: Annotated[str, "resolution method"]
    integrator: Annotated[str, "`accurate` or `euler`: integration of joint velocities to positions"]
    accuracy_mm: Annotated[Number, "largest tool error between nodes that `accurate` accepts"]
    gain_per_s: Annotated[Number, "gain of the pose-error feedback of Euler steps"]
    damping: Annotated[Number | str, "largest damping factor of Euler steps, or `auto`"]
    settings: Annotated[SettingsRecord, "settings of the method itself"]
    secondary: Annotated[dict[str, GoalRecord], "secondary goals in the null space, by name"]
    weighting: Annotated[WeightingRecord, "change of the joint weights"]
    iterations: Annotated[IterationsRecord | None, "evaluations of the tasks per step; null in the accurate mode"]
    slack: Annotated[SlackRecord | None, "task slack; null if the method has none"]
    resolution: Annotated[ResolutionRecord | None, "effort of the accurate mode; null without a record of it"]
    transfers: Annotated[dict[str, str] | None, "by phase: how its transfer moves were found; null without such moves"]
    moved_starts: Annotated[
        list[MovedStartRecord], "starts that were moved to their tasks: given ones, or those of a run"
    ]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlanningFacts:
    """What of a program only its planner knows."""

    motion: Motion | None = None  # the planned motion; None if it is not available, or if there are several
    transfers: Mapping[str, str] = field(default_factory=dict)  # how transfer moves were found, by phase
    moved: Sequence[MovedStart] = ()  # how far starts were moved


NOT_PLANNED: Final = PlanningFacts()


def solver_record(solver: SolverEntry, planning: PlanningFacts = NOT_PLANNED) -> SolverRecord:
    """The method with its settings under the keys of the cell file, and the effort of its steps."""
    motion = planning.motion
    return {
        "method": solver.method,
        "integrator": str(Integrator.ACCURATE if solver.is_accurate else Integrator.EULER),
        "accuracy_mm": number(solver.accuracy_mm),
        "gain_per_s": number(solver.gain),
        "damping": "auto" if solver.damping == "auto" else number(solver.damping),
        "settings": _method_settings(solver),
        "secondary": {name: entry_record(goal, without={"at"}) for name, goal in solver.secondary.goals.items()},
        "weighting": entry_record(solver.weighting),
        "iterations": None if motion is None else _iterations_record(motion),
        "slack": None if motion is None else _slack_record(motion),
        "resolution": None if motion is None else _resolution_record(motion),
        "transfers": dict(planning.transfers) or None,
        "moved_starts": [moved_start_record(start) for start in planning.moved],
    }


def moved_start_record(moved: MovedStart) -> MovedStartRecord:
    """How far one start was moved."""
    unit = joint_unit(is_revolute=moved.is_revolute)
    return {
        "robot": moved.robot,
        "task": moved.task,
        "run": moved.run or None,
        "tool_mm": number(MM * moved.position),
        "tool_deg": number(DEG * moved.orientation),
        "joint": moved.joint,
        "joint_moved": number(unit.scale * moved.moved),
        "unit": unit.name,
    }


def _method_settings(solver: SolverEntry) -> SettingsRecord:
    """Settings of the method itself; only the recursive search has a sequence."""
    match solver.method:
        case "damped_least_squares":
            damping = entry_record(solver.damped_least_squares)
        case "filtered_inverse" | "filtered_inverse_ii":
            damping = entry_record(solver.filtered_inverse)
        case "quadratic_program":
            damping = entry_record(solver.quadratic_program)
        case "heuristic_search":
            damping = entry_record(solver.search, without={"sequence"})
        case "recursive_search":
            damping = entry_record(solver.search)
        case _:
            damping = {}
    return damping


def _iterations_record(motion: Motion) -> IterationsRecord | None:
    """Evaluations of the tasks per step; None if they were not counted."""
    if motion.iterations is None:
        return None
    return {"mean": number(float(np.mean(motion.iterations))), **_largest(motion.iterations, motion.times)}


def _slack_record(motion: Motion) -> SlackRecord | None:
    """Largest task slack; None if the method has none."""
    return None if motion.slack is None else {**_largest(motion.slack, motion.times), "unit": SLACK_UNIT}


def _resolution_record(motion: Motion) -> ResolutionRecord | None:
    """Effort of the accurate mode; None without a record of it."""
    resolution = motion.resolution
    if resolution is None:
        return None
    return {
        "panels": resolution.panels,
        "nodes": resolution.nodes,
        "sweeps": resolution.sweeps,
        "solves": resolution.solves,
        "error_between_nodes_mm": number(resolution.error_between, MM),
        "euler_from_s": number(resolution.euler_from),
        "lost": None if resolution.lost is None else _lost_record(resolution.lost),
    }


def _lost_record(lost: NearestSingular) -> NearestSingularRecord:
    """The robot closest to a singular configuration where collocation failed."""
    return {
        "robot": lost.robot,
        "task": lost.task,
        "smallest_singular_value": number(lost.smallest),
        "stack_smallest_singular_value": number(lost.stack),
        "message": lost.words,
    }


def _largest(of_steps: Array, times: Array) -> MaximumRecord:
    """The largest value and the start of its step."""
    worst = int(np.argmax(of_steps))
    return {"max": number(of_steps[worst]), "max_at_s": number(times[worst])}
