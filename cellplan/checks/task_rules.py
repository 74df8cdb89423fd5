"""Rules of a program for its tasks: who does them, which begin together, and which come first, over all phases."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from cellplan.checks.clearance.phase_ends import JudgedPhase
from cellplan.geometry.arrays import Array
from cellplan.measures.weld_position import resting_pairs
from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import Check, Report
from cellplan.model.settings.program import groups_of
from cellplan.model.task.task import Service

ROUNDING: Final = 1e-6  # [s] of times between rows


@dataclass(frozen=True, slots=True, kw_only=True)
class _Arc:
    """The time in which a tool is on its path, with the delays of its process."""

    task: str
    robot: str
    place: int  # number of its phase
    origin: float  # time of the program in [s] at which that phase begins
    begin: float  # time of the program in [s]
    end: float
    points: Array  # of its path on the part in [m], shape (N, 3)


PlacedCheck = tuple[int, Check]  # number of a phase, and a check at a time of it


def with_task_rules(cell: Cell, phases: Sequence[JudgedPhase], reports: Sequence[Report]) -> list[Report]:
    """The reports of the phases of one cycle with the checks of the rules, each where the later task begins."""
    checks: dict[int, list[Check]] = {}
    for place, check in check_task_rules(cell, phases):
        checks.setdefault(place, []).append(check)
    return [replace(report, checks=(*report.checks, *checks.get(place, ()))) for place, report in enumerate(reports)]


def check_task_rules(cell: Cell, phases: Sequence[JudgedPhase]) -> Iterator[PlacedCheck]:
    """Every rule of the program between tasks that are worked on, with the number of the phase that it is judged in."""
    arcs = _arcs(phases)
    for names in groups_of(cell.program.same_robot):
        group = sorted((arcs[name] for name in names if name in arcs), key=lambda arc: arc.begin)
        if len(group) > 1:
            robots = sorted({arc.robot for arc in group})
            words = f"done by {', '.join(robots)}, one robot is demanded"
            yield _check("same_robot", group, (len(robots), 1, ""), words, passed=len(robots) == 1)
    for names in groups_of(cell.program.together):
        group = sorted((arcs[name] for name in names if name in arcs), key=lambda arc: arc.begin)
        if len(group) > 1:
            apart = group[-1].begin - group[0].begin
            words = f"begin within {apart:.4g} s, together is demanded"
            yield _check("together", group, (apart, 0.0, "s"), words, passed=apart <= ROUNDING)
    tacks = [task.name for task in cell.tasks if task.is_tack]
    pairs: dict[str, list[tuple[_Arc, _Arc]]] = {}
    for first, later, key in cell.program.in_order(tacks, [task.name for task in cell.tasks]):
        if first in arcs and later in arcs:
            pairs.setdefault(key, []).append((arcs[first], arcs[later]))
    for key, ordered in pairs.items():
        worst = min(ordered, key=lambda pair: pair[1].begin - pair[0].end)
        after = worst[1].begin - worst[0].end
        words = f"the second begins {after:.4g} s after the end of the first, at least 0 is demanded by program.{key}"
        yield _check("task_order", worst, (after, 0.0, "s"), words, passed=after >= -ROUNDING)
    if cell.program.rest_s is not None:
        yield from _rests(cell, arcs, cell.program.rest_s)
    yield from _services(cell, arcs)


def _rests(cell: Cell, arcs: Mapping[str, _Arc], least: float) -> Iterator[PlacedCheck]:
    """For each task the shortest rest after one that warms its place, of at least some time in [s]."""
    together = [frozenset(names) for names in groups_of(cell.program.together)]
    paths = {task.name: arcs[task.name].points for task in cell.tasks if task.name in arcs and task.is_on_part}
    rests: dict[str, tuple[float, _Arc, _Arc]] = {}
    for pair in resting_pairs(paths, cell.program.apart):
        if not any(group.issuperset(pair) for group in together):
            first, later = sorted((arcs[name] for name in pair), key=lambda arc: arc.begin)
            between = later.begin - first.end, first, later
            rests[later.task] = min(between, rests.get(later.task, between), key=lambda it: it[0])
    for rest, first, later in rests.values():
        words = f"the part cools for {rest:.4g} s between them, at least {least:g} s is demanded"
        yield _check("rest", (first, later), (rest, least, "s"), words, passed=rest >= least - ROUNDING)


def _services(cell: Cell, arcs: Mapping[str, _Arc]) -> Iterator[PlacedCheck]:
    """For each robot whose tool is cleaned the most tasks between two services; of several cycles, over two of them."""
    for robot in (it for it in cell.robots if it.service is not None):
        done = sorted((arc for arc in arcs.values() if arc.robot == robot.name), key=lambda arc: arc.begin)
        groups = list[list[_Arc]]([[]])
        for arc in done * min(cell.program.cycles, 2):
            task = cell.task(arc.task)
            is_clean = any(isinstance(it, Service) for it in task.via_before)
            groups = [*groups, [arc]] if is_clean else [*groups[:-1], [*groups[-1], arc]]
            groups += [[]] if any(isinstance(it, Service) for it in task.via_after) else []
        longest, most = max(groups, key=len), robot.service.most if robot.service else 0
        if longest:
            words = f"done by {robot.name} between two services, at most {most} are demanded"
            measured = len(longest), most, ""
            yield _check("service", longest[: most + 1], measured, words, passed=len(longest) <= most)


def _arcs(phases: Sequence[JudgedPhase]) -> dict[str, _Arc]:
    """The tasks on the clock of the program, by name."""
    arcs, origin = dict[str, _Arc](), 0.0
    for place, phase in enumerate(phases):
        for scheduled in phase.schedule.tasks:
            task, times = scheduled.task, phase.schedule.times
            arcs[task.name] = _Arc(
                task=task.name,
                robot=task.robot,
                place=place,
                origin=origin,
                begin=origin + task.start,
                end=origin + scheduled.end + task.off_delay,
                points=scheduled.X_PT[(times >= scheduled.begin) & (times <= scheduled.end), :3, 3],
            )
        origin += float(phase.report.times[-1])
    return arcs


def _check(
    name: str, arcs: Sequence[_Arc], measured: tuple[float, float, str], words: str, *, passed: bool
) -> PlacedCheck:
    """The check of tasks, in the phase of the last of them.

    Args:
        measured: Value, limit and unit.
    """
    last = arcs[-1]
    value, limit, unit = measured
    subject = ", ".join(arc.task for arc in arcs)
    message = f"tasks {subject}: {words}"
    check = Check(name, subject, passed, message, value=value, limit=limit, unit=unit, at_s=last.begin - last.origin)
    return last.place, check
