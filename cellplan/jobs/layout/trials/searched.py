"""The cell that a layout search is asked for, with all that its request sets in it."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from cellplan.errors import InputError
from cellplan.files.cell.changes import read_setting
from cellplan.files.cell.load import load_cell
from cellplan.files.input.findings import did_you_mean, listed, shown
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.model.cell.cell import Cell, Mode, Relation, Robot, Timing
from cellplan.model.cell.layout import ChoiceKind, VariableKind
from cellplan.model.units import DEG, MM
from cellplan.runs.greatest_feeds import open_feeds
from cellplan.runs.overrides import with_overrides
from cellplan.runs.run_lengths import refuse_open_runs
from cellplan.search.programs.objective import CycleTiming, Objective
from cellplan.search.synchronous import refuse_other_jobs, refuse_other_methods

COMPONENTS: Final = ("x_mm", "y_mm", "z_mm", "roll_deg", "pitch_deg", "yaw_deg", "length_mm", "tilt_deg")
PREFIX: Final = "robots."
FREE: Final = ("start", "weights", "path", "spin")


def searched_cell(request: LayoutRequest) -> Cell:
    """The cell with all that the request sets in it."""
    if request.duration is not None and request.objective is Objective.CYCLE:
        raise InputError(
            "--duration: expected no duration where the shortest cycle is sought; add --objective conforming, "
            "clearance or change"
        )
    cell = load_cell(request.cell, allow_dirs=request.allow_dirs)
    cell = with_overrides(cell, request.settings, duration=request.duration, clearance_mm=request.clearance)
    values: dict[str, object] = {}
    if request.margin is not None:
        values["layout.margin_deg"] = request.margin
    if request.misplacement is not None:
        position, orientation = request.misplacement
        values["layout.misplacement"] = {"position_mm": position, "orientation_deg": orientation}
    if request.free:
        margins = {key: value for key, value in _written_layout(cell).items() if key.startswith("margin_")}
        values = {"layout": {**margins, "vary": freed(cell, request.free)}, **values}
    elif request.vary or request.fixed:
        values["layout.vary"] = _varied(cell, request)
    changed = cell.with_values(values) if values else cell
    paths = () if changed.layout is None else changed.layout.paths
    refuse_unsearchable(request, changed)
    if paths:
        _refuse_open_tasks(changed)
    _refuse_margins(changed)
    _refuse_misplacement(request, changed)
    _refuse_open_feeds(request, changed)
    refuse_open_runs(changed, "a layout search")
    return changed


def refuse_unsearchable(request: LayoutRequest, cell: Cell) -> None:
    """Refuse motions that a search cannot judge, and what it cannot change in a program from home to home."""
    at, motion, layout = cell.origin.at, cell.motion, cell.layout
    if not cell.program.is_home_to_home:
        paths = () if layout is None else [path.robot for path in layout.paths]
        refuse_other_jobs(cell, "a layout search", paths=paths)
        if motion.mode is not Mode.SIMULTANEOUS and layout is not None and (layout.paths or layout.null_space):
            raise InputError(
                f"{at('motion.mode')}: expected simultaneous where joint paths may change, got '{motion.mode}': choose "
                "it, or leave path and null_space out"
            )
        return
    refuse_other_methods(replace(cell, motion=replace(motion, timing=Timing.AS_WRITTEN)), "a layout search")
    if motion.timing is Timing.CYCLE:
        raise InputError(
            f"{at('motion.timing')}: expected as_written or fastest for a layout search of a program, got a cycle: "
            "write fastest, and cycle_s into what comes of it"
        )
    if layout is None:
        return
    vary = "--free" if request.free else at("layout.vary")
    branches = [f"robots.{choice.name}.branch" for choice in layout.choices if choice.kind is ChoiceKind.BRANCH]
    motions = [f"robots.{path.robot}.path" for path in layout.paths] + ["null_space"] * (layout.null_space is not None)
    for address in [*branches, *motions]:
        raise InputError(f"{vary}: expected no branch and no joint path with a program, got {address}; leave it out")
    for variable in layout.ranges:
        if variable.kind is VariableKind.START and variable.name not in cell.positioners[:1]:
            raise InputError(
                f"{vary}: expected no starts but that of the first holder with a program, got {variable.address}; "
                "leave it out"
            )


def _refuse_misplacement(request: LayoutRequest, cell: Cell) -> None:
    """Refuse misplaced bases with a retimed motion or a given joint path: their corners have no common time law."""
    if cell.layout is None or cell.layout.misplacement is None:
        return
    key = "--misplacement" if request.misplacement is not None else cell.origin.at("layout.misplacement")
    if request.timing is CycleTiming.RETIMED:
        raise InputError(f"{key}: expected a motion by the time laws, got --timing retimed: leave one of them out")
    if cell.layout.null_space is not None or cell.layout.paths or any(robot.path is not None for robot in cell.robots):
        raise InputError(f"{key}: expected no joint path (robots.ROBOT.path, null_space): leave one of them out")


def _refuse_open_feeds(request: LayoutRequest, cell: Cell) -> None:
    """Refuse feeds that are sought where not all motion scales with them."""
    layout = cell.layout
    for feed in open_feeds(cell):
        where, process = feed.task.where("process.feed_mm_s"), feed.task.process
        if request.objective is not Objective.CYCLE:
            raise InputError(f"{where}: expected a number beside --objective {request.objective}, got a feed to seek")
        if request.timing is CycleTiming.RETIMED:
            raise InputError(f"{where}: expected a number beside --timing retimed, got a feed to seek")
        if layout is not None and layout.misplacement is not None:
            raise InputError(f"{where}: expected a number where bases are misplaced, got a feed to seek")
        if process is not None and not process.scales and not cell.program.is_home_to_home:
            raise InputError(
                f"{feed.task.where('process.ramp_s')}: expected ramp_mm where the greatest feed is sought over a "
                "layout, as all motion must scale with the feed; write process: {ramp_mm: 20} or both runs"
            )


def _refuse_open_tasks(cell: Cell) -> None:
    """Refuse open components, and robots without just six joints, where a joint path of the positioner is searched."""
    for task in cell.tasks:
        robot = cell.robot(task.robot)
        why = f"for a joint path: the joints of '{robot.name}' would not follow from the path of the positioner"
        cure = "vary null_space in place of path"
        if task.is_spin_free:
            raise InputError(f"{task.where('free')}: expected no free spin {why}, got [spin]; {cure}")
        if len(task.axes) < 6:
            raise InputError(f"{task.where('axes')}: expected all six components {why}, got {len(task.axes)}; {cure}")
        if len(robot.model.joints) != 6:
            raise InputError(
                f"{cell.origin.at(f'robots.{robot.name}')}: expected six joints {why}, got "
                f"{len(robot.model.joints)}; {cure}"
            )


def _refuse_margins(cell: Cell) -> None:
    """Refuse demanded margins that leave a joint no room."""
    if cell.layout is None:
        return
    for robot in cell.robots:
        for joint in robot.model.joints:
            margin = cell.layout.margin if joint.is_revolute else cell.layout.margin_sliding
            half = 0.5 * (joint.upper - joint.lower)
            if margin >= half > 0.0:
                key, scale = ("margin_deg", DEG) if joint.is_revolute else ("margin_mm", MM)
                raise InputError(
                    f"{cell.origin.at(f'layout.{key}')}: expected less than {scale * half:.6g}, half of the range of "
                    f"{joint.name} of '{robot.name}', got {scale * margin:.6g}"
                )


def read_attempts(request: LayoutRequest, cell: Cell) -> list[Cell]:
    """The cells whose layouts are tried too; one that cannot be read, or has other robots, is refused."""
    names = [robot.name for robot in cell.robots]
    layouts = [load_cell(path, allow_dirs=request.allow_dirs) for path in request.attempts]
    for path, other in zip(request.attempts, layouts, strict=True):
        robot_names = [robot.name for robot in other.robots]
        if robot_names != names or other.joint_count != cell.joint_count:
            raise InputError(
                f"--try {path}: expected the robots of the cell ({listed(names)}), got {listed(robot_names)}"
            )
    return layouts


def _varied(cell: Cell, request: LayoutRequest) -> dict[str, Any]:
    """What may change: as the cell says, or as it is by default, with the options of the request."""
    written = written_vary(cell) or (_by_default(cell) if request.fixed and not request.vary else {})
    vary = {short_key(key): dict(value) if isinstance(value, Mapping) else value for key, value in written.items()}
    for text in request.vary:
        key, sign, ranges = text.partition("=")
        vary[short_key(key.strip())] = read_setting(f"{key.strip()}={ranges}", option="--vary")[1] if sign else True
    for key in map(short_key, request.fixed):
        entry, _, component = key.rpartition(".")
        if key in vary:
            del vary[key]
        elif component in COMPONENTS and isinstance(vary.get(entry), dict) and component in vary[entry]:
            del vary[entry][component]
            if not vary[entry]:
                del vary[entry]
        else:
            known = sorted(_keys(vary))
            raise InputError(
                f"--fix: expected a key that may change ({listed(known)}), got {shown(key)}{did_you_mean(key, known)}"
            )
    if not vary:
        raise InputError("--fix: expected at least one key that may still change, got none")
    return vary


def written_vary(cell: Cell) -> Mapping[str, Any]:
    """What the cell file says may change; empty where it says nothing."""
    return dict(_written_layout(cell).get("vary") or {})


def _written_layout(cell: Cell) -> Mapping[str, Any]:
    """The section ``layout`` of the cell file; empty where there is none."""
    written = cell.origin.source.written if cell.origin.source is not None else {}
    return written.get("layout") or {}


def _by_default(cell: Cell) -> Mapping[str, Any]:
    """What may change of a cell that says nothing of it, as the file would say it."""
    vary: dict[str, Any] = {}
    for variable in () if cell.layout is None else cell.layout.ranges:
        entry, _, component = variable.address.rpartition(".")
        if component in COMPONENTS:
            scale = DEG if variable.is_angle else MM
            vary.setdefault(entry, {})[component] = [round(scale * variable.lower, 9), round(scale * variable.upper, 9)]
        else:
            vary[variable.address.partition("[")[0]] = True
    return vary


def _keys(vary: Mapping[str, Any]) -> Iterable[str]:
    """Keys that can be fixed: entries, and the components of those with ranges."""
    for key, value in vary.items():
        yield key
        if isinstance(value, dict):
            yield from (f"{key}.{component}" for component in value)


def short_key(key: str) -> str:
    """A key without ``robots.``, which may be left out."""
    return key.removeprefix(PREFIX)


def _is_open(cell: Cell) -> bool:
    """Whether operators do not follow from a path of the positioner, or better share what is rough with it.

    So it is where tasks leave components open or robots have not just six joints; and with demanded feeds, whose ramps
    a spline over the clock follows badly.
    """
    robots = [len(cell.robot(task.robot).model.joints) for task in cell.tasks]
    tasks = (task.process is not None or task.is_spin_free or len(task.axes) < 6 for task in cell.tasks)
    return any(tasks) or any(count != 6 for count in robots)


def freed(cell: Cell, words: Iterable[str]) -> dict[str, object]:
    """Keys of ``layout.vary``, without ``robots.``, for what is named.

    Args:
        words: ``start``: the start posture of the positioner, and of operators that their tasks leave free;
            ``weights``: of all joints; ``path``: the joint path of the positioner, or motion in the null space;
            ``spin``: how the tools are turned about their own axes.
    """
    vary = dict[str, object]()
    for word in words:
        match word:
            case "path" if _is_open(cell):
                vary["null_space"] = True
            case "start" | "path" if cell.carrier is None:
                where = cell.origin.at("part.held_by")
                raise InputError(f"{where}: expected a robot that holds the part, for --free {word}")
            case "start":
                for robot in (cell.robot(cell.positioners[0]), *_redundant_operators(cell)):
                    is_turning = all(joint.is_revolute for joint in robot.model.joints)
                    vary[f"{robot.name}.start_deg" if is_turning else f"{robot.name}.start"] = True
            case "weights":
                vary |= {f"{robot.name}.weights": True for robot in cell.robots}
            case "path":
                vary[f"{cell.positioners[0]}.path"] = True
            case "spin":
                vary |= {f"tasks.{task.name}.spin_deg": True for task in cell.tasks}
            case _:
                hint = did_you_mean(word, FREE)
                raise InputError(f"--free: expected some of {listed(FREE)}, got {shown(word)}{hint}")
    return vary


def _redundant_operators(cell: Cell) -> list[Robot]:
    """Robots with more joints than their tasks prescribe components, which may begin a task in many configurations.

    None of a program, whose tasks begin where the ones before have led.
    """
    relations: list[Relation] = [] if cell.program.is_home_to_home else [*cell.tasks, *cell.part.held_by[1:]]
    counts = {it.robot: len(it.axes) - it.is_spin_free for it in relations}  # at most one each without a program
    return [robot for robot in cell.robots if len(robot.model.joints) > counts.get(robot.name, np.inf)]
