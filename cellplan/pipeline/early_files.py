"""Files of a run that do not depend on its clearance, made while the clearance is checked."""

from dataclasses import replace
from typing import NamedTuple

from cellplan.model.cell import Cell
from cellplan.model.motion import Motion
from cellplan.model.report import Report
from cellplan.pipeline.solution import Run, Solution
from cellplan.report.plots.run import CLEARANCE, run_figures
from cellplan.report.plots.svg import svg_text
from cellplan.report.record.series import series_head


class EarlyFiles(NamedTuple):
    """What was made of one run.

    Attributes:
        report: Its report, without clearance.
        motion: Its motion.
        drawn: Its figures as SVG, but for that of the clearance, by name.
        series: The beginning of ``series.json``.
    """

    report: Report
    motion: Motion
    drawn: dict[str, str]
    series: str


def with_early_files(solution: Solution) -> Solution:
    """The solution, whose clearance need not be known, with the files of all of its runs that do not depend on it."""
    runs = (replace(run, early=_made(run, run.cell_of(solution.cell))) for run in solution.runs)
    return replace(solution, runs=tuple(runs))


def early_files(run: Run) -> EarlyFiles:
    """What was made of a run; nothing where that was not done, or was done of another report or motion."""
    early = run.early
    if early is not None and early.motion is run.motion and _is_same(early.report, run.report):
        return early
    return EarlyFiles(run.report, run.motion, {}, "")


def _made(run: Run, cell: Cell) -> EarlyFiles:
    """The files of one run."""
    figures = run_figures(run.report, cell=cell)
    drawn = {name: svg_text(figure) for name, figure in figures.items() if name != CLEARANCE}
    return EarlyFiles(run.report, run.motion, drawn, series_head(run.report, run.motion))


def _is_same(one: Report, other: Report) -> bool:
    """Whether two reports say the very same but for the clearance, as far as figures and series go."""
    return (
        one.times is other.times
        and one.q is other.q
        and one.qd is other.qd
        and one.accuracy is other.accuracy
        and one.joints is other.joints
        and one.closures is other.closures
        and one.conditioning is other.conditioning
        and one.tasks == other.tasks
    )
