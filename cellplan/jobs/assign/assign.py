"""Assign: a draft becomes a program from home to home that passed every check, with a lower bound of its cycle.

In each round the block model chooses who does which tasks together, the sequencer orders the blocks and chooses the
modes, and the transfers are certified; the program is then solved as any other. Blocks that fail a check are not chosen
again; where no program passes, the one with fewest failed checks is the result, of equal ones the first.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import inf
from typing import Final, TypedDict

from cellplan.errors import ImpossibleTasksError, NoSolutionError
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.jobs.assign.search import AssignmentSearch, PlannedBlocks
from cellplan.jobs.assign.written import written_cell
from cellplan.model.answers import Answers, worked_out
from cellplan.model.cell.cell import Cell, Timing
from cellplan.model.presented import Presented
from cellplan.model.progress import Progress, silent
from cellplan.runs.solution import Solution
from cellplan.runs.solve import solve
from cellplan.search.assign.problem.instance import Instance
from cellplan.search.assign.schedules.blocks import BlockAnswer
from cellplan.search.assign.schedules.order import SequencedBlocks

ROUNDS: Final = 4  # programs that are solved until one passes
NEARLY: Final = 1.05  # [-] of the cycle of the program: so long are those of its alternatives at most
MOST_OTHERS: Final = 5  # alternatives that are stated


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Assignment(Presented):
    """Who does which task, in which order, at which pose of the part; and what is proved of it.

    Attributes:
        draft: The cell that was given, each open task with the first of its robots.
        cell: The program, with nothing open.
        solution: The program, solved and verified.
        instance: What was chosen from.
        sequenced: The blocks in their order, with a mode of every task.
        bound: No program in blocks at these stations, with these modes, is shorter, in [s]; None where that is not
            known: without OR-Tools, or where the part cools between the tasks of a retimed program.
        is_proved: Whether no schedule of the block model is better than the one that was first sequenced.
        greedy: Cycle in [s] of the greedy schedule, scarce tasks first, by the model.
        alternatives: Other schedules of the first round that are nearly as good by the model, the best one first; they
            are not certified.
        without: Cycle in [s] by the model without each robot, its transfers certified; None where it has to work.
        rounds: Number of programs that were solved.
        counts: Numbers of goals, modes, certificates and refusals.
        left_out: Why tasks are not in the program, one line for each; empty where it has all.
        with_more: Cycle in [s] by the model with each robot that is not available; None where there is no schedule.
    """

    draft: Cell
    cell: Cell
    solution: Solution
    instance: Instance
    sequenced: SequencedBlocks
    bound: float | None
    is_proved: bool
    greedy: float
    alternatives: tuple[SequencedBlocks, ...]
    without: Mapping[str, float | None]
    rounds: int
    counts: Mapping[str, int]
    left_out: tuple[str, ...] = ()
    with_more: Mapping[str, float | None] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether the program has all tasks and passed every check."""
        return self.solution.passed and not self.left_out

    @property
    def cycle(self) -> float:
        """Time of the program from home to home in [s]."""
        return sum(run.report.cycle_time for run in self.solution.runs)

    @property
    def model_cycle(self) -> float:
        """The same by the model, in [s]."""
        return self.sequenced.steps * self.instance.step

    def __repr__(self) -> str:
        """One line without arrays."""
        verdict = "passed" if self.passed else "failed"
        bound = "" if self.bound is None else f", at least {self.bound:.4g} s"
        return f"<Assignment of '{self.cell.name}': {self.cycle:.4g} s{bound}; {verdict}>"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AssignmentBound:
    """What the block model of an assignment comes to before anything is certified.

    Attributes:
        draft: The cell that was given, each open task with the first of its robots.
        instance: What is chosen from.
        answer: Its best schedule by the model, and the bound.
        counts: Numbers of goals, modes and conflicts.
    """

    draft: Cell
    instance: Instance
    answer: BlockAnswer
    counts: Mapping[str, int]


