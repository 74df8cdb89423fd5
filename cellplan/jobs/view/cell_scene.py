"""The scene of a cell that was not solved: at its start postures, or as near to them as can be said."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.jobs.check import check
from cellplan.jobs.view.describe import base_records, cell_record, excluded_records
from cellplan.jobs.view.geometries import Geometries
from cellplan.jobs.view.nearest import ViewedStretch, nearest_record, sampled_rows, touching_pairs
from cellplan.jobs.view.run_scene import motion_record
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.progress import Progress, silent
from cellplan.planning.transfer.best_try import STEP as TRY_STEP
from cellplan.planning.transfer.best_try import BlockedTry
from cellplan.report.record.common import Record
from cellplan.scene.scene import Scene


def unsolved_scene(cell: Cell, geometries: Geometries, *, progress: Progress = silent) -> Record:
    """The scene of a cell at its start, what ``check`` finds, and the bases for moving them.

    Where no start is found the robots stand at the starts and homes that are given, others in the middle of their
    ranges, and the scene says why.
    """
    failures: list[tuple[str, str]] = []  # subject and message
    scene = Scene.from_cell(cell)
    try:
        checked = check(cell, scene=scene, progress=progress)
        started = checked.cell
        failures += [(check.subject, check.message) for check in checked.checks if not check.passed]
        facts = [["start", (checked.choice or "given").removeprefix("start ")]]
    except (InputError, NoSolutionError) as error:
        started = cell
        failures += [("", line) for line in str(error).splitlines()]
        facts = [["start", "none found: robots are where the cell puts them"]]
    record = standing_scene(replace(scene, cell=started), geometries)
    return {
        **record,
        "facts": facts,
        "passed": not failures,
        "failures": [*record["failures"], *_further(failures, record)],
        "bases": base_records(cell),
    }


def _further(failures: Iterable[tuple[str, str]], record: Record) -> Iterator[Record]:
    """Failures by subject and message, but for pairs that are known to touch."""
    index = {body["name"]: number for number, body in enumerate(record["bodies"])}
    known = [set(failure["bodies"]) for failure in record["failures"]]
    for subject, message in failures:
        bodies = [index[name] for name in subject.split(" - ") if name in index]
        if set(bodies) not in known:
            yield {**_failure(message), "bodies": bodies}


def blocked_scene(blocked: BlockedTry, what: str, geometries: Geometries) -> Record:
    """The scene of the best try of a transfer move that was not found, in nominal time."""
    q, names = blocked.tried.q, [body.name for body in blocked.scene.bodies]
    times: Array = TRY_STEP * np.arange(len(q), dtype=np.float64)
    at = float(times[blocked.row])
    bodies = [names.index(name) for name in blocked.bodies if name in names]
    return {
        **_scene(blocked.scene, times, q, geometries),
        "facts": [["best try", blocked.tried.words]],
        "remarks": ["time is nominal: no time law was found"],
        "passed": False,
        "nearest": nearest_record([ViewedStretch(blocked.scene, 0, len(q))], times, q, sampled_rows(times, [at])),
        "failures": [{**_failure(what), "bodies": bodies, "at": at}],
    }


def standing_scene(scene: Scene, geometries: Geometries) -> Record:
    """The scene of a cell whose robots stand still at their starts."""
    q = np.concatenate([standing(robot) for robot in scene.cell.robots])
    touching = touching_pairs(scene, q)
    return {
        **_scene(scene, np.zeros(1), q[None], geometries),
        "contacts": [
            {"bodies": list(pair), "first": 0.0, "last": 0.0, "allowed": False, "text": _pair_text(scene, pair)}
            for pair in touching
        ],
        "failures": [{**_failure(_pair_text(scene, pair)), "bodies": list(pair), "at": 0.0} for pair in touching],
    }


def _scene(scene: Scene, times: Array, q: Array, geometries: Geometries) -> Record:
    """Robots, bodies and paths of a cell at times of shape (K,), in configurations of shape (K, nq)."""
    return {
        **cell_record(scene.cell, scene.bodies, geometries),
        "motion": motion_record(times, q, []),
        "nearest": nearest_record([ViewedStretch(scene, 0, 1)], times[:1], q[:1], np.zeros(1, dtype=np.intp)),
        "excluded": excluded_records(scene),
    }


def standing(robot: Robot) -> Array:
    """Where a robot stands: its start, its home, or the middle of its range."""
    for given in (robot.start, robot.home):
        if given is not None:
            return given
    lower, upper = robot.model.lower, robot.model.upper
    is_bounded = np.isfinite(lower) & np.isfinite(upper)
    return np.where(is_bounded, 0.5 * (np.where(is_bounded, lower, 0.0) + np.where(is_bounded, upper, 0.0)), 0.0)


def _pair_text(scene: Scene, pair: tuple[int, int]) -> str:
    """Two bodies that touch, as a line of text."""
    return f"'{scene.bodies[pair[0]].name}' touches '{scene.bodies[pair[1]].name}' at the start"


def _failure(text: str) -> Record:
    """Something that failed without an instant."""
    return {"text": text, "at": None, "bodies": [], "joint": []}
