"""Outcome of one variant of a study: a cell that is solved, or the reason why there is no motion."""

from collections.abc import Callable, Mapping
from pathlib import Path

from cellplan.errors import InputError, NoSolutionError, StudyStoppedError
from cellplan.model.cell.cell import Cell
from cellplan.report.record.figures import KEY, figures_of
from cellplan.runs.overrides import require_task
from cellplan.runs.solution import Solution
from cellplan.runs.solve import solve
from cellplan.runs.write_run import write_run
from cellplan.study.trial import TrialOutcome, TrialStatus


def solved_outcome(
    read: Callable[[], Cell],
    *,
    file: Path,
    task: str | None = None,
    folder: Path | None = None,
    figures: Callable[[Solution], Mapping[str, object]] | None = None,
) -> TrialOutcome:
    """Solve one variant; what is wrong with it becomes its reason.

    Args:
        file: The cell file; reasons name it without its folder.
        task: Name of the only task to work on; None for all.
        folder: Run folder to be written; None for none.
        figures: Gives the figures of the outcome; None for the key figures of the program.

    Raises:
        StudyStoppedError: The run folder cannot be written.
    """
    try:
        cell = read()
        require_task(cell, task)
        solution = solve(cell, task=task, is_reported=folder is not None)
    except (InputError, NoSolutionError) as error:
        status = TrialStatus.BAD_INPUT if isinstance(error, InputError) else TrialStatus.NO_SOLUTION
        reason = str(error).splitlines()[0].replace(str(file), file.name)  # the same wherever the cell file lies
        return TrialOutcome(status=status, reason=reason, figures={})
    if folder is not None:
        try:
            write_run(solution, folder)
        except InputError as error:
            raise StudyStoppedError(str(error)) from error
    failed = [check.message for run in solution.runs for check in run.report.checks if not check.passed]
    status = TrialStatus.FAILED if failed else TrialStatus.PASSED
    key = figures_of([run.report for run in solution.runs]).record(KEY) if figures is None else figures(solution)
    return TrialOutcome(status=status, reason=failed[0] if failed else "", figures=key)