def assignment_bound(
    draft: AssignmentDraft,
    *,
    effort: int = 2,
    stations: int | None = None,
    progress: Progress = silent,
    answers: Answers = worked_out,
) -> AssignmentBound:
    """The lower bound of a draft, with no program; the arguments are those of ``assign``.

    Raises:
        InputError: Something in the cell cannot be assigned.
        NoSolutionError: A task can be done by no robot at any pose of the part, or no schedule keeps all rules.
    """
    progress("table of modes", 0.0)
    search = AssignmentSearch(draft, effort, most_stations=stations, answers=answers)
    instance = search.instance(progress)
    progress("blocks", 0.0)
    return AssignmentBound(draft=draft.cell, instance=instance, answer=search.blocks(instance), counts=search.counts)


def assign(
    draft: AssignmentDraft,
    *,
    effort: int = 2,
    stations: int | None = None,
    progress: Progress = silent,
    answers: Answers = worked_out,
) -> Assignment:
    """Choose robots, order, directions, spins and poses of the part for all tasks.

    Without OR-Tools blocks are improved by exchanges alone, and no lower bound is known. Where a robot is not available
    and no other one can do some tasks, they are left out with all that come after them.

    Args:
        draft: The cell with open tasks.
        effort: Work of the block model, from 1 to 5.
        stations: Number of poses of the part in use at most; that of the draft when None.
        progress: Called with the stage and the fraction done.
        answers: What answers for clearances, transfers and programs, or records it.

    Raises:
        InputError: Something in the cell cannot be assigned.
        NoSolutionError: A task can be done by no robot at any pose of the part, or no program passed.
    """

    def searched(given: AssignmentDraft) -> AssignmentSearch:
        progress("table of modes", 0.0)
        return AssignmentSearch(given, effort, most_stations=stations, answers=answers)

    left_out: tuple[str, ...] = ()
    try:
        assignment = _program_of(searched(draft), progress)
    except ImpossibleTasksError as error:
        partial, left_out = draft.without(error.tasks), tuple(error.findings)
        if partial is None:
            raise
        assignment = _program_of(searched(partial), progress)
    more = {name: _cycle_of(searched(draft.with_robot(name)), progress) for name in draft.absent}
    return replace(assignment, left_out=left_out, with_more=more)


def _cycle_of(search: AssignmentSearch, progress: Progress) -> float | None:
    """Cycle of a draft in [s] by the model; None where there is no schedule."""
    try:
        instance = search.instance(progress)
        blocks = search.little(instance)
        return None if blocks is None else blocks.steps * instance.step
    except ImpossibleTasksError:
        return None


def _program_of(search: AssignmentSearch, progress: Progress) -> Assignment:
    """The program of all tasks of a draft."""
    draft = search.draft
    instance = search.instance(progress)
    counts, trials = search.counts, list[_Trial]()
    for number in range(1, ROUNDS + 1):
        progress("blocks", (number - 1) / ROUNDS)
        plan = search.planned(instance, is_first=number == 1)
        trials.append(_tried(written_cell(draft, instance, plan.sequenced), instance, plan, search.answers, progress))
        best = min(trials, key=lambda it: it.failed)
        trials = [it if it is best else replace(it, solution=None) for it in trials]
        if (failure := trials[-1].failure) is None:
            break
        instance = without_failed(instance, plan.sequenced, failure)
    if best.failure is not None and best.failure["reason"]:
        where = draft.cell.origin.at("tasks")
        raise NoSolutionError(f"{where}: no program passed in {ROUNDS} rounds; the first one: {best.failure['reason']}")
    first, step = trials[0].plan, instance.step
    steps = None if has_open_rests(draft.cell, instance) else first.bound
    return Assignment(
        draft=draft.cell,
        cell=best.cell,
        solution=best.solution or solve(best.cell, progress=progress),
        instance=best.instance,
        sequenced=best.plan.sequenced,
        bound=None if steps is None else steps * step,
        is_proved=first.is_proved,
        greedy=best.plan.greedy * step,
        alternatives=alternatives_to(best.plan.sequenced, first.others),
        without={name: None if it is None else it.steps * step for name, it in first.without.items()},
        rounds=len(trials),
        counts=counts | {"certificates": plan.examined, "refused": plan.refused},
    )


