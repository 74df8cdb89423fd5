"""Plots of runs, drawn in a background process while the clearance is checked, or when they are needed."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from cellplan.guard import BackgroundProcess
from cellplan.report.plots.rendering import pictures, warm_up
from cellplan.report.plots.sheet import Sheet

if TYPE_CHECKING:  # the child is to begin before these are imported
    from cellplan.model.cell import Cell
    from cellplan.model.report import Report

Pictures = dict[str, bytes]


class BackgroundPlots:
    """Draws the plots of one run after the other; the files are the same with and without a child process."""

    def __init__(self, background: BackgroundProcess | None = None) -> None:
        """Let the child import the plotting library; without a child everything is drawn when it is needed."""
        self._background = background
        self._begun: list[tuple[Report, Callable[[], Pictures]]] = []
        if background is not None:
            background.begin(warm_up)

    def begin(self, report: "Report", *, cell: "Cell") -> None:
        """Begin with the plots of a run of which all is known but the clearance."""
        from cellplan.report.plots.run import motion_sheets

        if self._background is not None:
            self._begun.append((report, self._background.begin(pictures, motion_sheets(report, cell=cell))))

    def pictures(self, report: "Report", *, cell: "Cell") -> Callable[[], Pictures]:
        """Draw all plots of a run; the returned function waits for them and returns what ``draw_plots`` returns.

        Plots that were begun are used only when their figures are those of this report.
        """
        from cellplan.report.plots.run import clearance_sheets, motion_sheets

        of_clearance = self._drawn(clearance_sheets(report, cell=cell))
        begun = (plots for other, plots in self._begun if _is_same_motion(other, report))
        of_motion = next(begun, None) or self._drawn(motion_sheets(report, cell=cell))
        return lambda: of_motion() | of_clearance()

    def _drawn(self, sheets: dict[str, Sheet]) -> Callable[[], Pictures]:
        """Function that returns the pictures of some sheets."""
        return (lambda: pictures(sheets)) if self._background is None else self._background.begin(pictures, sheets)


def _is_same_motion(one: "Report", other: "Report") -> bool:
    """Whether two reports show the very same curves, except for the clearance."""
    return (
        one.q is other.q
        and one.qd is other.qd
        and one.accuracy is other.accuracy
        and one.joints is other.joints
        and one.closures is other.closures
        and one.conditioning is other.conditioning
    )
