"""Repair: the smallest change with which a failing cell passes, and other remedies that were solved and verified."""

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final

import numpy as np

from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.trials.prepared import PreparedSearch
from cellplan.jobs.layout.trials.searched import searched_cell
from cellplan.jobs.repair.attempts import (
    PART,
    Attempt,
    RemedyKind,
    of_branches,
    of_far_starts,
    of_layout,
    of_paths,
    of_tools,
    of_weights,
    owners,
)
from cellplan.jobs.repair.neat import far_starts
from cellplan.jobs.repair.prepare import ready_cell, start_posture
from cellplan.jobs.repair.record import AdviceRecord, Case, Tried, advice_record, failed_checks, remedy_values
from cellplan.jobs.repair.solved import required_step, required_time
from cellplan.jobs.repair.trial import ATTEMPT, FACTOR, evaluate, violations
from cellplan.model.cell.cell import Cell
from cellplan.model.presented import Presented
from cellplan.model.progress import Progress, silent
from cellplan.model.report.check_kinds import DISTANCES, JOINT_LIMITS, PASSED_BY_STEP, PASSED_BY_TIME
from cellplan.model.units import MM
from cellplan.scene.scene import Scene
from cellplan.search.programs.objective import Objective
from cellplan.search.programs.problem import Point
from cellplan.study.run import outcomes
from cellplan.study.trial import TrialOutcome, TrialStatus, Variant

FEW: Final = 6  # [-] attempts that take less time than further processes to start
KINDS: Final = list(RemedyKind)
WITH_LIMITS: Final = "quadratic_program"  # the method that keeps joints within their limits
CLEARLY: Final = 1e-4  # [rad] or [m] by which a demand is missed for sure
KEEPS_START: Final = frozenset({RemedyKind.WEIGHTS, RemedyKind.METHOD, RemedyKind.DURATION})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Repair(Presented):
    """What makes a failing cell pass.

    Attributes:
        record: The record of ``advice.json``.
        given: The cell as it is given, with what the request sets in it.
        best: The cell with the first remedy; None where there is none.
    """

    record: AdviceRecord
    given: Cell
    best: Cell | None

    def __repr__(self) -> str:
        """One line without arrays."""
        remedies = self.record["remedies"]
        cure = f"; {remedies[0]['text']}" if remedies else ""
        return f"<Repair of '{self.given.name}', {self.record['status'].replace('_', ' ')}{cure}>"


def repair(request: LayoutRequest, *, workers: int | Executor = 1, progress: Progress = silent) -> Repair:
    """Find the smallest change with which a failing cell passes every check, and other remedies.

    First all that the cell lets a layout search change of one robot alone, then of two, and so on until a change
    passes; beside it other branches, spins, rods, weights, methods and a longer cycle. Every remedy is solved and
    verified.

    Args:
        request: What is repaired; its objective counts for nothing.
        workers: Number of processes; or an executor, which stays open. What passes on other machines is solved here
            once more.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: The cell cannot be read, or its job is not one that can be searched.
    """
    sought = replace(request, objective=Objective.CHANGE)
    ready = ready_cell(sought)
    start, reason = start_posture(ready)
    point = None if reason else ready.coarse.evaluate(ready.variables.given, start)
    faults = () if point is None else start_faults(ready, point)
    work = _Work(request=sought, workers=workers, progress=progress, faults=faults)
    work.try_all(ready, point is not None and not violations(ready, point))
    case = Case(ready=ready, given=work.given, remedies=work.remedies, failures=work.failures)
    best = ready.cell.with_values(remedy_values(case.remedies[0][1])) if case.remedies else None
    return Repair(record=advice_record(case), given=ready.cell, best=best)


@dataclass(frozen=True, slots=True, kw_only=True)
class StartFault:
    """A demand that the start posture misses.

    The start posture of an operator follows from its own base, tool and branch and from where the part is: a change of
    other operators leaves it as it is.
    """

    robots: frozenset[str]  # robots of which a change may help
    text: str  # what is missed

    def excludes(self, attempt: Attempt) -> bool:
        """Whether an attempt cannot help."""
        return attempt.kind in KEEPS_START or self.robots.isdisjoint(attempt.robots)


