"""Finish of a layout whose bases may all be off their places: one cycle for all corners, each of them verified."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.jobs.fastest.timed_program import TimedProgram, whole_steps
from cellplan.jobs.layout.finish.cycles import is_scaled, load_of, required_time
from cellplan.jobs.layout.finish.displaced import DisplacedLayout, solved_in, verified
from cellplan.jobs.layout.finish.finish import (
    FINISH,
    MORE_ANGLE,
    NODES,
    CandidateResult,
    Finalist,
    Finish,
    clearance_of,
    layout_of,
    margin_of,
    problem_of,
    rejection_of,
    too_singular,
)
from cellplan.jobs.layout.misplacement_record import CornerRecord, MisplacementRecord, ToleranceRecord
from cellplan.jobs.layout.trials.limits import standing_of
from cellplan.jobs.layout.trials.prepared import NODES as FEW_NODES
from cellplan.jobs.layout.trials.prepared import NOT_FOLLOWED, UNLIMITED, is_fastest, values_of
from cellplan.jobs.layout.trials.proposals import BESTS, SAME
from cellplan.model.cell.cell import Cell
from cellplan.model.seeds import generator
from cellplan.model.settings.layout import MisplacementEntry
from cellplan.model.units import DEG, MM
from cellplan.report.record.common import number
from cellplan.runs.early_clearance import EarlyClearance
from cellplan.search.misplacement.corners import BaseTolerance, Corner, tolerances
from cellplan.search.misplacement.displacements import BaseDisplacements
from cellplan.search.misplacement.guarded import guarded
from cellplan.search.misplacement.robust import WITHIN, Robust, RobustSearch, robust_layout, seeded_signs
from cellplan.search.programs.objective import CycleTiming, Demands, Effort, Objective
from cellplan.study.study import Study
from cellplan.study.trial import StudyTrial, Variant
from cellplan.study.workers import Limits

FINALISTS: Final = 3  # [-] layouts that differ, of which the one is finished that is the best with displaced bases
FEW_ROUNDS: Final = 2  # [-] of programs for each of them
FEW: Final = Effort(iterations=12, keys=9, trust=0.2)
MANY: Final = Effort(iterations=8, keys=FINISH.keys, trust=0.1)
ATTEMPTS: Final = 3  # [-] times that a layout is improved and verified before it is given up
DURATIONS: Final = 4  # [-] durations tried until the limits hold
MORE_TIME: Final = 0.003  # [-] that a cycle of the nodes is lengthened by: peaks between them
MORE_LENGTH: Final = 0.002  # [m] asked for beyond the demands where distances were not kept
NARROWER: Final = 4  # [-] displacements verified in each direction until a tolerance is known
OF_PROGRAM: Final = 16  # [-] seeded corners of a program, whose transfers are planned in each; and one displacement
SECONDS: Final = 900.0  # [s] of the processor to verify one layout
FINE: Final = 3  # decimals of figures in [mm] and [deg]

Placed = tuple[Array, Array]  # displacement, shape (m,), and start posture, shape (nq,)


@dataclass(frozen=True, slots=True)
class _Verdict:
    """What ``solve`` says of a layout with displaced bases."""

    reason: str  # why it is rejected; empty where it passed
    load: float  # how many times as long its limits ask it to last; 0 where it has no motion
    cycle: float  # its cycle in [s]; 0 where it has no motion
    is_mendable: bool  # whether only a margin or a distance is missed, so that the search may ask for more


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MisplacedFinish(Finish):
    """The finish of layouts that must keep all demands with all bases off their places."""

    misplacement: MisplacementEntry  # by how much

    def ordered(self, trials: Sequence[StudyTrial]) -> Sequence[Finalist]:
        """See ``Finish``: of the best ones that differ, the one with the shortest cycle with displaced bases first."""
        if self.ready.request.objective is not Objective.CYCLE:
            return Finish.ordered(self, trials)
        listed = list[StudyTrial]()
        for trial in trials:
            cycle = trial.figures[BESTS[Objective.CYCLE].figure]
            if all(abs(cycle - other.figures["cycle_s"]) > SAME * cycle for other in listed):
                listed.append(trial)
        listed = listed[: FINALISTS if self.ready.phases is None else 1]

        def rank(finalist: Finalist) -> tuple[int, float]:
            robust = None if finalist.begun is None else finalist.begun[1]
            return (10**9, np.inf) if robust is None else (len(robust.corners) - robust.passing, robust.cycle)

        first = sorted((Finalist(trial, self._begun(trial)) for trial in listed), key=rank)
        return [*first, *(Finalist(trial) for trial in trials if all(trial is not leading for leading in listed))]

    def certified(self, finalist: Finalist) -> CandidateResult:
        """A layout of the search with all its corners; see ``Finish``.

        Raises:
            NoSolutionError: A tool loses its path at the nodes of the search.
        """
        trial = finalist.trial
        search, robust = finalist.begun or self._begun(trial)
        if robust is None:
            raise NoSolutionError(NOT_FOLLOWED)
        self.progress(f"displacing the bases of trial {trial.number}", 1.0)
        made, effort = self._with_choice_of(trial), MANY
        corners = _Corners(made, trial.number)
        search = search.finer(guarded(problem_of(made.ready, NODES)), robust, effort)
        for _ in range(ATTEMPTS):
            x, start = robust.improved.x, robust.improved.start
            robust = robust_layout(search, (x, start), signs=made.signs(search)) or robust
            result, missing = corners.result(robust, effort)
            if result.passed or missing is None:
                break
            reserve = effort.reserve
            more = replace(reserve, margin=reserve.margin + missing[0], distance=reserve.distance + missing[1])
            effort = replace(effort, reserve=more, keys=2 * effort.keys - 1)
            search.effort = effort
        return result

    def _begun(self, trial: StudyTrial) -> tuple[RobustSearch, Robust | None]:
        """A layout improved with displaced bases at few nodes."""
        self.progress(f"displacing the bases of trial {trial.number}", 0.0)
        made, (x, start) = self._with_choice_of(trial), layout_of(trial)
        search = RobustSearch(
            problem=guarded(problem_of(made.ready, FEW_NODES)),
            displacements=BaseDisplacements.of(made.ready.variables, x, self.misplacement),
            demands=made.demands(),
            effort=FEW,
        )
        return search, robust_layout(search, (x, start), signs=made.signs(search), rounds=FEW_ROUNDS)

    def demands(self) -> Demands:
        """What is demanded of every corner: of retimed programs, whose corners have no common clock, as any takes."""
        is_retimed = self.ready.phases is not None and is_fastest(self.ready)
        return self.ready.demands(**({"duration": UNLIMITED, "timing": CycleTiming.LAWS} if is_retimed else {}))

    def learned(self, trial: StudyTrial, result: CandidateResult) -> CandidateResult:  # noqa: ARG002 - of the finish
        """See ``Finish``: a layout whose corners are verified stays as it is."""
        return result

    def signs(self, search: RobustSearch) -> Array:
        """The seeded corners."""
        rng = generator("layout/misplacement", self.ready.request.seed)
        signs = seeded_signs(rng, len(search.displacements.names))
        return signs if self.ready.phases is None else signs[:OF_PROGRAM]


@dataclass(slots=True)
class _Corners:
    """One layout with displaced bases while it is solved and its corners are verified."""

    finish: MisplacedFinish  # the cell, made ready with the choices of the layout
    trial: int  # number of the trial
    solves: int = 0  # how often it was solved in full so far

    def result(self, robust: Robust, effort: Effort) -> tuple[CandidateResult, tuple[float, float] | None]:
        """The layout solved and all its corners verified, and the margin and distance to ask for where one failed."""
        x, start, demands = robust.improved.x, robust.improved.start, self.finish.demands()
        standing = standing_of(problem_of(self.finish.ready, NODES), robust.improved.point, demands, effort)
        program, solved, reason, verdicts = None, list[CornerRecord](), "", list[_Verdict]()
        missing, record = None, None
        try:
            program, solved, reason, verdicts = self._in_one_cycle(robust)
            reason = reason or too_singular(self.finish.ready, standing, program)
        except (InputError, NoSolutionError) as error:
            reason = str(error).splitlines()[0]
        failed = [verdict for verdict in verdicts if verdict.reason]
        if program is not None:
            if not reason and failed:
                reason = f"with displaced bases: {failed[0].reason}"
                missing = (MORE_ANGLE, MORE_LENGTH) if failed[0].is_mendable else None
            if not reason:
                limits = self._tolerances(robust, program, effort)
                record = self._record(robust, program.cycle, verdicts, solved, limits)
        result = CandidateResult(
            trial=self.trial,
            x=x,
            start=start,
            program=program,
            reason=reason,
            standing=standing,
            solves=self.solves,
            misplacement=record,
        )
        return result, missing

    def _in_one_cycle(self, robust: Robust) -> tuple[TimedProgram, list[CornerRecord], str, list[_Verdict]]:
        """The layout and its worst corners solved in one cycle, and the verdicts on all corners in it.

        Returns:
            The program of the layout, its worst corners, why one of them failed, and the verdicts.
        """
        of, listed, ready = robust.displacements, list(_chosen(robust)), self.finish.ready
        placed = [(of.given, robust.improved.start), *((corner.d, corner.start) for _, corner in listed)]
        cells, factor = [of.cell(d, values_of(ready, of.x, start)) for d, start in placed], None
        if is_scaled(ready):
            factor = whole_steps(cells[0], (1.0 + MORE_TIME) * robust.cycle / ready.duration)
        for _ in range(DURATIONS):
            programs, factor = self._solved_together(cells, factor)
            verdicts = self._verdicts(
                robust, [(corner.d, corner.start) for corner in robust.corners], factor, is_first_enough=True
            )
            most = max((verdict.load for verdict in verdicts), default=0.0)
            if factor is None or most <= 1.0:
                break
            factor = whole_steps(cells[0], factor * most, longer_than=factor)
        programs = [program.certified(self.finish.progress, EarlyClearance()) for program in programs]
        reasons = [rejection_of(program, self.finish.ready.variables) for program in programs]
        corners = [
            _corner(what, of.names, corner.d, (program, reason))
            for (what, corner), program, reason in zip(listed, programs[1:], reasons[1:], strict=True)
        ]
        return programs[0], corners, next((reason for reason in reasons if reason), ""), verdicts

    def _solved_together(self, cells: Sequence[Cell], factor: float | None) -> tuple[list[TimedProgram], float | None]:
        """Programs of cells in the shortest common cycle that all of them keep, from a given one on, and its factor."""
        self.solves += len(cells)
        for _ in range(DURATIONS):
            programs = [solved_in(self.finish.ready, cell, factor, self.finish.progress) for cell in cells]
            if factor is None:
                break
            required = max(max(load_of(program), required_time(program)) for program in programs)
            if required <= 1.0:
                break
            factor = whole_steps(cells[0], factor * required, longer_than=factor)
        return programs, factor

    def _verdicts(
        self, robust: Robust, placed: Sequence[Placed], factor: float | None, *, is_first_enough: bool = False
    ) -> list[_Verdict]:
        """Verdicts of the product on a layout with displaced bases; up to the first one that fails, if that is enough.

        One that only asks for more time is none of these.
        """
        of, x = robust.displacements, robust.improved.x
        layout = DisplacedLayout(
            request=self.finish.ready.request.anywhere,
            choice=self.finish.choice,
            x=tuple(x.tolist()),
            robots=of.robots,
            components=of.components,
            factor=factor,
        )
        variants = [
            Variant(place, {"d": d.tolist(), "start": start.tolist()}) for place, (d, start) in enumerate(placed)
        ]
        header = {"kind": "displaced", "cell": self.finish.ready.cell.name, "x": x.tolist(), "factor": factor}
        with TemporaryDirectory(prefix="cellplan-displaced-") as folder:
            study = Study.of_variants(Path(folder), header, variants)
            if is_first_enough:
                study = replace(study, enough=_is_lost)
            limits, evaluate = Limits(seconds=SECONDS), partial(verified, layout)
            try:
                trials = study.run(
                    evaluate, workers=self.finish.workers, limits=limits, progress=self.finish.progress
                ).trials
            except KeyboardInterrupt:
                raise KeyboardInterrupt(
                    "interrupted while displaced bases were verified; --resume begins with that"
                ) from None
        self.solves += len(trials)
        return [self._verdict(trial) for trial in trials]

    def _verdict(self, trial: StudyTrial) -> _Verdict:
        figures, demanded = trial.figures, DEG * float(self.finish.ready.variables.margin.max(initial=0.0))
        margin = figures.get("margin_deg")
        is_mendable = bool(figures) and (not figures["is_apart"] or (margin is not None and margin < demanded))
        reason = "" if trial.passed else trial.outcome.reason
        return _Verdict(reason, figures.get("load") or 0.0, figures.get("cycle_s") or 0.0, is_mendable)

    def _tolerances(self, robust: Robust, program: TimedProgram, effort: Effort) -> list[BaseTolerance]:
        """How far each base may be off, found at the nodes and verified; less where that fails."""
        factor = program.cycle / self.finish.ready.duration if is_scaled(self.finish.ready) else None
        finer, demands, start = replace(effort, within=WITHIN), self.finish.demands(), robust.improved.start
        measured = list(tolerances(robust.problem, start, demands, finer, max(program.cycle, robust.cycle)))
        of = robust.displacements
        ends = np.tile(of.amounts, 2)  # verified already, as far as the nodes do not say otherwise
        lower = np.array(
            [float(end) if tolerance.extent >= end else 0.0 for tolerance, end in zip(measured, ends, strict=True)]
        )
        upper = np.array([tolerance.extent for tolerance in measured])
        first = [tolerance.first for tolerance in measured]
        at, open_ones = upper.copy(), [place for place, verdict in enumerate(measured) if verdict.extent > 0.0]
        for _ in range(NARROWER if self.finish.ready.phases is None else 1):
            placed = [(at[place] * measured[place].unit, measured[place].start) for place in open_ones]
            verdicts = self._verdicts(robust, placed, factor) if placed else []
            for place, verdict in zip(open_ones, verdicts, strict=True):
                if verdict.reason:
                    upper[place], first[place] = at[place], verdict.reason
                else:
                    lower[place] = at[place]
            open_ones = [place for place in open_ones if lower[place] < upper[place]]
            at = 0.5 * (lower + upper)
        return [
            replace(tolerance, extent=end, first=why)
            for tolerance, end, why in zip(measured, lower.tolist(), first, strict=True)
        ]

    def _record(
        self,
        robust: Robust,
        cycle: float,
        verdicts: Sequence[_Verdict],
        solved: list[CornerRecord],
        limits: Sequence[BaseTolerance],
    ) -> MisplacementRecord:
        """All of it in printed units."""
        ends = robust.worst_ones + robust.ends
        groups = (verdicts[: robust.worst_ones], verdicts[robust.worst_ones : ends], verdicts[ends:])
        passing = [sum(not corner.reason for corner in group) for group in groups]
        return {
            "position_mm": number(self.finish.misplacement.position_mm),
            "orientation_deg": number(self.finish.misplacement.orientation_deg),
            "cycle_s": number(round(max(cycle, *(verdict.cycle for verdict in verdicts)), 6)),
            "nominal_cycle_s": number(round(robust.nominal if self.finish.ready.phases is None else cycle, 6)),
            "seeded": len(groups[2]),
            "seeded_kept": passing[2],
            "by_derivatives": len(groups[0]),
            "by_derivatives_kept": passing[0],
            "ends": len(groups[1]),
            "ends_kept": passing[1],
            "solved": solved,
            "tolerances": list(_tolerances(limits)),
        }


def _is_lost(trial: StudyTrial) -> bool:
    """Whether a layout with displaced bases fails in any cycle."""
    load = trial.figures.get("load")
    return not trial.passed and not (isinstance(load, float) and load > 1.0)


def _chosen(robust: Robust) -> Iterator[tuple[str, Corner]]:
    """The corners that are solved in full: the worst by each figure, each once."""
    corners = robust.corners
    orders = {
        "longest cycle": [-corner.cycle for corner in corners],
        "smallest margin": [float(corner.margins.min()) for corner in corners],
        "least room between bodies": [corner.spare_distance for corner in corners],
    }
    seen = set[int]()
    for what, order in orders.items():
        place = int(np.argmin(order))
        if place not in seen:
            seen.add(place)
            yield what, corners[place]
    end = robust.worst_ones + int(
        np.argmin([corner.spare_distance for corner in corners[robust.worst_ones :][: robust.ends]])
    )
    if end not in seen:
        yield "one base in one direction, least room between bodies", corners[end]


def _corner(what: str, names: Sequence[str], d: Array, judged: tuple[TimedProgram, str]) -> CornerRecord:
    """A corner that was solved, with why it failed."""
    program, reason = judged
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


def _tolerances(limits: Sequence[BaseTolerance]) -> Iterator[ToleranceRecord]:
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
            "minus": number(round(scale * minus.extent, FINE)),
            "plus": number(round(scale * plus.extent, FINE)),
            "first_minus": minus.first,
            "first_plus": plus.first,
        }
