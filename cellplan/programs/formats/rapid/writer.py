r"""RAPID: a module for each robot; robots on one controller move in step by MultiMove, others meet at signals.

Synchronised programs follow the rules of MultiMove (application manual 3HAC021272-001, chapter 6): the move before
``SyncMoveOn`` ends in a stop point; from there to ``SyncMoveOff`` every task has the same moves with the same numbers
``\ID`` and the same durations ``\T``, and no other move has a number. The longest of the moves that run together
sets the time of all.

A zone is the distance of the tool from the target at which the next motion begins; a unit without a tool has zones of
its axes. Sizes are taken from a fixed scale of ten to the decade, always the next smaller one. The corner path is a
parabola from the edge of the zone, and a zone larger than half the distance to a neighbouring target is reduced to that
half; during joint movement it "may differ somewhat" (ABB, RAPID reference manual, zonedata).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import Final

import numpy as np

from cellplan.errors import InputError, raise_findings, refusals
from cellplan.geometry.arrays import Flags
from cellplan.geometry.transforms import Array, pose
from cellplan.model.report.exported import (
    ExportFrame,
    ExportJob,
    Interpolation,
    Moves,
    ProgramRows,
    Promise,
    RobotRows,
)
from cellplan.model.units import MM
from cellplan.programs.elements.corners import chosen_shares, moves, row_shares
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.frames import on_flange
from cellplan.programs.elements.handshake import first_steps, handshake_steps, require_signals_like
from cellplan.programs.elements.head import head_notes
from cellplan.programs.elements.joints import from_numbers, to_numbers
from cellplan.programs.elements.text import comment, fixed, joined, safe_names
from cellplan.programs.formats.rapid.moves import LARGEST_ID, TURN
from cellplan.programs.formats.rapid.paced import PacedWriter, signal_text
from cellplan.programs.formats.rapid.reader import read_rapid
from cellplan.programs.formats.rapid.targets import configuration, frame_text, joint_targets, part_targets
from cellplan.programs.formats.rapid.units import (
    DECIMALS,
    FROM,
    LONGEST_NAME,
    NAME,
    PART,
    ROWS,
    SYNC_OFF,
    SYNC_ON,
    TASKS,
    TIME_DECIMALS,
    WORDS,
    ZONES,
    PartFrame,
    RapidUnit,
    listed_tasks,
    part_frame,
    rapid_task,
    rapid_units,
    require_one_controller,
    works_on_part,
    zone_name,
)
from cellplan.programs.formats.zones import axis_zones, on_scale, tool_zones

LINES: Final = 5000  # moves of a module
LINE_END: Final = "\r\n"
ID_STEP: Final = 10
UNKNOWN_MASS: Final = 0.001  # [kg] as a controller refuses a tool without mass
SMALLEST_TOOL: Final = 50  # [um] a smaller zone of a tool is a stop


def render_rapid(job: ExportJob) -> dict[str, str]:
    """Text of every file: a program file and the modules of each robot, in a folder for each of several programs."""
    raise_findings(refusals(*_demands(job.frame, int)))
    units, part = rapid_units(job.frame), part_frame(job.frame)
    files: dict[str, str] = {}
    for program in job.programs:
        durations = _durations(job.frame, program)
        zones = {} if job.frame.promise is Promise.PACED else row_zones(job, program, units)
        folder = "" if program.name is None else f"{program.name}/"
        for unit in units:
            name = unit.robot.name
            if job.frame.promise is Promise.PACED:
                modules = _paced_modules(job, units, unit, program, durations[name])
            else:
                moves = _moves(job.frame, unit, program.robots[name], durations=durations[name], zones=zones[name])
                modules = _modules(job, units, unit, part=part, moves=moves, zones=zones[name])
            files |= {f"{folder}{module}.mod": text for module, text in modules.items()}
            files[f"{folder}{unit.module}.pgf"] = _program_file(modules)
    return files


def _demands(frame: ExportFrame, _rows: Callable[[], int]) -> Iterator[Callable[[], object]]:
    """What these programs need of the cell."""
    if frame.promise is Promise.SYNCHRONISED and any(refusals(partial(require_one_controller, frame))):
        yield partial(require_one_controller, frame)  # all else may be as it is
        return
    for name in frame.robots:
        yield partial(rapid_units, replace(frame, robots=(name,), promise=Promise.SEQUENCE_ONLY))
        if frame.promise is Promise.SYNCHRONISED:
            yield partial(rapid_task, frame, name)
        elif frame.promise.waits:
            yield partial(_require_names, frame, name)
            yield partial(listed_tasks, frame, name)
        if works_on_part(frame, name):
            robot = frame.robot(name)
            yield partial(configuration, robot, np.zeros((1, len(robot.model.joints))))
    yield partial(rapid_units, frame)
    yield partial(part_frame, frame)


def _program_file(modules: dict[str, str]) -> str:
    """The file that names the modules of a program."""
    lines = [f"  <Module>{module}.mod</Module>" for module in modules]
    head = '<?xml version="1.0" encoding="ISO-8859-1" ?>'
    return joined([head, "<Program>", *lines, "</Program>"], line_end=LINE_END)


def _durations(frame: ExportFrame, program: ProgramRows) -> dict[str, list[str]]:
    """Durations of the moves to the second and further rows, as text, by robot; rounding does not add up."""
    durations: dict[str, list[str]] = {}
    for name in frame.robots:
        rows = program.robots[name]
        if rows.times is None or len(rows) < 2:
            raise InputError(f"rapid: robot '{name}': expected at least two rows with times")
        quanta = np.rint((rows.times - rows.times[0]) * 10.0**TIME_DECIMALS)
        if not np.all(np.diff(quanta) > 0):
            raise InputError(f"rapid: robot '{name}': expected rows at least {10.0**-TIME_DECIMALS:g} s apart")
        durations[name] = [fixed(step, TIME_DECIMALS) for step in (np.diff(quanta) / 10.0**TIME_DECIMALS).tolist()]
    if frame.promise is Promise.SYNCHRONISED:
        first = frame.robots[0]
        for name in frame.robots[1:]:
            if len(durations[name]) != len(durations[first]):
                raise InputError(
                    f"rapid: expected the same rows of all robots, as their moves run together, got "
                    f"{len(durations[first]) + 1} of '{first}' and {len(durations[name]) + 1} of '{name}'"
                )
            if durations[name] != durations[first]:
                raise InputError(f"rapid: expected rows of '{name}' at the same times as those of '{first}'")
        if len(durations[first]) * ID_STEP > LARGEST_ID:
            raise InputError(f"rapid: expected at most {LARGEST_ID // ID_STEP} rows, got {len(durations[first]) + 1}")
    return durations


def _paced_modules(
    job: ExportJob, units: Sequence[RapidUnit], unit: RapidUnit, program: ProgramRows, durations: Sequence[str]
) -> dict[str, str]:
    """Text of the one module of a robot with seams, by its name."""
    paced = PacedWriter.of(job, program, unit)
    rows = {name: replace(rows, X_PT=None, marks=()) for name, rows in program.robots.items()}
    zones = row_zones(job, replace(program, robots=rows), units)[unit.robot.name]
    targets = [paced.point(row) for row in range(len(zones))]
    joint_moves = _moves(job.frame, unit, rows[unit.robot.name], durations=durations, zones=zones, targets=targets)
    routines = paced.routines([move for (move,) in joint_moves])
    notes = list(chain.from_iterable(comment(note, "!") for note in _notes(job, unit)))
    is_joint = ~paced.rows.on_seam
    sizes = [*paced.zones(), *(size for size, is_used in zip(zones, is_joint, strict=True) if is_used)]
    data = [*notes, *_data(job, unit, None), *zone_data(unit, sizes), *paced.data()]
    return {unit.module: _module(unit.module, data, routines)}


def _moves(
    frame: ExportFrame,
    unit: RapidUnit,
    rows: RobotRows,
    *,
    durations: Sequence[str],
    zones: Sequence[int],
    targets: Sequence[str] | None = None,
) -> list[list[str]]:
    """Statements at each row: the move there, to a target or its name, and the handshake where it waits."""
    is_synchronised = frame.promise is Promise.SYNCHRONISED
    at_part = rows_at_part(rows)
    targets = joint_targets(unit, rows.q) if targets is None else list(targets)
    if np.any(at_part) and rows.X_PT is not None:
        stated = part_targets(unit, rows.q[at_part], rows.X_PT[at_part])
        for place, target in zip(np.flatnonzero(at_part).tolist(), stated, strict=True):
            targets[place] = target
    joint_move = "MoveAbsJ" if unit.has_tool else "MoveExtJ"
    tool = f",{unit.tool}" if unit.has_tool else ""
    names = [zone_name(size) if size else "fine" for size in zones]
    moves = [[f"{joint_move} {targets[0]},{FROM},fine{tool};"]]
    for place, (duration, is_at_part) in enumerate(zip(durations, at_part[1:].tolist(), strict=True), start=1):
        number = f"\\ID:={ID_STEP * place}" if is_synchronised else ""
        move, ending = ("MoveL", f"{tool}\\WObj:={PART}") if is_at_part else (joint_move, tool)
        moves.append([f"{move} {targets[place]}{number},{ROWS}\\T:={duration},{names[place]}{ending};"])
    if not is_synchronised:
        if rows.marks:
            _require_names(frame, unit.robot.name)
            moves[0][:0] = map(signal_text, first_steps(frame, unit.robot.name))
        for mark in rows.marks:
            moves[mark] += [signal_text(step) for step in handshake_steps(frame, unit.robot.name)]
    return moves


def _require_names(frame: ExportFrame, robot: str) -> None:
    """Make sure that the signals of a robot are names that RAPID takes."""
    expected = f"the name of a signal of at most {LONGEST_NAME} letters, digits and _"
    require_signals_like(frame, robot, lambda name: NAME.fullmatch(name) and name.lower() not in WORDS, expected)


def _modules(
    job: ExportJob,
    units: Sequence[RapidUnit],
    unit: RapidUnit,
    *,
    part: PartFrame | None,
    moves: list[list[str]],
    zones: Sequence[int],
) -> dict[str, str]:
    """Text of each module of a robot by its name, the one with the main routine first."""
    is_synchronised = job.frame.promise is Promise.SYNCHRONISED
    notes = list(chain.from_iterable(comment(note, "!") for note in _notes(job, unit)))
    first, rest = moves[0], moves[1:]
    longest = LINES if job.frame.split is None else job.frame.split
    pages = [rest[start : start + longest] for start in range(0, len(rest), longest)] if len(moves) > longest else []
    names = [f"{unit.module}_{number:03d}" for number in range(1, len(pages) + 1)]
    called = safe_names(names, longest=LONGEST_NAME, reserved=[unit.module for unit in units])
    body = [f"page_{number:03d};" for number in range(1, len(pages) + 1)] or [*chain.from_iterable(rest)]
    if is_synchronised:
        body = [f"SyncMoveOn {SYNC_ON},{TASKS};", *body, f"SyncMoveOff {SYNC_OFF};"]
    data = [*_data(job, unit, part), *zone_data(unit, zones)]
    files = {unit.module: _module(unit.module, [*notes, *data], {"main": [*first, *body]})}
    for number, (name, page) in enumerate(zip(names, pages, strict=True), start=1):
        files[called[name]] = _module(called[name], notes, {f"page_{number:03d}": [*chain.from_iterable(page)]})
    return files


def _module(name: str, data: Sequence[str], routines: Mapping[str, Sequence[str]]) -> str:
    """Text of one module with its routines."""
    inner: list[str] = []
    for routine, statements in routines.items():
        inner += [f"  PROC {routine}()", *(f"    {statement}" for statement in statements), "  ENDPROC"]
    return joined([f"MODULE {name}", *(f"  {line}" for line in data), *inner, "ENDMODULE"], line_end=LINE_END)


def _notes(job: ExportJob, unit: RapidUnit) -> Iterator[str]:
    """Notes at the head of a module."""
    yield from head_notes(job, unit.robot.name)
    if unit.has_tool and unit.robot.tool.mass is None:
        yield f"mass of the tool not stated: set the load of {unit.tool} before the first run"


def _data(job: ExportJob, unit: RapidUnit, part: PartFrame | None) -> Iterator[str]:
    """Declarations of a robot's main module."""
    if tasks := listed_tasks(job.frame, unit.robot.name):
        names = ",".join(f'["{task}"]' for task in tasks)
        yield f"PERS tasks {TASKS}{{{len(tasks)}}} := [{names}];"
        steps = handshake_steps(job.frame, unit.robot.name) if job.frame.promise.waits else ()
        for name in (SYNC_ON, SYNC_OFF) if not steps else (step.signal for step in steps if step.meets):
            yield f"VAR syncident {name};"
    if unit.has_tool:
        yield f"PERS tooldata {unit.tool} := [TRUE,{frame_text(unit.X_GT, DECIMALS)},{_load(unit)}];"
    if part is not None and works_on_part(job.frame, unit.robot.name):
        frames = f"{frame_text(pose(), DECIMALS)},{frame_text(part.X_GP, DECIMALS)}"
        yield f'PERS wobjdata {PART} := [FALSE,FALSE,"{part.unit}",{frames}];'
    yield f"CONST speeddata {FROM} := [100,20,100,20];"
    yield f"CONST speeddata {ROWS} := [1000,200,1000,200];"


