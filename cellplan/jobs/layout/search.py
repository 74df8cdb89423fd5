"""Layout search: trials in rounds, the best of them finished and certified, and all of it in one folder."""

from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.jobs.fastest.timed_program import TimedProgram
from cellplan.jobs.layout.finish.finish import CandidateResult, Finish, certified_cell
from cellplan.jobs.layout.given_layout import Given, given_layout, given_program, given_result
from cellplan.jobs.layout.record import LayoutRecord, layout_record
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.result import head_of, layout_files, verdict_line
from cellplan.jobs.layout.result_file import file_records, result_files
from cellplan.jobs.layout.trials.prepared import PreparedSearch, prepared
from cellplan.jobs.layout.trials.proposals import BESTS, SIZE, Proposal, Proposals, is_candidate, proposals_of
from cellplan.jobs.layout.trials.searched import read_attempts, searched_cell
from cellplan.jobs.layout.trials.trial import evaluate
from cellplan.model.cell.cell import Cell
from cellplan.model.presented import Presented
from cellplan.model.progress import Progress, silent
from cellplan.runs.write_run import versions
from cellplan.search.programs.objective import Objective
from cellplan.search.programs.program_problem import ProgramProblem
from cellplan.study.folder import write_results
from cellplan.study.study import Finished, Stop, Study
from cellplan.study.trial import StudyTrial
from cellplan.study.workers import Limits, Workers

BUDGET: Final = 60.0  # [s] of a search that does not say where to end
CANDIDATES: Final = 4  # [-] layouts that are finished until one passes
TRIAL_LIMIT: Final = 900.0  # [s] of the processor for one trial
TRIAL: Final = "cellplan.jobs.layout.trials.trial"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LayoutResult(Presented):
    """What a layout search has come to.

    Attributes:
        record: The record of ``study.json``.
        best: The best certified layout; None without one.
    """

    record: LayoutRecord
    best: CandidateResult | None

    def __repr__(self) -> str:
        """One line without arrays."""
        return (
            f"<Layout search of '{self.record['cell']}', trials: {self.record['trials']}; {verdict_line(self.record)}>"
        )


@dataclass(slots=True, kw_only=True)
class _Search:
    """One search."""

    request: LayoutRequest
    folder: Path
    ready: PreparedSearch
    workers: int | Executor
    stop: Stop
    progress: Progress
    finish: Finish
    proposals: Proposals
    program: TimedProgram | None = None  # that of the given layout where it is certified before the search
    given: Callable[[], Given] | None = None
    tried: dict[int, CandidateResult] = field(default_factory=dict)

    def run(self, *, resume: bool) -> tuple[Finished, CandidateResult | None]:
        """Rounds and finish; a search for any conforming layout goes on where the first one is rejected."""
        while True:
            finished = self._study().run(
                partial(evaluate, self.request.anywhere),
                workers=self.workers,
                stop=self.stop,
                limits=Limits(seconds=TRIAL_LIMIT),
                resume=resume or bool(self.tried),
                progress=self.progress,
            )
            if isinstance(self.workers, Workers) and self.request.objective is Objective.CONFORMING:
                self.workers.stop()  # trials after the one that is enough do not count
            if self.given is None and isinstance(self.workers, Workers):
                self.given = self.workers.begin(given_layout, self.request.anywhere)
            best = self._best(finished)
            goes_on = finished.stopped_by == "enough" and bool(self.candidates(finished))
            if best is not None or self.request.objective is not Objective.CONFORMING or not goes_on:
                return finished, best

    def _study(self) -> Study:
        """The study, without the candidates that were rejected."""
        rejected = frozenset(self.tried)
        is_enough = partial(_is_enough, rejected) if self.request.objective is Objective.CONFORMING else None
        study = _study(self.request, self.ready.cell, self.folder)
        return replace(study, propose=self.proposals, enough=is_enough)

    def _best(self, finished: Finished) -> CandidateResult | None:
        """The first candidate that passes, best first; of programs, whose transfers are estimates, the fastest one.

        Those whose estimate is longer than a certified program are not solved.
        """
        passed = list[CandidateResult]()
        is_estimate = self.ready.phases is not None and self.request.objective is Objective.CYCLE
        is_estimate = is_estimate and self.ready.variables.settings.misplacement is None
        for finalist in self.finish.ordered(self.candidates(finished))[:CANDIDATES]:
            number = finalist.trial.number
            if is_estimate and finalist.trial.figures["cycle_s"] > min((one.cycle for one in passed), default=np.inf):
                break
            if number not in self.tried:
                self.progress(f"certifying trial {number}", 1.0)
                self.tried[number] = self.finish.certified(finalist)
            if self.tried[number].passed:
                passed.append(self.tried[number])
                if not is_estimate:
                    break
        best = min(passed, key=lambda result: (result.cycle, result.trial), default=None)
        if best is not None and is_estimate:
            [trial] = (it for it in finished.trials if it.number == best.trial)
            self.tried[best.trial] = best = self.finish.learned(trial, best)
        return best

    def candidates(self, finished: Finished) -> list[StudyTrial]:
        """Trials that conform by the search, best first."""
        best = BESTS[self.request.objective]
        sign = -1.0 if best.is_largest else 1.0
        listed = [trial for trial in finished.trials if is_candidate(trial)]
        return sorted(listed, key=lambda trial: (sign * _value(trial, best.figure, sign), trial.number))


