"""The record of a repair: what JSON, page and console show."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from cellplan.io.yaml.writer import flow_text
from cellplan.model.check_kinds import JOINT_LIMITS, PASSED_BY_TIME
from cellplan.model.units import DEG, MM
from cellplan.pipeline.layout.prepared import Prepared
from cellplan.pipeline.repair.attempts import Attempt, RemedyKind
from cellplan.pipeline.repair.wording import change_text, effects
from cellplan.pipeline.write_run import versions
from cellplan.report.record.advice import SCHEMA, AdviceRecord, AttemptRecord, RemedyRecord
from cellplan.report.record.common import number
from cellplan.search.variables.pedestals import with_pedestals
from cellplan.study.trial import Outcome, TrialStatus

Tried = tuple[Attempt, Outcome]
DIGITS: Final = 6  # of a cost


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """A repair that is done."""

    ready: Prepared  # the cell with all that may change
    given: Outcome  # what came of it as it is given
    remedies: Sequence[Tried]  # attempts that passed, the smallest first
    failures: Sequence[Tried]  # the others, in their order

    @property
    def failed(self) -> list[dict[str, Any]]:
        """Checks that fail as the cell is given."""
        found: Any = self.given.figures.get("failed", ())
        return list(found)

    @property
    def no_motion(self) -> str:
        """Why the given cell has no motion; empty where it has one."""
        return "" if "failed" in self.given.figures else self.given.reason

    @property
    def status(self) -> str:
        """The verdict."""
        if self.given.status is TrialStatus.PASSED:
            return "passes"
        if self.remedies:
            return "repaired"
        return "no_motion" if self.no_motion else "no_remedy"


def advice_record(case: Case) -> AdviceRecord:
    """The record of a repair."""
    cell, request = case.ready.cell, case.ready.request
    return {
        "schema": SCHEMA,
        "cell": cell.name,
        "file": request.cell.name,
        "status": case.status,
        "duration_s": number(case.ready.duration),
        "required_clearance_mm": number(MM * cell.checks.clearance),
        "required_margin_deg": 0.0 if cell.layout is None else number(DEG * cell.layout.margin),
        "failed": case.failed,  # type: ignore[typeddict-item]
        "no_motion": case.no_motion,
        "remedies": [_remedy(case, attempt, outcome) for attempt, outcome in case.remedies],
        "tried": [*_failures(case), *_left_out(case)],
        "remarks": _remarks(case),
        "files": {},
        "seed": request.seed,
        "inputs": dict(cell.inputs),
        "versions": versions(),
    }


def remedy_values(outcome: Outcome) -> dict[str, Any]:
    """What a remedy changes in the cell of the request, by address."""
    found: Any = outcome.figures["values"]
    return dict(found)


def _remedy(case: Case, attempt: Attempt, outcome: Outcome) -> RemedyRecord:
    """One remedy; its settings are those of the file: what the request sets, then the change."""
    figures: Mapping[str, Any] = outcome.figures
    cell, values = case.ready.cell, remedy_values(outcome)
    asked = {key: value for key, value in cell.origin.changes.items() if key.partition(".")[0] != "layout"}
    settings = {**asked, **values}
    return {
        "kind": str(attempt.kind),
        "text": change_text(cell, attempt, values),
        "robots": list(attempt.robots),
        "cost": number(round(figures["cost"], DIGITS)),
        "settings": settings,
        "options": [f"{key}={'null' if value is None else flow_text(value)}" for key, value in settings.items()],
        "effects": [] if case.no_motion else effects(case.given.figures, figures),
        "cycle_s": figures["cycle_s"],
        "smallest_margin_deg": figures["smallest_margin_deg"],
        "smallest_clearance_mm": figures["smallest_clearance_mm"],
        "solves": figures["solves"],
    }


def _failures(case: Case) -> Iterator[AttemptRecord]:
    """What was tried and is no remedy."""
    for attempt, outcome in case.failures:
        yield {
            "kind": str(attempt.kind),
            "text": attempt.text,
            "robots": list(attempt.robots),
            "reason": outcome.reason,
        }


def _left_out(case: Case) -> Iterator[AttemptRecord]:
    """What cannot help as the cell fails, and was not tried."""
    other = next((check for check in case.failed if check["name"] not in PASSED_BY_TIME), None)
    if other is not None:
        reason = f"not tried, as a slower motion does not help: {other['message']}"
        yield {"kind": str(RemedyKind.DURATION), "text": "longer cycle", "robots": [], "reason": reason}
    near = next((check for check in case.failed if check["name"] not in JOINT_LIMITS), None)
    if near is not None:
        reason = f"not tried, as more than limits of joints is broken: {near['message']}"
        text = "joint weights, another method"
        yield {"kind": str(RemedyKind.WEIGHTS), "text": text, "robots": [], "reason": reason}


def _remarks(case: Case) -> list[str]:
    """What the user should know of the first remedy: obstacles that became pedestals."""
    if not case.remedies or case.ready.cell.layout is None:
        return []
    changed = remedy_values(case.remedies[0][1])
    values, remarks = with_pedestals(case.ready.cell, case.ready.cell.layout)
    gone = [address for address, value in values.items() if value is None and changed.get(address, 0) is None]
    return [remark for remark in remarks if any(remark.startswith(f"{address} ") for address in gone)]
