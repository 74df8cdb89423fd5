"""Map of one base: what becomes of the job at places around it, coarse ones first, the nearest ones of each first."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.jobs.base_map.base_map import Tiles
from cellplan.jobs.base_map.grid import BaseGrid
from cellplan.jobs.base_map.prepared import PreparedMap, prepared
from cellplan.model.cell.cell import Cell
from cellplan.model.units import MM
from cellplan.report.record.common import number
from cellplan.search.base_map.verdicts import PlaceVerdict, judge_phases
from cellplan.session.works.events import Send, progress_event, progress_of

WORK: Final = "map"
SIZES_MM: Final = (200.0, 100.0, 50.0)  # of tiles; each divides the one before it, so that no place is judged twice
AT_ONCE: Final = 48  # [-] places that are judged between two events


def map(cell: Cell, robot: str, *, send: Send) -> None:  # noqa: A001 - the name of the command
    """Send tiles of the base plane of one robot with their verdicts, as ``cellplan map`` has them.

    Each event has the robot, the size of its tiles in [mm], and for each tile its middle in [mm], its state, one of
    ``Verdict``, and the shortest cycle in [s] where it passes.

    Args:
        cell: The cell.
        robot: Name of an operator: a robot with a task that does not hold the part.

    Raises:
        InputError: There is no such operator, or the cell is of a kind that is not mapped.
        NoSolutionError: The other robots have no start posture.
    """
    ready = prepared(cell, robot, BaseGrid(step=SIZES_MM[0]), progress_of(WORK, send))
    for level, size in enumerate(SIZES_MM):
        finer = _with_places(ready, size)
        new = _new_places(finer, SIZES_MM[level - 1] if level else None)
        for done, tiles in _judged(finer, new):
            send({"event": "tiles", "robot": robot, "size_mm": size, "tiles": tiles})
            send(progress_event(WORK, (level + done) / len(SIZES_MM), f"tiles of {size:g} mm"))


def _with_places(ready: PreparedMap, size: float) -> PreparedMap:
    """The same map with places of another distance in [mm] within the same bounds."""
    x, y = (axis.tolist() for axis in (ready.jobs[0].places.x, ready.jobs[0].places.y))
    grid = BaseGrid(x=(x[0], x[-1]), y=(y[0], y[-1]), step=size)
    places = grid.places(ready.cell.robot(ready.jobs[0].robot), np.zeros(3))
    return replace(ready, jobs=tuple(replace(job, places=places) for job in ready.jobs))


def _new_places(ready: PreparedMap, before: float | None) -> Indices:
    """Places that a coarser grid of a size in [mm] does not have, the nearest to the present base first."""
    places, base = ready.jobs[0].places, ready.cell.robot(ready.jobs[0].robot).X_WB
    points = places.X_WB[:, :2, 3]
    order = np.argsort(np.linalg.norm(points - base[:2, 3], axis=1), kind="stable")
    if before is None:
        return order
    steps = MM * (points - points[0]) / before
    is_old = (np.abs(steps - np.round(steps)) < 1e-6).all(axis=1)
    return order[~is_old[order]]


def _judged(ready: PreparedMap, sought: Indices) -> Iterator[tuple[float, list[dict[str, Any]]]]:
    """Tiles of some places in their order, and the fraction of them that is done."""
    jobs, tiles = ready.jobs, Tiles.of(ready.jobs, ready.starts())
    phases = [values["phases"] for values in tiles.values]
    starts = [_joined([phase[index] for phase in phases]) for index in range(len(jobs))]
    for begin in range(0, len(sought), AT_ONCE):
        places = sought[begin : begin + AT_ONCE]
        verdicts = {place: tiles.known[place] for place in places.tolist()}
        some = [(q[rows], at[rows]) for q, at in starts for rows in [np.isin(at, places)]]
        if len(some[0][1]):
            for place, verdict in judge_phases(jobs, some).items():
                verdicts[place] = verdict.or_better(tiles.at_start[verdict.phase][place])
        yield (begin + len(places)) / len(sought), [_tile(ready, place, verdicts[place]) for place in verdicts]


def _joined(parts: list[dict[str, Any]]) -> tuple[Array, Indices]:
    """Starts of all tiles and their places, ascending."""
    at = np.array([place for part in parts for place in part["places"]], dtype=np.intp)
    q = np.array([start for part in parts for start in part["starts"]], dtype=float)
    order = np.argsort(at, kind="stable")
    return q[order], at[order]


def _tile(ready: PreparedMap, place: int, verdict: PlaceVerdict) -> dict[str, Any]:
    x, y = (MM * ready.jobs[0].places.X_WB[place, :2, 3]).tolist()
    cycle = verdict.cycle if verdict.passes else None
    return {"x_mm": number(x), "y_mm": number(y), "value": number(cycle), "state": str(verdict.verdict)}
