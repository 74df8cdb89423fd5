"""Lines of a tool on a part that moves in step: as long as all axes may move evenly along them, and no longer."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import work

from cellplan.model.settings.task import ToleranceEntry
from cellplan.programs.seams.choose import ToolPath

STEPS = 200


def line_path(held: np.ndarray) -> ToolPath:
    """The tool on a line of 0.2 m, with joints that move the part, as shares of what they may be off."""
    X = np.repeat(np.eye(4)[None], STEPS + 1, axis=0)
    X[:, 0, 3] = np.linspace(0.0, 0.2, STEPS + 1)
    task = replace(work("arm"), tolerance=ToleranceEntry(position_mm=0.5, orientation_deg=0.5))
    return ToolPath(task=task, X_PT=X, most=5e-5, held=held)


@pytest.mark.parametrize("bend", [0.0, 3.9, 90.0, 250.0])
def test_a_line_is_divided_where_the_part_does_not_move_evenly(bend: float) -> None:
    """A parabola of height b over the path is off its chord by b h^2 / 4 on a share h of it: at most 1."""
    share = np.linspace(0.0, 1.0, STEPS + 1)
    longest = STEPS if bend <= 4.0 else int(np.floor(STEPS * 2.0 / np.sqrt(bend)))

    pieces = list(line_path(np.stack([bend * share**2, -7.0 * share], axis=1)).pieces([0, STEPS]))

    assert [piece.last for piece in pieces] == [*range(longest, STEPS, longest), STEPS]


def test_a_part_that_rests_divides_nothing() -> None:
    assert [piece.last for piece in line_path(np.zeros((STEPS + 1, 0))).pieces([0, STEPS])] == [STEPS]
