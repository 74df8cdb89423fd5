"""Finish of a layout whose bases may all be off their places: one cycle for all corners, the worst of them solved."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.model.cell import Cell
from cellplan.model.layout import Misplacement
from cellplan.model.seeds import generator
from cellplan.model.units import DEG, MM
from cellplan.pipeline.fastest.scaling import whole_steps
from cellplan.pipeline.fastest.timed_program import Law, TimedProgram
from cellplan.pipeline.layout.cycles import DURATIONS, load_of, scaled, time_asked
from cellplan.pipeline.layout.finish import (
    ITERATIONS,
    KEYS,
    NODES,
    Certified,
    Finish,
    clearance_of,
    margin_of,
)
from cellplan.pipeline.layout.limits import standing_of
from cellplan.pipeline.quick_clearance import QuickClearance
from cellplan.report.record.common import number
from cellplan.report.record.misplacement import CornerRecord, MisplacementRecord, ToleranceRecord
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.misplacement.corners import Corner
from cellplan.search.misplacement.displacements import BaseDisplacements
from cellplan.search.misplacement.guarded import GuardedProblem
from cellplan.search.misplacement.robust import WITHIN, Robust, robust_layout, seeded_signs
from cellplan.search.misplacement.tolerance import Tolerance, tolerances
from cellplan.search.programs.objective import Effort, Objective

MORE_TIME: Final = 0.003  # [-] that a cycle of the nodes is lengthened by: peaks between them
FINE: Final = 3  # decimals of figures in [mm] and [deg]


@dataclass(slots=True, kw_only=True)
class MisplacedFinish(Finish):
    """The finish of layouts that must keep all demands with all bases off their places.

    Attributes:
        misplacement: By how much.
    """

    misplacement: Misplacement

    def certified(self, trial: int, figures: Mapping[str, Any]) -> Certified:
        """A layout of the search with all its corners; see ``Finish``.

        Raises:
            NoSolutionError: A tool cannot follow its path.
        """
        x, start = np.array(figures["x"], dtype=float), np.array(figures["start"], dtype=float)
        ready, before, effort = self.ready, self.solves, Effort(iterations=ITERATIONS, keys=KEYS, trust=0.2)
        self.progress(f"displacing the bases of trial {trial}", 1.0)
        problem = GuardedProblem.like(self._problem(NODES))
        count = len(self._displacements(x).names)
        signs = seeded_signs(generator("layout/misplacement", ready.request.seed), count)
        robust = robust_layout(problem, self._displaced, (x, start), ready.demands(), effort, signs=signs)
        if robust is None:
            raise NoSolutionError("a tool cannot follow its path")
        return self._result(trial, robust, effort, before)

    def _result(self, trial: int, robust: Robust, effort: Effort, before: int) -> Certified:
        """The layout solved, with its record."""
        program, corners, reason = self._solved_all(robust)
        demands, found = self.ready.demands(), robust.found
        span = robust.cycle if program is None else program.cycle
        asked = replace(effort, within=WITHIN)
        limits = tolerances(robust.problem, found.start, demands, asked, max(span, robust.cycle))
        standing = standing_of(self._problem(NODES), found.point, demands, effort)
        self.records[trial] = self._record(robust, span, standing.measures.cycle, corners, limits)
        return Certified(
            trial=trial,
            x=found.x,
            start=found.start,
            program=program,
            reason=reason,
            standing=standing,
            solves=self.solves - before,
        )

    def _displacements(self, x: Array) -> BaseDisplacements:
        """Displacements of the bases of a layout."""
        return BaseDisplacements.of(self.ready.variables, x, self.misplacement)

    def _displaced(self, x: Array) -> GuardedProblem:
        """The job with displacements of the bases of a layout as variables."""
        of = self._displacements(x)
        return GuardedProblem.like(self._problem(NODES), variables=of, bodies=CellDistances.of(self.ready.scene, of))

    def _solved_all(self, robust: Robust) -> tuple[TimedProgram | None, list[CornerRecord], str]:
        """The layout and its worst corners solved in one cycle: the layout's program, the corners, why it failed."""
        of = self._displacements(robust.found.x)
        missed = [corner for corner in robust.corners if not corner.keeps(robust.cycle)]
        listed = list(_chosen(robust))
        try:
            cells = [self.ready.variables.cell(robust.found.x, robust.found.start)]
            cells += [of.cell(corner.d, corner.start) for _, corner in listed]
            programs = self._in_one_cycle(cells, robust.cycle)
        except (InputError, NoSolutionError) as error:
            return None, [], str(error).splitlines()[0]
        reasons = [self._rejection(program) for program in programs]
        corners = [
            _corner(what, of.names, corner.d, (program, reason))
            for (what, corner), program, reason in zip(listed, programs[1:], reasons[1:], strict=True)
        ]
        reason = next((each for each in reasons if each), "")
        if not reason and missed:
            reason = f"{len(missed)} of {len(robust.corners)} layouts with displaced bases miss: {missed[0].first}"
        return programs[0], corners, reason

    def _in_one_cycle(self, cells: Sequence[Cell], cycle: float) -> list[TimedProgram]:
        """The programs of cells in the shortest common cycle that all of them keep, certified."""
        if self.ready.request.objective is not Objective.CYCLE:
            found = [TimedProgram.solved(cell, Law.AS_WRITTEN, {}, task=None, progress=self.progress) for cell in cells]
        else:
            factor = whole_steps(cells[0], (1.0 + MORE_TIME) * cycle / self.ready.duration)
            for _ in range(DURATIONS):
                found = [scaled(cell, factor, self.progress) for cell in cells]
                asked = max(max(load_of(program), time_asked(program)) for program in found)
                if asked <= 1.0:
                    break
                factor = whole_steps(cells[0], factor * asked, longer_than=factor)
        self.solves += len(cells)
        return [program.certified(self.progress, QuickClearance()) for program in found]

    def _record(
        self,
        robust: Robust,
        cycle: float,
        nominal: float,
        solved: list[CornerRecord],
        limits: Sequence[Tolerance],
    ) -> MisplacementRecord:
        """All of it in printed units."""
        ends = robust.worst_ones + robust.ends
        groups = (robust.corners[: robust.worst_ones], robust.corners[robust.worst_ones : ends], robust.corners[ends:])
        kept = [sum(corner.keeps(max(cycle, robust.cycle)) for corner in group) for group in groups]
        return {
            "position_mm": number(MM * self.misplacement.position),
            "orientation_deg": number(round(DEG * self.misplacement.orientation, 9)),
            "cycle_s": number(round(cycle, 6)),
            "nominal_cycle_s": number(round(nominal, 6)),
            "seeded": len(groups[2]),
            "seeded_kept": kept[2],
            "by_derivatives": len(groups[0]),
            "by_derivatives_kept": kept[0],
            "ends": len(groups[1]),
            "ends_kept": kept[1],
            "solved": solved,
            "tolerances": list(_tolerances(limits)),
        }


