"""The cell that an assignment writes: its draft with the values that were chosen, and where its tasks end in it."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from cellplan.files.cell.write import in_file_units
from cellplan.geometry.arrays import Array
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.model.cell.cell import Cell
from cellplan.model.robot.robot import RobotModel, start_keys
from cellplan.search.assign.problem.goals import STRAIGHT, TaskGoal, task_goals
from cellplan.search.assign.problem.instance import End, Instance
from cellplan.search.assign.schedules.order import SequencedBlocks, order_values

ANGLES: Final = np.radians(np.arange(0.0, 360.0, 45.0))
CORNERS: Final = {
    "circle": [tuple(np.round([np.cos(it), np.sin(it)], 9).tolist()) for it in ANGLES],
    "rectangle": [(1, 1), (-1, 1), (-1, -1), (1, -1)],
    "rhombus": [(1, 0), (0, 1), (-1, 0), (0, -1)],
}  # starts of closed shapes, the one without start_at first


def written_cell(draft: AssignmentDraft, instance: Instance, sequenced: SequencedBlocks) -> Cell:
    """The program of a schedule, read from the draft's document with the chosen values."""
    values: dict[str, object] = {}
    before: tuple[str, ...] = ()
    schedule = sequenced.schedule
    stops = zip(schedule.blocks, sequenced.stops, schedule.cleaned(instance), strict=True)
    for block, (station, ends), cleaned in stops:
        for end in ends:
            if end is not None:
                values |= task_values(draft.cell, end, before, holder_at(instance, station))
                values |= {f"tasks.{end.mode.task}.holder_moves": True} if station in instance.columns else {}
                values |= via_values(draft.cell, end.mode.task, is_cleaned=end.mode.robot in cleaned)
        before = block
    return draft.cell.with_values(values | order_values(sequenced, instance.step))


def holder_at(instance: Instance, station: int | None) -> tuple[str, Array] | None:
    """Holder and its configuration at a station; None for a part that is fixed."""
    holder = instance.stations.holder
    return None if holder is None or station is None else (holder, instance.stations.q[station])


def task_values(cell: Cell, end: End, before: tuple[str, ...], holder: tuple[str, Array] | None) -> dict[str, object]:
    """Values of one task by address.

    Args:
        before: Tasks of the block before.
        holder: The holder of the part and its configuration; None for a part that is fixed.
    """
    task, robot = cell.task(end.mode.task), end.mode.robot
    place = f"tasks.{task.name}"
    values: dict[str, object] = {f"{place}.robot": robot, **dict(end.mode.path_values)}
    spin = float(np.round(np.degrees(np.remainder(task.spin + end.mode.spin + np.pi, 2.0 * np.pi) - np.pi), 9))
    if end.mode.spin and not task.is_spin_free:
        values[f"{place}.spin_deg"] = spin
    if task.start_posture is None:
        values |= _configuration(f"{place}.start", cell.robot(robot).model, end.begin)
    if holder is not None and task.holder_posture is None:
        values |= _configuration(f"{place}.holder", cell.robot(holder[0]).model, holder[1])
    if after := tuple(dict.fromkeys((*task.after, *before))):
        values[f"{place}.after"] = after
    return values | ((backwards_values(cell, task.name) or {}) if end.is_reversed else {})


def via_values(cell: Cell, task: str, *, is_cleaned: bool) -> dict[str, object]:
    """Via points of a task by address, its tool cleaned first or not at all; nothing where they stay as written."""
    tasks: Any = cell.origin.document["tasks"]
    written = tasks[task].get("via") or {}
    points = {key: [it for it in written.get(key, ()) if it != "service"] for key in ("before", "after")}
    if not is_cleaned and points == {key: [*written.get(key, ())] for key in points}:
        return {}
    points["before"] = [*(["service"] if is_cleaned else []), *points["before"]]
    return {f"tasks.{task}.via": {key: it for key, it in points.items() if it} or None}


def backwards_values(cell: Cell, task: str) -> dict[str, object] | None:
    """Values with which a polyline is gone through from its end to its begin; None where that is not known.

    A tool that pushes or drags does so backwards too, as it is mirrored across the path: on a straight one, with an
    axis that is written as a vector.
    """
    points = written_points(cell, task)
    if points is None:
        return None
    if cell.task(task).seam is not None or cell.task(task).stretch is not None:
        return _reversed_seam(cell, task)
    place, at = f"tasks.{task}", np.array(points, dtype=float)
    values: dict[str, object] = {f"{place}.path.polyline.points_mm": points[::-1]}
    document: Any = cell.origin.document["tasks"]
    written = document[task].get("tool_axis")
    if not isinstance(written, tuple | list):
        return values
    axis, steps = np.array(written, dtype=float), np.diff(at, axis=0)
    along = steps @ axis / np.maximum(np.linalg.norm(steps, axis=1) * np.linalg.norm(axis), STRAIGHT)
    if np.all(np.abs(along) <= STRAIGHT):
        return values
    travel = (at[-1] - at[0]) / max(float(np.linalg.norm(at[-1] - at[0])), STRAIGHT)
    if np.any(np.linalg.norm(np.cross(steps, travel), axis=1) > STRAIGHT * np.linalg.norm(steps, axis=1)):
        return None
    mirrored = axis - 2.0 * (axis @ travel) * travel
    return values | {f"{place}.tool_axis": [float(it) for it in np.round(mirrored, 9) + 0.0]}


