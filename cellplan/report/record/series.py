"""``series.json``: errors, singular values, joint positions and velocities along the motion, sample by sample."""

import json
import math
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Final, TypedDict

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.motion.motion import Motion
from cellplan.model.report.report import ClearanceReport, JointUse, Report
from cellplan.model.units import MM
from cellplan.report.record.common import SIGNIFICANT, Number

SCHEMA: Final = "cellplan.series/1"
MAX_STEPS: Final = 50_000  # a longer motion is thinned
DIGITS: Final = 7  # [-] significant: 1e-5 deg of a joint, 1e-7 of an error; the joint tables have all digits
INDENT: Final = "  "

Curve = list[Number]


class TaskCurves(TypedDict):
    """Tool error of a task, one value for each kept sample."""

    position_error_mm: Annotated[Curve, "distance from the desired position on the part"]
    orientation_error_deg: Annotated[Curve, "angle from the desired orientation"]


class JointCurves(TypedDict, total=False):
    """Motion of a joint; a velocity belongs to the step that begins at its sample, so there is one value less."""

    position_deg: Annotated[Curve, "position of a revolute joint"]
    speed_deg_s: Annotated[Curve, "its velocity"]
    position_mm: Annotated[Curve, "position of a prismatic joint"]
    speed_mm_s: Annotated[Curve, "its velocity"]


class ConditioningCurves(TypedDict, total=False):
    """Distance of all robots together from singularities; empty where no task is worked on; see Singularity."""

    smallest_singular_value: Annotated[Curve, "of J"]
    condition: Annotated[Curve, "ratio of the smallest to the largest singular value of J"]
    squared_condition: Annotated[Curve, "the same of `J J^T`"]
    manipulability: Annotated[Curve, "product of the singular values of J"]


class ClearanceCurves(TypedDict, total=False):
    """Distance that each class of pairs keeps over time; empty where it was not worked out."""

    times_s: Annotated[Curve, "middles of some 200 blocks of the motion, its ends and the times of the minima"]
    robot_robot_mm: Annotated[Curve, "what pairs of two robots keep all through the block that holds the time"]
    self_mm: Annotated[Curve, "the same for each robot with itself"]
    part_mm: Annotated[Curve, "the same for the part"]
    environment_mm: Annotated[Curve, "the same for the surroundings"]


class SeriesRecord(TypedDict):
    """The curves of a run."""

    schema: Annotated[str, "`cellplan.series/1`, always the first key"]
    every: Annotated[int, "n: every n-th sample is kept, and the last one"]
    times_s: Annotated[Curve, "times of the kept samples"]
    tasks: Annotated[dict[str, TaskCurves], "by task"]
    conditioning: Annotated[ConditioningCurves, "distance from singularities"]
    joints: Annotated[dict[str, dict[str, JointCurves]], "by robot and joint"]
    iterations: Annotated[Curve | None, "evaluations of the tasks in each step; null in the accurate mode"]
    slack: Annotated[Curve | None, "norm of the twist residual in each step; null if the method has none"]
    clearance: Annotated[ClearanceCurves, "distance that bodies keep"]


Tree = dict[str, Any]  # by name: trees, arrays of shape (K,), whole numbers, texts or None


def series(report: Report, motion: Motion | None = None) -> Tree:
    """Quantities along the motion in printed units.

    Every n-th sample is kept, and the last one; the clearance has times of its own. Quantities of a step, velocities
    among them, have one value less than there are samples: the k-th value belongs to the step of the clock that begins
    at the k-th kept sample.

    Args:
        motion: The planned motion, for iterations and slack of its steps; None if it is not available.
    """
    last = len(report.times) - 1
    every = max(1, math.ceil(last / MAX_STEPS))
    steps = np.arange(0, last, every)
    samples = np.append(steps, last)
    return {
        "schema": SCHEMA,
        "every": every,
        "times_s": report.times[samples],
        "tasks": {
            accuracy.task: {
                "position_error_mm": 1e3 * np.linalg.norm(accuracy.position_error[samples], axis=1),
                "orientation_error_deg": np.rad2deg(np.linalg.norm(accuracy.orientation_error[samples], axis=1)),
            }
            for accuracy in report.accuracy
        },
        "conditioning": {name: values[samples] for name, values in _of_stack(report).items()},
        "joints": {
            robot: _joint_series(
                [use for use in report.joints if use.robot == robot], q=q[samples], qd=report.qd[robot][steps]
            )
            for robot, q in report.q.items()
        },
        "iterations": None if motion is None or motion.iterations is None else motion.iterations[steps],
        "slack": None if motion is None or motion.slack is None else motion.slack[steps],
        "clearance": _clearance_series(report.clearance),
    }


def _of_stack(report: Report) -> dict[str, Array]:
    """Distance of all robots together from singularities, shape (N,) each; nothing where no task is worked on."""
    conditioning = report.conditioning
    if conditioning is None:
        return {}
    return {
        "smallest_singular_value": conditioning.stack,
        "condition": conditioning.condition,
        "squared_condition": conditioning.squared_condition,
        "manipulability": conditioning.manipulability,
    }


def _clearance_series(clearance: ClearanceReport) -> Tree:
    """What each class of pairs keeps over time; nothing where the curves were not worked out."""
    if not clearance.curves:
        return {}
    return {"times_s": clearance.curve_times} | {f"{kind}_mm": MM * curve for kind, curve in clearance.curves.items()}


def _joint_series(uses: Iterable[JointUse], *, q: Array, qd: Array) -> Tree:
    """Position and velocity of each joint of one robot, in the order of its columns."""
    tree: Tree = {}
    for use, position, speed in zip(uses, q.T, qd.T, strict=True):
        unit, scale = use.display_unit
        tree[use.joint] = {f"position_{unit}": scale * position, f"speed_{unit}_s": scale * speed}
    return tree


def series_json(report: Report, motion: Motion | None = None) -> str:
    """The text of ``series.json``; see ``series``."""
    return series_text(series(report, motion)) + "\n"


def series_text(tree: Mapping[str, Any], depth: int = 0) -> str:
    """The series as JSON behind ``depth`` levels, one line for each array; values that are not finite are null."""
    inside = INDENT * (depth + 1)
    lines = [
        f"{inside}{json.dumps(name, ensure_ascii=False)}: "
        + (_array_text(value, SIGNIFICANT) if name == "times_s" else _value_text(value, depth + 1))
        for name, value in tree.items()
    ]
    return "{\n" + ",\n".join(lines) + f"\n{INDENT * depth}}}" if lines else "{}"


def _value_text(value: Any, depth: int) -> str:
    """A tree, an array, a whole number or nothing as JSON."""
    if isinstance(value, Mapping):
        return series_text(value, depth)
    return _array_text(value, DIGITS) if isinstance(value, np.ndarray) else json.dumps(value)


def _array_text(values: Array, digits: int) -> str:
    """Numbers in one line, without -0."""
    tidy = (values + 0.0).tolist()
    if np.isfinite(values).all():
        return f"[{','.join([f'%.{digits}g'] * len(tidy)) % tuple(tidy)}]"
    return f"[{','.join(f'{value:.{digits}g}' if math.isfinite(value) else 'null' for value in tidy)}]"
