"""Legs: a recovery between places at which all robots wait for one another, clear in every order of the robots."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from cellplan.certify.free_clocks.free_clocks import ClockRegion, certify_regions
from cellplan.geometry.transforms import Array
from cellplan.jobs.recover.judge import judged_tables
from cellplan.jobs.recover.phases import RecoveryPhase, scene_of
from cellplan.jobs.recover.state import RunPlaces, StoppedState
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import JointTable
from cellplan.programs.promises.orders import PhaseSearch, order_finding
from cellplan.programs.promises.run_programs import RunPhase, RunProgram

WRITTEN_TOL: Final = 1e-4  # [rad] or [m] by which rounding to few decimals may move the first row
SLOWLY: Final = 1e4  # [s] from row to row where controllers choose the times: no speed is judged


class Track(NamedTuple):
    """What a robot passes in a leg, even from row to row."""

    times: Array  # increasing, of any unit, shape (N,)
    q: Array  # positions in [rad] or [m], shape (N, n)


@dataclass(frozen=True, slots=True, kw_only=True)
class Leg:
    """Rows of a recovery between two waits."""

    phase: int  # place of its phase
    first: int  # its first row in the recovery
    last: int  # its last row
    pairs: tuple[tuple[str, str], ...] = ()  # robots that both move, clear in all combinations of places


def recovery_rows(phases: Sequence[RecoveryPhase]) -> Array:
    """Rows of all phases, shape (N, nq)."""
    return np.concatenate([phases[0].q, *(phase.q[1:] for phase in phases[1:])])


def recovery_legs(places: RunPlaces, state: StoppedState, phases: Sequence[RecoveryPhase]) -> tuple[Leg, ...]:
    """Waits of a recovery, as few as every order of the robots between them allows.

    A ``NotVerifiedError`` has the phase, both robots and the distance where waits do not suffice.
    """
    made, begin, step = list[Leg](), 0, places.cell.motion.step
    for place, phase in enumerate(phases):
        last = len(phase.q) - 1
        program = RunProgram(name=None, times=np.arange(last + 1, dtype=float) * step, q=phase.q, phases=(), process={})
        of_phase = RunPhase(name=phase.words, place=0, first=0, last=last)
        search = PhaseSearch(places.cell, scene_of(phase, places, state), program, of_phase)
        made += [
            Leg(phase=place, first=begin + part.first, last=begin + part.last, pairs=part.pairs)
            for part in search.stretches()
        ]
        begin += last
    return tuple(made)


def leg_findings(
    places: RunPlaces,
    state: StoppedState,
    phases: Sequence[RecoveryPhase],
    tracks: Sequence[tuple[Leg, Mapping[str, Track]]],
) -> Iterator[str]:
    """Demands that legs do not keep as they were read, by the judge of recoveries and by all orders of the robots.

    Args:
        phases: What is done; of these only kinds, robots and scenes are used.
        tracks: Every leg with what each robot of the cell passes in it, two rows at least.
    """
    cell, grids = places.cell, dict[int, list[Array]]()
    for leg, by_robot in tracks:
        grids.setdefault(leg.phase, []).append(_on_one_clock(cell, by_robot))
        q = {name: track.q for name, track in by_robot.items()}
        scene, phase = scene_of(phases[leg.phase], places, state), phases[leg.phase]
        regions = [
            ClockRegion(first=one, second=two, rectangles=np.array([[0.0, len(q[one]) - 1.0, 0.0, len(q[two]) - 1.0]]))
            for one, two in leg.pairs
        ]
        for bound in certify_regions(scene, q, regions) if regions else ():
            if not bound.is_met:
                yield order_finding(phase.words, bound, np.array([leg.first, leg.last]) * cell.motion.step)
    read = [replace(phases[place], q=_chained(parts)) for place, parts in grids.items()]
    rows = recovery_rows(read)
    tables = [
        JointTable(
            robot=robot.name,
            joints=robot.model.joint_names,
            times=np.arange(len(rows), dtype=float) * SLOWLY,
            q=rows[:, cell.columns(robot.name)],
        )
        for robot in cell.robots
    ]
    judgement = judged_tables(tables, read, places=places, state=state, tolerance=WRITTEN_TOL)
    yield from (check.message for check in judgement.checks if not check.passed)


def _chained(parts: Sequence[Array]) -> Array:
    """Legs of a phase one after the other, each from the last row of the one before."""
    return np.concatenate([parts[0], *(part[1:] for part in parts[1:])])


def _on_one_clock(cell: Cell, tracks: Mapping[str, Track]) -> Array:
    """Rows of all robots at all times at which one of them has a row, shape (N, nq)."""
    every = np.unique(np.concatenate([track.times for track in tracks.values()]))
    return np.concatenate(
        [
            np.stack([np.interp(every, tracks[robot.name].times, column) for column in tracks[robot.name].q.T], axis=1)
            for robot in cell.robots
        ],
        axis=1,
    )