def search_layout(
    request: LayoutRequest,
    folder: Path,
    *,
    stop: Stop | None = None,
    workers: int | Executor = 1,
    resume: bool = False,
    progress: Progress = silent,
) -> LayoutResult:
    """Search for the best layout of a cell and write it, with what it was chosen from, into a folder.

    The folder holds ``study.jsonl``, a line for each trial that grows while the search runs, and at the end
    ``best.yaml``, the given cell file with the values of the best layout, ``study.json`` and ``study.html``. Only a
    layout that passed every check of ``solve`` is written as the best one. For an equal number of trials the files are
    the same, for any number of workers.

    Args:
        request: What is searched for.
        folder: Folder of the study; an earlier one is replaced, or continued with ``resume``.
        stop: Where it ends: a number of trials, or a budget of seconds; None for 60 s.
        workers: Number of processes that search; or an executor, which stays open, such as ``layout_workers``.
        resume: Whether trials that the folder holds already are not repeated.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: The cell cannot be read or searched, or the folder cannot be used.
        KeyboardInterrupt: It was interrupted; says how many trials are recorded.
    """
    with ExitStack() as opened:
        pool = workers
        if isinstance(workers, int):
            refuse_search(request, folder, resume=resume)
            pool = opened.enter_context(layout_workers(workers, request))
        ready = prepared(request)
        program = _given_program(ready, progress)
        proposals = proposals_of(request, ready)
        search = _Search(
            request=request,
            folder=folder,
            ready=ready,
            workers=pool,
            stop=stop or Stop(seconds=BUDGET),
            progress=progress,
            finish=finish_of(ready, progress, workers=pool),
            proposals=replace(proposals, detours=_given_detours(ready, program)),
            program=program,
            given=None if program is None else partial(given_layout, request, program),
        )
        finished, best = search.run(resume=resume)
        progress("writing the result", 1.0)
        return _written(search, finished, best)


def refuse_search(request: LayoutRequest, folder: Path, *, resume: bool = False) -> Cell:
    """The cell to search; refuses what its files say already cannot be searched, before any process begins."""
    cell = searched_cell(request)
    read_attempts(request, cell)
    _study(request, cell, folder).refuse(resume=resume)
    return cell


def _study(request: LayoutRequest, cell: Cell, folder: Path) -> Study:
    """The study of a search, which proposes nothing yet."""
    header = {
        "kind": "layout",
        "cell": cell.name,
        **request.record,
        "inputs": dict(cell.inputs),
        "versions": versions(),
    }
    best = BESTS[request.objective]
    return Study(folder=folder, header=header, size=SIZE, propose=lambda _finished: (), best=best)