@dataclass(slots=True, kw_only=True)
class _Work:
    """The attempts of a repair."""

    request: LayoutRequest  # what is repaired
    workers: int | Executor  # number of processes, or what works attempts out
    progress: Progress  # called with the stage and the fraction done
    faults: Sequence[StartFault] = ()  # what the given start posture misses already
    given: TrialOutcome = field(default_factory=lambda: TrialOutcome(status=TrialStatus.FAILED, figures={}))
    tried: list[Tried] = field(default_factory=list)  # what came of the attempts

    def try_all(self, ready: PreparedSearch, seems_sound: bool) -> None:
        """Make attempts until changes of the layout of some number of robots pass, and all others."""
        if seems_sound:
            self._run([None])
            if self.given.status is TrialStatus.PASSED:
                return
            self._run(of_far_starts(far_starts(ready).values()))
        names = {check["name"] for check in failed_checks(self.given)}
        can_help = not seems_sound or bool(names & (JOINT_LIMITS | DISTANCES))  # a search knows of nothing else
        can_help = can_help or bool(self.tried and not self.remedies)
        self._run([*([] if seems_sound else [None]), *(_first(ready) if can_help else [])])
        sizes = range(2, len(owners(ready.cell, ready.variables.settings)) + 1) if can_help else ()
        for size in sizes:
            if any(attempt.kind is RemedyKind.LAYOUT for attempt, _ in self.remedies):
                break
            self._run(list(of_layout(ready.cell, ready.variables.settings, size)))
        self._run(_about_limits(ready, self.given))

    def _run(self, attempts: Sequence[Attempt | None]) -> None:
        """Make some attempts; None stands for the cell as it is given."""
        jobs: list[Attempt | None] = []
        for job in attempts:
            fault = None if job is None else next((it for it in self.faults if it.excludes(job)), None)
            if job is None or fault is None:
                jobs.append(job)
            else:
                self.tried.append((job, TrialOutcome(status=TrialStatus.FAILED, reason=fault.text, figures={})))
        variants = [Variant(place, {ATTEMPT: job}) for place, job in enumerate(jobs)]
        workers = self.workers if len(jobs) > FEW else 1
        is_remote = getattr(workers, "is_remote", False)
        with outcomes(variants, partial(evaluate, self.request), workers) as every:
            for place, (attempt, outcome) in enumerate(zip(jobs, every, strict=True)):
                if is_remote and outcome.status is TrialStatus.PASSED:
                    outcome = evaluate(self.request, variants[place])  # noqa: PLW2901 - the one that counts
                if attempt is None:
                    self.given = outcome
                else:
                    self.tried.append((attempt, outcome))
                words = "cell as given" if attempt is None else attempt.text
                self.progress(f"{words}, {place + 1} of {len(jobs)}", (place + 1) / len(jobs))

    @property
    def remedies(self) -> list[Tried]:
        """Attempts that pass: changes of the layout by their number of robots and cost, then others by their cost."""
        return sorted((tried for tried in self.tried if tried[1].status is TrialStatus.PASSED), key=_size)

    @property
    def failures(self) -> list[Tried]:
        """Attempts that do not pass."""
        return [tried for tried in self.tried if tried[1].status is not TrialStatus.PASSED]


def _first(ready: PreparedSearch) -> list[Attempt]:
    """Attempts that do not depend on what comes of others."""
    cell, settings = ready.cell, ready.variables.settings
    paths = of_paths(searched_cell(ready.request))
    attempts = [*of_layout(cell, settings, 1), *of_tools(cell, settings), *of_branches(cell), *paths]
    return sorted(attempts, key=lambda attempt: KINDS.index(attempt.kind))


def _about_limits(ready: PreparedSearch, given: TrialOutcome) -> list[Attempt]:
    """Attempts where the verdict is about limits of joints, or what a slower motion keeps, alone."""
    checks, step = failed_checks(given), ready.cell.motion.step
    failed = {check["name"] for check in checks}
    attempts: list[Attempt] = []
    if failed and failed <= JOINT_LIMITS:
        attempts += of_weights(ready.cell, ready.variables.settings)
        if ready.cell.solver.method != WITH_LIMITS:
            attempts.append(Attempt(kind=RemedyKind.METHOD, robots=(), values={"solver.method": WITH_LIMITS}))
    if failed and failed <= PASSED_BY_STEP and ready.cell.motion.grid is None:
        values = {"motion.step_s": required_step(checks, step)}
        attempts.append(Attempt(kind=RemedyKind.STEP, robots=(), values=values))
    if failed and failed <= PASSED_BY_TIME:
        attempts.append(Attempt(kind=RemedyKind.DURATION, robots=(), values={FACTOR: required_time(checks)}))
    return attempts


def _size(tried: Tried) -> tuple[bool, int, float, int]:
    """The size of a remedy: changes of the layout first, then the number of robots, the cost and the kind."""
    attempt, outcome = tried
    is_other = attempt.kind is not RemedyKind.LAYOUT
    robots = 0 if is_other else len(attempt.robots)
    return is_other, robots, float(str(outcome.figures["cost"])), KINDS.index(attempt.kind)


def start_faults(ready: PreparedSearch, point: Point) -> tuple[StartFault, ...]:
    """What the starts of its motions, of the phases of a program one after the other, miss of the demands."""
    problem, cell, margin = ready.coarse, ready.variables.base, ready.demands().margin
    holder = set(cell.positioners) or {PART}
    first = np.array([part.start for part in problem.transfers.parts], dtype=np.intp)
    left = np.minimum(point.q[first] - problem.limits.lower, problem.limits.upper - point.q[first])
    faults = []
    for column in np.flatnonzero(left.min(axis=0) - margin < -CLEARLY).tolist():
        robot, joint = problem.joint_names(column)
        text = f"joint {robot}/{joint} has too little room in the start posture, which this does not change"
        faults.append(StartFault(robots=frozenset({robot, *holder}), text=text))
    near = problem.distances(point, first, 0.0)
    missing = near.demands - near.values
    for row in np.argsort(-missing, kind="stable").tolist():
        if missing[row] > CLEARLY:
            names = problem.pair_names(int(near.pairs[row]))
            robots = frozenset().union(*(_carriers(ready.scene, name) for name in names))
            text = (
                f"{names[0]} and {names[1]} are {MM * float(missing[row]):.3g} mm too near in the start posture, which "
                "this does not change"
            )
            faults.append(StartFault(robots=robots | holder, text=text))
    return tuple(faults)


def _carriers(scene: Scene, name: str) -> set[str]:
    """The robot that a body belongs to."""
    return {body.robot for body in scene.bodies if body.name == name and body.robot is not None}
