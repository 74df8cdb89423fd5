"""The method of a run as sentences."""

import math
from collections.abc import Iterable, Iterator
from typing import Final

import numpy as np

from cellplan.model.solver import METHODS, Integrator, MethodName, MethodTraits
from cellplan.report.record.common import Record

DEFAULT_METHOD: Final[MethodName] = "weighted_pseudo_inverse"  # not mentioned in summaries
SHOWN_DIGITS: Final = 2  # of an error between nodes
MIN_SHOWN: Final = 1e-9  # [mm] smaller errors are shown as this one


def method_lines(record: Record, step_s: float) -> Iterator[str]:
    """Sentences about the method, its secondary goals, and its effort.

    Args:
        step_s: Time between two samples in [s].
    """
    yield from _integration_lines(record, f"{1e3 * step_s:.6g} ms")
    goals = [f"{name.replace('_', ' ')} (gain {goal['gain']:g})" for name, goal in record["secondary"].items()]
    if goals:
        yield f"Secondary goals: {', '.join(goals)}."
    weights = [f"{name.replace('_', ' ')} {value:g}" for name, value in record["weighting"].items() if value]
    if weights:
        yield f"Joint weights change along the motion: {', '.join(weights)}."
    steps = record["iterations"]
    if steps and steps["max"] is not None and steps["max"] > 1.0:
        yield (
            f"Iterations per step: {steps['mean']:.3g} on average, {steps['max']:g} at most, "
            f"at {steps['max_at_s']:.3f} s."
        )
    slack = record["slack"]
    if slack and slack["max"] is not None and slack["max"] > 0.0:
        yield f"Task slack: at most {slack['max']:.3g} at {slack['max_at_s']:.3f} s ({slack['unit']})."
    yield from (f"{line[0].upper()}{line[1:]}." for line in moved_start_lines(record.get("moved_starts") or []))


def moved_start_lines(records: Iterable[Record]) -> Iterator[str]:
    """How far each start was moved, from where the cell or an earlier run has it."""
    for move in records:
        source = f"of the run '{move['run']}'" if move["run"] else "as given"
        yield (
            f"start of '{move['robot']}' for '{move['task']}' moved: {source} its tool is {move['tool_mm']:.3f} mm and "
            f"{move['tool_deg']:.3f} deg off; most by '{move['joint']}', {move['joint_moved']:.3f} {move['unit']}"
        )


def _integration_lines(record: Record, step: str) -> Iterator[str]:
    """The method and the integration of joint velocities."""
    traits: MethodTraits = METHODS[record["method"]]
    name, resolution = traits.label, record["resolution"]
    feedback = f"pose errors are fed back with a gain of {record['gain_per_s']:g} per second"
    if record["integrator"] != Integrator.ACCURATE:
        steps = f", Euler steps of {step}" if traits.takes_euler_steps else ""
        yield f"Method: {name}{steps}." if not traits.feeds_back else f"Method: {name}{steps}; {feedback}."
        if not traits.is_accurate:
            yield no_accurate_mode(record["method"])
        return
    yield f"Method: {name}."
    if resolution is None:
        yield f"Accurate mode: error between nodes at most {_plain(record['accuracy_mm'])} mm."
        return
    if resolution["panels"]:
        error = resolution["error_between_nodes_mm"]
        within = "" if error is None else f", error between nodes below {_plain(_above(error))} mm"
        counts = f"{counted(resolution['nodes'], 'node')} in {counted(resolution['panels'], 'panel')}"
        yield f"Accurate mode: {counts}{within}."
    if resolution["euler_from_s"] is not None:
        lost = resolution.get("lost")
        reason = f" ({lost['message']})" if lost else ""
        yield (
            f"Collocation failed at {resolution['euler_from_s']:.3f} s; continued with Euler steps of {step}{reason}; "
            f"{feedback}."
        )


def no_accurate_mode(method: MethodName) -> str:
    """Why a method steps along the clock, as a sentence."""
    return f"No accurate mode: {method} {METHODS[method].steps_because}."


def counted(count: int, what: str) -> str:
    """A count with its noun."""
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def _above(error: float) -> float:
    """An upper bound of the error with few digits."""
    shown = max(error, MIN_SHOWN)
    unit = 10.0 ** (math.floor(math.log10(shown)) + 1 - SHOWN_DIGITS)
    return (math.floor(shown / unit) + 1.0) * unit


def _plain(value: float) -> str:
    """A positive number without an exponent."""
    return np.format_float_positional(float(f"{value:.6g}"), trim="-")
