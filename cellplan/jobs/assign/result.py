"""An assignment as record, text and page: what is shown, and in which order."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, Final

from cellplan.jobs.assign.assign import Assignment, AssignmentBound, has_open_rests
from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import CAUTION
from cellplan.report.page.figures import figure
from cellplan.report.page.kind import ResultKind
from cellplan.report.page.render import template
from cellplan.report.page.time_line import time_line
from cellplan.report.plots.palette import robot_colours
from cellplan.report.record.common import Record, number
from cellplan.report.record.rows import Tables, columns_of, flat
from cellplan.report.text.method import counted
from cellplan.runs.solution import Run
from cellplan.runs.write_run import versions
from cellplan.search.assign.problem.instance import Instance
from cellplan.search.assign.schedules.order import SequencedBlocks
from cellplan.search.assign.schedules.solver import solver_version

SCHEMA: Final = "cellplan.assignment/1"
BOUND_SCHEMA: Final = "cellplan.assignment-bound/1"
HOLDS_FOR: Final = (
    "programs in blocks at the chosen poses of the part, with the modes that were found and the conflicts as listed"
)
MOVING: Final = "; of blocks in which the part moves, for those that were planned and passed all checks"
NO_SOLVER: Final = "no lower bound is known, as OR-Tools is not installed: pip install 'cellplan[assign]'"
OPEN_RESTS: Final = "no lower bound is known of a program that is retimed and in which the part cools between tasks"


# The record: assign.json


def assign_record(assignment: Assignment) -> dict[str, Any]:
    """The assignment in printed units: content of ``assign.json``."""
    instance, sequenced = assignment.instance, assignment.sequenced
    step, cycle = instance.step, assignment.cycle
    works = [run for run in assignment.solution.runs if run.schedule.tasks]
    failed = [check.message for run in assignment.solution.runs for check in run.report.checks if not check.passed]
    blocks = [
        _block(assignment, place, run, begin)
        for place, (run, begin) in enumerate(zip(works, _begins(assignment.solution.runs), strict=True))
    ]
    waits = _waits(instance.robots, blocks)
    return {
        "schema": SCHEMA,
        "cell": assignment.cell.name,
        "status": "passed" if assignment.passed else "partial" if assignment.solution.passed else "failed",
        "left_out": list(assignment.left_out),
        "cycle_time_s": number(cycle),
        "model_cycle_s": number(assignment.model_cycle),
        "bound_s": number(assignment.bound),
        "bound_holds_for": _holds_for(assignment),
        "gap_percent": number(100.0 * (cycle / assignment.bound - 1.0)) if assignment.bound else None,
        "is_proved": assignment.is_proved,
        "greedy_cycle_s": number(assignment.greedy),
        "binding": _binding(assignment, blocks, waits),
        "blocks": blocks,
        "alternatives": [_alternative(assignment, it) for it in assignment.alternatives],
        "robots": {name: _use(assignment, blocks, waits, name) for name in instance.robots},
        "not_available": {name: {"cycle_with_s": number(cycle)} for name, cycle in assignment.with_more.items()},
        "only_one_robot": _only_one_robot(instance),
        "part_moves_s": number(step * _part_steps(assignment)),
        "stations": len({station for station, _ in sequenced.stops}),
        "rounds": assignment.rounds,
        "counts": dict(assignment.counts),
        "failed": failed,
        "inputs": dict(assignment.draft.inputs),
        "versions": versions() | solver_version(),
    }


def bound_record(bound: AssignmentBound) -> dict[str, Any]:
    """The bound of an assignment without a program: content of ``assign.json``."""
    instance, answer = bound.instance, bound.answer
    is_open = has_open_rests(bound.draft, instance)
    steps = None if is_open else answer.bound
    return {
        "schema": BOUND_SCHEMA,
        "cell": bound.draft.name,
        "bound_s": number(steps, instance.step),
        "bound_holds_for": OPEN_RESTS if is_open else NO_SOLVER if steps is None else HOLDS_FOR,
        "is_proved": answer.is_proved,
        "blocks": [] if answer.schedule is None else [list(block) for block in answer.schedule.blocks],
        "only_one_robot": _only_one_robot(instance),
        "counts": dict(bound.counts),
        "inputs": dict(bound.draft.inputs),
        "versions": versions() | solver_version(),
    }


def bound_lines(record: Record) -> list[str]:
    """All lines on the terminal."""
    if record["bound_s"] is None:
        return [f"{record['cell']}: {record['bound_holds_for']}"]
    proved = "the block model is solved to its end" if record["is_proved"] else "more --effort may raise it"
    return [
        f"{record['cell']}: lower bound {record['bound_s']:g} s, of {record['bound_holds_for']}",
        f"  {len(record['blocks'])} blocks at {record['counts']['stations']} poses; {proved}; no program was made",
    ]


def _only_one_robot(instance: Instance) -> dict[str, str]:
    """The robot of each task that one alone can do."""
    able = {task: sorted({robot for robot, _ in instance.options[task]}) for task in instance.tasks}
    return {task: robots[0] for task, robots in able.items() if len(robots) == 1}


def _holds_for(assignment: Assignment) -> str:
    """What the lower bound holds for, or why there is none."""
    if assignment.bound is not None:
        return HOLDS_FOR + (MOVING if assignment.draft.assign and assignment.draft.assign.groups else "")
    return OPEN_RESTS if has_open_rests(assignment.draft, assignment.instance) else NO_SOLVER


def _begins(runs: Sequence[Run]) -> Iterator[float]:
    """Times of the program at which phases with tasks begin, in [s]."""
    begin = 0.0
    for run in runs:
        if run.schedule.tasks:
            yield begin
        begin += run.report.cycle_time


def _block(assignment: Assignment, place: int, run: Run, begin: float) -> dict[str, Any]:
    """One block: its tasks by robot, with their times in the program."""
    instance = assignment.instance
    station, ends = assignment.sequenced.stops[place]
    return {
        "block": place + 1,
        "phase": run.phase.name,
        "station": station,
        "begin_s": number(begin),
        "end_s": number(begin + run.report.cycle_time),
        "cleaned_before": sorted(assignment.sequenced.schedule.cleaned(instance)[place]),
        "tasks": {
            robot: {
                "task": end.mode.task,
                "work_s": number(instance.steps(end.mode.task) * instance.step),
                "is_reversed": end.is_reversed,
            }
            for robot, end in zip(instance.robots, ends, strict=True)
            if end is not None
        },
    } | ({"part_moves": True} if station in instance.columns else {})


def _waits(robots: Sequence[str], blocks: Sequence[Record]) -> dict[str, dict[str, float]]:
    """How long each robot waits in blocks for the robots whose tasks are the longest there, in [s]."""
    waits: dict[str, dict[str, float]] = {robot: {} for robot in robots}
    for block in blocks:
        length = block["end_s"] - block["begin_s"]
        longest = max(block["tasks"], key=lambda robot: block["tasks"][robot]["work_s"])
        for robot, of_robot in waits.items():
            work = block["tasks"][robot]["work_s"] if robot in block["tasks"] else 0.0
            if robot != longest and length > work:
                of_robot[longest] = round(of_robot.get(longest, 0.0) + length - work, 6)
    return waits


def _alternative(assignment: Assignment, other: SequencedBlocks) -> dict[str, Any]:
    """Another schedule: its figures, and what is different in it: robots, else blocks, else poses of the part."""
    best = assignment.sequenced.schedule
    others = {task: robot for task, (robot, _) in other.schedule.chosen.items() if robot != best.chosen[task][0]}
    blocks = set(map(frozenset, best.blocks))
    words = [f"{task} by {robot}" for task, robot in others.items()]
    words = words or [" with ".join(block) for block in other.schedule.blocks if frozenset(block) not in blocks]
    return {
        "model_cycle_s": number(other.steps * assignment.instance.step),
        "blocks": [list(block) for block in other.schedule.blocks],
        "stations": len({station for station, _ in other.stops}),
        "other_robots": others,
        "words": ", ".join(words) or "other poses of the part",
    }


def _use(assignment: Assignment, blocks: Sequence[Record], waits: Mapping[str, Record], robot: str) -> dict[str, Any]:
    """How long a robot works, and the share of the cycle; for whom it waits, and what the cycle would be without it."""
    tasks = [block["tasks"][robot] for block in blocks if robot in block["tasks"]]
    work, without = sum(task["work_s"] for task in tasks), assignment.without[robot]
    return {
        "tasks": len(tasks),
        "work_s": number(work),
        "use_percent": number(100.0 * work / assignment.cycle),
        "waits_s": waits[robot],
        "cycle_without_s": number(without),
    }


def _binding(assignment: Assignment, blocks: Sequence[Record], waits: Mapping[str, Record]) -> dict[str, Any]:
    """What the cycle is made of."""
    work = sum(block["end_s"] - block["begin_s"] for block in blocks)
    cools = sum(assignment.sequenced.waits) * assignment.instance.step
    busiest = min(waits, key=lambda robot: sum(waits[robot].values()))
    return {
        "busiest_robot": busiest,
        "blocks_s": number(work),
        "transfers_s": number(assignment.cycle - work - cools),
        "cools_s": number(cools),
        "waiting_s": number(sum(time for of_robot in waits.values() for time in of_robot.values())),
    }


def _part_steps(assignment: Assignment) -> int:
    """Steps of the part from home over all stations and back."""
    places = [None, *(station for station, _ in assignment.sequenced.stops), None]
    return sum(assignment.instance.station_steps(a, b) for a, b in pairwise(places) if a != b)


# Text


def assign_lines(record: Record) -> list[str]:
    """All lines on the terminal."""
    binding, only = record["binding"], record["only_one_robot"]
    bound = f"  {record['bound_holds_for']}"
    if record["bound_s"] is not None:
        above = f"the program is {record['gap_percent']:.3g} % above it"
        bound = f"  lower bound {record['bound_s']:g} s, of {record['bound_holds_for']}; {above}"
    lines = [
        f"{record['cell']}: {record['status']}, {record['cycle_time_s']:g} s",
        bound,
        f"  {len(record['blocks'])} blocks {binding['blocks_s']:g} s, transfers {binding['transfers_s']:g} s; "
        + (f"for {binding['cools_s']:g} s the part cools; " if binding["cools_s"] else "")
        + _part_words(record),
        f"  a greedy schedule, scarce tasks first, would take {record['greedy_cycle_s']:g} s by the model",
    ]
    for name, use in record["robots"].items():
        busiest = " (busiest)" if name == binding["busiest_robot"] else ""
        work = f"{counted(use['tasks'], 'task')}, {use['work_s']:g} s at work, {use['use_percent']:.3g} %{busiest}"
        without = "has tasks that no other robot can do"
        if use["cycle_without_s"] is not None:
            without = f"without it about {use['cycle_without_s']:g} s"
        lines.append(f"  {name}: {work}; {without}{_wait_words(use['waits_s'])}")
    for name, it in record["not_available"].items():
        cycle = it["cycle_with_s"]
        lines.append(f"  {name}: not available; with it {'no schedule' if cycle is None else f'about {cycle:g} s'}")
    if only:
        lines.append("  done by one robot alone: " + ", ".join(f"{task} ({robot})" for task, robot in only.items()))
    for block in record["blocks"]:
        tasks = ", ".join(f"{robot} {it['task']}" for robot, it in block["tasks"].items())
        words = ", the part moves" if "part_moves" in block else ""
        if block["cleaned_before"]:
            words += f"; before it the tools of {', '.join(block['cleaned_before'])} are cleaned"
        lines.append(f"  {block['phase']} {block['begin_s']:g} to {block['end_s']:g} s: {tasks}{words}")
    lines += dict.fromkeys(f"  nearly as good: {_alternative_words(other)}" for other in record["alternatives"])
    lines += [f"  LEFT OUT {message}" for message in record["left_out"]]
    return [*lines, *(f"  FAILED {message}" for message in record["failed"])]


def _wait_words(waits: Record) -> str:
    """For whom a robot waits in blocks, and how long."""
    return "; waits " + ", ".join(f"{time:.3g} s for {other}" for other, time in waits.items()) if waits else ""


def _alternative_words(other: Record) -> str:
    """A schedule that is nearly as good."""
    figures = f"{other['model_cycle_s']:g} s by the model in {len(other['blocks'])} blocks, {other['stations']} poses"
    return f"{figures}; {other['words']}"


def _part_words(record: Record) -> str:
    """How long the part moves."""
    if not record["part_moves_s"]:
        return "the part rests"
    return f"the part moves for {record['part_moves_s']:g} s over {record['stations']} poses"


# Page


def assign_page(record: Record, run: Record, cell: Cell) -> str:
    """The page of an assignment.

    Args:
        record: The assignment's.
        run: The ``report.json`` of its run.
        cell: The program.
    """
    return template("jobs/assign/assign.html").render(
        r=record,
        figures=[
            figure("cycle", f"{record['cycle_time_s']:g}", "s", is_bad=record["status"] != "passed"),
            *_bound_figure(record),
        ],
        several=True,
        line=time_line(run, cell),
        colours=robot_colours(cell),
        caution=CAUTION,
    )


def _bound_figure(record: Record) -> list[dict[str, Any]]:
    """The lower bound at the top of the page; nothing where none is known."""
    if record["bound_s"] is None:
        return []
    return [figure("lower bound", f"{record['bound_s']:g}", "s", note=record["bound_holds_for"])]


# Tables


def assign_tables(record: Record) -> Tables:
    """The tables of frames and notebooks: tasks in their blocks, and the use of the robots."""
    tasks = [
        {"block": block["block"], "begin_s": block["begin_s"], "robot": robot, **it}
        for block in record["blocks"]
        for robot, it in block["tasks"].items()
    ]
    robots = [{"robot": name, **use} for name, use in record["robots"].items()]
    return {"tasks": lambda: columns_of(map(flat, tasks), []), "robots": lambda: columns_of(map(flat, robots), [])}


ASSIGNMENT: Final = ResultKind(
    name="assignment",
    title="Assignment",
    file="assign.json",
    made_of=Assignment,
    record=assign_record,
    tables=assign_tables,
    shown={"robots": ("robot", "tasks", "work_s", "use_percent")},
)
