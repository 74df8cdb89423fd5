"""The scene of a stored run: its motion as the series have it, and what its reports say of it."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final

import numpy as np

from cellplan.errors import InputError
from cellplan.files.run.stored import SERIES, StoredRun
from cellplan.geometry.arrays import Array
from cellplan.jobs.view.describe import cell_record, excluded_records, place_record
from cellplan.jobs.view.geometries import Geometries
from cellplan.jobs.view.nearest import ViewedStretch, nearest_record, sampled_rows
from cellplan.jobs.view.result import packed
from cellplan.model.cell.cell import Cell
from cellplan.report.record.common import Record
from cellplan.report.record.common import number as plain
from cellplan.report.record.numbers import floored, seconds
from cellplan.report.record.phases import instant_text
from cellplan.runs.plan.demanded import DemandedProgram

MOST_NUMBERS: Final = 800_000  # [-] joint positions of a page: 4.3 MB in base64
TIME_DECIMALS: Final = 6  # of [s]
DISTANCE_DECIMALS: Final = 4  # of [mm]
SAME_TIME: Final = 1e-9  # [s] within which the end of a phase is the begin of the next


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ViewedPhase:
    """A phase as it is played."""

    name: str  # name of the phase
    place: str  # folder of its report in the run
    begin: float  # when it begins on the clock of the program in [s]
    number: int  # number among the phases of one cycle
    times: Array  # times of its rows on the clock of the program in [s], shape (N,)
    q: Array  # stacked joint positions in [rad] or [m], shape (N, nq)
    gap_times: Array  # times on the clock of the program for which the report certifies a distance in [s], shape (M,)
    distances: Array  # what all pairs keep about each of them in [mm], shape (M,); what is not finite is not known


def run_scene(stored: StoredRun, cell: Cell, geometries: Geometries) -> Record:
    """The scene of a run."""
    program = DemandedProgram.of(cell)
    played = list(_played(stored, cell, program.labels))
    scenes = program.scenes(cell)
    times, q, firsts = _joined(played)
    bodies = scenes[0].bodies
    index = {body.name: number for number, body in enumerate(bodies)}
    contacts = list(_contacts(stored, played, index))
    failures = list(_failures(stored, played, cell, index))
    further: list[float | None] = [time for contact in contacts for time in (contact["first"], contact["last"])]
    further += [failure["at"] for failure in failures]
    further += [at for one in played for at in _worst_times(stored.records[one.place], one.begin)]
    ends = [*firsts[1:], len(times)]
    stretches = [ViewedStretch(scenes[one.number], *rows) for one, *rows in zip(played, firsts, ends, strict=True)]
    record = cell_record(cell, bodies, geometries)
    return {
        **record,
        "facts": _facts(stored.record),
        "remarks": [*record["remarks"], *stored.record.get("not_in_program", [])],
        "passed": stored.record["status"] == "passed",
        "part": _part_places(played, program.cells),
        "motion": motion_record(times, q, _phases(stored.record)),
        "nearest": nearest_record(stretches, times, q, sampled_rows(times, further)),
        "certified": _certified(played),
        "contacts": contacts,
        "failures": failures,
        "excluded": excluded_records(min(scenes, key=lambda scene: len(scene.excluded))),  # of most of the program
    }


def motion_record(times: Array, q: Array, phases: list[dict[str, Any]]) -> Record:
    """A motion with times (N,) in [s] and joints (N, nq) in [rad] or [m]: every n-th row of a long one and the last."""
    every = max(1, math.ceil(q.size / MOST_NUMBERS))
    rows = np.unique(np.append(np.arange(0, len(times), every), len(times) - 1))
    return {
        "count": len(rows),
        "total": len(times),
        "times": packed(times[rows], "<f8"),
        "q": packed(q[rows], "<f4"),
        "phases": phases,
    }


def _played(stored: StoredRun, cell: Cell, labels: Sequence[str]) -> Iterator[ViewedPhase]:
    """The phases of the program in their order; those of further cycles repeat the first.

    Args:
        labels: Names of the phases of one cycle; a run of a single task has others, all in one scene.
    """
    phases = [phase for phase in stored.record["phases"] if phase["in_program"]]
    if "" in stored.records:
        yield ViewedPhase(name=phases[0]["name"], place="", begin=0.0, number=0, **_series(stored, "", cell))
        return
    read = {name: _series(stored, name, cell) for name in stored.records}
    for phase in phases:
        if phase["name"] not in read:
            file = stored.file("", "report.json")
            raise InputError(f"{file}: phases: expected the runs {', '.join(read)}, got '{phase['name']}'")
        begin, read_phase = float(phase["begin_s"]), read[phase["name"]]
        shifted = {key: begin + read_phase[key] for key in ("times", "gap_times")}
        number = labels.index(phase["name"]) if phase["name"] in labels else 0
        yield ViewedPhase(name=phase["name"], place=phase["name"], begin=begin, number=number, **(read_phase | shifted))


def _series(stored: StoredRun, place: str, cell: Cell) -> dict[str, Array]:
    """Times and stacked joint positions of one run and what it keeps of distances, from its series."""
    tree, file = stored.series(place), stored.file(place, SERIES)
    times, q = _positions(tree, file, cell)
    gap_times, distances = _certified_distances(tree.get("clearance", {}), file)
    return {"times": times, "q": q, "gap_times": gap_times, "distances": distances}


def stored_series(stored: StoredRun, place: str, cell: Cell) -> tuple[Array, Array]:
    """Times in [s] and stacked joints in [rad] or [m] of one run, from series that must fit the cell."""
    return _positions(stored.series(place), stored.file(place, SERIES), cell)


def _positions(tree: Record, file: str, cell: Cell) -> tuple[Array, Array]:
    """Times and stacked joint positions in a series."""
    columns = list[Array]()
    try:
        times = np.array(tree["times_s"], dtype=np.float64)
        for robot in cell.robots:
            for joint in robot.model.joints:
                unit, scale = joint.display_unit
                values = tree["joints"][robot.name][joint.name][f"position_{unit}"]
                columns.append(np.array(values, dtype=np.float64) / scale)
        q = np.stack(columns, axis=1)
        is_sound = q.shape[:1] == times.shape and bool(np.all(np.isfinite(q)))
    except (KeyError, TypeError, ValueError):
        is_sound = False
    if not is_sound:
        raise InputError(f"{file}: joints: expected positions of all joints of the cell, got others; solve again")
    return times, q


def _joined(played: Sequence[ViewedPhase]) -> tuple[Array, Array, list[int]]:
    """All rows one after the other, a row that two phases share once, and the first row of each phase."""
    times, q, firsts = [played[0].times], [played[0].q], [0]
    for before, one in pairwise(played):
        shared = int(abs(one.times[0] - before.times[-1]) <= SAME_TIME)
        firsts.append(sum(map(len, times)))
        times.append(one.times[shared:])
        q.append(one.q[shared:])
    return np.concatenate(times), np.concatenate(q), firsts


def _phases(record: Record) -> list[dict[str, Any]]:
    """Name, begin and end of all phases; none where there is only one."""
    phases = record["phases"]
    if len(phases) < 2:
        return []
    return [{"name": phase["name"], "begin": phase["begin_s"], "end": phase["end_s"]} for phase in phases]


def _part_places(played: Sequence[ViewedPhase], cells: Sequence[Cell]) -> list[Record]:
    """What carries the part, phase by phase; a phase in which it stays where it was is left out."""
    places: list[Record] = []
    for one in played:
        place = place_record(cells[one.number], one.begin)
        if not places or any(place[key] != places[-1][key] for key in ("robot", "link", "pose")):
            places.append(place)
    return places


def _certified(played: Sequence[ViewedPhase]) -> Record:
    """The smallest distance of all classes over time, as the runs certify it."""
    times = np.round(np.concatenate([one.gap_times for one in played]), TIME_DECIMALS)
    distances = np.round(np.concatenate([one.distances for one in played]), DISTANCE_DECIMALS)
    return {"times": times.tolist(), "distances": [plain(distance) for distance in distances.tolist()]}


def _certified_distances(tree: Record, file: str) -> tuple[Array, Array]:
    """Times in [s] and what all pairs keep in [mm], shape (M,) each; what is not finite is not known."""
    try:
        classes = [np.array(values, dtype=np.float64) for name, values in tree.items() if name != "times_s"]
        times = np.array(tree["times_s"] if tree else [], dtype=np.float64)
        distances = np.fmin.reduce([np.full(times.shape, np.inf), *classes])
        is_sound = times.ndim == 1 and times.shape == distances.shape and bool(np.all(np.isfinite(times)))
    except (AttributeError, KeyError, TypeError, ValueError):
        is_sound = False
    if not is_sound:
        raise InputError(f"{file}: clearance: expected times and as many distances of each class, got something else")
    return times, distances


def _contacts(stored: StoredRun, played: Sequence[ViewedPhase], index: dict[str, int]) -> Iterator[Record]:
    """What touches, on the clock of the program."""
    for one in played:
        for contact in stored.records[one.place].get("contacts", []):
            pair = contact["pair"]
            yield {
                "bodies": [index[name] for name in pair if name in index],
                "first": one.begin + contact["first_s"],
                "last": one.begin + contact["last_s"],
                "allowed": contact["allowed"],
                "text": contact["reason"] or " and ".join(pair),
            }


def _failures(stored: StoredRun, played: Sequence[ViewedPhase], cell: Cell, index: dict[str, int]) -> Iterator[Record]:
    """Checks that failed, on the clock of the program, in the order of their times; those without one come last."""
    failures: list[Record] = []
    seen = set[str]()
    for one in played:
        for check in stored.records[one.place]["checks"]:
            if check["passed"] or (one.place and one.place + check["message"] in seen):
                continue
            seen.add(one.place + check["message"])
            prefix = f"{one.name}: " if one.place else ""
            failures.append(
                {
                    "text": f"{prefix}{check['message']}",
                    "at": None if check["at_s"] is None else one.begin + check["at_s"],
                    "bodies": _named(check, stored.records[one.place], index),
                    "joint": _joint(check["subject"], cell),
                }
            )
    yield from sorted(failures, key=lambda failure: math.inf if failure["at"] is None else failure["at"])


def _named(check: Record, record: Record, index: dict[str, int]) -> list[int]:
    """Bodies that a check is about: named by its subject, or those of the smallest clearance of a class."""
    names = check["subject"].split(" - ")
    if check["name"] == "clearance" and (worst := record["clearance"].get(check["subject"])):
        names = worst["pair"] or []
    return [index[name] for name in names if name in index]


def _joint(subject: str, cell: Cell) -> list[int]:
    """Numbers of the robot and the joint that a check is about."""
    robot, _, joint = subject.partition("/")
    for place, candidate in enumerate(cell.robots):
        if candidate.name == robot and joint in candidate.model.joint_names:
            return [place, candidate.model.joint_names.index(joint)]
    return []


def _worst_times(record: Record, begin: float) -> Iterator[float]:
    """Times of the smallest distance of each class."""
    for minimum in record["clearance"].values():
        if minimum["at_s"] is not None:
            yield begin + minimum["at_s"]


def _facts(record: Record) -> list[list[str]]:
    """What the head of the page says of a run."""
    whole = record["clearance"]["whole"]
    facts = [["mode", str(record["mode"])], ["cycle", f"{seconds(record['cycle_time_s'])} s"]]
    if whole["minimum_mm"] is not None:
        word = "certified" if whole["certified"] else "not certified"
        distance = f"{'' if whole['exact'] else 'at least '}{floored(whole['minimum_mm'])} mm"
        where = " – ".join(whole["pair"] or [])
        facts.append(["smallest clearance", f"{distance}, {word}: {where} {instant_text(whole)}"])
    return facts
