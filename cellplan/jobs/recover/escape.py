"""Escape programs: for each step of a program the way home from wherever robots stand between two marks, certified."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from cellplan.cache import without_cache
from cellplan.errors import InputError, NotVerifiedError
from cellplan.files.input.files import digest
from cellplan.files.input.findings import listed
from cellplan.geometry.transforms import Array
from cellplan.jobs.recover.legs import WRITTEN_TOL, Leg, Track, leg_findings, recovery_legs, recovery_rows
from cellplan.jobs.recover.programs import WITHIN
from cellplan.jobs.recover.recover import Recovery, recover
from cellplan.jobs.recover.state import RunPlaces
from cellplan.model.progress import Progress, silent
from cellplan.model.report.exported import ProgramRows, Promise, RobotRows
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.programs.dialects import ESCAPES
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.escapes import EscapeForm, EscapeProgram, EscapeStep, read_escape, require_same
from cellplan.programs.elements.head import head_notes
from cellplan.programs.elements.joints import Angle, exact_numbers
from cellplan.programs.elements.text import comment
from cellplan.programs.export.choice import Choice
from cellplan.programs.export.exporters import exporter_of
from cellplan.programs.export.notes import READ_BACK
from cellplan.programs.export.prepare import PreparedExport, prepare
from cellplan.programs.export.program import write_export
from cellplan.programs.export.record import Record, export_record
from cellplan.programs.export.stored import StoredExport, refuse_other_run
from cellplan.programs.export.verify_export import VerifiedExport
from cellplan.programs.export.written import write
from cellplan.programs.promises.orders import Orders, OrderStretch
from cellplan.programs.promises.promises import waits
from cellplan.programs.rows.margins import corner_vectors, row_tube
from cellplan.programs.rows.thin import bends
from cellplan.programs.seams.executed import BENDS
from cellplan.programs.shared import Shared

OFF: Final = 0.1  # [deg] or [mm] that a robot may stand off its rows, beside what rounding puts it off
OFF_RADIANS: Final = 0.0017  # [rad] the same
ROUNDED_OFF: Final = 1.03  # [-] rounding of zones to sizes that are written


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Homeward:
    """The way home from a mark."""

    number: int  # of the step that begins there, from 1
    phase: str  # name of the phase of the step
    recovery: Recovery  # from the mark home
    legs: tuple[Leg, ...]  # what lies between two waits on it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WrittenEscape:
    """Main programs that set their step registers, and the escape programs to them."""

    files: Mapping[str, str]  # of the main programs
    record: Record  # of these
    main: ProgramRows  # rows of these as they were read
    routes: tuple[Homeward, ...]  # the way home of each step
    programs: Mapping[str, EscapeProgram]  # by robot
    escape_files: Mapping[str, str]
    escape_record: Record


def homewards(run: VerifiedRun, orders: Orders, progress: Progress = silent) -> tuple[Homeward, ...]:
    """The way home from each mark but the last one, with every order of the robots between two waits certified.

    Raises:
        InputError: A robot by itself has a part only for some time: its rows alone do not say whether it has it.
        NotVerifiedError: There is none; with the step and its phase, and the robots or bodies that bar it.
    """
    places, routes = RunPlaces.of(run), list[Homeward]()
    if len(run.cell.robots) == 1 and len({places.lying_at(place) for place in range(len(places.phases))}) > 1:
        raise InputError("--escape: expected a part that rests, or is held throughout, in a cell of one robot")
    for number, (at, stretch) in enumerate(zip(orders.times[:-1], orders.stretches, strict=True), start=1):
        progress("planning the ways home", (number - 1) / len(orders.stretches))
        where = f"no way home from step {number}, '{stretch.phase}' from {at:g} s: "
        try:
            recovery = recover(run, at=at)
            legs = recovery_legs(places, recovery.state, recovery.phases) if recovery.succeeded else ()
        except NotVerifiedError as error:
            raise NotVerifiedError([where + finding for finding in error.findings]) from None
        if not recovery.succeeded:
            raise NotVerifiedError([where + recovery.reason])
        routes.append(Homeward(number=number, phase=stretch.phase, recovery=recovery, legs=legs))
    return tuple(routes)


def escape_programs(
    run: VerifiedRun, form: str, choice: Choice, *, shared: Shared | None = None, progress: Progress = silent
) -> WrittenEscape:
    """The programs of a run in one format, with step registers, and the escape programs to them, judged as read back.

    Raises:
        InputError: The format has no escape programs, or something is not stated in the cell.
        NotVerifiedError: The programs cannot be written, there is no way home from a mark, or a check fails.
    """
    choice, shared = replace(choice, steps=True, promise=choice.promise or Promise.SEQUENCE_ONLY), shared or Shared(run)
    dialect, escape = exporter_of(form, choice), ESCAPES.get(form)
    if escape is None or not isinstance(dialect, Dialect):
        raise ValueError(f"{form}: expected a format with escape programs")
    prepared = prepare(run, dialect, choice, shared=shared, progress=progress)
    written = write(run, prepared, progress=progress)
    (main,) = written.judgement.executed
    (orders,) = prepared.orders or (_one_stretch(run),)
    with without_cache():
        routes = shared.once("homewards", lambda: homewards(run, orders, progress))
        programs = _programs(run, prepared, escape, main, routes)
        files = {name: escape.render(program) for name, program in programs.items()}
        findings = list(escape_findings(run, escape, programs, routes, main, files))
    if findings:
        raise NotVerifiedError([f"{form}: escape: {finding}" for finding in findings])
    joined = {path: text for of_robot in files.values() for path, text in of_robot.items()}
    record = export_record(run, prepared, written)
    digests = {path: digest(text.encode()) for path, text in joined.items()}
    return WrittenEscape(
        files=written.files,
        record=record,
        main=main,
        routes=routes,
        programs=programs,
        escape_files=joined,
        escape_record={**record, "escape": _about(run, programs, routes, orders), "files": digests},
    )


def verify_escape(stored: StoredExport, run: VerifiedRun, *, progress: Progress = silent) -> VerifiedExport:
    """Verify escape programs on disk: they must be those that the run gives, which are judged as they are read.

    Raises:
        InputError: A file is another one, with its first such line; the programs belong to another run.
        NotVerifiedError: The programs cannot be written any more.
    """
    refuse_other_run(stored, run)
    again = escape_programs(run, stored.form, stored.choice, progress=progress)
    for path, text in again.escape_files.items():
        require_same(str(stored.folder / path), text, stored.files.get(path, ""))
    if set(stored.files) != set(again.escape_files) or stored.record["escape"] != again.escape_record["escape"]:
        raise InputError(f"{stored.where}: expected the record of these programs, got another one")
    return VerifiedExport(record=stored.record, remarks=())


def write_escape(folder: Path, escape: WrittenEscape) -> Path:
    """Write main programs to a folder and escape programs to another one beside it, which is returned."""
    escape_folder = folder.with_name(f"{folder.name}-escape")
    write_export(folder, escape.files, escape.record)
    write_export(escape_folder, escape.escape_files, escape.escape_record)
    return escape_folder


def escape_lines(record: Record) -> Iterator[str]:
    """The lines of the record of escape programs."""
    for step in record["escape"]["steps"]:
        yield f"{step['number']}. {step['phase']}, {step['from_s']:g} to {step['to_s']:g} s: {'; '.join(step['way'])}"
    if by_hand := record["escape"]["by_hand"]:
        yield f"no format writes that of {listed(by_hand)}: program its steps by hand"


def escape_findings(
    run: VerifiedRun,
    form: EscapeForm,
    programs: Mapping[str, EscapeProgram],
    routes: Sequence[Homeward],
    main: ProgramRows,
    files: Mapping[str, Mapping[str, str]],
) -> Iterator[str]:
    """What does not hold of the files of escape programs, by robot, as they are read.

    The way back is that of the main program as it was read: its rows backwards, between the same two marks, within
    which every order was certified. The ways home are judged as recoveries are.
    """
    places, read = RunPlaces.of(run), dict[str, EscapeProgram]()
    for name, expected in programs.items():
        read[name] = program = read_escape(form, expected, files[name])
        rows = main.robots[name]
        off = np.abs(program.rows - rows.q[_rows_back(rows)]) if len(program.rows) == len(expected.rows) else np.inf
        if np.any(off > (0.0 if rows.tube is None else WRITTEN_TOL)):
            yield f"'{name}': expected the rows of its main program, read others"
        if program.steps != expected.steps:
            yield f"'{name}': expected the steps of its main program, read others"
        shapes = program.homeward.shape, expected.homeward.shape
        if shapes[0] != shapes[1] or np.any(np.abs(program.homeward - expected.homeward) > WRITTEN_TOL):
            yield f"'{name}': expected the planned rows of the ways home, read others"
            return
    for route in routes:
        tracks = _tracks(places, route, read)
        for finding in leg_findings(places, route.recovery.state, route.recovery.phases, tracks):
            yield f"step {route.number}: {finding}"


def _one_stretch(run: VerifiedRun) -> Orders:
    """All rows of a robot by itself, which waits for none."""
    last = len(run.motion.times) - 1
    stretch = OrderStretch(phase="program", place=0, first=0, last=last)
    return Orders(program=None, stretches=(stretch,), times=(0.0, float(run.motion.times[-1])))


def _tracks(
    places: RunPlaces, route: Homeward, read: Mapping[str, EscapeProgram]
) -> list[tuple[Leg, dict[str, Track]]]:
    """What each robot passes on a way home: as it was read, or as it was planned where it has no program."""
    rows, tracks = recovery_rows(route.recovery.phases), list[tuple[Leg, dict[str, Track]]]()
    at = {name: program.rows[program.steps[route.number - 1].first - 1] for name, program in read.items()}
    for place, leg in enumerate(route.legs):
        by_robot = {}
        for robot in places.cell.robots:
            q = rows[leg.first : leg.last + 1, places.cell.columns(robot.name)]
            if robot.name in read:
                program = read[robot.name]
                span = program.steps[route.number - 1].legs[place] or (1, 0)
                moved = program.homeward[span[0] - 1 : span[1]]
                q = np.stack([at[robot.name], *(moved if len(moved) else [at[robot.name]])])
                at[robot.name] = q[-1]
            by_robot[robot.name] = Track(np.linspace(0.0, 1.0, len(q)), q)
        tracks.append((leg, by_robot))
    return tracks


def _programs(
    run: VerifiedRun, prepared: PreparedExport, form: EscapeForm, main: ProgramRows, routes: Sequence[Homeward]
) -> dict[str, EscapeProgram]:
    frame, cell, programs = prepared.job.frame, run.cell, dict[str, EscapeProgram]()
    for name in frame.robots:
        passed = main.robots[name]
        marks, back = passed.marks or (0, len(passed) - 1), _rows_back(passed)
        steps, homeward = list[EscapeStep](), [passed.q[:1]]
        for route in routes:
            rows, legs = recovery_rows(route.recovery.phases)[:, cell.columns(name)], list[tuple[int, int] | None]()
            for leg in route.legs:
                q = rows[leg.first : leg.last + 1]
                moved = q[bends(q, WITHIN)[1:]] if np.any(q != q[0]) else q[:0]
                begin = sum(map(len, homeward))
                legs.append((begin + 1, begin + len(moved)) if len(moved) else None)
                homeward.append(moved)
            first, last = marks[route.number - 1], marks[route.number]
            off = "" if form.read else _off(prepared, passed, slice(first, last + 1), form.angle)
            steps.append(EscapeStep(route.number, back.index(first) + 1, back.index(last) + 1, off, tuple(legs)))
        notes = [line[2:] for note in _notes(run, prepared, name) for line in comment(note, "#")]
        programs[name] = EscapeProgram(
            frame=frame,
            robot=name,
            notes=tuple(notes),
            rows=passed.q[back],
            homeward=np.concatenate(homeward),
            steps=tuple(steps),
        )
    return programs


def _rows_back(rows: RobotRows) -> list[int]:
    """Rows along which a robot goes back: all that were read, and on seams those between which joints move evenly."""
    is_inner = np.zeros(len(rows), dtype=bool)
    if rows.tube is not None:
        on_seam = np.any(rows.tube[:, 4:] > 0.0, axis=1)
        is_inner[1:-1] = on_seam[:-1] & on_seam[1:]
    return bends(rows.q, BENDS, needed=[*np.flatnonzero(~is_inner).tolist(), *rows.marks])


def _off(prepared: PreparedExport, rows: RobotRows, stretch: slice, angle: Angle) -> str:
    """How far a robot may stand off some of its rows, in the units of the program: by rounding, and in its tube."""
    timed = replace(prepared.job.programs[0].robots[rows.robot], q=rows.q) if rows.times is None else rows
    shares: Array = np.zeros(len(rows)) if rows.rounding is None else ROUNDED_OFF * rows.rounding
    robot, count = prepared.job.frame.robot(rows.robot), rows.q.shape[1]
    numbers = [exact_numbers(robot, q, angle=angle) for q in (rows.q, rows.q + corner_vectors(timed, shares))]
    units = [exact_numbers(robot, q, angle=angle) for q in (np.eye(count), np.zeros((count, count)))]
    tube = row_tube(rows)[:, 2:] @ np.abs(units[0] - units[1])
    least, decimals = (OFF_RADIANS, 6) if angle is Angle.RADIANS else (OFF, 4)
    off = (np.linalg.norm(numbers[1] - numbers[0], axis=1) + np.linalg.norm(tube, axis=1))[stretch]
    return f"{least + off.max(initial=0.0):.{decimals}f}"


def _notes(run: VerifiedRun, prepared: PreparedExport, robot: str) -> Iterator[str]:
    """Notes for the head of an escape program."""
    yield f"cell {run.cell.name}, escape program to {prepared.dialect.name}"
    if len(run.cell.robots) == 1:
        yield "from any of its rows back along these to the first one, then home"
    else:
        yield "from between two marks back along the rows to the first of them, then home"
        yield "start it on all robots; step registers that differ by one keep them from moving"
        yield "all robots then stand at a mark: set the larger number on all controllers"
    yield "every row is a stop"
    yield f"run {run.digest}"
    yield READ_BACK
    yield from head_notes(prepared.job, robot)


def _about(
    run: VerifiedRun, programs: Mapping[str, EscapeProgram], routes: Sequence[Homeward], orders: Orders
) -> Record:
    """What the record says of escape programs beside what that of the main programs says."""
    steps = [
        {
            "number": route.number,
            "phase": route.phase,
            "from_s": orders.times[route.number - 1],
            "to_s": orders.times[route.number],
            "way": [phase.words for phase in route.recovery.phases],
            "waits": len(route.legs) + 1,
        }
        for route in routes
    ]
    return {
        "registers": {name: program.register for name, program in programs.items()},
        "by_hand": [robot.name for robot in run.cell.robots if not waits(run.cell, robot.name)],
        "steps": steps,
    }