def has_open_rests(cell: Cell, instance: Instance) -> bool:
    """Whether tasks rest for each other whose times only the solve of the program decides: no bound counts these."""
    return bool(instance.rules.lags) and cell.motion.timing is not Timing.AS_WRITTEN


def alternatives_to(best: SequencedBlocks, others: Iterable[SequencedBlocks]) -> tuple[SequencedBlocks, ...]:
    """Schedules with other robots or poses of the part, or other tasks together, that take little more time."""
    different = {best.schedule.identity: best}
    for other in sorted(others, key=lambda it: it.steps):
        if other.steps <= NEARLY * best.steps:
            different.setdefault(other.schedule.identity, other)
    return tuple(different.values())[1 : 1 + MOST_OTHERS]


class Failure(TypedDict):
    """Why a program did not pass, as plain data."""

    reason: str  # why there is none; empty where there is one
    blocks: list[int]  # places of the blocks that failed a check
    checks: int  # number of checks that failed
    short_s: float  # longest time by which the part cooled too shortly


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Trial:
    """A program that was solved in one round."""

    instance: Instance
    plan: PlannedBlocks
    cell: Cell
    solution: Solution | None  # None where it is only known why it failed, or that it passed
    failure: Failure | None

    @property
    def failed(self) -> float:
        """Number of checks that failed; none is the best, no program the worst."""
        if self.failure is None:
            return 0.0
        return inf if self.failure["reason"] else self.failure["checks"]


def _tried(cell: Cell, instance: Instance, plan: PlannedBlocks, answers: Answers, progress: Progress) -> _Trial:
    """A program, solved and verified, and why it did not pass; no solution where that was recorded."""
    solutions = list[Solution]()

    def solved() -> Failure | None:
        try:
            solutions.append(solve(cell, progress=progress))
        except NoSolutionError as error:
            return Failure(reason=str(error), blocks=[], checks=0, short_s=0.0)
        return failure_of(solutions[0])

    failure: Failure | None = answers("program", str(cell.origin.document), solved)
    solution = next(iter(solutions), None)
    return _Trial(instance=instance, plan=plan, cell=cell, solution=solution, failure=failure)


def failure_of(solution: Solution) -> Failure | None:
    """Why a program did not pass; None where it did."""
    if solution.passed:
        return None
    checks = [check for run in solution.runs for check in run.report.checks if not check.passed]
    works = [run for run in solution.runs if run.schedule.tasks]
    return Failure(
        reason="",
        checks=len(checks),
        blocks=[place for place, run in enumerate(works) if not all(check.passed for check in run.report.checks)],
        short_s=max((check.limit - check.value for check in checks if check.name == "rest"), default=0.0),
    )


def without_failed(instance: Instance, sequenced: SequencedBlocks, failure: Failure) -> Instance:
    """The instance without the choices of blocks that failed; where the part cooled too shortly, with longer rests."""
    if (rules := instance.rules.with_longer_rests(failure["short_s"], instance.step)) != instance.rules:
        return replace(instance, rules=rules)
    blocks = sequenced.schedule.blocks
    words = set(re.findall(r"[\w-]+", failure["reason"]))
    named = {place for place, block in enumerate(blocks) if words.intersection(block)}
    failed = {*failure["blocks"], *named} or set(range(len(blocks)))
    modes, conflicts = dict(instance.modes), set(instance.conflicts)
    for place in failed:
        chosen = {
            (end.mode.task, end.mode.robot, end.mode.station): end.mode
            for end in sequenced.stops[place][1]
            if end is not None
        }
        keys = list(chosen)
        if any(mode not in instance.modes[key] for key, mode in chosen.items()):
            continue  # a finer mode: the next round has none
        if len(keys) > 1:
            conflicts |= {frozenset(pair) for pair in pairwise(keys)}
        else:
            left = tuple(mode for mode in modes[keys[0]] if mode is not chosen[keys[0]])
            if left:
                modes[keys[0]] = left
            elif any(key[0] == keys[0][0] for key in modes if key != keys[0]):
                del modes[keys[0]]
    return replace(instance, conflicts=frozenset(conflicts)).with_modes(modes)
