"""What determines the duration of the motion."""

from typing import Final

from cellplan.model.cell import Cell, Timing

STEP_TOL: Final = 1e-9  # [-] relative rounding error of the number of steps
GIVEN: Final = "motion.duration_s"
NEXT_STEP: Final = "step after motion.duration_s"
TASKS: Final = "tasks"
TIMING: Final = "motion.timing"


def clock_from(cell: Cell) -> str:
    """The timing, the stated duration, the step after it if it is no whole number of steps, or the last task."""
    if cell.motion.timing is not Timing.AS_WRITTEN:
        return TIMING
    duration = cell.motion.duration
    if duration is None:
        return TASKS
    steps = duration / cell.motion.step
    return GIVEN if abs(steps - round(steps)) <= STEP_TOL * max(steps, 1.0) else NEXT_STEP
