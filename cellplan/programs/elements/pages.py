"""Programs in the language of a maker: whose robots, which names and pages, how fast, and which rows are rounded."""

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, ExportJob, ProgramRows, RobotRows
from cellplan.programs.elements.corners import row_shares
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.handshake import HandshakeStep, first_steps, handshake_steps
from cellplan.programs.elements.head import head_notes
from cellplan.programs.elements.joints import Axes, to_numbers
from cellplan.programs.elements.text import ascii_text, safe_names
from cellplan.programs.elements.timed_rows import decimals_of

ENDING: Final = 4  # characters of the ending _001 of a page
MOST_PAGES: Final = 999
SHORTEST: Final = 1e-6  # [s] between two rows that count as apart
SLOW: Final = 10  # [%] to the first row, and throughout where no times are known


def robots_of(frame: ExportFrame, dialect: Dialect) -> tuple[str, ...]:
    """The exported robots whose controllers play a format, in the order of the cell; ``InputError`` without any."""
    kinds = {name: _kind(frame, name, dialect) for name in frame.robots}
    robots = tuple(name for name, kind in kinds.items() if kind in dialect.kinds)
    if not robots:
        name, kind = next(iter(kinds.items()))
        allowed = " or ".join(sorted(dialect.kinds))
        raise InputError(
            f"robots.{name}.controller: expected a controller that plays {dialect.name} ({allowed}), got '{kind}'"
        )
    return robots


def _kind(frame: ExportFrame, robot: str, dialect: Dialect) -> str:
    """Kind of the controller of a robot."""
    control = frame.robot(robot).control
    if control is None:
        raise InputError(f"robots.{robot}.controller: expected the controller that plays {dialect.name}, got none")
    if control.id not in frame.cell.controllers:
        raise InputError(f"robots.{robot}.controller: expected one of the controllers of the cell, got '{control.id}'")
    return frame.cell.controllers[control.id].kind


def require_six_axes(robot: Robot, *, external: int, what: str) -> Axes:
    """The axes of an arm of six, with at most so many others before it as a language has external axes."""
    axes, count = Axes.of(robot), len(robot.model.joints)
    if not axes.arm:
        raise InputError(
            f"robots.{robot.name}: expected an arm of six axes, got {count} axes: {what} moves a positioner "
            f"by the program of an arm only"
        )
    if len(axes.external) > external:
        kind = "a turning axis" if robot.model.joints[0].is_revolute else "a rail"
        got = f"{kind} before it" if external == 0 else f"{len(axes.external)} axes before it"
        raise InputError(
            f"robots.{robot.name}: expected an arm of six axes{f' and at most {external} others' if external else ''}, "
            f"got {got}: {what} has no place for it"
        )
    return axes


class ProgramNames(NamedTuple):
    """How programs of a language may be named."""

    longest: int  # most characters
    reserved: Collection[str]  # words of the language
    taken: str  # pattern of the names that points and other data have


def program_paths(frame: ExportFrame, dialect: Dialect, rules: ProgramNames) -> dict[tuple[str | None, str], str]:
    """Path of each program by its name and robot, without an ending: ``alpha``, or ``alpha/weld`` of several programs.

    The last part may become longer by the ending of a page.
    """
    robots = robots_of(frame, dialect)
    if len(frame.programs) == 1:
        names = page_names(robots, rules)
        return {(frame.programs[0], robot): names[robot] for robot in robots}
    folders = safe_names(robots, longest=rules.longest)
    programs = page_names([name or "" for name in frame.programs], rules)
    return {(name, robot): f"{folders[robot]}/{programs[name or '']}" for name in frame.programs for robot in robots}


def page_names(names: Iterable[str], rules: ProgramNames) -> dict[str, str]:
    """Names of programs by the names in the cell: with the ending of a page still unique and short enough.

    No name ends like one of a page, so that ``weld_001`` is the first page of ``weld`` and nothing else.
    """
    used, result = set(rules.reserved), dict[str, str]()
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9]+", "_", ascii_text(name)).strip("_") or "x"
        plain = re.sub(r"_(?=[0-9]{3})", "", plain)
        if not plain[0].isalpha() or re.fullmatch(rules.taken, plain, re.IGNORECASE):
            plain = f"p{plain}"
        result[name] = safe_names([plain], longest=rules.longest - ENDING, reserved=used)[plain]
        used.add(result[name])
    return result


def pages_of(count: int, frame: ExportFrame, dialect: Dialect) -> list[range]:
    """Rows of each of up to 999 pages: as many as fit into all but the last, the same for equally many rows."""
    size = frame.split or dialect.split or max(count, 1)
    pages = [range(first, min(first + size, count)) for first in range(0, count, size)]
    if len(pages) > MOST_PAGES:
        raise InputError(
            f"--split: expected at most {MOST_PAGES} pages, got {len(pages)} of {size} of {count} rows; use larger ones"
        )
    return pages


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PagedProgram:
    """What is written of one robot in one program."""

    path: str  # path without an ending; its last part is its name
    notes: Sequence[str]  # notes for the heads of its files
    placed: Robot
    rows: RobotRows
    numbers: Array  # positions of its joints as they are written, shape (N, n)
    decimals: int  # of these
    speeds: Sequence[int]  # share of the top speed with which each row is approached in [%]
    shares: Array  # of its segments within which each row is rounded, 0 for a stop, shape (N,)
    first: Sequence[HandshakeStep]  # instructions before the first motion
    steps: Sequence[HandshakeStep]  # instructions at a mark
    pages: Sequence[range]  # rows of each page

    @property
    def name(self) -> str:
        """Its name."""
        return self.path.rpartition("/")[2]

    @property
    def endings(self) -> list[str]:
        """What the names of its pages end in; nothing for a single one."""
        return [f"_{page:03d}" for page in range(1, len(self.pages) + 1)] if len(self.pages) > 1 else [""]


