"""URScript: a program per robot, in radians.

``timed``: the first row by ``movej``, each further one by ``servoj`` at the cycle of the controller, ``stopj`` at the
end. ``servoj`` follows its rows with a lag, its lookahead time, which the cell states as the latency of the controller.
``sequence only``: one ``movej`` per row, and at marks a handshake by standard digital signals. ``paced``: likewise, and
``movel`` and ``movec`` on seams.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Final

import numpy as np

from cellplan.errors import InputError, raise_findings, refusals
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, ExportJob, Moves, Promise, RobotRows
from cellplan.programs.elements.corners import chosen_shares
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.frames import require_rest
from cellplan.programs.elements.head import head_notes
from cellplan.programs.elements.joints import Angle, to_numbers
from cellplan.programs.elements.paced import moves_of
from cellplan.programs.elements.pages import pages_of
from cellplan.programs.elements.text import comment, joined, point_stems
from cellplan.programs.elements.timed_rows import cycle_of, file_path, times_of
from cellplan.programs.formats.urscript.reader import read_urscript
from cellplan.programs.formats.urscript.rows import blend_radii, move_acceleration, move_speeds
from cellplan.programs.formats.urscript.seams import DATA, SeamWriter, routine_names, urscript_events
from cellplan.programs.formats.urscript.text import (
    DECIMALS,
    ENDING,
    LONGEST_NAME,
    MOST_ROWS,
    OFF_CYCLE,
    approach_call,
    decimals_of_urscript,
    function_names,
    handshake_lines,
    lowering,
    page_name,
    require_standard_signals,
    require_turns,
    servo_call,
    stop_call,
)


def render_urscript(job: ExportJob) -> dict[str, str]:
    """Text of every file, by its path in the folder of the export: ``<robot>.script``, in a folder of each task.

    ``InputError`` for a robot that has other joints than six, a position beyond two turns, or lacks something that its
    program needs.
    """
    raise_findings(refusals(*_demands(job.frame, int)))
    names, files = function_names(job.frame), {}
    for program in job.programs:
        for name in job.frame.robots:
            robot, rows = job.frame.robot(name), program.robots[name]
            path = file_path(program.name, f"{name}{ENDING}")
            points = _points(robot, rows, decimals_of_urscript(job.frame, robot))
            if job.frame.promise is Promise.PACED:
                moves = moves_of(job, program, urscript_events(job.frame, name))
                routines = routine_names(job.frame, name)
                stems = point_stems(routines, longest=LONGEST_NAME, others=names.values(), data=DATA)
                seams = SeamWriter(frame=job.frame, robot=robot, rows=rows, moves=moves, names=routines, stems=stems)
                body = seams.lines(points)
            else:
                is_timed = job.frame.promise is Promise.TIMED
                at_rows = (_timed if is_timed else _sequence)(job, robot, rows, points)
                body = [*_routines(job, rows, at_rows), *([stop_call(robot)] if is_timed else [])]
            head = [line for note in _notes(job, rows) for line in comment(note, "#")]
            files[path] = joined([*head, f"def {names[program.name, name]}():", *("  " + line for line in body), "end"])
    return files


def _demands(frame: ExportFrame, _rows: Callable[[], int]) -> Iterator[Callable[[], object]]:
    """What these programs need of the cell."""
    for name in frame.robots:
        yield partial(decimals_of_urscript, frame, frame.robot(name))
        if frame.promise is Promise.TIMED:
            yield partial(servo_call, frame, frame.robot(name))
        else:
            yield partial(require_standard_signals, frame, name)
        for station in frame.stations.get(name, ()):
            yield partial(require_rest, name, station)


def _notes(job: ExportJob, rows: RobotRows) -> Iterator[str]:
    """Notes at the head of a program."""
    yield from head_notes(job, rows.robot)
    if len(rows) > MOST_ROWS:
        yield f"{len(rows)} rows: no program of more than {MOST_ROWS} has been tried on a controller"


def _routines(job: ExportJob, rows: RobotRows, at_rows: Sequence[Sequence[str]]) -> list[str]:
    """The instructions at all rows, in routines of the program and calls of these where one does not hold them."""
    pages, waits = pages_of(len(at_rows), job.frame, URSCRIPT), rows.marks and handshake_lines(job.frame, rows.robot)
    begin = [lowering(job.frame, rows.robot)] if waits else []
    if len(pages) == 1:
        return [*begin, *(line for lines in at_rows for line in lines)]
    lines, names = list[str](), [page_name(number) for number in range(1, len(pages) + 1)]
    for name, page in zip(names, pages, strict=True):
        lines += [f"def {name}():", *(f"  {line}" for row in page for line in at_rows[row]), "end"]
    return [*lines, *begin, *(f"{name}()" for name in names)]


def _points(robot: Robot, rows: RobotRows, decimals: int) -> list[str]:
    """Positions of all rows as they are written: ``[0.1, …]``."""
    numbers = to_numbers(robot, rows.q, decimals=decimals, angle=Angle.RADIANS)
    where = [f"robot '{robot.name}', row {row}" for row in range(len(rows))]
    require_turns(robot.model.joint_names, numbers, row_of=where)
    point = "[" + ", ".join([f"%.{decimals}f"] * numbers.shape[1]) + "]"
    return [point % tuple(row) for row in numbers.tolist()]


def _timed(job: ExportJob, robot: Robot, rows: RobotRows, points: Sequence[str]) -> list[list[str]]:
    """Instructions at each row that follow the rows at the cycle of the controller."""
    cycle, times, servo = cycle_of(robot), times_of(rows), servo_call(job.frame, robot)
    if np.any(np.abs(times - np.arange(len(times)) * cycle) > OFF_CYCLE + np.spacing(times)):
        raise InputError(f"robot '{robot.name}': expected rows every {1000.0 * cycle:g} ms, got others")
    first, *others = points
    return [[f"movej({first}, {approach_call()})"], *([f"servoj({point}, {servo})"] for point in others)]


def _sequence(job: ExportJob, robot: Robot, rows: RobotRows, points: Sequence[str]) -> list[list[str]]:
    """Instructions at each row that move there, and wait at marks; the last row of a routine is a stop."""
    meeting = handshake_lines(job.frame, robot.name) if rows.marks else []
    lines = []
    speeds, radii = move_speeds(robot, rows), blend_radii(robot, rows, chosen_shares(job, rows))
    radii[[page[-1] for page in pages_of(len(rows), job.frame, URSCRIPT)]] = 0.0
    acceleration = f"a={move_acceleration(robot):.3f}"
    for row, point in enumerate(points):
        call = approach_call() if row == 0 else f"{acceleration}, v={speeds[row]:.3f}"
        call += f", r={radii[row]:.4f}" if radii[row] > 0.0 else ""
        lines.append([f"movej({point}, {call})", *(meeting * rows.marks.count(row))])
    return lines


URSCRIPT: Final[Dialect] = Dialect(
    name="urscript",
    title="URScript programs: servoj at the cycle, or movej from row to row",
    render=render_urscript,
    read=read_urscript,
    decimals=DECIMALS,
    promises=(Promise.TIMED, Promise.PACED, Promise.SEQUENCE_ONLY),
    moves=tuple(Moves),
    kinds=frozenset({"ur"}),
    at_cycle=True,
    is_thinned=True,
    is_rounded=True,
    lags=True,
    split=MOST_ROWS,
    speeds=move_speeds,
    demands=_demands,
)
