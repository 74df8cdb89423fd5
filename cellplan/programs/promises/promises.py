"""Promises: what holds when controllers play the programs of a run, and why not more."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from cellplan.errors import InputError, InvalidFileError, NotVerifiedError
from cellplan.files.input.findings import listed
from cellplan.model.cell.cell import Cell
from cellplan.model.report.exported import Moves, Promise
from cellplan.model.report.verified_run import AnyRun
from cellplan.model.settings.controllers import ControllerEntry
from cellplan.model.task.task import Service
from cellplan.model.units import MM
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.joints import Axes, unit_of
from cellplan.programs.elements.process import ProcessForm
from cellplan.programs.promises.run_programs import moving_robots, run_programs, spoilt_by_another_order
from cellplan.programs.promises.skew import PER_SECOND, ClockPair, RunSkew, skew_text

BEST_FIRST: Final = (Promise.TIMED, Promise.SYNCHRONISED, Promise.PACED, Promise.SEQUENCE_ONLY)
LAGGING: Final = {"stream": frozenset({"ur", "abb"})}  # servoj and EGM follow 0.03 to 0.2 s late
ONE_CLOCK: Final = "timed for one controller; several controllers agree only to their start skew"


@dataclass(frozen=True, slots=True, kw_only=True)
class Promised:
    """What is promised."""

    promise: Promise
    reasons: tuple[str, ...] = ()  # why it is not a better one, one for each better one
    remarks: tuple[str, ...] = ()  # under which conditions it holds


class _Against(NamedTuple):
    """Why a promise cannot be made, and whether that is for want of something that the cell may state."""

    text: str
    is_input: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class _Export:
    """What is exported, and what is known of it."""

    run: AnyRun
    dialect: Dialect
    robots: tuple[str, ...]
    skew: RunSkew | None
    requested: Promise | None
    moves: Moves

    @property
    def promises(self) -> tuple[Promise, ...]:
        """What the format can state of these robots, the best first; in step only so many arms on one controller."""
        count, most = len(self.robots), self.dialect.most_arms
        arms = sum(bool(Axes.of(self.run.cell.robot(name)).arm) for name in self.robots)
        is_split = len(set(controllers_of(self.run.cell, self.robots).values())) > 1
        cannot = most is not None and (is_split or arms == count or not 0 < arms <= most)
        return tuple(it for it in self.dialect.promises if not (cannot and it is Promise.SYNCHRONISED))

    @property
    def controllers(self) -> dict[str, ControllerEntry]:
        """The stated controllers of the robots that are exported, by name."""
        stated = self.run.cell.controllers
        return {name: stated[name] for name in controllers_of(self.run.cell, self.robots).values() if name in stated}


def choose_promise(
    run: AnyRun,
    dialect: Dialect,
    robots: Sequence[str],
    *,
    skew: RunSkew | None = None,
    requested: Promise | None = None,
    moves: Moves = Moves.JOINTS,
) -> Promised:
    """The best promise that a format can keep for some robots of a run, or the one that is asked for.

    Args:
        skew: How far the starts of controllers may be apart; None where it is unknown, or there is one only.
        requested: The only promise that will do; None for the best.
        moves: How tools move where they work; ``paced`` takes lines and arcs.

    Raises:
        InputError: None can be kept, as something is not stated in the cell.
        NotVerifiedError: None can be kept with this motion; the first line says why not the least one that the format
            can hold, indented ones say why not the better ones.
    """
    export = _Export(run=run, dialect=dialect, robots=tuple(robots), skew=skew, requested=requested, moves=moves)
    promise, failures = _best(export)
    reasons = tuple(f"not {better}: {reason.text}" for better, reason in failures.items())
    return Promised(promise=promise, reasons=reasons, remarks=tuple(_remarks(export, promise)))


def require_promise(
    run: AnyRun, dialect: Dialect, robots: Sequence[str], *, requested: Promise | None, moves: Moves
) -> Promise:
    """The promise of ``choose_promise`` alone, as far as it does not depend on skews."""
    export = _Export(run=run, dialect=dialect, robots=tuple(robots), skew=None, requested=requested, moves=moves)
    return _best(export)[0]


def _best(export: _Export) -> tuple[Promise, dict[Promise, _Against]]:
    """The best promise that can be kept, and what is against better ones; errors as those of ``choose_promise``."""
    dialect, failures = export.dialect, dict[Promise, _Against]()
    for promise in BEST_FIRST:
        if promise is Promise.PACED and (export.moves is Moves.JOINTS or promise not in dialect.promises):
            continue  # joints have no speed of a tool
        against = _against(export, promise)
        if against is None:
            return promise, failures
        failures[promise] = against
    unstated = [against.text for against in failures.values() if against.is_input]
    if unstated:
        raise InvalidFileError([InputError(text) for text in unstated])
    *better, last = [promise for promise in failures if promise in export.promises]
    details = [f"  not {promise}: {failures[promise].text}" for promise in better]
    raise NotVerifiedError([f"{dialect.name}: not {last}: {failures[last].text}", *details, f"  cure: {_cure(export)}"])


def _cure(export: _Export) -> str:
    """What helps where the motion of a cell keeps a format from promising anything."""
    cell, form = export.run.cell, export.dialect.name
    every = [robot.name for robot in cell.robots]
    groups: dict[str, list[str]] = {}
    for robot, controller in controllers_of(cell, every).items():
        groups.setdefault(controller, []).append(robot)
    rest = "or let the part rest while a tool is in process (motion.mode: semi_coordinated or part_at_rest)"
    timed = "export joint tables that keep the plan's times (--format stream, csv, json, ros2 or wide)"
    if Promise.SYNCHRONISED in export.promises:
        if len(groups) > 1:
            return f"state one controller for {listed(every)}, if it moves them all, {rest}; {timed}"
        return f"export all robots of controller '{next(iter(groups))}' together, without --robot, {rest}; {timed}"
    shared = next(
        (f"{listed(names)} share controller '{name}'" for name, names in groups.items() if len(names) > 1), ""
    )
    why = f"{shared}, but {form} as cellplan writes it moves each robot by a program of its own: " if shared else ""
    return f"{why}{timed}, {rest}"


def controllers_of(cell: Cell, robots: Sequence[str]) -> dict[str, str]:
    """Name of the controller of each robot; one without a stated controller counts as having one of its own."""
    controllers = {}
    for name in robots:
        control = cell.robot(name).control
        controllers[name] = f"that of {name}" if control is None else control.id
    return controllers


def _against(export: _Export, promise: Promise) -> _Against | None:
    """Why a promise cannot be made; None where it can."""
    if promise not in export.promises:
        return _Against(f"{export.dialect.name} programs cannot state it")
    if export.requested is not None and promise is not export.requested:
        return _Against(f"'{export.requested}' was asked for")
    match promise:
        case Promise.TIMED if export.moves is not Moves.JOINTS and Promise.PACED in export.dialect.promises:
            return _Against("lines and arcs of a tool have no times")
        case Promise.TIMED:
            return _against_timed(export)
        case Promise.SYNCHRONISED:
            return _against_synchronised(export)
        case Promise.PACED | Promise.SEQUENCE_ONLY:
            return _against_sequence(export)


def _against_timed(export: _Export) -> _Against | None:
    """Why the rows are not passed at their times."""
    kinds = LAGGING.get(export.dialect.name, frozenset())
    for name, controller in export.controllers.items():
        if (export.dialect.lags or controller.kind in kinds) and controller.latency_ms is None:
            text = (
                f"controllers.{name}.latency_ms: expected the time by which its robots follow what "
                f"{export.dialect.name} sends to them, got none"
            )
            return _Against(text, is_input=True)
    for pair in () if export.skew is None else export.skew.broken(export.robots):
        return _Against(_broken_skew(export.skew, pair))
    return None


def _broken_skew(skew: RunSkew | None, pair: ClockPair) -> str:
    """What is stated of two clocks and what is allowed."""
    cycle = "" if skew is None else f"; {skew.shortest_cycle(pair)}"
    return (
        f"'{pair.first}' and '{pair.second}': the stated skew of {_ms(pair.stated or 0.0)} is more than the allowed "
        f"{skew_text(pair.allowed)} ({pair.reason}){cycle}"
    )


def _against_synchronised(export: _Export) -> _Against | None:
    """Why the robots do not pass the same rows at the same time."""
    cell, robots = export.run.cell, export.robots
    dialect = export.dialect
    no_lines = _no_lines(export)
    if export.moves is Moves.LINEAR and not dialect.has_part_targets and no_lines:
        return _Against(f"{no_lines} (--moves joints)")
    is_free = export.requested is None and dialect.has_joint_seams and export.moves is Moves.LINEAR
    if is_free and _against_sequence(export) is None:
        return _Against(f"{dialect.name} moves tools relative to another robot only where the part moves meanwhile")
    if len(robots) < 2:
        return _Against(f"it takes two robots on one controller, and only '{robots[0]}' is exported")
    names = list(dict.fromkeys(controllers_of(cell, robots).values()))
    if len(names) > 1:
        return _Against(f"the robots are on {len(names)} controllers ({listed(names)})")
    others = {name for played in run_programs(export.run) for name in moving_robots(cell, played)} - set(robots)
    if others:
        return _Against(f"{listed(sorted(others))} moves too and is not in the program of controller {names[0]}")
    return None


def _no_lines(export: _Export) -> str:
    """Why tools do not move on lines and arcs while robots move in step; empty where they do."""
    dialect = export.dialect
    if dialect.has_lines_of(map(export.run.cell.robot, export.robots)):
        return ""
    arms = "other than one arm" if dialect.has_seams_in_step else "robots"
    return f"{dialect.name} moves tools by joints where {arms} move in step"


def _against_sequence(export: _Export) -> _Against | None:
    """Why robots that only wait for one another at marks spoil something."""
    cell = export.run.cell
    if len(cell.robots) == 1:
        return None
    for played in run_programs(export.run):
        for reason in spoilt_by_another_order(cell, played):
            return _Against(reason)
    return None


def _remarks(export: _Export, promise: Promise) -> Iterator[str]:
    """Under which conditions a promise holds."""
    cell = export.run.cell
    every = [robot.name for robot in cell.robots]
    match promise:
        case Promise.TIMED:
            if len(set(controllers_of(cell, every).values())) > 1:
                yield ONE_CLOCK
            yield from _skew_remarks(export)
            if Promise.SEQUENCE_ONLY in export.dialect.promises and _against_sequence(export) is None:
                yield from _unmet(export)
        case Promise.SYNCHRONISED:
            yield "same row at the same time within the blend zones; the controller may take longer than planned"
            if not _no_lines(export) and export.moves is not Moves.JOINTS:
                yield "on seams the tool moves at the programmed speed on the part, also where the part moves"
                yield from _processes(export)
            elif export.dialect.has_seams_in_step and export.moves is Moves.AUTO:
                yield f"no lines: {_no_lines(export)}"
            yield from _stays(export)
        case Promise.PACED:
            yield "on seams the tool moves at the programmed speed; times between robots are not kept"
            yield "accelerations are those of the controllers and are not judged"
            yield from _units(export)
            yield from _processes(export)
            yield from _unwritten(cell)
            yield from _stays(export)
        case Promise.SEQUENCE_ONLY:
            yield "the controller makes the speed between rows: times and feeds of the plan are not kept"
            yield from _units(export)
            yield from _unwritten(cell)
            yield from _stays(export)


def _unmet(export: _Export) -> Iterator[str]:
    """What timed programs without waits are no match for: robots of other formats that wait for them."""
    others = [robot.name for robot in export.run.cell.robots if robot.name not in export.robots]
    if any(waits(export.run.cell, name) for name in others):
        yield "not to be played with programs that wait at marks: --promise sequence writes those that do"


def _units(export: _Export) -> Iterator[str]:
    """Robots that one program moves in step, whatever others do."""
    for unit in dict.fromkeys(unit_of(export.run.cell, name) for name in export.robots):
        if len(unit) > 1:
            yield f"{' and '.join(unit)} pass the same rows at the same time, as axes of one program"


def _unwritten(cell: Cell) -> Iterator[str]:
    """Robots that have to wait at the marks, and that no format is written for."""
    names = [robot.name for robot in cell.robots if not waits(cell, robot.name)]
    if names and len(cell.robots) > 1:
        yield f"no format writes the waits of {listed(names)}: program the marks of export.json there by hand"


def unstated_processes(cell: Cell, robots: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Robots whose tasks have a process of which their controllers state no statement: key of these, and a remark."""
    for robot in robots:
        control = cell.robot(robot).control
        has_process = any(task.robot == robot and task.process is not None for task in cell.tasks)
        if control is not None and has_process and cell.controllers[control.id].process is None:
            key = f"controllers.{control.id}.process"
            yield key, f"no statement of a process is written for '{robot}': state {key}"


