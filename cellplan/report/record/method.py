"""How a motion was found: the method, the settings it used, and what its steps took."""

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.motion import Motion, NearestSingular
from cellplan.model.solver import METHODS, Integrator, MethodName, MethodTraits, SolverSettings
from cellplan.report.record.run import Record, number

USUAL_METHOD: Final[MethodName] = "weighted_pseudo_inverse"  # nobody has to be told
SHOWN_DIGITS: Final = 2  # [-] of an error between nodes
LEAST_SHOWN: Final = 1e-9  # [mm] of such an error: below it more zeros tell nothing
SLACK_UNIT: Final = "norm of the twist given up, m/s and rad/s as they come"


def solver_record(solver: SolverSettings, motion: Motion | None = None) -> Record:
    """The method with its settings under the names of the cell file, and what its steps took.

    Args:
        solver: The settings.
        motion: The motion as it was planned; None when it is not at hand, or when there are several.
    """
    return {
        "method": solver.method,
        "integrator": str(Integrator.ACCURATE if solver.is_accurate else Integrator.EULER),
        "accuracy_mm": number(1e3 * solver.accuracy),
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
        "resolution": None if motion is None else _resolution_record(motion),
    }


def method_lines(record: Record, step_s: float) -> Iterator[str]:
    """What is worth a sentence: the method, what it pursued besides the tasks, and where it had trouble.

    Args:
        record: What ``solver_record`` gives.
        step_s: Time between two samples in [s].
    """
    yield from _way_lines(record, f"{1e3 * step_s:.6g} ms")
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


def _way_lines(record: Record, step: str) -> Iterator[str]:
    """The method and how it got from instant to instant."""
    traits: MethodTraits = METHODS[record["method"]]
    name, resolution = traits.label, record["resolution"]
    feedback = f"errors are fed back with a gain of {record['gain_per_s']:g} per second"
    if record["integrator"] != Integrator.ACCURATE:
        steps = f", Euler steps of {step}" if traits.takes_euler_steps else ""
        yield f"Method: {name}{steps}." if traits.is_search else f"Method: {name}{steps}; {feedback}."
        return
    yield f"Method: {name}."
    if resolution is None:
        yield f"Resolved accurately: error between nodes not above {_plain(record['accuracy_mm'])} mm."
        return
    if resolution["panels"]:
        error = resolution["error_between_nodes_mm"]
        within = "" if error is None else f", error between nodes below {_plain(_above(error))} mm"
        counts = f"{_counted(resolution['nodes'], 'node')} in {_counted(resolution['panels'], 'panel')}"
        yield f"Resolved accurately: {counts}{within}."
    if resolution["euler_from_s"] is not None:
        lost = resolution.get("lost")
        reason = f" ({lost['message']})" if lost else ""
        yield (
            f"From {resolution['euler_from_s']:.3f} s on Euler steps of {step} had to be taken instead{reason}; "
            f"{feedback}."
        )


def _counted(count: int, what: str) -> str:
    """A count with its noun."""
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def _above(error: float) -> float:
    """A number with few digits that the error stays below."""
    shown = max(error, LEAST_SHOWN)
    unit = 10.0 ** (math.floor(math.log10(shown)) + 1 - SHOWN_DIGITS)
    return (math.floor(shown / unit) + 1.0) * unit


def _plain(value: float) -> str:
    """A positive number without an exponent."""
    return np.format_float_positional(float(f"{value:.6g}"), trim="-")


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
    return _search_settings(solver) if solver.traits.is_search else {}


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


def _resolution_record(motion: Motion) -> Record | None:
    """How finely the motion was resolved; None when nobody kept account."""
    made = motion.resolution
    if made is None:
        return None
    return {
        "panels": made.panels,
        "nodes": made.nodes,
        "sweeps": made.sweeps,
        "solves": made.solves,
        "error_between_nodes_mm": None if made.error_between is None else number(1e3 * made.error_between),
        "euler_from_s": number(made.euler_from),
        "lost": None if made.lost is None else _lost_record(made.lost),
    }


def _lost_record(lost: NearestSingular) -> Record:
    """The robot that is nearest to a singular configuration where the accurate mode gave up."""
    return {
        "robot": lost.robot,
        "task": lost.task,
        "smallest_singular_value": number(lost.smallest),
        "stack_smallest_singular_value": number(lost.stack),
        "message": lost.words,
    }


def _largest(of_steps: Array, times: Array) -> Record:
    """The largest value and the instant at which its step begins."""
    worst = int(np.argmax(of_steps))
    return {"max": number(of_steps[worst]), "max_at_s": number(times[worst])}