def _chosen(robust: Robust) -> Iterator[tuple[str, Corner]]:
    """The corners that are solved in full: the worst by each figure, each once."""
    corners = robust.corners
    orders = {
        "longest cycle": [-corner.cycle for corner in corners],
        "smallest margin": [float(corner.margins.min()) for corner in corners],
        "least room between bodies": [corner.room for corner in corners],
    }
    seen = set[int]()
    for what, order in orders.items():
        place = int(np.argmin(order))
        if place not in seen:
            seen.add(place)
            yield what, corners[place]
    end = robust.worst_ones + int(np.argmin([corner.room for corner in corners[robust.worst_ones :][: robust.ends]]))
    if end not in seen:
        yield "one base in one direction, least room between bodies", corners[end]


def _corner(what: str, names: Sequence[str], d: Array, found: tuple[TimedProgram, str]) -> CornerRecord:
    """A corner that was solved, with why it failed."""
    program, reason = found
    margin, clearance = margin_of(program), clearance_of(program)
    scale = [DEG if name.endswith("_deg") else MM for name in names]
    values = (round(by * unit, FINE) for by, unit in zip(d.tolist(), scale, strict=True))
    return {
        "what": what,
        "bases": {name: value for name, value in zip(names, values, strict=True) if value},
        "margin_deg": None if margin is None else number(round(margin, 6)),
        "clearance_mm": None if clearance is None else number(round(clearance, 6)),
        "reason": reason,
    }


def _tolerances(limits: Sequence[Tolerance]) -> Iterator[ToleranceRecord]:
    """One line for each base and direction."""
    count = len(limits) // 2
    for plus, minus in zip(limits[:count], limits[count:], strict=True):
        robot, _, component = plus.name.removeprefix("robots.").partition(".base.")
        direction, _, unit = component.partition("_")
        scale = DEG if unit == "deg" else MM
        yield {
            "robot": robot,
            "direction": direction,
            "unit": unit,
            "minus": number(round(scale * minus.kept, FINE)),
            "plus": number(round(scale * plus.kept, FINE)),
            "first_minus": minus.first,
            "first_plus": plus.first,
        }
