"""The start of a cell, given or found; where none is found, faults of the cell that leave none are named first."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.checks.clearance.mounting import CURES, check_mounting
from cellplan.checks.clearance.tool_depth import check_depths, check_standoffs
from cellplan.errors import StartNotFoundError
from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.curve import chord_lengths
from cellplan.measures.standoff import standoff_on
from cellplan.measures.tool_depth import AXIS_COMPONENTS, path_depth
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress, silent
from cellplan.model.report.report import Check
from cellplan.model.task.clocked_path import ClockedPath
from cellplan.model.task.task import Frame, ProgrammedPath, Task
from cellplan.model.task.toolpath import Toolpath
from cellplan.planning.start.search import StartChoice, choose_start
from cellplan.scene.bodies import Kind
from cellplan.scene.grips import closed_depth
from cellplan.scene.mounting import Mount, MountedPair
from cellplan.scene.scene import Scene

POSES: Final = 1001  # [-] poses of each path at which the depth of the tool's axis is computed


def chosen_start(scene: Scene, paths: Mapping[str, ClockedPath], *, progress: Progress = silent) -> StartChoice:
    """Start configuration of the whole cell: see `choose_start`.

    A base deep in a floor, a part the wrong way round or a tool axis that comes through the part often leave a robot
    no start at all. They do not depend on the start, so they are known even then, and are what is to be mended.

    Raises:
        StartNotFoundError: No configuration reaches all tasks within limits and without collision.
    """
    try:
        return choose_start(scene, paths, progress=progress)
    except StartNotFoundError as error:
        faults = list(_faults(scene, {name: path.toolpath for name, path in paths.items()}))
        if not faults:
            raise
        raise StartNotFoundError(f"{'; '.join(faults)}; no start posture was found: {error}") from error


def _faults(scene: Scene, toolpaths: Mapping[str, Toolpath]) -> Iterator[str]:
    """What is wrong with a cell wherever its robots are, the deepest fault of each place in the cell file."""
    cell = scene.cell
    fixed = replace(scene, mounted=tuple(pair for pair in scene.mounted if _is_fixed(scene, pair)))
    faults: dict[str, list[Check]] = {}
    for check in check_mounting(fixed, np.zeros((1, cell.joint_count))):
        if not check.passed:
            faults.setdefault(_mounting_key(cell, check.name, check.subject.split(" - ")), []).append(check)
    for key, checks in faults.items():
        deepest = max(checks, key=lambda check: check.value)
        more = f" (and {len(checks) - 1} more of that place)" if len(checks) > 1 else ""
        yield f"{cell.origin.at(key)}: {deepest.message}{more}"
    at_rest = [scene.bodies[pair.first].is_at_rest and scene.bodies[pair.second].is_at_rest for pair in scene.pairs]
    touching = scene.touching(np.zeros(cell.joint_count), among=np.array(at_rest, dtype=bool))
    if touching is not None:
        key = _mounting_key(cell, Mount.STANDING, list(touching))
        yield f"{cell.origin.at(key)}: '{touching[0]}' touches '{touching[1]}', and neither of them moves"
    yield from _deep_grasps(scene)
    for check in depths_on_paths(cell, toolpaths):
        yield f"{cell.origin.at(f'tasks.{check.subject}')}: {check.message}"


def _deep_grasps(scene: Scene) -> Iterator[str]:
    """Grasps that leave axes free, by which a holder is too deep in the part at the pose that they state."""
    cell = scene.cell
    for pair in scene.mounted:
        if pair.mount is Mount.GRIP and pair.moves:
            ends = (scene.bodies[pair.first], scene.bodies[pair.second])
            body = next(end for end in ends if end.kind is not Kind.PART)
            number = cell.positioners.index(str(body.robot))
            depth = closed_depth(cell, body, cell.part.held_by[number])
            if depth > pair.limit:
                yield (
                    f"{cell.origin.at(f'part.held_by[{number}].at')}: {body.name} is {1e3 * depth:.4g} mm deep in part "
                    f"at this pose, allowed {1e3 * pair.limit:g} mm: {CURES[Mount.GRIP]}"
                )


def _is_fixed(scene: Scene, pair: MountedPair) -> bool:
    """Whether a depth is the same at every start: of what stands, and of the grip that carries the part."""
    if pair.mount is Mount.STANDING:
        return True
    carrier = scene.cell.positioners[:1]
    return not pair.moves and any(scene.bodies[end].robot in carrier for end in (pair.first, pair.second))


def _mounting_key(cell: Cell, name: str, bodies: list[str]) -> str:
    """Where in the cell file the first of two bodies is put to the other."""
    if name == Mount.GRIP:
        return "part.held_by[0].at"
    robot = bodies[0].partition("/")[0]
    if any(other.name == robot for other in cell.robots):
        return f"robots.{robot}.base"
    return "part.at" if bodies[0] == "part" else f"environment.{bodies[0]}"


def depths_on_paths(cell: Cell, toolpaths: Mapping[str, Toolpath]) -> list[Check]:
    """Checks of those tools that would stand too deep in the part, or off it, on the desired path."""
    depths = [path_depth(cell, cell.task(name), toolpath.spread(POSES)) for name, toolpath in toolpaths.items()]
    checks = check_depths(cell, [depth for depth in depths if depth is not None])
    tips = [
        standoff_on(cell, cell.task(name), _at_work(cell.task(name), path))
        for name, path in toolpaths.items()
        if _on_part(cell, name)
    ]
    return [check for check in (*checks, *check_standoffs(cell, tips)) if not check.passed]


def _at_work(task: Task, toolpath: Toolpath) -> Array:
    """Tool poses along a path, shape (N, 4, 4), without those on its rapids and runs."""
    poses, s = toolpath.spread(POSES), np.linspace(0.0, toolpath.length, POSES)
    if not isinstance(task.path, ProgrammedPath):
        run_in, run_out = toolpath.runs
        return poses[(s >= run_in) & (s <= toolpath.length - run_out)]
    behind = toolpath.arc.lengths(chord_lengths(task.path.points))
    sides = np.searchsorted(behind, s, side="right") - 1
    return poses[task.path.is_on[np.minimum(sides, len(task.path.is_on) - 1)]]


def _on_part(cell: Cell, name: str) -> bool:
    """Whether a task says where on the part the tip is, all along its path."""
    task = cell.task(name)
    return task.relative_to is Frame.PART and set(AXIS_COMPONENTS) <= set(task.axes)
