"""How a motion was found: the method, the settings it used, and what its steps took."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.motion import Motion
from cellplan.model.solver import MethodName, SolverSettings
from cellplan.report.record import Record, number

USUAL_METHOD: Final[MethodName] = "weighted_pseudo_inverse"  # nobody has to be told
METHOD_NAMES: Final[dict[MethodName, str]] = {
    "weighted_pseudo_inverse": "weighted pseudo-inverse",
    "damped_least_squares": "damped least squares",
    "jacobian_transpose": "Jacobian transpose",
    "filtered_inverse": "filtered inverse I",
    "filtered_inverse_ii": "filtered inverse II",
    "heuristic_search": "heuristic search, the best joint first",
    "recursive_search": "recursive search, joint by joint",
    "quadratic_program": "quadratic program",
}
SEARCHES: Final[frozenset[MethodName]] = frozenset({"heuristic_search", "recursive_search"})  # no error feedback
SLACK_UNIT: Final = "norm of the twist given up, m/s and rad/s as they come"


def solver_record(solver: SolverSettings, motion: Motion | None = None) -> Record:
    """The method with its settings under the names of the cell file, and what its steps took.

    Args:
        solver: The settings.
        motion: The motion as it was planned; None when it is not at hand, or when there are several.
    """
    return {
        "method": solver.method,
        "gain_per_s": number(solver.gain),
        "damping": "auto" if solver.damping is None else number(solver.damping),
        "settings": _own_settings(solver),
        "secondary": {
            str(goal.kind): {"gain": number(goal.gain)}
            | ({"within_mm": number(1e3 * goal.within)} if goal.kind == "obstacles" else {})
            for goal in solver.goals
        },
        "weighting": {
            "near_limits": number(solver.weighting.near_limits),
            "load": number(solver.weighting.load),
        },
        "iterations": None if motion is None else _iterations_record(motion),
        "slack": None if motion is None else _slack_record(motion),
    }


def method_lines(record: Record) -> Iterator[str]:
    """What is worth a sentence: the method, what it pursued besides the tasks, and where it had trouble.

    Args:
        record: What ``solver_record`` gives.
    """
    is_search = record["method"] in SEARCHES
    feedback = "" if is_search else f"; errors are fed back with a gain of {record['gain_per_s']:g} per second"
    yield f"Method: {METHOD_NAMES[record['method']]}{feedback}."
    goals = [f"{name.replace('_', ' ')} (gain {goal['gain']:g})" for name, goal in record["secondary"].items()]
    if goals:
        yield f"Besides the tasks: {', '.join(goals)}."
    held_back = [f"{name.replace('_', ' ')} {value:g}" for name, value in record["weighting"].items() if value]
    if held_back:
        yield f"Joint weights change along the motion: {', '.join(held_back)}."
    steps = record["iterations"]
    if steps and steps["max"] is not None and steps["max"] > 1.0:
        yield (
            f"Iterations per step: {steps['mean']:.3g} on average, {steps['max']:g} at most, "
            f"at {steps['max_at_s']:.3f} s."
        )
    slack = record["slack"]
    if slack and slack["max"] is not None and slack["max"] > 0.0:
        yield f"The tasks were left on purpose: by {slack['max']:.3g} at {slack['max_at_s']:.3f} s ({slack['unit']})."


def _own_settings(solver: SolverSettings) -> Record:
    """Settings of the method itself."""
    if solver.method == "damped_least_squares":
        damped = solver.damped_least_squares
        measure = str(damped.measure)
        return {"measure": measure, "region": number(damped.region), "shape_gain": damped.shapes_gain}
    if solver.method in {"filtered_inverse", "filtered_inverse_ii"}:
        filtered = solver.filtered_inverse
        return {"gain_per_s": number(filtered.gain), "start": "zero" if filtered.starts_at_zero else "inverse"}
    if solver.method == "quadratic_program":
        program = solver.quadratic_program
        return {"slack_weight": number(program.slack_weight), "ramp_s": number(program.ramp)}
    return _search_settings(solver) if solver.method in SEARCHES else {}


def _search_settings(solver: SolverSettings) -> Record:
    """Settings of a search; only the recursive one has a sequence."""
    search = solver.search
    record: Record = {
        "tolerance_mm": number(1e3 * search.tolerance),
        "orientation_weight_m2": number(search.orientation_weight),
        "rounds": search.rounds,
        "brakes": search.brakes,
    }
    if solver.method == "recursive_search":
        sequence = search.sequence
        record["sequence"] = (
            None if sequence is None else [{"robot": robot, "joint": joint} for robot, joint in sequence]
        )
    return record


def _iterations_record(motion: Motion) -> Record | None:
    """How often the method looked at the tasks in a step; None when nobody counted."""
    if motion.iterations is None:
        return None
    return {"mean": number(float(np.mean(motion.iterations))), **_largest(motion.iterations, motion.times)}


def _slack_record(motion: Motion) -> Record | None:
    """By how much the tasks were left on purpose; None when nobody measured it."""
    return None if motion.slack is None else {**_largest(motion.slack, motion.times), "unit": SLACK_UNIT}


def _largest(of_steps: Array, times: Array) -> Record:
    """The largest value and the instant at which its step begins."""
    worst = int(np.argmax(of_steps))
    return {"max": number(of_steps[worst]), "max_at_s": number(times[worst])}
