"""Judge a recovery: its tables are parsed, then checked by a kinematics that the planner does not use."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.cache import without_cache
from cellplan.certify.bound import Bound, PairBound
from cellplan.certify.certify import certify
from cellplan.certify.growth import ComingApart, certify_growth
from cellplan.checks.clearance.contacts import time_of
from cellplan.checks.clearance.mounting import check_mounting
from cellplan.checks.verify import verify_motion
from cellplan.files.run.joint_tables import parse_table
from cellplan.geometry.transforms import Array
from cellplan.jobs.recover.phases import RecoveryKind, RecoveryPhase, scene_of
from cellplan.jobs.recover.state import RunPlaces, StoppedState
from cellplan.model.motion.motion import JointTable, Schedule
from cellplan.model.report.report import Check
from cellplan.model.units import MM

STATE_TOL: Final = 1e-9  # [rad] or [m] by which the first row may differ from the stopped state: rounding of the tables


Apart = tuple[ComingApart, float | None]  # a pair, and the time in [s] from which on it keeps its demand


@dataclass(frozen=True, slots=True, kw_only=True)
class Nearest:
    """Where two bodies that keep what is demanded of them come nearest."""

    distance: float  # proved distance in [m]
    demand: float  # what is demanded in [m]
    pair: tuple[str, str]  # names of the bodies
    at_s: float  # when, in [s] of the recovery


@dataclass(frozen=True, slots=True, kw_only=True)
class TimedPhase:
    """A phase of a recovery on its clock, as it was judged."""

    kind: str  # what is done
    robots: tuple[str, ...]  # names of the robots that move
    words: str  # the same for people
    begin: float  # time in [s] at which it begins
    end: float  # time in [s] at which it ends
    place: int | None  # place of the phase of the program that is played backwards; None for what is not
    nearest: Nearest | None  # smallest distance in it of the pairs that keep their demand; None without such pairs


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecoveryJudgement:
    """What was found on the written tables of a recovery."""

    checks: tuple[Check, ...]  # all checks
    phases: tuple[TimedPhase, ...]  # the phases on their clock
    apart: tuple[Apart, ...]  # pairs that begin too near, with the time in [s] from which each keeps its demand

    @property
    def passed(self) -> bool:
        """Whether every check passed."""
        return all(check.passed for check in self.checks)

    @property
    def nearest(self) -> Nearest | None:
        """The smallest distance of all phases."""
        distances = [phase.nearest for phase in self.phases if phase.nearest is not None]
        return min(distances, key=lambda distance: distance.distance, default=None)


@without_cache()  # a proof rests on the tables themselves
def judged(
    texts: Mapping[str, str], phases: Sequence[RecoveryPhase], *, places: RunPlaces, state: StoppedState
) -> RecoveryJudgement:
    """Check the tables of a recovery.

    Args:
        phases: What they were written from: of these only kinds, scenes and numbers of rows are used.
    """
    tables = [parse_table(text, f"tables/{name}.csv") for name, text in texts.items()]
    return judged_tables(tables, phases, places=places, state=state)


def judged_tables(
    tables: Sequence[JointTable],
    phases: Sequence[RecoveryPhase],
    *,
    places: RunPlaces,
    state: StoppedState,
    tolerance: float = STATE_TOL,
) -> RecoveryJudgement:
    """The same of tables that were read, whose first row may be off by a tolerance in [rad] or [m]."""
    times, q = tables[0].times, np.concatenate([table.q for table in tables], axis=1)
    stopped = places.scene_while_stopped(state.lying)
    schedule = Schedule(times=times, tasks=())
    moving = [name for name in state.times if name not in state.standing]
    checks = list(verify_motion(stopped, schedule, tables, moving=moving, idle=()).checks)
    checks += check_mounting(stopped, q, times)
    checks.append(_begins(q, state, tolerance))
    checks += _stand_still(q, phases, places)
    timed: list[TimedPhase] = []
    apart: list[Apart] = []
    first = 0
    for group in _runs_of_retracts(phases):
        last = first + sum(len(phase.q) - 1 for phase in group)
        rows, times_of_run = q[first : last + 1], times[first : last + 1]
        bound, separations = _proved(group[0], rows, times_of_run, places=places, state=state)
        checks += [_coming_apart(pair, fault, at) for (pair, at), fault in separations.items()]
        apart += separations
        checks.append(_clearance(bound, times_of_run, f"{group[0].kind} from {times_of_run[0]:g} s"))
        timed += _timed(group, times, first, _nearest(bound, times_of_run))
        first = last
    return RecoveryJudgement(checks=tuple(checks), phases=tuple(timed), apart=tuple(apart))


def _proved(
    phase: RecoveryPhase, rows: Array, times: Array, *, places: RunPlaces, state: StoppedState
) -> tuple[Bound, dict[Apart, str]]:
    """What is proved of the pairs that keep their demand, and the pairs that come apart with what is wrong of each."""
    if phase.kind is not RecoveryKind.RETRACT:
        return certify(scene_of(phase, places, state), rows, with_curves=False), {}
    growth = certify_growth(places.scene_while_stopped(state.lying), rows, with_minimum=True)
    faults = dict(growth.faults)
    timed = [(pair, None if pair.row is None else float(times[pair.row])) for pair in growth.apart]
    return growth.bound, {pair: faults.get(pair[0].names, "") for pair in timed}


def _timed(group: Sequence[RecoveryPhase], times: Array, first: int, nearest: Nearest | None) -> list[TimedPhase]:
    """Phases that are judged together, on their clock."""
    phases = []
    for phase in group:
        end = first + len(phase.q) - 1
        phases.append(
            TimedPhase(
                kind=str(phase.kind),
                robots=phase.robots,
                words=phase.words,
                begin=float(times[first]),
                end=float(times[end]),
                place=phase.place,
                nearest=nearest,
            )
        )
        first = end
    return phases


def _runs_of_retracts(phases: Sequence[RecoveryPhase]) -> list[list[RecoveryPhase]]:
    """The phases, retracts that follow one another together: pairs come apart over all of them."""
    runs: list[list[RecoveryPhase]] = []
    for phase in phases:
        if runs and phase.kind is RecoveryKind.RETRACT is runs[-1][-1].kind:
            runs[-1].append(phase)
        else:
            runs.append([phase])
    return runs


def _stays(name: str, subject: str, off: float, message: str, *, at_s: float | None, limit: float = STATE_TOL) -> Check:
    """Whether something is where it has to be, to the rounding of the tables; by how much it is off in [rad] or [m]."""
    is_there = off <= limit
    unit = "rad or m"
    return Check(
        name=name, subject=subject, passed=is_there, value=off, limit=limit, unit=unit, at_s=at_s, message=message
    )


def _begins(q: Array, state: StoppedState, tolerance: float) -> Check:
    """Whether the tables begin where the cell has stopped."""
    off = float(np.abs(q[0] - state.q).max())
    message = f"begin: the first row is {off:.1e} rad or m from the stopped state, allowed {tolerance:g}"
    return _stays("begin", "cell", off, message, at_s=0.0, limit=tolerance)


def _stand_still(q: Array, phases: Sequence[RecoveryPhase], places: RunPlaces) -> list[Check]:
    """Whether robots that have no part in a phase stand still in it: one check for all, those that move by name."""
    cell, first = places.cell, 0
    checks = []
    for phase in phases:
        rows = q[first : first + len(phase.q)]
        first += len(phase.q) - 1
        for robot in cell.robots:
            positions = rows[:, cell.columns(robot.name)]
            moved = float(np.abs(positions - positions[0]).max())
            if robot.name not in phase.robots and moved > STATE_TOL:
                message = f"standing: {robot.name} moves by {moved:.1e} rad or m in '{phase.words}', where it stands"
                checks.append(_stays("standing", robot.name, moved, message, at_s=None))
    return checks


def _coming_apart(pair: ComingApart, fault: str, at: float | None) -> Check:
    """Whether a pair that begins too near only comes apart, and keeps its demand in the end."""
    first, second = pair.names
    begin = f"{MM * pair.begin:.2f} mm" if pair.begin > 0.0 else f"{-MM * pair.begin:.2f} mm deep"
    what = fault or (
        f"only comes apart, and keeps {MM * pair.demand:g} mm from {at:.3f} s on"
        if at is not None
        else f"does not come {MM * pair.demand:g} mm apart"
    )
    return Check(
        name="coming_apart",
        subject=f"{first} - {second}",
        passed=not fault and at is not None,
        value=MM * pair.end,
        limit=MM * pair.demand,
        unit="mm",
        at_s=at,
        message=f"coming apart: {first} to {second} begins {begin} apart and {what}".replace("deep apart", "deep"),
    )


def _nearest(bound: Bound, times: Array) -> Nearest | None:
    """The smallest distance of the pairs that keep the clearance."""
    pairs = [pair for pair in bound.pairs if pair.keeps_clearance and np.isfinite(pair.proved)]
    if not pairs:
        return None
    return _nearest_of(min(pairs, key=lambda pair: pair.proved), bound, times)


def _nearest_of(pair: PairBound, bound: Bound, times: Array) -> Nearest:
    """The smallest distance of a pair."""
    return Nearest(distance=pair.proved, demand=pair.demand, pair=bound.names(pair), at_s=time_of(times, pair.at))


def _clearance(bound: Bound, times: Array, phase: str) -> Check:
    """Whether every pair keeps what is demanded of it in one phase."""
    failed = [pair for pair in bound.pairs if not pair.is_met]
    nearest = _nearest(bound, times)
    if failed:
        nearest = _nearest_of(min(failed, key=lambda pair: pair.proved - pair.demand), bound, times)
    if nearest is None:
        nearest = Nearest(distance=0.0, demand=0.0, pair=("", ""), at_s=float(times[0]))
    shown = np.floor(10.0 * MM * nearest.distance) / 10.0
    between = f"{nearest.pair[0]} to {nearest.pair[1]} {shown:.1f} mm at {nearest.at_s:.3f} s"
    return Check(
        name="clearance",
        subject=phase,
        passed=not failed,
        value=MM * nearest.distance,
        limit=MM * nearest.demand,
        unit="mm",
        at_s=nearest.at_s,
        message=f"clearance of the {phase}: {between}, required {MM * nearest.demand:.1f} mm",
    )
