"""Rendering of sheets: imports the plotting library only when something is drawn."""

from collections.abc import Mapping

import numpy as np

from cellplan.report.plots.sheet import Sheet


def pictures(sheets: Mapping[str, Sheet]) -> dict[str, bytes]:
    """Every sheet as SVG and PNG, by file name."""
    from cellplan.report.plots.canvas import paint

    return paint(sheets)


def warm_up() -> None:
    """Import the plotting library and fill its font cache."""
    sheet = Sheet("", rows=1, columns=1, times=np.array([0.0, 1.0]))
    sheet.panel(0, "0", span=(0.0, 1.0))
    pictures({"": sheet})
