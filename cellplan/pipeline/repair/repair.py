"""Repair: the smallest change with which a failing cell passes, and other remedies that were solved and verified."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Final

from cellplan.errors import InputError
from cellplan.io.yaml.writer import flow_text
from cellplan.model.cell import Cell
from cellplan.model.progress import Progress, silent
from cellplan.pipeline.layout.limits import standing_of
from cellplan.pipeline.layout.prepared import Prepared
from cellplan.pipeline.layout.request import LayoutRequest
from cellplan.pipeline.repair.attempts import (
    Attempt,
    RemedyKind,
    of_branches,
    of_layout,
    of_tools,
    of_weights,
    owners,
)
from cellplan.pipeline.repair.prepare import ready_cell, start_posture
from cellplan.pipeline.repair.solved import MARGIN, TIMED
from cellplan.pipeline.repair.trial import GIVEN, evaluate
from cellplan.pipeline.repair.wording import change_text, effects
from cellplan.pipeline.write_run import versions
from cellplan.report.record.advice import SCHEMA, AdviceRecord, AttemptRecord, RemedyRecord
from cellplan.report.record.common import number
from cellplan.search.programs.objective import Effort, Objective
from cellplan.study.run import outcomes
from cellplan.study.trial import Outcome, TrialStatus
from cellplan.study.variants import Variant

KINDS: Final = list(RemedyKind)
WITH_LIMITS: Final = "quadratic_program"  # the method that keeps joints within their limits
LIMITS: Final = frozenset({"joint_position", MARGIN, *TIMED})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Repair:
    """What makes a failing cell pass.

    Attributes:
        record: The record of ``advice.json``.
        best: The cell with the first remedy; None where there is none.
    """

    record: AdviceRecord
    best: Cell | None


def repair(request: LayoutRequest, *, workers: int = 1, progress: Progress = silent) -> Repair:
    """Find the smallest change with which a failing cell passes every check, and other remedies.

    First what the cell lets a layout search change, of one robot alone, then of two, and so on until a change passes;
    beside it other spins, branches, rods, weights, methods and a longer cycle. Every remedy is solved and verified.

    Args:
        request: What is repaired; its objective counts for nothing.
        workers: Number of processes.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: The cell cannot be read, or its job is not one that can be searched.
    """
    sought = replace(request, objective=Objective.CHANGE)
    ready = ready_cell(sought)
    case = _Case(request=sought, ready=ready, workers=workers, progress=progress)
    first, is_likely_sound = _first(ready), _conforms(ready)
    if is_likely_sound:
        case.run([GIVEN_ATTEMPT])
    if case.given is None or case.given.status is not TrialStatus.PASSED:
        case.run([*([] if is_likely_sound else [GIVEN_ATTEMPT]), *first])
        for size in range(2, len(owners(ready.cell, ready.variables.settings)) + 1):
            if any(each.kind is RemedyKind.LAYOUT for each, _ in case.remedies):
                break
            case.run(list(of_layout(ready.cell, ready.variables.settings, size)))
        case.run(_last(ready, case))
    return case.result()


GIVEN_ATTEMPT: Final = None  # in place of an attempt: the cell as it is


def _first(ready: Prepared) -> list[Attempt]:
    """Attempts that do not depend on what comes of others."""
    cell, settings = ready.cell, ready.variables.settings
    found = [*of_layout(cell, settings, 1), *of_tools(cell, settings), *of_branches(cell)]
    return sorted(found, key=lambda each: KINDS.index(each.kind))


def _last(ready: Prepared, case: "_Case") -> list[Attempt]:
    """Attempts where the verdict is about limits of joints alone."""
    failed = set() if case.given is None else {check["name"] for check in case.given.figures.get("failed", ())}
    if not failed or not failed <= LIMITS:
        return []
    found = list(of_weights(ready.cell, ready.variables.settings))
    if str(ready.cell.solver.method) != WITH_LIMITS:
        found.append(Attempt(kind=RemedyKind.METHOD, robots=(), values={"solver.method": WITH_LIMITS}))
    if failed <= TIMED:
        found.append(Attempt(kind=RemedyKind.DURATION, robots=()))
    return found


def _conforms(ready: Prepared) -> bool:
    """Whether the given layout seems to keep all demands."""
    start, reason = start_posture(ready)
    point = None if reason else ready.coarse.evaluate(ready.variables.given, start)
    if point is None:
        return False
    return not standing_of(ready.coarse, point, ready.demands(), Effort()).violations()


@dataclass(slots=True, kw_only=True)
class _Case:
    """A repair under way."""

    request: LayoutRequest
    ready: Prepared
    workers: int
    progress: Progress
    given: Outcome | None = None
    tried: list[tuple[Attempt, Outcome]] = field(default_factory=list)

    def run(self, attempts: Sequence[Attempt | None]) -> None:
        """Make some attempts."""
        variants = [
            Variant(place, {"kind": GIVEN} if each is None else each.record) for place, each in enumerate(attempts)
        ]
        with outcomes(variants, partial(evaluate, self.request), self.workers) as every:
            for attempt, outcome in zip(attempts, every, strict=True):
                if attempt is None:
                    self.given = outcome
                else:
                    self.tried.append((attempt, outcome))
                done = len(self.tried)
                self.progress("solving the cell" if attempt is None else attempt.text, done / (done + len(attempts)))

    @property
    def remedies(self) -> list[tuple[Attempt, Outcome]]:
        """Attempts that pass: changes of the layout by their number of robots and cost, then others by their cost."""
        found = [each for each in self.tried if each[1].status is TrialStatus.PASSED]
        return sorted(found, key=_size)

    def result(self) -> Repair:
        """The record and the repaired cell."""
        cell, remedies = self.ready.cell, self.remedies
        settings = [self._settings(outcome.figures["values"]) for _, outcome in remedies]
        best = cell.with_values(_mapping(remedies[0][1].figures["values"])) if remedies else None
        layout = cell.layout
        given = self.given.figures if self.given is not None else {}
        record: AdviceRecord = {
            "schema": SCHEMA,
            "cell": cell.name,
            "file": self.request.cell.name,
            "status": self._status(),
            "duration_s": number(self.ready.duration),
            "required_clearance_mm": number(1e3 * cell.checks.clearance),
            "required_margin_deg": self.request.margin if layout is None else number(_degrees(layout.margin)),
            "failed": list(given.get("failed", ())),
            "no_motion": self._no_motion(),
            "remedies": [
                self._remedy(attempt, outcome, values)
                for (attempt, outcome), values in zip(remedies, settings, strict=True)
            ],
            "tried": list(self._failures()),
            "remarks": list(self.ready.variables.remarks),
            "files": {},
            "seed": self.request.seed,
            "inputs": dict(cell.inputs),
            "versions": versions(),
        }
        return Repair(record=record, best=best)

    def _status(self) -> str:
        """The verdict."""
        if self.given is not None and self.given.status is TrialStatus.PASSED:
            return "passes"
        if self.remedies:
            return "repaired"
        return "no_motion" if self._no_motion() else "no_remedy"

    def _no_motion(self) -> str:
        """Why the given cell has no motion."""
        if self.given is None or "failed" in self.given.figures:
            return ""
        return self.given.reason

    def _settings(self, values: object) -> dict[str, Any]:
        """What makes a remedy of the file: what the request sets, then the change."""
        earlier = {
            address: value
            for address, value in self.ready.cell.origin.changes.items()
            if address != "layout" and not address.startswith("layout.")
        }
        return {**earlier, **_mapping(values)}

    def _remedy(self, attempt: Attempt, outcome: Outcome, settings: Mapping[str, Any]) -> RemedyRecord:
        """One remedy."""
        figures: Mapping[str, Any] = outcome.figures
        given = {} if self.given is None else self.given.figures
        return {
            "kind": str(attempt.kind),
            "text": change_text(self.ready.cell, attempt, _mapping(figures["values"])),
            "robots": list(attempt.robots),
            "cost": number(round(float(figures["cost"]), 6)),
            "settings": dict(settings),
            "options": [f"{address}={flow_text(value)}" for address, value in settings.items()],
            "effects": effects(given, figures) if "failed" in given else [],
            "cycle_s": figures["cycle_s"],
            "smallest_margin_deg": figures["smallest_margin_deg"],
            "smallest_clearance_mm": figures["smallest_clearance_mm"],
            "solves": int(figures["solves"]),
        }

    def _failures(self) -> Iterator[AttemptRecord]:
        """What was tried and is no remedy."""
        for attempt, outcome in self.tried:
            if outcome.status is not TrialStatus.PASSED:
                yield {
                    "kind": str(attempt.kind),
                    "text": attempt.text,
                    "robots": list(attempt.robots),
                    "reason": outcome.reason,
                }
        yield from self._not_tried()

    def _not_tried(self) -> Iterable[AttemptRecord]:
        """What cannot help as the cell fails."""
        failed = [] if self.given is None else list(self.given.figures.get("failed", ()))  # type: ignore[call-overload]
        other = next((check for check in failed if check["name"] not in TIMED), None)
        if other is not None:
            reason = f"not tried, as slower motions do not help: {other['message']}"
            yield {"kind": str(RemedyKind.DURATION), "text": "longer cycle", "robots": [], "reason": reason}
        near = next((check for check in failed if check["name"] not in LIMITS), None)
        if near is not None:
            reason = f"not tried, as more than limits of joints is broken: {near['message']}"
            yield {"kind": str(RemedyKind.WEIGHTS), "text": "joint weights, other methods", "robots": [], "reason": reason}


def _size(each: tuple[Attempt, Outcome]) -> tuple[bool, int, float, int]:
    """The size of a remedy: changes of the layout first, then the number of robots, the cost and the kind."""
    attempt, outcome = each
    is_other = attempt.kind is not RemedyKind.LAYOUT
    robots = 0 if is_other else len(attempt.robots)
    return is_other, robots, float(str(outcome.figures["cost"])), KINDS.index(attempt.kind)


def _mapping(values: object) -> dict[str, Any]:
    """Values by address."""
    if not isinstance(values, Mapping):
        raise InputError("expected values by address")
    return dict(values)


def _degrees(angle: float) -> float:
    """An angle of [rad] in [deg]."""
    return round(57.29577951308232 * angle, 9)