def finish_of(ready: PreparedSearch, progress: Progress, *, workers: int | Executor) -> Finish:
    """The finish of the layouts of a cell, with displaced bases where they are asked for."""
    misplacement = ready.variables.settings.misplacement
    if misplacement is None:
        return Finish(ready=ready, progress=progress, workers=workers)
    from cellplan.jobs.layout.finish.misplacement import MisplacedFinish

    return MisplacedFinish(ready=ready, progress=progress, workers=workers, misplacement=misplacement)


def _written(search: _Search, finished: Finished, best: CandidateResult | None) -> LayoutResult:
    """The record and all files."""
    given = given_layout(search.request) if search.given is None else search.given()
    best = _not_worse(search, finished, given, best)
    record = layout_record(search.ready, finished, given, tried=search.tried, best=best)
    if best is not None:
        record["misplacement"] = best.misplacement
    files: dict[str, bytes] = {}
    if best is not None:
        head = head_of(record, search.request)
        files = result_files(certified_cell(best), search.request.cell, search.folder, head=head)
        record["files"] = file_records(files)  # type: ignore[typeddict-item]
    write_results(search.folder, {**layout_files(record), **files})
    return LayoutResult(record=record, best=best)


def _given_program(ready: PreparedSearch, progress: Progress) -> TimedProgram | None:
    """The given program whose transfers are to become shorter, certified; None without one."""
    if ready.phases is None or ready.request.objective is not Objective.CYCLE:
        return None
    progress("solving the given layout", 0.0)
    try:
        return given_program(ready)
    except (InputError, NoSolutionError):
        return None


def _given_detours(ready: PreparedSearch, program: TimedProgram | None) -> tuple[float, ...] | None:
    """The detours of the transfers of the given program; None without one."""
    problem = ready.coarse
    if program is None or ready.phases is None or not isinstance(problem, ProgramProblem):
        return None
    point = problem.evaluate(problem.given, ready.given_start)
    return None if point is None else ready.phases.with_detours(problem, point, program.solution).detours


def _not_worse(
    search: _Search, finished: Finished, given: Given, best: CandidateResult | None
) -> CandidateResult | None:
    """The best layout, or the given one where that passes in a cycle that is not longer; it is the first trial then."""
    ready, cycle = search.ready, given.record["cycle_s"]
    is_comparable = ready.unled is None and ready.variables.settings.misplacement is None
    firsts = [trial for trial in finished.trials[:1] if trial.figures and Proposal.of_trial(trial).kind == "given"]
    if cycle is None or given.record["status"] != "conforming" or not is_comparable or not firsts:
        return best
    if best is not None and best.cycle < cycle:
        return best
    result = given_result(ready, firsts[0].number, search.program)
    if result is None or not result.passed:
        return best
    search.tried[result.trial] = result
    return result


def _is_enough(rejected: frozenset[int], trial: StudyTrial) -> bool:
    """Whether a trial ends the search for any conforming layout."""
    return trial.passed and trial.number not in rejected


def _value(trial: StudyTrial, figure: str, sign: float) -> float:
    """The figure of a trial that is compared; without one it comes last."""
    value = trial.figures.get(figure)
    return float(value) if isinstance(value, int | float) else sign * float("inf")


def layout_workers(count: int, request: LayoutRequest) -> Workers:
    """Worker processes, for a ``with`` statement; they make the cell ready while the caller goes on.

    Where the first conforming layout ends the search, mostly the first trial is the last one: one process begins, with
    that trial.
    """
    is_one = request.objective is Objective.CONFORMING
    first = partial(_call, "evaluate_first" if is_one else "prepared", request.anywhere)
    return Workers(count, modules=(TRIAL,), first=first, at_once=1 if is_one else None)


def _call(name: str, *arguments: object) -> Any:
    """Call a function of the trials, which only the worker imports."""
    return getattr(import_module(TRIAL), name)(*arguments)
