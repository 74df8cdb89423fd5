"""Export jobs of smooth timed motions with known speeds, at rest at both ends; files broken at one place."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from builders.export_jobs import (
    NAMES,
    cell_of,
    controlled,
    drawn_limits,
    job_of,
    positioner_model,
    rail_model,
    zero_of,
)
from builders.scene_builders import arm_model
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.report.exported import ExportJob, ProgramRows, Promise, RobotRows
from cellplan.model.settings.controllers import HandshakeEntry, KindName
from cellplan.programs.elements.dialect import Dialect

REST = 0.1  # [s] at both ends


def smooth_rows(robot: Robot, times: Array, *, stops: Sequence[float], rng: np.random.Generator) -> RobotRows:
    """Rows that move between drawn positions, at rest at each stop: quintic in time, so speeds are known exactly.

    The positions come within a millionth of the limits of some joints.
    """
    lower, upper = robot.model.lower, robot.model.upper
    places = rng.uniform(lower, upper, (len(stops), len(lower)))
    edge = rng.integers(0, 3, places.shape)
    places = np.where(edge == 0, upper - 1e-9 * rng.uniform(0.0, 1e3, places.shape), places)
    q, qd = np.empty((len(times), len(lower))), np.zeros((len(times), len(lower)))
    for k, (begin, end) in enumerate(pairwise(stops)):
        inside = (times >= begin) if k else np.full(len(times), True)
        u = np.clip((times[inside] - begin) / (end - begin), 0.0, 1.0)[:, None]
        travel = places[k + 1] - places[k]
        q[inside] = places[k] + travel * (10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5)
        qd[inside] = travel * 30.0 * (u - u**2) ** 2 / (end - begin)
    qd[[0, -1]] = 0.0
    process = (times > 0.3 * times[-1]) & (times < 0.6 * times[-1])
    return RobotRows(robot=robot.name, q=np.clip(q, lower, upper), times=times, qd=qd, process=process)


def smooth_program(
    cell: Cell,
    *,
    cycle: float | dict[str, float] = 0.004,
    end: float = 1.2,
    rests: Sequence[float] = (),
    seed: int = 0,
    name: str | None = None,
) -> ProgramRows:
    """A program of all robots of a cell, each on a cycle, that ends at the same time for all."""
    rng, robots = np.random.default_rng(seed), {}
    stops = (REST, *rests, end - REST)
    for robot in cell.robots:
        rows = cycle[robot.name] if isinstance(cycle, dict) else cycle
        times = np.arange(round(end / rows) + 1) * rows
        robots[robot.name] = smooth_rows(robot, times, stops=stops, rng=rng)
    return ProgramRows(name=name, robots=robots)


def cell_for(kind: KindName, *, seed: int = 0, cycle: float = 0.004, decimals: int | None = None) -> Cell:
    """An arm that its controller counts otherwise, one on a rail, and a positioner with two axes; limits are drawn."""
    rng = np.random.default_rng(seed)
    settings = {"cycle_ms": 1e3 * cycle, "decimals": decimals}
    models = (
        replace(drawn_limits(arm_model(), rng), controller=zero_of(6)),
        replace(drawn_limits(rail_model(), rng), controller=zero_of(7, coupling=-1.0)),
        drawn_limits(positioner_model(), rng),
    )
    cell = cell_of(
        *(controlled(name, model, **settings) for name, model in zip(NAMES, models, strict=False)), kind=kind
    )
    return with_latency(cell, 100.0)


def with_latency(cell: Cell, latency_ms: float | None) -> Cell:
    """The cell with one latency of all controllers."""
    controllers = {name: controller.changed(latency_ms=latency_ms) for name, controller in cell.controllers.items()}
    return replace(cell, controllers=controllers)


def timed_job(kind: KindName = "kuka", *, seed: int = 0, **changes: object) -> ExportJob:
    """A timed job of the three robots of ``cell_for``; changes are of the program first, then of the job."""
    options = {key: changes.pop(key) for key in ("cycle", "end", "rests", "name") if key in changes}
    cell = cell_for(kind, seed=seed)
    return job_of(cell, smooth_program(cell, seed=seed, **options), promise=Promise.TIMED, **changes)


def ur_cell(*, robots: int = 1, seed: int = 0, cycle: float = 0.008, decimals: int | None = None) -> Cell:
    """Six-axis arms with UR controllers, and standard digital signals where there are several."""
    rng, names = np.random.default_rng(seed), NAMES[:robots]
    placed = []
    for k, name in enumerate(names):
        zero = replace(zero_of(6), coupling=np.zeros((6, 6)))
        model = replace(drawn_limits(arm_model(), rng), controller=zero)
        inputs = {other: place for place, other in enumerate(names) if other != name}
        shake = HandshakeEntry(output=k, inputs=inputs) if robots > 1 else None
        placed.append(controlled(name, model, cycle_ms=1e3 * cycle, decimals=decimals, handshake=shake))
    return with_latency(cell_of(*placed, kind="ur"), 100.0)


def round_trip(dialect: Dialect, job: ExportJob) -> tuple[dict[str, str], tuple[ProgramRows, ...]]:
    """Files of a job, and what their reader finds."""
    files = dialect.render(job)
    return files, dialect.read(job.frame, files)


def largest_error(job: ExportJob, read: Sequence[ProgramRows], robot: str) -> Array:
    """Largest difference of each joint in [rad] or [m] between a job and what was read, shape (n,)."""
    errors = [
        np.abs(mine.robots[robot].q - other.robots[robot].q).max(axis=0)
        for mine, other in zip(job.programs, read, strict=True)
    ]
    return np.max(errors, axis=0)


def is_within_limits(robot: Robot, q: Array) -> bool:
    """Whether no position is beyond a limit, not by the last bit."""
    return bool(np.all(q >= robot.model.lower) and np.all(q <= robot.model.upper))


def edited(text: str, old: str, new: str, *, nth: int = 0) -> tuple[str, int]:
    """A text with one occurrence of something replaced, and the line of the place, from 1."""
    at = -1
    for _ in range(nth + 1):
        at = text.index(old, at + 1)
    return text[:at] + new + text[at + len(old) :], 1 + text.count("\n", 0, at)


def without_line(text: str, line: int) -> str:
    """A text without one line, from 1."""
    lines = text.splitlines(keepends=True)
    return "".join(lines[: line - 1] + lines[line:])


def with_line_twice(text: str, line: int) -> str:
    """A text with one line, from 1, repeated."""
    lines = text.splitlines(keepends=True)
    return "".join(lines[:line] + lines[line - 1 :])
