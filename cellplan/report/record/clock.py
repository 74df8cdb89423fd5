"""What decides the length of the common clock, for the record and in words."""

from typing import Final

from cellplan.model.cell import Cell

STEP_ROOM: Final = 1e-9  # [-] of a step, or of so many steps as the clock has: rounding of the quotient
GIVEN: Final = "motion.duration_s"
NEXT_STEP: Final = "step after motion.duration_s"
TASKS: Final = "tasks"
WORDS: Final = {
    TASKS: "no motion.duration_s: the clock ends with the last task",
    NEXT_STEP: "motion.duration_s is no whole number of steps: the clock ends with the step after it",
}


def clock_from(cell: Cell) -> str:
    """The given duration, the step after it where it is no whole number of steps, or the last task to end."""
    duration = cell.motion.duration
    if duration is None:
        return TASKS
    steps = duration / cell.motion.step
    return GIVEN if abs(steps - round(steps)) <= STEP_ROOM * max(steps, 1.0) else NEXT_STEP


def clock_words(origin: str) -> str:
    """The same for people; empty where the clock is as long as the cell says."""
    return WORDS.get(origin, "")
