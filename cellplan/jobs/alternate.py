"""Alternate: who does which task, then where the robots stand, in turn until neither makes the program shorter."""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from cellplan.errors import NoSolutionError
from cellplan.jobs.assign.assign import Assignment, assign
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.jobs.assign.write import write_assignment
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.result_file import BEST
from cellplan.jobs.layout.search import search_layout
from cellplan.jobs.layout.trials.prepared import prepared
from cellplan.model.progress import Progress, silent
from cellplan.model.seeds import generator
from cellplan.report.record.common import number
from cellplan.search.variables.variables import Variables
from cellplan.study.study import Stop

SCHEMA: Final = "cellplan.alternation/1"
ROUNDS: Final = 3  # [-] assignments at most
GAIN: Final = 0.005  # [-] share of the cycle that a step must gain to go on
LAYOUTS: Final = 6  # [-] layouts tried until one has an assignment: the given one, then others near it

Numbers = Mapping[str, object]  # bases and tools, by address in the cell file


@dataclass(frozen=True, slots=True, kw_only=True)
class AlternationStep:
    """An assignment or a layout search of it."""

    kind: str  # assign or layout
    folder: Path  # where its result stands, with its best cell
    cycle: float | None  # certified cycle in [s]; None where it did not pass


def alternate(
    request: LayoutRequest,
    folder: Path,
    *,
    stop: Stop | None = None,
    workers: int | Executor = 1,
    progress: Progress = silent,
) -> tuple[AlternationStep, ...]:
    """Assign the open tasks of a cell, search the layout of the program, assign again there, while the cycle falls.

    Each step is a folder of its own, ``1-assign``, ``1-layout``, ``2-assign`` and so on, with ``best.yaml``.

    Args:
        request: What is searched for; its cell has open tasks.
        workers: Processes that search layouts.

    Raises:
        InputError: The cell cannot be assigned, or its layout not be searched.
        NoSolutionError: No layout that was tried has an assignment.
    """
    draft, steps, numbers = AssignmentDraft.load(request.cell, allow_dirs=request.allow_dirs), [], dict[str, object]()
    for count in range(1, ROUNDS + 1):
        assigned = folder / f"{count}-assign"
        draft, assignment = _assigned(draft, numbers, progress)
        write_assignment(assignment, request.cell, assigned, progress=progress)
        steps.append(
            AlternationStep(kind="assign", folder=assigned, cycle=assignment.cycle if assignment.passed else None)
        )
        if not gains(steps):
            break
        of_program, moved = replace(request, cell=assigned / BEST), folder / f"{count}-layout"
        result = search_layout(of_program, moved, stop=stop, workers=workers, progress=progress)
        cycle = None if result.best is None else result.best.cycle
        steps.append(AlternationStep(kind="layout", folder=moved, cycle=cycle))
        if result.best is None or not gains(steps):
            break
        numbers = prepared(of_program).variables.numbers(result.best.x)
    return tuple(steps)


def gains(steps: Sequence[AlternationStep]) -> bool:
    """Whether the last step is enough shorter than all before it, or none passed before."""
    before, last = best_step(steps[:-1]), steps[-1].cycle
    if before is None or before.cycle is None:
        return True
    return last is not None and last < (1.0 - GAIN) * before.cycle


def best_step(steps: Sequence[AlternationStep]) -> AlternationStep | None:
    """The step with the shortest certified cycle, of equal ones the first; None where none passed."""
    passed = [step for step in steps if step.cycle is not None]
    return min(passed, key=lambda step: step.cycle or 0.0, default=None)


def alternation_record(steps: Sequence[AlternationStep]) -> dict[str, Any]:
    """All steps as plain data."""
    best = best_step(steps)
    listed = [{"kind": step.kind, "folder": step.folder.name, "cycle_s": number(step.cycle)} for step in steps]
    return {"schema": SCHEMA, "steps": listed, "best": None if best is None else best.folder.name}


def alternation_lines(steps: Sequence[AlternationStep]) -> list[str]:
    """A line for each step, and the best cell."""
    best = best_step(steps)
    lines = ["NOTHING CERTIFIED" if best is None else f"CERTIFIED: cycle {best.cycle:.4g} s"]
    words = {"assign": "tasks assigned", "layout": "layout searched"}
    for step in steps:
        came = "did not pass" if step.cycle is None else f"{step.cycle:.4g} s"
        lines.append(f"  {words[step.kind]}: {came}, {step.folder}")
    return lines if best is None else [*lines, f"cell: {best.folder / BEST}"]


def _assigned(draft: AssignmentDraft, numbers: Numbers, progress: Progress) -> tuple[AssignmentDraft, Assignment]:
    """A draft in a layout that has an assignment, and this; without given numbers layouts near the draft's follow."""
    failure = NoSolutionError("expected a layout")
    for place in [numbers] if numbers else _near(draft):
        moved = replace(draft, cell=draft.cell.with_values(place)) if place else draft
        try:
            return moved, assign(moved, progress=progress)
        except NoSolutionError as error:
            failure = error
    raise failure


def _near(draft: AssignmentDraft) -> Iterator[Numbers]:
    """The given layout, then layouts a usual step or so away from it."""
    yield {}
    variables = Variables.of(draft.cell)
    for count in range(1, LAYOUTS):
        rng = generator(f"alternate/{count}", draft.cell.solver.seed)
        x = variables.given + variables.scale * rng.normal(size=len(variables.names))
        yield variables.numbers(np.clip(np.nan_to_num(x), variables.lower, variables.upper))
