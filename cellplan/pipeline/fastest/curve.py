"""Production curve: what a program loads the joints with, from the shortest cycle to calmer ones."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Final

from cellplan.errors import InputError, NoSolutionError
from cellplan.model.cell import Cell
from cellplan.model.progress import Progress, silent
from cellplan.pipeline.fastest.scaling import scaled_values, steps_within, whole_steps
from cellplan.pipeline.fastest.timed_program import Law, TimedProgram
from cellplan.report.record.figures import LOAD
from cellplan.study.run import outcomes
from cellplan.study.trial import TrialOutcome, TrialStatus, Variant

LONGEST: Final = 3.0  # [-] times the shortest cycle: where the curve ends


@dataclass(frozen=True, slots=True, kw_only=True)
class CurvePoint:
    """One cycle on the production curve.

    Attributes:
        law: What decides when the joints are where.
        values: What is set in the cell for it, by address.
        figures: Its load, ``LOAD`` of it; empty where there is no program.
        reason: Why there is none.
    """

    law: Law
    values: Mapping[str, object]
    figures: Mapping[str, object]
    reason: str = ""


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
    points of a law run along one joint path, and that of the shortest one is.

    Args:
        base: The cell as it is written.
        shortest: The shortest program of each law.
        task: Name of the only task to work on.
        points: Number of calmer cycles of each law.
        workers: Number of processes that solve.
        progress: Called with the stage and the fraction done.
    """
    factors = [LONGEST ** ((k + 1) / points) for k in range(points)]
    sought = [(program.law, _values(base, program, factor)) for program, factor in product(shortest, factors)]
    variants = [Variant(number, values) for number, (_, values) in enumerate(sought)]
    by_law: dict[Law, list[CurvePoint]] = {
        program.law: [CurvePoint(law=program.law, values=program.values, figures=program.figures.record(LOAD))]
        for program in shortest
    }
    laws = tuple(law for law, _ in sought)
    with outcomes(variants, partial(_outcome, base, laws, task), workers) as every:
        for (law, values), outcome in zip(sought, every, strict=True):
            by_law[law].append(CurvePoint(law=law, values=values, figures=outcome.figures, reason=outcome.reason))
            done = sum(map(len, by_law.values())) - len(shortest)
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
