"""Phases of the program in the record of a run, its clock, and robots and moves that are not part of it."""

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Final, TypedDict

from cellplan.model.cell.cell import Cell, Timing
from cellplan.model.cell.idle import not_in_program
from cellplan.model.motion.plan import Phase
from cellplan.report.record.common import Number, Record, number

AT: Final = "at_s"  # ends the key of an instant, which counts from the begin of its phase
PHASE: Final = "phase"  # ends the key of its phase instead
STEP_TOL: Final = 1e-9  # [-] relative rounding error of the number of steps
GIVEN: Final = "motion.duration_s"
NEXT_STEP: Final = "step after motion.duration_s"
TASKS: Final = "tasks"
TIMING: Final = "motion.timing"


class PhaseRecord(TypedDict):
    """An interval of the program in which no robot changes its role."""

    name: Annotated[str, "name of the phase"]
    begin_s: Annotated[Number, "begin on the clock of the whole program"]
    end_s: Annotated[Number, "end on the clock of the whole program"]
    in_program: Annotated[bool, "whether the joint tables hold this motion"]
    roles: Annotated[dict[str, str], "by robot: `carry`, `work: TASK`, `transfer: TARGET`, `hold at home` or `hold`"]


def phases_record(phases: Iterable[Phase]) -> list[PhaseRecord]:
    """All phases of the program in their order."""
    return [
        {
            "name": phase.name,
            "begin_s": number(phase.begin),
            "end_s": number(phase.end),
            "in_program": phase.in_program,
            "roles": {robot: str(role) for robot, role in phase.roles.items()},
        }
        for phase in phases
    ]


def is_of_phase(record: Record) -> bool:
    """Whether a ``report.json`` is that of one phase, with its samples; else it has the worst values of several."""
    return "samples" in record


def phase_key(key: str) -> str:
    """Key of the phase of an instant: ``margin_phase`` of ``margin_at_s``, ``phase`` of ``at_s``."""
    return key.removesuffix(AT) + PHASE


def in_phase(record: Record, phase: str) -> Any:
    """A record of one phase, and of the records in it, in which every instant names that phase."""
    named: dict[str, Any] = {}
    for key, value in record.items():
        named[key] = _in_phase(value, phase)
        if key.endswith(AT) and not isinstance(value, list):
            named[phase_key(key)] = None if value is None else phase
    return named


def _in_phase(value: Any, phase: str) -> Any:
    """The same of what stands within a record."""
    if isinstance(value, Mapping):
        return in_phase(value, phase)
    return [_in_phase(item, phase) for item in value] if isinstance(value, list) else value


def instant_text(entry: Record, key: str = AT) -> str:
    """When a figure is reached: its time, and its phase in the record of a program; empty without a time."""
    if entry[key] is None:
        return ""
    phase = entry.get(phase_key(key))
    return f"at {entry[key]:.3f} s" + (f" of {phase}" if phase else "")


def clock_from(cell: Cell) -> str:
    """The timing, the stated duration, the step after it if it is no whole number of steps, or the last task."""
    if cell.motion.timing is not Timing.AS_WRITTEN:
        return TIMING
    duration = cell.motion.duration
    if duration is None:
        return TASKS
    steps = duration / cell.motion.step
    return GIVEN if abs(steps - round(steps)) <= STEP_TOL * max(steps, 1.0) else NEXT_STEP


def missing_moves(cell: Cell, runs: Mapping[str | None, Iterable[str]]) -> list[str]:
    """Lines on moves that the programs of several runs do not contain, each with the name of its run.

    Args:
        runs: Names of its tasks, by the name of the run.
    """
    lines = {run: not_in_program(cell, tuple(tasks)) for run, tasks in runs.items()}
    return [f"{run}: {line}" if run else line for run, line in lines.items() if line]
