"""The rows of a stored program: tables and clock, checked against the cell's plan before verification."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cellplan.errors import InputError
from cellplan.files.input.findings import listed, shown
from cellplan.files.run.clock_table import ClockText, parse_clock
from cellplan.files.run.joint_tables import MM_PER_M, TableHeader, parse_header, parse_table, program_digest, row_place
from cellplan.files.run.stored import CLOCK, StoredRun
from cellplan.geometry.arrays import Array, Flags
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.motion.motion import ClockTable, JointTable, Motion
from cellplan.model.motion.plan import NOT_IN_PROGRAM, Phase, rows_of
from cellplan.runs.plan.demanded import DemandedProgram, others_than_first_cycle
from cellplan.runs.plan.headers import left_out_of_program
from cellplan.runs.plan.program import ProgramClock, moved_while_holding, off_given_path

START_TOL: Final = 1e-9  # [rad] or [m] tables and cells have twelve decimals of a degree, millimetre or metre
LENGTH_TOL: Final = 1e-6  # [mm] of path: rounding of the arithmetic on another processor


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredRows:
    """The rows of a program as they are on disk; of the run only times, nominal times and joint positions are used."""

    stored: StoredRun
    program: DemandedProgram  # the phases that the cell demands, and the cell in each of them
    # the plan on its clock, and the desired tool poses: all from the cell but for the nominal times of the rows of a
    # retimed program, and the number of rows of transfer moves
    clock: ProgramClock
    tables: dict[str, JointTable]  # the joint tables with all rows of the program, by robot
    motion: Motion  # the same as one motion

    def of_phase(self, place: int) -> dict[str, JointTable]:
        """The rows of one phase on its own time, by robot."""
        return dict(zip(self.tables, self.clock.cut(list(self.tables.values()), place), strict=True))

    def refuse_other_starts(self, cell: Cell) -> None:
        """Refuse phases that do not begin at the start posture of the cell; idle robots are at their homes.

        Raises:
            InputError: With file and line.
        """
        for phase, phase_cell in zip(self.clock.plan.program, self.program.cells, strict=False):
            first = rows_of(phase, self.clock.sigma).start
            for robot in phase_cell.robots if phase.tasks else ():
                if robot.start is not None and robot.name not in phase.idle:
                    self._refuse_other(robot, first, robot.start, "start posture")
        if self.program.stages:
            for robot in cell.robots:
                for row in (0, len(self.clock.times) - 1):
                    self._refuse_other(robot, row, robot.home, "home")

    def refuse_other_cycles(self, cell: Cell) -> None:
        """Refuse cycles that have other rows than the first.

        Raises:
            InputError: With file and line.
        """
        count, phases = len(self.program.cells), self.clock.plan.program
        for place in range(count if cell.program.cycles > 1 else 0):
            rows = [rows_of(phase, self.clock.sigma) for phase in phases[place::count]]
            for robot in cell.robots:
                other = others_than_first_cycle([self.tables[robot.name].q[end_rows] for end_rows in rows])
                if other is not None:
                    at = self.place(robot.name, rows[other[0]].start + other[1])
                    raise InputError(f"{at}: expected the same row as in the first cycle, got another one")

    def _refuse_other(self, robot: Robot, row: int, q: Array | None, what: str) -> None:
        """Refuse a row in which a robot is in another configuration than one that the cell states."""
        off = np.abs(self.tables[robot.name].q[row] - q)
        if not np.all(off <= START_TOL):
            joint = robot.model.joint_names[int(np.argmax(off))]
            raise InputError(
                f"{self.place(robot.name, row)}: {joint}: expected the {what} of the cell, got another one"
            )

    def refuse_motion_in_hold(self, cell: Cell) -> None:
        """Refuse a robot that moves in a phase in which it holds still.

        Raises:
            InputError: With file and line.
        """
        for phase in self.clock.plan.program:
            rows = rows_of(phase, self.clock.sigma)
            for robot in cell.robots:
                moved = moved_while_holding(phase, robot.name, self.tables[robot.name].q[rows])
                if moved is not None:
                    place, joint = self.place(robot.name, rows.start + moved[0]), robot.model.joint_names[moved[1]]
                    raise InputError(
                        f"{place}: {joint}: expected the position at the start of the phase '{phase.name}', in which "
                        f"'{robot.name}' holds still, got another one"
                    )

    def refuse_other_paths(self, cell: Cell) -> None:
        """Refuse a robot that leaves the path that the cell gives for its joints.

        Raises:
            InputError: With file and line.
        """
        for robot in cell.robots if len(self.clock.plan.program) == 1 else ():
            q, phase = self.tables[robot.name].q, self.clock.plan.program[0]
            off = off_given_path(phase, robot, self.clock.sigma, q)
            if off is not None:
                raise InputError(
                    f"{self.place(robot.name, off[0])}: {robot.model.joint_names[off[1]]}: expected the position of "
                    f"robots.{robot.name}.path in the cell, got another one"
                )

    def place(self, robot: str, row: int) -> str:
        """File and line of a row of a joint table."""
        return row_place(self.stored.tables[robot], self.stored.file("", f"tables/{robot}.csv"), row)


def read_rows(stored: StoredRun, cell: Cell, demanded: DemandedProgram) -> StoredRows:
    """Read the tables of a run back, each under the header and on the clock that it must have.

    Raises:
        InputError: With file and line, when something is not as the plan of the cell demands.
    """
    texts = {robot.name: stored.tables[robot.name] for robot in cell.robots if robot.name in stored.tables}
    program = program_digest(texts)
    tables = _joint_tables(stored, cell, demanded.plan.program, program)
    file = stored.file("", f"tables/{CLOCK}.csv")
    written = parse_clock(stored.clock, file)
    clock = demanded.clock(cell, written, file=file)
    for name, table in tables.items():
        _refuse_other_times(stored, name, table, clock)
    for finding in _clock_findings(written, clock, cell=cell, program=program):
        raise InputError(f"{file}{finding}")
    q = np.concatenate([table.q for table in tables.values()], axis=1)
    motion = Motion(times=written.table.times, sigma=written.table.sigma, q=q, plan=clock.plan)
    rows = StoredRows(stored=stored, program=demanded, clock=clock, tables=tables, motion=motion)
    rows.refuse_motion_in_hold(cell)
    rows.refuse_other_paths(cell)
    rows.refuse_other_cycles(cell)
    return rows


def _joint_tables(stored: StoredRun, cell: Cell, phases: tuple[Phase, ...], program: str) -> dict[str, JointTable]:
    """The joint tables of all robots, each under the header that it must have."""
    names = [robot.name for robot in cell.robots]
    if sorted(stored.tables) != sorted(names):
        got = listed(sorted(stored.tables))
        raise InputError(f"{stored.file('', 'tables')}: expected one table for each of {listed(names)}, got {got}")
    manifest = stored.manifest
    expected = TableHeader(
        cell=cell.name,
        mode=str(cell.motion.mode),
        verdict="passed",
        digests={"cell": manifest.inputs[manifest.cell_file], "program": program},
        remark=left_out_of_program(cell, phases),
    )
    tables = {}
    for name in names:
        text, file = stored.tables[name], stored.file("", f"tables/{name}.csv")
        tables[name] = parse_table(text, file)
        _refuse_other_header(parse_header(text, file), expected, file)
        if tables[name].robot != name:
            raise InputError(f"{file}: robot: expected '{name}', got '{tables[name].robot}'")
        if tables[name].joints != cell.robot(name).model.joint_names:
            joints = listed(cell.robot(name).model.joint_names)
            raise InputError(f"{file}: expected the joints {joints} in this order, got {listed(tables[name].joints)}")
    for place, record in {"": stored.record, **stored.records}.items():
        if record.get("digests") != {"program": program}:
            file = stored.file(place, "report.json")
            raise InputError(f"{file}: digests.program: differs from that of the tables of the run")
    return tables


def _refuse_other_header(header: TableHeader, expected: TableHeader, file: str) -> None:
    """Refuse a table of another run, of another cell, or with another verdict than passed."""
    for key in ("cell", "mode", "verdict", "remark"):
        got, desired = getattr(header, key), getattr(expected, key)
        if got != desired:
            raise InputError(f"{file}: {key}: expected {shown(desired)}, got {shown(got)}")
    for name in dict.fromkeys([*expected.digests, *header.digests]):
        if header.digests.get(name) != expected.digests.get(name):
            raise InputError(
                f"{file}: {name} digest: differs from that of this run; tables of different runs must not be mixed"
            )


def _refuse_other_times(stored: StoredRun, robot: str, table: JointTable, clock: ProgramClock) -> None:
    """Refuse a table whose times or gaps are not those of the cell, and name the first line that is not."""
    file = stored.file("", f"tables/{robot}.csv")
    if len(table.times) != len(clock.times):
        raise InputError(
            f"{file}: expected {len(clock.times)} rows, as on the clock of the cell, got {len(table.times)}"
        )
    late = np.flatnonzero(table.times != clock.times)
    if len(late):
        row = int(late[0])
        desired, got = float(clock.times[row]), float(table.times[row])
        place = row_place(stored.tables[robot], file, row)
        raise InputError(f"{place}: time_s: expected {desired!r} as on the clock of the cell, got {got!r}")
    for finding in _gap_findings(table.gaps, clock, lambda row: row_place(stored.tables[robot], file, row)):
        raise InputError(finding)


def _clock_findings(written: ClockText, clock: ProgramClock, *, cell: Cell, program: str) -> Iterator[str]:
    """What in a written clock is not as the plan of the cell demands, the first row of each column first."""
    table, demanded = written.table, clock.table([task.name for task in cell.tasks if task.name in clock.plan.process])
    if written.cell != cell.name:
        yield f":2: cell: expected {shown(cell.name)}, got {shown(written.cell)}"
    if written.program != program:
        yield ":3: program digest: differs from that of this run; tables of different runs must not be mixed"
    if tuple(table.lengths) != tuple(demanded.lengths):
        yield f":4: expected the tasks {listed(demanded.lengths)}, got {listed(table.lengths)}"
    if len(table.times) != len(demanded.times):
        yield f": expected {len(demanded.times)} rows, as in the joint tables, got {len(table.times)}"
    yield from _gap_findings(table.gaps, clock, lambda row: f":{written.line(row)}")
    for name, got, desired, is_other in _columns(table, demanded):
        rows = np.flatnonzero(is_other)
        if len(rows):
            row = int(rows[0])
            yield f":{written.line(row)}: {name}: expected {desired[row]} as in the plan of the cell, got {got[row]}"


def _columns(table: ClockTable, demanded: ClockTable) -> Iterator[tuple[str, NDArray[Any], NDArray[Any], Flags]]:
    """Every column with what is written, what is demanded, and where they differ."""
    plain: list[tuple[str, NDArray[Any], NDArray[Any]]] = [
        ("time_s", table.times, demanded.times),
        ("sigma_s", table.sigma, demanded.sigma),
        ("phase", np.array(table.phases), np.array(demanded.phases)),
        *((f"{task}_process", 1 * table.process[task], 1 * process) for task, process in demanded.process.items()),
    ]
    for name, got, desired in plain:
        yield name, got, desired, got != desired
    for task, desired in demanded.lengths.items():
        got_mm, desired_mm = MM_PER_M * table.lengths[task], MM_PER_M * desired
        tolerance = LENGTH_TOL + 1e-9 * np.abs(desired_mm)
        yield f"{task}_s_mm", got_mm, desired_mm, ~(np.abs(got_mm - desired_mm) <= tolerance)


def _gap_findings(gaps: Mapping[int, str], clock: ProgramClock, place: Callable[[int], str]) -> Iterator[str]:
    """Marked gaps that only the table or only the plan has, or whose names differ."""
    demanded = clock.gaps
    for row in sorted({*gaps, *demanded}):
        if gaps.get(row) != demanded.get(row):
            before = "no line" if row not in demanded else f"the line '# {NOT_IN_PROGRAM}: {demanded[row]}'"
            got = f"'{gaps[row]}'" if row in gaps else "none"
            yield f"{place(row)}: expected {before} before this row, got {got}"
