"""The cycle of a layout's motion: as the nodes have it, then as short as the limits of the verified motion allow."""

from cellplan.jobs.fastest.time_laws import from_both_sides
from cellplan.jobs.fastest.timed_program import Law, TimedProgram, scaled_values, whole_steps
from cellplan.jobs.layout.trials.prepared import PreparedSearch, is_fastest
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress
from cellplan.runs.early_clearance import EarlyClearance
from cellplan.search.programs.objective import CycleTiming, Objective


def is_scaled(ready: PreparedSearch) -> bool:
    """Whether the motion is made as fast as the limits allow as a whole."""
    is_cycle = ready.request.objective is Objective.CYCLE
    return is_cycle and ready.request.timing is CycleTiming.LAWS and ready.phases is None


def draft(
    ready: PreparedSearch, cell: Cell, cycle: float, progress: Progress, early: EarlyClearance | None = None
) -> TimedProgram:
    """The program of a layout in a cycle, or at the duration of the cell, or retimed; verified but for its clearance.

    Args:
        cycle: Its cycle in [s], if that may change.
        early: Begins with its clearance at once, unless its duration may still change.
    """
    is_cycle = ready.request.objective is Objective.CYCLE
    if ready.phases is not None:
        law = Law.COMMON_SPEED if is_fastest(ready) else Law.AS_WRITTEN
        retimed: dict[str, object] = {"motion.timing": "fastest"} if is_fastest(ready) else {}
        return TimedProgram.solved(cell, law, retimed, task=None, progress=progress, early=early)
    if ready.request.timing is CycleTiming.RETIMED:
        timing: object = "fastest" if is_cycle else {"cycle_s": ready.duration}
        law = Law.COMMON_SPEED if is_cycle else Law.REDUCED_SPEED
        values = {"motion.timing": timing}
        return TimedProgram.solved(cell, law, values, task=None, progress=progress, early=early)
    if not is_cycle:
        return TimedProgram.solved(cell, Law.AS_WRITTEN, {}, task=None, progress=progress, early=early)
    return scaled(cell, whole_steps(cell, cycle / ready.duration), progress)


def shortest(ready: PreparedSearch, cell: Cell, program: TimedProgram, progress: Progress) -> TimedProgram:
    """The program in the shortest cycle that its limits allow, from that in another cycle; see ``draft``."""
    step = cell.motion.step

    def at(steps: int) -> TimedProgram:
        return scaled(cell, steps * step / ready.duration, progress)

    def required(program: TimedProgram) -> float:
        load, more = load_of(program), required_time(program)
        return max(load, more) if more > 1.0 else load

    best = from_both_sides(round(program.cycle / step), program, at, required)
    return program if best is None else best


def scaled(cell: Cell, factor: float, progress: Progress) -> TimedProgram:
    """The program slower or faster by a factor, verified but for its clearance."""
    return TimedProgram.solved(cell, Law.TIME_LAWS, scaled_values(cell, factor), task=None, progress=progress)


def load_of(program: TimedProgram) -> float:
    """Share of its time in which the limits of speed and acceleration of the joints would allow the same motion."""
    figures = program.figures
    velocity, acceleration = (figures.recorded(f"max_{it}_ratio") or 0.0 for it in ("velocity", "acceleration"))
    return max(velocity, acceleration**0.5)


def time_of(program: TimedProgram) -> float:
    """Cycle in [s] in which the limits of speed and acceleration of the joints allow the motion."""
    return program.cycle * load_of(program)


def required_time(program: TimedProgram) -> float:
    """How many times as long the motion must last for failed checks that a slower one passes."""
    checks = [check for run in program.solution.runs for check in run.report.checks if not check.passed]
    return max((check.kind.more_time(check.value, check.limit) for check in checks), default=1.0)