def _load(unit: RapidUnit) -> str:
    """Load data of a tool: mass in [kg], its centre in the flange of the controller in [mm], no inertia of its own."""
    tool = unit.robot.tool
    mass = UNKNOWN_MASS if tool.mass is None else max(tool.mass, UNKNOWN_MASS)
    centre = on_flange(unit.robot, pose(tool.X_FT[:3, 3] if tool.centre is None else tool.centre))[:3, 3]
    place = ",".join(fixed(number, 3) for number in (centre * MM).tolist())
    return f"[{fixed(mass, 3)},[{place}],[1,0,0,0],0,0,0]"


RAPID: Final = Dialect(
    name="rapid",
    title="ABB RAPID modules, in step by MultiMove",
    render=render_rapid,
    read=read_rapid,
    decimals=DECIMALS,
    promises=(Promise.SYNCHRONISED, Promise.PACED, Promise.SEQUENCE_ONLY),
    interpolation=Interpolation.LINEAR,
    kinds=frozenset({"abb"}),
    is_thinned=True,
    is_rounded=True,
    split=LINES,
    demands=_demands,
    has_part_targets=True,
    moves=tuple(Moves),
    configuration=configuration,
)


def row_zones(job: ExportJob, program: ProgramRows, units: Sequence[RapidUnit]) -> dict[str, list[int]]:
    """Size of the zone of each row in [um] or [mdeg], 0 for a stop, by robot.

    Robots that are in step stop at the same rows: at those where one of them that moves has no zone. One that stands
    has the smallest zone at the others.
    """
    shares = row_shares(job, program)
    sizes = {
        (name := unit.robot.name): _sizes(
            unit, program.robots[name], shares[name], chosen=chosen_shares(job, program.robots[name])
        )
        for unit in units
    }
    if job.frame.promise is Promise.SYNCHRONISED:
        passed: Flags = np.logical_and.reduce(
            [
                (shares[name] > 0.0) & ((radii > 0) | ~np.any(moves(program.robots[name]), axis=0))
                for name, radii in sizes.items()
            ]
        )
        sizes = {name: np.where(passed, np.maximum(radii, ZONES[0]), 0) for name, radii in sizes.items()}
    return {name: radii.tolist() for name, radii in sizes.items()}


