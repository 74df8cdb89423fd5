"""A change as it is written: round numbers, nothing that stays as it is."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.jobs.layout.trials.prepared import PreparedSearch, values_of
from cellplan.model.cell.layout import VariableKind
from cellplan.search.spline_path.spline_problem import SplineProblem

LEAST: Final = 1e-3  # [-] cost of a change that is left out: 0.1 mm or 0.01 deg
LENGTH: Final = 1e-4  # [m] to which lengths are rounded
ANGLE: Final = float(np.radians(0.01))  # [rad] to which angles are rounded
SAME: Final = 2e-6  # [deg] or [mm] by which numbers differ that are the same but for their digits


def neat(ready: PreparedSearch, x: Array, start: Array) -> tuple[Array, Array]:
    """A layout with round numbers and its start posture; as it was where the tools cannot follow from there.

    Args:
        x: Values of the variables, shape (n,).
        start: Start posture in [rad] or [m], shape (nq,).
    """
    variables = ready.variables
    if isinstance(ready.coarse, SplineProblem):  # every coefficient changes, none is one that anyone would type
        return x, start
    kinds = {variable.address: variable for variable in variables.settings.ranges}
    rounded = x.copy()
    for place, name in enumerate(variables.names):
        kind = kinds[name]
        if abs(x[place] - variables.given[place]) * variables.cost[place] < LEAST:
            rounded[place] = variables.given[place]
        elif kind.kind is not VariableKind.WEIGHT:
            grid = ANGLE if kind.is_angle else LENGTH
            rounded[place] = grid * round(float(x[place]) / grid)
    rounded = np.clip(rounded, variables.lower, variables.upper)
    point = ready.coarse.evaluate(rounded, start)
    return (x, start) if point is None else (rounded, point.start)


def changed_values(ready: PreparedSearch, x: Array, start: Array) -> dict[str, object]:
    """What to write into the cell file, by address; nothing that stands in it already, or that a program begins at."""
    written = values_of(ready, x, start)
    document: Any = ready.cell.origin.document
    begun = {} if ready.phases is None else values_of(ready, ready.variables.given, ready.given_start)
    far = far_starts(ready)
    return {
        address: value
        for address, value in written.items()
        if not _is_same(written_at(document, address), value)
        and not (address not in far and address.startswith("tasks.") and _is_same(begun.get(address), value))
    }


def far_starts(ready: PreparedSearch) -> dict[str, str]:
    """Addresses of the starts of those tasks of a program whose stated starts are too far off, with their robots."""
    tasks = () if ready.phases is None else ready.phases.work.far
    return {f"tasks.{name}.{key}": ready.cell.task(name).robot for name in tasks for key in ("start", "start_deg")}


def written_at(document: Any, address: str) -> Any:
    """What the file has at an address, a component of a pose among them; None where it has nothing."""
    components = {"x_mm": ("xyz_mm", 0), "y_mm": ("xyz_mm", 1), "z_mm": ("xyz_mm", 2)}
    components |= {"roll_deg": ("rpy_deg", 0), "pitch_deg": ("rpy_deg", 1), "yaw_deg": ("rpy_deg", 2)}
    node = document
    for step in address.replace("[", ".").replace("]", "").split("."):
        if isinstance(node, Mapping) and step not in node and step in components:
            key, index = components[step]
            node = node.get(key, (0.0, 0.0, 0.0))[index]
        elif isinstance(node, Mapping):
            node = node.get(step)
        elif isinstance(node, list | tuple) and step.isdigit() and int(step) < len(node):
            node = node[int(step)]
        else:
            return None
    return node


def _is_same(old: Any, new: Any) -> bool:
    """Whether two values of a file are the same but for their last digits."""
    if isinstance(old, bool) or isinstance(new, bool):
        return old is new
    if isinstance(old, int | float) and isinstance(new, int | float):
        return abs(old - new) <= SAME
    if isinstance(old, list | tuple) and isinstance(new, list | tuple):
        return len(old) == len(new) and all(_is_same(*pair) for pair in zip(old, new, strict=True))
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        return old.keys() == new.keys() and all(_is_same(old[key], new[key]) for key in old)
    return bool(old == new) and new is not None