def render_programs(
    job: ExportJob,
    dialect: Dialect,
    paths: Mapping[tuple[str | None, str], str],
    files_of: Callable[[PagedProgram], dict[str, str]],
) -> dict[str, str]:
    """Text of every file by its path, from the files of each robot in a program; each may keep other rows.

    ``InputError`` where robots do not meet at equally many marks, one has no row, or a position cannot be written.
    """
    robots, files = list(dict.fromkeys(robot for _, robot in paths)), dict[str, str]()
    for program in job.programs:
        require_rows(job, program)
        for robot in robots:
            files |= files_of(paged(job, dialect, program, robot, paths[program.name, robot]))
    return files


def require_rows(job: ExportJob, program: ProgramRows) -> None:
    """Refuse robots that do not meet at equally many marks, or have no row."""
    rows_of = program.robots
    if len({len(rows.marks) for rows in rows_of.values()}) > 1 or not all(map(len, rows_of.values())):
        got = ", ".join(f"{len(rows)} and {len(rows.marks)} of '{name}'" for name, rows in rows_of.items())
        name = program.name or job.frame.cell.name
        raise InputError(f"program '{name}': expected rows, and equal marks, got {got}")


def paged(job: ExportJob, dialect: Dialect, program: ProgramRows, robot: str, path: str) -> PagedProgram:
    """All that the files of one robot in one program are made of."""
    placed, rows = job.frame.robot(robot), program.robots[robot]
    decimals = decimals_of(placed, dialect.decimals)
    numbers, pages = to_numbers(placed, rows.q, decimals=decimals), pages_of(len(rows), job.frame, dialect)
    steps = handshake_steps(job.frame, robot) if rows.marks else ()
    return PagedProgram(
        path=path,
        notes=head_notes(job, robot),
        placed=placed,
        rows=rows,
        numbers=numbers,
        decimals=decimals,
        speeds=percentages(placed, rows).astype(int).tolist(),
        shares=shares_as_written(row_shares(job, program)[robot], numbers, pages),
        first=first_steps(job.frame, robot) if steps else [],
        steps=steps,
        pages=pages,
    )


def shares_as_written(shares: Array, numbers: Array, pages: Iterable[range]) -> Array:
    """Shares within which a target rounds rows, shape (N,): as far as they may be, but for ends of pages.

    Rows that stand on a neighbour are no corner that could be rounded.

    ``numbers`` are the positions as they are written, shape (N, n).
    """
    flags = np.ones(len(shares), dtype=bool)
    flags[[page[-1] for page in pages]] = False
    moves = np.any(np.diff(numbers, axis=0) != 0.0, axis=1)
    flags[1:] &= moves
    flags[:-1] &= moves
    return shares * flags


def read_programs(
    frame: ExportFrame,
    files: Mapping[str, str],
    paths: Mapping[tuple[str | None, str], str],
    rows_of: Callable[[ExportFrame, str, dict[str, str], str], tuple[RobotRows, ...]],
    *,
    ending: str = "",
) -> tuple[ProgramRows, ...]:
    """Programs as a reader finds them, which takes the files of each robot out of those that are left.

    It finds rows of that robot, and of others that the same files move.

    Robots have equally many marks, else the file with this ending is named; no file may be left.
    """
    programs: dict[str | None, dict[str, RobotRows]] = {program: {} for program in frame.programs}
    left = dict(files)
    for (program, robot), path in paths.items():
        programs[program] |= {rows.robot: rows for rows in rows_of(frame, robot, left, path)}
        if len({len(rows.marks) for rows in programs[program].values()}) > 1:
            raise InputError(f"{path}{ending}: expected as many marks as the programs of the other robots have")
    if left:
        raise InputError(f"{min(left)}: expected no such file in this export")
    return tuple(ProgramRows(name=program, robots=robots) for program, robots in programs.items())


def percentages(robot: Robot, rows: RobotRows) -> Array:
    """Speed with which a robot comes to each row, as a whole share of the top speed of its axes in [%], shape (N,).

    It is that of the plan: the largest share that an axis needs from one row to the next in the time between them. A
    stretch in which nothing moves keeps the share before it.
    """
    if rows.times is None or len(rows) < 2:
        return np.full(len(rows), float(SLOW))
    top = np.array([joint.top_speed for joint in robot.model.joints])
    shares = np.max(
        np.abs(np.diff(rows.q, axis=0)) / (np.maximum(np.diff(rows.times), SHORTEST)[:, None] * top), axis=1
    )
    stated = [float(SLOW)]
    for share in np.clip(np.rint(100.0 * shares), 1, 100) * (shares > 0.0):
        stated.append(float(share) or stated[-1])
    return np.array(stated)