def _processes(export: _Export) -> Iterator[str]:
    """Where a controller takes the speed of the tool from data of its own, and where no process is written."""
    cell = export.run.cell
    yield from (remark for _, remark in unstated_processes(cell, export.robots))
    for robot in export.robots:
        control = cell.robot(robot).control
        tasks = [task for task in cell.tasks if task.robot == robot and task.process is not None]
        form = None if control is None else ProcessForm.of(cell.controllers[control.id])
        if form is None:
            continue
        held = dict.fromkeys((form.feed_in(task.name), task.feed) for task in tasks if task.has_one_feed)
        for data, feed in held:
            if data is not None and feed is not None:
                yield f"the tool of '{robot}' moves at {MM * feed:g} mm/s if {data} holds it"


def _stays(export: _Export) -> Iterator[str]:
    """Times for which tools are cleaned, for which programs without times do not wait."""
    for robot in export.robots:
        of_robot = (task for task in export.run.cell.tasks if task.robot == robot)
        names = [it.name for it in of_robot if any(isinstance(p, Service) for p in (*it.via_before, *it.via_after))]
        if names and (service := export.run.cell.robot(robot).service):
            yield (
                f"no wait is written for the {service.takes:g} s in which the tool of '{robot}' is cleaned (via points "
                f"of {listed(names)}): add one where it stands in robots.{robot}.service.at"
            )


def waits(cell: Cell, robot: str) -> bool:
    """Whether the controller of a robot plays a format whose programs wait for one another at marks."""
    control = cell.robot(robot).control
    kind = None if control is None else cell.controllers[control.id].kind
    return any(kind in dialect.kinds and Promise.SEQUENCE_ONLY in dialect.promises for dialect in DIALECTS.values())


def _skew_remarks(export: _Export) -> Iterator[str]:
    """What robots on other controllers, and interfaces that lag, ask for."""
    cell = export.run.cell
    for name, controller in export.controllers.items():
        if controller.latency_ms is not None:
            yield f"controller {name} follows {_ms(controller.latency_ms.si)} late: start it that much earlier"
    every = [robot.name for robot in cell.robots]
    for pair in () if export.skew is None else export.skew.broken(every):
        yield f"not to be played together with the robots of other controllers: {_broken_skew(export.skew, pair)}"


def _ms(seconds: float) -> str:
    """A time in milliseconds."""
    return f"{PER_SECOND * seconds:.4g} ms"
