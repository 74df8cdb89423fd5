"""Shortest cycle of a cell: by its time laws, and with the best common speed of all robots along the same path."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from time import perf_counter
from typing import Final

from cellplan.errors import InputError, NoSolutionError
from cellplan.jobs.fastest.demand import MetDemand, calmest, refuse_unless_possible
from cellplan.jobs.fastest.time_laws import shortest_by_time_laws
from cellplan.jobs.fastest.timed_program import (
    Law,
    SolvedAt,
    TimedProgram,
    refuse_fixed_times,
    scaled_values,
    steps_within,
    whole_steps,
)
from cellplan.model.cell.cell import Cell
from cellplan.model.presented import Presented
from cellplan.model.progress import Progress, silent
from cellplan.model.report.report import REDUCED_SPEED
from cellplan.model.units import MM
from cellplan.report.record.figures import LOAD
from cellplan.runs.greatest_feeds import OpenFeed, open_feeds, open_values, stated_values
from cellplan.runs.run_lengths import lengths_in, open_runs
from cellplan.runs.solve import solve_motion
from cellplan.study.run import outcomes
from cellplan.study.trial import TrialOutcome, TrialStatus, Variant

POINTS: Final = 4  # calmer cycles of each law on the production curve
PAYS: Final = 12.0  # [s] of work on the curve: less is done before further processes have started
LONGEST: Final = 3.0  # [-] times the shortest cycle: where the curve ends


@dataclass(frozen=True, slots=True, kw_only=True)
class CurvePoint:
    """One cycle on the production curve."""

    law: Law
    values: Mapping[str, object]  # what is set in the cell for it, by address
    figures: Mapping[str, object]  # its load, ``LOAD`` of it; empty where there is no program
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShortestCycles(Presented):
    """The shortest cycles of a cell, and what calmer ones load it with.

    Attributes:
        as_written: The program as it is written; its clearance is not checked.
        by_time_laws: With the durations, feeds and laws of the cell, all faster or slower by one factor.
        by_common_speed: With the best speed of all robots together along the path that the time laws give.
        at_reduced_speed: The same with no tool tip faster than 250 mm/s in the world; None where this is not possible.
        remark: Why there is no program at reduced speed; empty where there is one.
        curve: The production curve: both laws at the shortest cycle and at calmer ones, the shortest first.
        demand: The calmest program that meets a demand; None where none was asked for.
    """

    as_written: TimedProgram
    by_time_laws: TimedProgram
    by_common_speed: TimedProgram
    at_reduced_speed: TimedProgram | None
    remark: str = ""
    curve: tuple[CurvePoint, ...] = ()
    demand: MetDemand | None = None

    @property
    def programs(self) -> dict[str, TimedProgram]:
        """The programs that were solved and verified in full, by name."""
        programs = {"time_laws": self.by_time_laws, "common_speed": self.by_common_speed}
        if self.at_reduced_speed is not None:
            programs["reduced_speed"] = self.at_reduced_speed
        if self.demand is not None:
            programs["demand"] = self.demand.program
        return programs

    def __repr__(self) -> str:
        """One line without arrays."""
        name, verdict = self.as_written.solution.cell.name, "passed" if self.passed else "failed"
        cycles = ", ".join(f"{key.replace('_', ' ')} {one.cycle:.4g} s" for key, one in self.programs.items())
        return f"<Shortest cycles of '{name}': {cycles}; as written {self.as_written.cycle:.4g} s; {verdict}>"

    @property
    def passed(self) -> bool:
        """Whether all these programs passed every check."""
        return all(program.solution.passed for program in self.programs.values())


def fastest(
    cell: Cell,
    *,
    task: str | None = None,
    demand: float | None = None,
    points: int = POINTS,
    workers: int = 1,
    progress: Progress = silent,
) -> ShortestCycles:
    """The shortest time in which a program keeps the velocity, acceleration and jerk limits of all joints.

    Feeds are scaled with the time laws; for the common speed they are upper limits. Other checks, as tool errors and
    clearance, are made at the times found and do not change these.

    Args:
        cell: The cell, as ``load_cell`` gives it; its own timing does not matter.
        task: Name of the only task to work on.
        demand: Parts per hour that the calmest program is chosen for.
        points: Number of calmer cycles of each law on the production curve.
        workers: Largest number of processes that solve these; one where more would not pay.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: The cell cannot be worked with, or a task has times that do not follow the clock.
        NoSolutionError: No start posture or no home was found, the time laws keep no limit however slow they are, or
            the demand cannot be met.
    """
    refuse_fixed_times(cell)
    opened = open_feeds(cell, task)
    base = _with_stated_feeds(cell, opened, task, progress).with_values({"motion.timing": "as_written"})

    def solved(law: Law, values: dict[str, object], title: str) -> TimedProgram:
        return TimedProgram.solved(base, law, values, task=task, progress=_within(progress, title))

    written = solved(Law.AS_WRITTEN, {}, "as written")
    laws = shortest_by_time_laws(base, written, solved)
    begun = perf_counter()
    common = solved(Law.COMMON_SPEED, {"motion.timing": "fastest"}, "common speed")
    processes = workers if 2 * points * (perf_counter() - begun) > PAYS else 1
    if demand is not None:
        refuse_unless_possible(demand, min(laws, common, key=lambda program: program.cycle), cell.motion.step)
    laws = laws.certified(_within(progress, "time laws"))
    common = common.certified(_within(progress, "common speed"))
    reduced, remark = _at_reduced_speed(common, open_values(opened), solved, progress)
    met = None
    if demand is not None:
        met = calmest(base, demand, written=written, laws=laws, common=common, solved=solved)
        met = met.certified(_within(progress, "demand"))
    curve = production_curve(base, (laws, common), task=task, points=points, workers=processes, progress=progress)
    return ShortestCycles(
        as_written=written,
        by_time_laws=laws,
        by_common_speed=common,
        at_reduced_speed=reduced,
        remark=remark,
        curve=curve,
        demand=met,
    )


def _with_stated_feeds(cell: Cell, opened: Sequence[OpenFeed], task: str | None, progress: Progress) -> Cell:
    """The cell with the greatest feeds, which also hold at the best common speed, and with lengths of runs."""
    sought = open_runs(cell, task)
    if not opened and not sought:
        return cell
    _, solution = solve_motion(cell.with_values({"motion.timing": "fastest"}), task=task, progress=progress)
    stated = {feed.task.name: solution.cell.task(feed.task.name).feed or 0.0 for feed in opened}
    return cell.with_values(stated_values(opened, stated) | lengths_in(solution.cell, sought))


def _at_reduced_speed(
    common: TimedProgram, feeds: Mapping[str, object], solved: SolvedAt, progress: Progress
) -> tuple[TimedProgram | None, str]:
    """The best common speed with all tools at reduced speed, feeds sought anew, or why there is none."""
    if max(speed.tool_peak for run in common.solution.runs for speed in run.report.speeds.values()) <= REDUCED_SPEED:
        return common, ""
    values = {"motion.timing": "fastest", "checks.tool_speed_mm_s": MM * REDUCED_SPEED, **feeds}
    try:
        program = solved(Law.REDUCED_SPEED, values, "reduced speed")
    except (InputError, NoSolutionError) as error:
        return None, str(error).splitlines()[0]
    return program.certified(_within(progress, "reduced speed")), ""


def _within(progress: Progress, title: str) -> Progress:
    """A listener that names what is being solved."""
    return lambda stage, share: progress(f"{title}: {stage}", share)


def production_curve(
    base: Cell,
    shortest: Sequence[TimedProgram],
    *,
    task: str | None,
    points: int,
    workers: int = 1,
    progress: Progress = silent,
) -> tuple[CurvePoint, ...]:
    """The load at the shortest cycle of each law and at calmer ones, in equal ratios up to three times as long.

    Every point is a program that was planned anew, written and read back. Its clearance is not certified again: all
    points of a law run along one joint path, and that of the shortest one is. Feeds of processes stay: where they
    alone decide how long all takes, a law has one point.
    """
    factors = [LONGEST ** ((k + 1) / points) for k in range(points)]
    longer = [(program, _values(base, program, factor)) for program, factor in product(shortest, factors)]
    sought = [(program.law, values) for program, values in longer if values != program.values]
    variants = [Variant(number, values) for number, (_, values) in enumerate(sought)]
    by_law: dict[Law, list[CurvePoint]] = {
        program.law: [CurvePoint(law=program.law, values=program.values, figures=program.figures.record(LOAD))]
        for program in shortest
    }
    laws = tuple(law for law, _ in sought)
    with outcomes(variants, partial(_outcome, base, laws, task), workers) as every:
        for done, ((law, values), outcome) in enumerate(zip(sought, every, strict=True), start=1):
            by_law[law].append(CurvePoint(law=law, values=values, figures=outcome.figures, reason=outcome.reason))
            progress(f"production curve: cycle {done} of {len(sought)}", done / len(sought))
    return tuple(point for group in by_law.values() for point in group)


def _values(base: Cell, shortest: TimedProgram, factor: float) -> dict[str, object]:
    """Values with which a program takes longer by a factor, up to whole steps."""
    if shortest.law is Law.COMMON_SPEED:
        step, longest = base.motion.step, max(shortest.phases)
        steps = max(steps_within(factor * longest, step), steps_within(longest, step) + 1)
        return {"motion.timing": {"cycle_s": round(steps * step, 9)}}
    scaled = base.with_values(shortest.values)
    return scaled_values(scaled, whole_steps(scaled, factor))


def _outcome(base: Cell, laws: Sequence[Law], task: str | None, variant: Variant) -> TrialOutcome:
    """One point; why there is none becomes its reason."""
    try:
        program = TimedProgram.solved(base, laws[variant.number], variant.values, task=task, progress=silent)
    except (InputError, NoSolutionError) as error:
        return TrialOutcome(status=TrialStatus.NO_SOLUTION, reason=str(error).splitlines()[0], figures={})
    return TrialOutcome(status=TrialStatus.PASSED, reason="", figures=program.figures.record(LOAD))
