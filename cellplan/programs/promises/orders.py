"""Marks and orders: where robots without a common clock wait for one another, and that no order between is unsafe.

Between two marks every robot passes its rows at a time of its own. Any place of the one may meet any place of another:
for each pair of robots the rectangle of both stretches of rows is certified. Marks lie at the ends of all phases; where
a rectangle is not clear further ones are set inside it, as few as the rows allow, so that the rectangles shrink towards
the motion that the run proves. No tool waits for others while it is in process.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final

import numpy as np

from cellplan.certify.free_clocks.free_clocks import ClockRegion, RegionBound, certify_regions
from cellplan.certify.lever_arms import LeverArms
from cellplan.certify.run_pairs import scene_of_run
from cellplan.errors import NotVerifiedError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress, silent
from cellplan.model.report.exported import ProgramRows
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.model.units import MM
from cellplan.programs.elements.joints import unit_of
from cellplan.programs.promises.run_programs import RunPhase, RunProgram, run_programs
from cellplan.programs.rows.margins import raised
from cellplan.runs.plan.demanded import DemandedProgram
from cellplan.runs.plan.program import STILL_TOL
from cellplan.scene.collision.distance import APART_TOL
from cellplan.scene.scene import Scene

STAGE: Final = "certifying every order between marks"
MOST_MARKS: Final = 200  # of one program; a longer row of waits is no program that anybody would run
CURE: Final = (
    "let the one task follow the other (after), place bases, approaches or homes farther apart, or export rows that "
    "keep the times of the plan (--format stream or csv)"
)
Pair = tuple[str, str]
KnownOrders = dict[tuple[bytes, ...], list[str]]  # findings between two marks, by the phase and all rows there


@dataclass(frozen=True, slots=True, kw_only=True)
class OrderStretch:
    """Rows between two neighbouring marks, within which every order of the robots is certified."""

    phase: str  # name of the phase
    place: int  # number of the motion of the run that the phase repeats
    first: int  # row of the first mark
    last: int  # row of the second one
    pairs: tuple[Pair, ...] = ()  # robots that both move between them, certified in all combinations of places
    proved: float = np.inf  # distance in [m] that the bodies of these keep in every order; inf without such bodies


@dataclass(frozen=True, slots=True, kw_only=True)
class Orders:
    """The marks of a program."""

    program: str | None  # name of the program; None for the only one
    stretches: tuple[OrderStretch, ...]  # what lies between them, in order
    times: tuple[float, ...]  # times of the marks in [s] in the run

    @property
    def marks(self) -> tuple[int, ...]:
        """Rows of the marks."""
        return (self.stretches[0].first, *(stretch.last for stretch in self.stretches))


def certified_orders(run: VerifiedRun, *, progress: Progress = silent) -> tuple[Orders, ...]:
    """Marks of every program of a run, between which every order of the robots is certified.

    A ``NotVerifiedError`` has the robots, the phase and the distance where marks do not suffice.
    """
    scenes, orders = scenes_of(run), []
    for program in run_programs(run):
        known: dict[int, list[OrderStretch]] = {}
        stretches: list[OrderStretch] = []
        for count, phase in enumerate(program.phases):
            progress(STAGE, count / len(program.phases))
            if phase.last == phase.first:
                continue
            if phase.place not in known:
                known[phase.place] = list(PhaseSearch(run.cell, scenes[phase.place], program, phase).stretches())
            by = phase.first - known[phase.place][0].first
            stretches += [
                replace(stretch, first=stretch.first + by, last=stretch.last + by) for stretch in known[phase.place]
            ]
        if len(stretches) > MOST_MARKS:
            raise NotVerifiedError([f"sequence only: {len(stretches)} waits would be needed, at most {MOST_MARKS} are"])
        marks = [stretches[0].first, *(stretch.last for stretch in stretches)]
        times = tuple(float(program.times[row]) for row in marks)
        orders.append(Orders(program=program.name, stretches=tuple(stretches), times=times))
    progress(STAGE, 1.0)
    return tuple(orders)


def scenes_of_motions(run: VerifiedRun) -> list[Scene]:
    """The scene of each motion of a run."""
    return DemandedProgram.of(run.cell).scenes(run.cell)[: len(run.motions)]


def scenes_of(run: VerifiedRun) -> list[Scene]:
    """The scene of each motion of a run, while its tasks are worked on."""
    return [
        scene_of_run(scene, [scheduled.task.name for scheduled in motion.schedule.tasks])
        for scene, motion in zip(scenes_of_motions(run), run.motions, strict=True)
    ]


def certify_written(
    run: VerifiedRun,
    orders: Sequence[Orders],
    read: Sequence[ProgramRows],
    corners: Sequence[Mapping[str, Array]],
    *,
    known: KnownOrders,
    progress: Progress = silent,
) -> Iterator[str]:
    """Certify every order once more on rows that were read: findings, one for each pair that is not clear.

    Robots that are not exported have the rows of the run. Corners are those of ``margins.robot_corners``, by program.
    """
    for order, rows, off in zip(orders, read, corners, strict=True):
        for name, robot_rows in rows.robots.items():
            if len(robot_rows.marks) != len(order.marks):
                yield f"program of '{name}': expected {len(order.marks)} marks, got {len(robot_rows.marks)}"
                return
        yield from dict.fromkeys(
            finding for _, finding in blocked_orders(run, order, rows, off, known=known, progress=progress)
        )


def blocked_orders(
    run: VerifiedRun,
    orders: Orders,
    rows: ProgramRows,
    corners: Mapping[str, Array],
    *,
    known: KnownOrders,
    progress: Progress = silent,
) -> Iterator[tuple[int, str]]:
    """Places of the stretches of a program in which a pair is not clear in every order, with what is not.

    Robots that are not exported have the rows of the run. Corners are those of ``margins.robot_corners``; what is known
    of a run already is not worked out again, and what comes is added.
    """
    scenes = scenes_of(run)
    program = next(program for program in run_programs(run) if program.name == orders.program)
    for count, stretch in enumerate(orders.stretches):
        progress(STAGE, count / len(orders.stretches))
        if not stretch.pairs:
            continue
        q, (off, tips) = _positions(run.cell, program, rows, count, stretch), _off(run.cell, rows, corners, count)
        key = (
            f"{orders.program} {stretch.place}".encode(),
            *(values.tobytes() for values in (*q.values(), off, *tips.values())),
        )
        if key not in known:  # or else a further cycle
            scene, regions = scenes[stretch.place], [_region(q, pair) for pair in stretch.pairs]
            if np.any(off):
                ends = [np.stack([positions.min(axis=0), positions.max(axis=0)]) for positions in q.values()]
                scene = raised(LeverArms(scene, np.concatenate(ends, axis=1)), scene, off, tips, in_step=False)
            times = program.times[[stretch.first, stretch.last]]
            bounds = certify_regions(scene, q, regions)
            known[key] = [order_finding(stretch.phase, bound, times) for bound in bounds if not bound.is_met]
        yield from ((count, finding) for finding in known[key])


class PhaseSearch:
    """The search for the marks of one phase."""

    def __init__(self, cell: Cell, scene: Scene, program: RunProgram, phase: RunPhase) -> None:
        """Take the rows of a phase, and the scene while its tasks are worked on."""
        self._cell, self._scene, self._phase = cell, scene, phase
        self._times = program.times[phase.first : phase.last + 1]
        rows = program.q[phase.first : phase.last + 1]
        self._q = {robot.name: rows[:, cell.columns(robot.name)] for robot in cell.robots}
        self._last = phase.last - phase.first
        busy = program.busy()[phase.first : phase.last + 1]
        self._free = [row for row in range(1, self._last) if not busy[row]]
        self._moves = {
            name: np.append(0, np.cumsum(np.any(np.abs(np.diff(q, axis=0)) > STILL_TOL, axis=1)))
            for name, q in self._q.items()
        }

    def stretches(self) -> Iterator[OrderStretch]:
        """The stretches of the phase: the longest from its first row on that is clear, and so on."""
        pairs = tuple(pair for pair in combinations(self._q, 2) if pair[1] not in unit_of(self._cell, pair[0]))
        first = 0
        while first < self._last:
            bounds = self._bounds(first, self._last, pairs)
            blocked = tuple((bound.first, bound.second) for bound in bounds if not bound.is_met)
            last = self._last
            if blocked:
                last = self._farthest(first, blocked)
                bounds = self._bounds(first, last, pairs)
            yield OrderStretch(
                phase=self._phase.name,
                place=self._phase.place,
                first=self._phase.first + first,
                last=self._phase.first + last,
                pairs=tuple((bound.first, bound.second) for bound in bounds),
                proved=min((bound.proved for bound in bounds), default=np.inf),
            )
            first = last

    def _farthest(self, first: int, pairs: Sequence[Pair]) -> int:
        """The last row at which robots may wait so that every order from a row on is clear.

        A rectangle within one that is clear is clear: the row is found by bisection.

        ``NotVerifiedError`` where there is none.
        """
        rows = [row for row in self._free if row > first]
        low, high = 0, len(rows)  # all before low are clear, none from high on is known to be
        while low < high:
            middle = (low + high) // 2
            if all(bound.is_met for bound in self._bounds(first, rows[middle], pairs)):
                low = middle + 1
            else:
                high = middle
        if low == 0:
            nearest = rows[0] if rows else self._last
            bounds = [bound for bound in self._bounds(first, nearest, pairs) if not bound.is_met]
            worst = min(bounds, key=lambda bound: bound.distance)
            raise NotVerifiedError([order_finding(self._phase.name, worst, self._times[[first, nearest]])])
        return rows[low - 1]

    def _bounds(self, first: int, last: int, pairs: Sequence[Pair]) -> tuple[RegionBound, ...]:
        """What is proved of the robots that both move between two rows."""
        q = {name: rows[first : last + 1] for name, rows in self._q.items()}
        moving = {name for name, moved in self._moves.items() if moved[last] > moved[first]}
        regions = [_region(q, pair) for pair in pairs if moving.issuperset(pair)]
        return certify_regions(self._scene, q, regions) if regions else ()


def _region(q: dict[str, Array], pair: Pair) -> ClockRegion:
    """All places of one robot with all of another."""
    last = [len(q[name]) - 1 for name in pair]
    return ClockRegion(first=pair[0], second=pair[1], rectangles=np.array([[0.0, last[0], 0.0, last[1]]]))


def _positions(
    cell: Cell, program: RunProgram, rows: ProgramRows, count: int, stretch: OrderStretch
) -> dict[str, Array]:
    """Rows of every robot between two marks: as they were read, or those of the run where it is not exported."""
    positions = {}
    for robot in cell.robots:
        robot_rows = rows.robots.get(robot.name)
        if robot_rows is None:
            positions[robot.name] = program.q[stretch.first : stretch.last + 1, cell.columns(robot.name)]
        else:
            positions[robot.name] = robot_rows.q[robot_rows.marks[count] : robot_rows.marks[count + 1] + 1]
        if len(positions[robot.name]) < 2:
            positions[robot.name] = np.repeat(positions[robot.name], 2, axis=0)
    return positions


def _off(cell: Cell, rows: ProgramRows, corners: Mapping[str, Array], count: int) -> tuple[Array, dict[str, Array]]:
    """How far joints may be off at the rows between two marks, of one robot after the other, and tips of their tools.

    In [rad] or [m], shape (M, nq), and in [m] and [rad], shape (M, 2), by robot.
    """
    between = {name: slice(it.marks[count], it.marks[count + 1] + 1) for name, it in rows.robots.items()}
    values = {name: np.unique(corners[name][rows], axis=0) for name, rows in between.items()}
    off, tips, first = np.zeros((sum(map(len, values.values())), cell.joint_count)), {}, 0
    for name, of_robot in values.items():
        place = slice(first, first := first + len(of_robot))
        off[place, cell.columns(name)], tips[name] = of_robot[:, 2:], np.zeros((len(off), 2))
        tips[name][place] = of_robot[:, :2]
    return off, tips


def order_finding(phase: str, bound: RegionBound, times: Array) -> str:
    """What is not clear in every order in a phase between two times in [s], shape (2,), as one line."""
    bodies = "" if bound.bodies is None else f" ({' and '.join(bound.bodies)})"
    if bound.distance > bound.demand:
        measured = f", nearest measured {MM * bound.distance:.3g} mm" if np.isfinite(bound.distance) else ""
        proved = np.floor(MM * MM * min(bound.proved, bound.demand)) / MM  # never more than is proved
        what = f"are proved to keep only {proved:g} mm{measured}"
    else:
        what = f"come within {MM * bound.distance:.3g} mm"
    demanded = f"{MM * bound.demand:.3g} mm are demanded" if bound.demand > APART_TOL else "they must not touch"
    return (
        f"sequence only: phase '{phase}', {times[0]:g} to {times[1]:g} s: '{bound.first}' and '{bound.second}' {what}"
        f"{bodies} in another order than that of the plan, {demanded}, and no robot can "
        f"wait between: {CURE}"
    )
