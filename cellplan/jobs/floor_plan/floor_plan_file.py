"""The floor plan of a run, or of a cell that was not solved, as SVG or DXF, with the frames that pendants have."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from cellplan.errors import InputError, NoSolutionError, raise_findings, refusals
from cellplan.files.cell.load import load_cell, with_names
from cellplan.files.run.stored import read_stored_run
from cellplan.files.run.whole_file import refuse_foreign, replace_older
from cellplan.geometry.arrays import Array
from cellplan.jobs.check import check
from cellplan.jobs.view.cell_scene import standing
from cellplan.jobs.view.describe import path_points
from cellplan.jobs.view.run_scene import stored_series
from cellplan.measures.torques import standing_reactions
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.progress import Progress, silent
from cellplan.model.report.exported import Station
from cellplan.programs.elements.conventions import Convention, convention_of
from cellplan.programs.elements.frames import controller_base, on_flange, require_frame_numbers
from cellplan.programs.elements.joints import Axes
from cellplan.programs.promises.stations import stations
from cellplan.report.floor_plan.dxf import MARK, floor_plan_dxf, require_dxf
from cellplan.report.floor_plan.pendants import PlanFrame, PlanPendant
from cellplan.report.floor_plan.plan import FloorPlan
from cellplan.report.floor_plan.sheet import SVG_START, floor_plan_svg
from cellplan.report.record.sections.base_reactions import read_base_reactions
from cellplan.runs.drawings.floor_plan import floor_plan, swept_state
from cellplan.runs.gate.open_gate import read_run
from cellplan.runs.gate.stored_cell import load_stored_cell
from cellplan.runs.overrides import with_overrides

ORIGINS: Final = {"base": "base", "tool_frame": "flange"}  # what is counted from, by key
NO_RUN: Final = "frames of the part follow from a run: solve the cell, and name the folder of the run"
DRAWING: Final = "floor plan"  # in messages
KNOWN_STARTS: Final = (MARK.encode(), SVG_START.encode())  # of files that may be replaced


class PlanFormat(StrEnum):
    """Formats of a floor plan."""

    SVG = "svg"
    DXF = "dxf"


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorPlanRequest:
    """What is to be drawn.

    Attributes:
        path: A run folder or a cell file.
        output: The drawing; None for the usual place.
        form: Its format.
        cell: The cell file of a run that depends on further files; None where the folder is enough.
        settings: Values of a cell file, as ``KEY=VALUE``.
        allow_dirs: Folders, beside the cell's own, that the files it names may lie in.
        controllers: A file of names of tools and frames that take the place of those of the cell; None without one.
        frames: Whether it shows the frames to type into the pendants, which a failed run does not have.
    """

    path: Path
    output: Path | None = None
    form: PlanFormat = PlanFormat.SVG
    cell: Path | None = None
    settings: Sequence[str] = field(default=())
    allow_dirs: Sequence[Path] = field(default=())
    controllers: Path | None = None
    frames: bool = False


def requested_floor_plan(request: FloorPlanRequest, *, progress: Progress = silent) -> FloorPlan:
    """The floor plan of a run with what its motion sweeps, or of a cell file at its start.

    A place that the drawing may not take is refused first, and a format whose package is missing.

    Args:
        request: Which run or cell.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: The path is neither a run nor a cell, or does not fit the options; a robot has more frames of the
            part than the cell states numbers.
        NotVerifiedError: Frames are to be shown of a run that failed.
    """
    if request.form is PlanFormat.DXF:
        require_dxf()
    if request.path.is_dir():
        if request.settings:
            raise InputError(f"--set: expected a cell file with it, got the folder '{request.path}'")
        return _of_run(request)
    if request.cell is not None:
        raise InputError(f"--cell: expected a run with it, got '{request.path}'")
    cell = with_overrides(load_cell(request.path, allow_dirs=request.allow_dirs), request.settings)
    cell = cell if request.controllers is None else with_names(cell, request.controllers)
    _refuse_place(request, cell.name)
    return replace(_of_cell(cell, progress), pendants=pendant_frames(cell, None) if request.frames else ())


def target_of(request: FloorPlanRequest, cell: str) -> Path:
    """Where the drawing of a cell of some name is written."""
    return request.output or Path("outputs") / f"{cell}-floor-plan.{request.form}"


def _refuse_place(request: FloorPlanRequest, cell: str) -> None:
    """Refuse a place that the drawing may not take."""
    refuse_foreign(target_of(request, cell), is_of_kind=_is_floor_plan, kind=DRAWING)


def write_floor_plan(plan: FloorPlan, target: Path, form: PlanFormat | str = PlanFormat.SVG) -> int:
    """Write a floor plan whole or not at all; gives the size of the file in bytes.

    Args:
        plan: What ``requested_floor_plan`` returned.
        target: The file; an older floor plan there is replaced.
        form: ``svg`` or ``dxf``.

    Raises:
        ValueError: There is no such format.
        InputError: The place holds something else or cannot be written, or ``ezdxf`` is missing.
    """
    kind = PlanFormat(form)
    content = (floor_plan_svg(plan) if kind is PlanFormat.SVG else floor_plan_dxf(plan)).encode()
    replace_older(target, content, is_of_kind=_is_floor_plan, kind=DRAWING)
    return len(content)


def _is_floor_plan(path: Path) -> bool:
    """Whether a file is a floor plan that cellplan wrote."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        start = file.read(max(map(len, KNOWN_STARTS)))
    return start.startswith(KNOWN_STARTS)


