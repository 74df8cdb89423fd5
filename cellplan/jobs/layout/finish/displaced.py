"""Layouts with displaced bases, planned anew and verified as ``solve`` does it, each by a worker process."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cellplan.certify.certify import certify
from cellplan.certify.run_pairs import scene_of_run
from cellplan.checks.clearance.mounting import check_mounting
from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.jobs.fastest.timed_program import TimedProgram
from cellplan.jobs.layout.finish.cycles import draft, load_of, required_time, scaled
from cellplan.jobs.layout.finish.finish import margin_of, rejection_of
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.trials.prepared import NOT_FOLLOWED, PreparedSearch, prepared, values_of
from cellplan.model.cell.cell import Cell, stacked_positions
from cellplan.model.progress import Progress, silent
from cellplan.runs.early_clearance import EarlyClearance
from cellplan.search.misplacement.displacements import BaseDisplacements
from cellplan.search.misplacement.guarded import guarded
from cellplan.study.trial import TrialOutcome, TrialStatus, Variant


@dataclass(frozen=True, slots=True, kw_only=True)
class DisplacedLayout:
    """A layout whose bases are displaced."""

    request: LayoutRequest  # what was searched for
    choice: Mapping[str, object]  # discrete choices of the layout, by address
    x: tuple[float, ...]  # its variables, n of them
    robots: tuple[int, ...]  # the robot of each displacement, m of them
    components: tuple[int, ...]  # their components, see ``BaseDisplacements``
    factor: float | None  # how many times as long as in the cell everything takes; None for as long as there

    def cell(self, ready: PreparedSearch, d: Array, start: Array) -> Cell:
        """The cell of the file with displacements of shape (m,), and with the start posture near a given one, (nq,).

        Raises:
            NoSolutionError: A tool loses its path at the nodes of the search.
        """
        of = BaseDisplacements(
            variables=ready.variables,
            x=np.array(self.x),
            robots=self.robots,
            components=self.components,
            amounts=np.ones(len(self.robots)),
        )
        point = guarded(ready.coarse).of_variables(of).evaluate(d, start)
        if point is None:
            raise NoSolutionError(NOT_FOLLOWED)
        return of.cell(d, values_of(ready, of.x, point.start))


def verified(layout: DisplacedLayout, variant: Variant) -> TrialOutcome:
    """Plan and verify a layout with one displacement: every check of the cell and the margins of the search.

    Distances are proved to be kept; the smallest ones are not searched for.

    Args:
        variant: The displacement ``d`` in [m] and [rad] and the ``start`` of a displacement nearby, as values.
    """
    values: Mapping[str, Any] = variant.values
    ready = prepared(layout.request, layout.choice)
    try:
        d, start = (np.array(values[key], dtype=float) for key in ("d", "start"))
        program = solved_in(ready, layout.cell(ready, d, start), layout.factor, silent)
        reason, is_apart = rejection_of(program, ready.variables), True
        if not reason and not (is_apart := _is_apart(program)):
            program = program.certified(silent, EarlyClearance())
            reason = rejection_of(program, ready.variables) or "distances are not certified"
    except (InputError, NoSolutionError) as error:
        return TrialOutcome(status=TrialStatus.NO_SOLUTION, reason=str(error).splitlines()[0], figures={})
    figures = {
        "load": max(load_of(program), required_time(program)),
        "cycle_s": program.cycle,
        "margin_deg": margin_of(program),
        "is_apart": is_apart,
    }
    return TrialOutcome(status=TrialStatus.FAILED if reason else TrialStatus.PASSED, reason=reason, figures=figures)


def solved_in(ready: PreparedSearch, cell: Cell, factor: float | None, progress: Progress) -> TimedProgram:
    """The program of a cell, slower or faster by a factor, verified but for its clearance."""
    return draft(ready, cell, ready.duration, progress) if factor is None else scaled(cell, factor, progress)


def _is_apart(program: TimedProgram) -> bool:
    """Whether all distances are proved to be kept, and mounted bodies are mounted as they should be."""
    for one in program.solution.runs:
        scene = scene_of_run(one.scene or program.scene, [it.task.name for it in one.schedule.tasks])
        q = stacked_positions(scene.cell, one.report.q)
        if not all(check.passed for check in check_mounting(scene, q, one.schedule.times)):
            return False
        if not certify(scene, q, with_minimum=False).is_met:
            return False
    return True
