"""BackgroundPlots: the plots of a run, painted aside as soon as their curves are known, or when they are asked for."""

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
    """Paints the plots of one run after the other; the files are the same with and without a child process."""

    def __init__(self, aside: BackgroundProcess | None = None) -> None:
        """Let the child import what it paints with; without one everything is painted when it is asked for."""
        self._aside = aside
        self._begun: list[tuple[Report, Callable[[], Pictures]]] = []
        if aside is not None:
            aside.begin(warm_up)

    def begin(self, report: "Report", *, cell: "Cell") -> None:
        """Begin with the plots of a run of which all is known but the clearance."""
        from cellplan.report.plots.run import motion_sheets

        if self._aside is not None:
            self._begun.append((report, self._aside.begin(pictures, motion_sheets(report, cell=cell))))

    def pictures(self, report: "Report", *, cell: "Cell") -> Callable[[], Pictures]:
        """Paint the plots of a run; what is returned gives them as ``draw_plots`` does, once they are there.

        Only what was begun with the very same figures is used.
        """
        from cellplan.report.plots.run import clearance_sheets, motion_sheets

        of_clearance = self._painted(clearance_sheets(report, cell=cell))
        of_motion = next((painting for begun, painting in self._begun if _is_same_motion(begun, report)), None)
        if of_motion is None:
            of_motion = self._painted(motion_sheets(report, cell=cell))
        painted = of_motion
        return lambda: painted() | of_clearance()

    def _painted(self, sheets: dict[str, Sheet]) -> Callable[[], Pictures]:
        """What gives the pictures of some sheets."""
        return (lambda: pictures(sheets)) if self._aside is None else self._aside.begin(pictures, sheets)


def _is_same_motion(one: "Report", other: "Report") -> bool:
    """Whether two reports show the very same curves, that of the clearance aside."""
    return (
        one.q is other.q
        and one.qd is other.qd
        and one.accuracy is other.accuracy
        and one.joints is other.joints
        and one.closures is other.closures
        and one.conditioning is other.conditioning
    )