def _reversed_seam(cell: Cell, task: str) -> dict[str, object]:
    """Values with which a path with walls, or a part of a path, is run along the other way; what is left is right then.

    Beside two walls angles and passes stay where they are.
    """
    document: Any = cell.origin.document["tasks"]
    path, place = document[task]["path"], f"tasks.{task}.path"
    values: dict[str, object] = {f"{place}.reverse": not path.get("reverse", False)}
    seam, weave = cell.task(task).seam, path.get("weave") or {}
    if seam is not None and len(seam.walls) == 1:
        values |= {f"{place}.{key}": -path[key] for key in ("work_deg", "side_mm") if path.get(key)}
    if weave.get("dwell_left_s") != weave.get("dwell_right_s"):
        sides = ("dwell_left_s", "dwell_right_s")
        values |= {f"{place}.weave.{key}": weave[other] for key, other in zip(sides, sides[::-1], strict=True)}
    return values


def goals_written_otherwise(draft: AssignmentDraft, goals: Sequence[TaskGoal]) -> list[TaskGoal]:
    """The same tasks as a cell file may also have them: done backwards with a mirrored tool, or begun elsewhere."""
    return [*mirrored_goals(draft, goals), *goals_with_other_starts(draft, goals)]


def mirrored_goals(draft: AssignmentDraft, goals: Sequence[TaskGoal]) -> list[TaskGoal]:
    """The ways back of tasks whose tool pushes or drags, with the tool mirrored across the path."""
    cell, values = draft.cell, dict[str, object]()
    for goal in goals:
        if not goal.is_reversible and goal.start_q is None and "direction" in draft.settings.free:
            values |= backwards_values(cell, goal.name) or {}
    if not values:
        return []
    back = {goal.name: goal.X_PT[::-1] for goal in task_goals(cell.with_values(values), draft.robots)}
    turned = [
        goal for goal in goals if values.keys() & {f"tasks.{goal.name}.tool_axis", f"tasks.{goal.name}.path.reverse"}
    ]
    return [replace(goal, X_PT=back[goal.name], is_mirrored=True) for goal in turned]


def goals_with_other_starts(draft: AssignmentDraft, goals: Sequence[TaskGoal]) -> list[TaskGoal]:
    """Tasks along circles, rectangles and rhombi without a given start, and closed polylines, from their other starts.

    There are none where arcs have to keep a distance, which is known for the paths as they are written.
    """
    cell = draft.cell
    if "start" not in draft.settings.free or cell.program.arcs_apart_mm is not None:
        return []
    starts = {goal.name: _starts(cell, goal.name) for goal in goals if goal.start_q is None}
    others = list[TaskGoal]()
    for number in range(max(map(len, starts.values()), default=0)):
        chosen = {name: options[number] for name, options in starts.items() if number < len(options)}
        begun = task_goals(cell.with_values(dict(chosen.values())), draft.robots)
        X_PT = {goal.name: goal.X_PT for goal in begun}
        others += [
            replace(goal, X_PT=X_PT[goal.name], path_values=(chosen[goal.name],))
            for goal in goals
            if goal.name in chosen
        ]
    return others


def _starts(cell: Cell, task: str) -> list[tuple[str, object]]:
    """Addresses and values of the starts of a path beside its own: 45 deg apart on a circle, else its corners.

    A polyline with rounded corners has none: it would be rounded where it began, and not where it begins.
    """
    tasks: Any = cell.origin.document["tasks"]
    path, place = tasks[task]["path"], f"tasks.{task}.path"
    points = written_points(cell, task)
    if cell.task(task).stretch is not None:
        return []
    if points is not None and path["polyline"].get("closed") and cell.task(task).blend is None:
        step = -(-len(points) // len(ANGLES))  # no more starts than a circle has
        turned = ((*points[first:], *points[:first]) for first in range(step, len(points), step))
        return [(f"{place}.polyline.points_mm", it) for it in turned]
    shape = next((name for name in CORNERS if path.get(name) is not None), None)
    if shape is None or f"{place}.{shape}.start_at" in cell.origin.lines:
        return []
    return [(f"{place}.{shape}.start_at", corner) for corner in CORNERS[shape][1:]]


def written_points(cell: Cell, task: str) -> tuple[object, ...] | None:
    """Points of the path of a task as they stand in the file; None where it is no polyline, or goes back at its end."""
    tasks: Any = cell.origin.document["tasks"]
    path = tasks[task]["path"]
    return tuple(path["polyline"]["points_mm"]) if path.get("polyline") and "back_mm" not in path else None


def _configuration(address: str, model: RobotModel, q: Array) -> dict[str, object]:
    """A configuration by address, under the key that suits the joints of the robot; the other key is left out."""
    values = in_file_units(model, q)
    if all(joint.is_revolute for joint in model.joints):
        return {f"{address}_deg": values, address: None}
    return {address: dict(zip(start_keys(model), values, strict=True)), f"{address}_deg": None}