def _of_run(request: FloorPlanRequest) -> FloorPlan:
    stored = read_stored_run(request.path)
    _refuse_place(request, stored.manifest.cell)
    cell = load_stored_cell(
        stored, cell=request.cell, allow_dirs=request.allow_dirs, controllers=request.controllers
    ).cell
    known = stations(read_run(stored, cell)) if request.frames else {}
    raise_findings(refusals(*(partial(require_frame_numbers, cell.robot(name), known[name]) for name in known)))
    pendants = pendant_frames(cell, known) if request.frames else ()
    read = [stored_series(stored, place, cell) for place in stored.records]
    motions = [{robot.name: q[:, cell.columns(robot.name)] for robot in cell.robots} for _, q in read]
    start = {name: q[0] for name, q in motions[0].items()}
    whole = sum(float(times[-1]) for times, _ in read)
    reactions, state = read_base_reactions(stored.record), swept_state(whole)
    plan = floor_plan(cell, start, motions, _task_points(cell), state=state, reactions=reactions)
    return replace(plan, pendants=pendants)


def _of_cell(cell: Cell, progress: Progress) -> FloorPlan:
    try:
        started, state = check(cell, progress=progress).cell, "Robots at the start"
    except (InputError, NoSolutionError):
        started, state = cell, "Robots where the cell puts them, as no start was found"
    start = {robot.name: standing(robot) for robot in started.robots}
    reactions = {it.robot: it for it in standing_reactions(started, start)}
    return floor_plan(started, start, [], _task_points(started), state=state, reactions=reactions)


def _task_points(cell: Cell) -> dict[str, Array]:
    """Points along the paths of all tasks; a path that cannot be built has none."""
    of_tasks = {}
    for task in cell.tasks:
        try:
            points = path_points(cell, task)
        except InputError:
            continue
        if np.all(np.isfinite(points)):
            of_tasks[task.name] = points
    return of_tasks


def pendant_frames(cell: Cell, known: Mapping[str, Sequence[Station]] | None) -> tuple[PlanPendant, ...]:
    """Base and tool of every robot, and the part in all poses in which it works on it.

    Args:
        known: The stations of a run, by robot; None without a run.
    """
    return tuple(_of_robot(cell, robot, None if known is None else known.get(robot.name, ())) for robot in cell.robots)


def _of_robot(cell: Cell, robot: Robot, known: Sequence[Station] | None) -> PlanPendant:
    control = robot.control
    entry = None if control is None else cell.controllers.get(control.id)
    convention = convention_of(None if entry is None else entry.kind)
    connected = "no controller stated" if control is None or entry is None else f"{control.id} ({entry.kind})"
    turns = f", {' '.join(convention.labels[3:])} in {convention.unit}" if convention.unit else ""
    return PlanPendant(
        robot=robot.name,
        title=f"{robot.name}, {connected}: {' '.join(convention.labels[:3])} in mm{turns}",
        labels=convention.labels,
        frames=(*_of_robot_itself(cell, robot, convention), *_of_part(cell, robot, convention, known or ())),
        remarks=tuple(_remarks(cell, robot, convention, known)),
    )


def _of_robot_itself(cell: Cell, robot: Robot, convention: Convention) -> Iterator[PlanFrame]:
    """Its base on the floor, and its tool unless it only turns parts."""
    X_WC = controller_base(robot)
    yield PlanFrame(
        name=_origin(robot, "base"), seen_from="floor", numbers=convention.texts(X_WC), purpose="where it stands"
    )
    if _has_tool(cell, robot):
        number = None if robot.control is None else robot.control.tool_number
        yield PlanFrame(
            name=convention.named(convention.tool, number),
            seen_from=_origin(robot, "tool_frame"),
            numbers=convention.texts(on_flange(robot, robot.tool.X_FT)),
            purpose="tip of the tool",
        )


def _has_tool(cell: Cell, robot: Robot) -> bool:
    """Whether it has a tool centre point: it works, or has an arm, and does not only turn parts."""
    return bool(Axes.of(robot).arm) or any(task.robot == robot.name for task in cell.tasks)


def _of_part(cell: Cell, robot: Robot, convention: Convention, known: Sequence[Station]) -> Iterator[PlanFrame]:
    """The part in each pose in which a robot works on it."""
    for station in known:
        holder = None if station.holder is None else cell.robot(station.holder)
        moves = "" if station.X is not None else "moves while the tool works, so that no frame has it: "
        yield PlanFrame(
            name=convention.named(convention.frame, station.number),
            seen_from=_origin(robot, "base") if holder is None else _origin(holder, "tool_frame", f" of {holder.name}"),
            numbers=() if station.X is None else convention.texts(station.X),
            purpose=moves + ", ".join(station.tasks),
            X_W=station.X_W,
        )


def _origin(robot: Robot, key: str, of_robot: str = "") -> str:
    """The base or the flange that a controller counts from; that of the model where the cell does not state it."""
    return f"{ORIGINS[key]}{of_robot}{'' if _states(robot, key) else ' (model)'}"


def _states(robot: Robot, key: str) -> bool:
    """Whether the cell states the base or the flange of a controller."""
    return robot.control is not None and getattr(robot.control, key) is not None


def _remarks(cell: Cell, robot: Robot, convention: Convention, known: Sequence[Station] | None) -> Iterator[str]:
    """What to know of the numbers of a robot."""
    needed = dict.fromkeys((robot.name, key) for key in ORIGINS if key == "base" or _has_tool(cell, robot))
    needed |= dict.fromkeys((station.holder, "tool_frame") for station in known or () if station.holder is not None)
    for name, key in needed:
        if not _states(cell.robot(name), key):
            yield f"robots.{name}.controller.{key} is not stated: (model) counts from the {ORIGINS[key]} of the model"
    if convention.has_numbers and any(station.X is not None and station.number is None for station in known or ()):
        yield f"robots.{robot.name}.controller.frames does not state a number for each frame of the part"
    if known is None and _has_tool(cell, robot):
        yield NO_RUN