def rows_at_part(rows: RobotRows) -> Flags:
    """Rows that are stated as targets on the part; never the first, which is reached before robots are in step."""
    if rows.X_PT is None:
        return np.zeros(len(rows), dtype=bool)
    is_at_part = np.all(np.isfinite(rows.X_PT), axis=(1, 2))
    is_at_part[0] = False
    return is_at_part


def zone_data(unit: RapidUnit, sizes: Sequence[int]) -> Iterator[str]:
    """Declarations of the zones of a robot, the smallest first."""
    for size in sorted(set(sizes) - {0}):
        reach = fixed(size / 1000.0, 3)
        turn = fixed(TURN * size / 1000.0, 4) if unit.has_tool else reach
        yield f"CONST zonedata {zone_name(size)} := [FALSE,{reach},{reach},{reach},{turn},{reach},{turn}];"


def _sizes(unit: RapidUnit, rows: RobotRows, shares: Array, *, chosen: Array) -> np.ndarray:
    """Sizes of the zones of a robot by itself, on the scale, shape (N,)."""
    q = from_numbers(unit.robot, to_numbers(unit.robot, rows.q, decimals=unit.decimals))  # as it is read
    if not unit.has_tool:
        return on_scale(np.maximum(1000.0 * axis_zones(unit.robot, q, chosen), ZONES[0]) * (shares > 0.0), ZONES)
    sizes = on_scale(1000.0 * MM * _tool_zones(unit, replace(rows, q=q), shares), ZONES)
    return np.where(sizes >= SMALLEST_TOOL, sizes, 0)


def _tool_zones(unit: RapidUnit, rows: RobotRows, shares: Array) -> Array:
    """Zones of a tool in [m]; none where a motion of joints meets one on the part, shape (N,)."""
    zones = tool_zones(unit.robot, rows.q, shares)
    at_part = rows_at_part(rows)
    if rows.X_PT is None or not np.any(at_part):
        return zones
    whole = at_part.copy()
    whole[1:-1] &= at_part[:-2] & at_part[2:]
    joint = ~at_part
    joint[1:-1] &= joint[:-2] & joint[2:]
    lengths = np.linalg.norm(np.diff(np.where(at_part[:, None], rows.X_PT[:, :3, 3], 0.0), axis=0), axis=1)
    on_part = np.zeros(len(zones))
    on_part[1:-1] = shares[1:-1] * np.minimum(lengths[:-1], lengths[1:])
    return np.where(joint, zones, np.where(whole, np.minimum(zones, on_part), 0.0))
