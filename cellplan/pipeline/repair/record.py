"""``advice.json``: what makes a failing cell pass, smallest change first, and what was tried and does not."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final, TypedDict

from cellplan.io.yaml.writer import flow_text
from cellplan.model.check_kinds import JOINT_LIMITS, PASSED_BY_TIME
from cellplan.model.units import DEG
from cellplan.pipeline.layout.prepared import PreparedSearch
from cellplan.pipeline.repair.attempts import Attempt, RemedyKind
from cellplan.pipeline.repair.wording import EffectRecord, change_text, effects
from cellplan.pipeline.write_run import versions
from cellplan.report.record.common import CheckRecord, Number, number
from cellplan.report.record.schema import record_schema
from cellplan.search.variables.pedestals import with_pedestals
from cellplan.study.trial import TrialOutcome, TrialStatus

SCHEMA: Final = "cellplan.advice/1"
Tried = tuple[Attempt, TrialOutcome]
DIGITS: Final = 6  # of a cost


class RemedyRecord(TypedDict):
    """A change with which every check passes, solved and verified."""

    kind: Annotated[
        str,
        "`move`, `tool`, `start`, `branch`, `spin`, `free_spin`, `weights`, `path`, `method`, `duration` or "
        "`everything`",
    ]
    text: Annotated[str, "the change as one line of text"]
    robots: Annotated[list[str], "what is changed: robots, or `part` for a part at rest"]
    cost: Annotated[Number, "size of the change: 1 for 100 mm, 10 deg or a tenth of the duration unless weighted"]
    settings: Annotated[dict[str, Any], "by address: values of the cell file that make it; null leaves a key out"]
    options: Annotated[list[str], "the same as `KEY=VALUE` for `--set`; empty where a key is to be left out"]
    effects: Annotated[list[EffectRecord], "what it does to the checks that fail as the cell is given"]
    cycle_s: Annotated[Number, "duration of the verified motion"]
    smallest_margin_deg: Annotated[Number, "smallest distance of a turning joint from its limits"]
    smallest_clearance_mm: Annotated[Number, "smallest certified distance of bodies; null without pairs"]
    solves: Annotated[int, "number of times it was solved in full until every demand was met"]


class AttemptRecord(TypedDict):
    """A change that does not make the cell pass, or is no better than a remedy of its kind."""

    kind: Annotated[str, "its kind, as of remedies"]
    text: Annotated[str, "what was allowed to change"]
    robots: Annotated[list[str], "what was allowed to change: robots, or `part` for a part at rest"]
    reason: Annotated[str, "why it is no remedy"]


class AdviceRecord(TypedDict):
    """What makes a failing cell pass."""

    schema: Annotated[str, "name and version of the format"]
    cell: Annotated[str, "name of the cell"]
    file: Annotated[str, "the cell file"]
    status: Annotated[str, "`passes` as given, `repaired`, `no_remedy` or `no_motion`"]
    duration_s: Annotated[Number, "duration that is demanded"]
    required_clearance_mm: Annotated[Number, "demanded distance of bodies"]
    required_margin_deg: Annotated[Number, "demanded distance of turning joints from their limits"]
    failed: Annotated[list[CheckRecord], "checks that fail as the cell is given; a demanded margin is `joint_margin`"]
    no_motion: Annotated[str, "why there is no motion as the cell is given; empty where there is one"]
    remedies: Annotated[list[RemedyRecord], "verified remedies, the smallest change of the layout first"]
    tried: Annotated[list[AttemptRecord], "what was tried besides"]
    remarks: Annotated[list[str], "what else the user should know, as pedestals that move with their robots"]
    files: Annotated[dict[str, str], "SHA-256 of copies beside `best.yaml`, by name"]
    seed: Annotated[int, "seed of all perturbations"]
    inputs: Annotated[dict[str, str], "SHA-256 of every input file, by name"]
    versions: Annotated[dict[str, str], "versions of cellplan and of the packages that the numbers depend on"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Case:
    """A repair that is done."""

    ready: PreparedSearch  # the cell with all that may change
    given: TrialOutcome  # what came of it as it is given
    remedies: Sequence[Tried]  # attempts that passed, the smallest first
    failures: Sequence[Tried]  # the others, in their order

    @property
    def failed(self) -> list[dict[str, Any]]:
        """Checks that fail as the cell is given."""
        names: Any = self.given.figures.get("failed", ())
        return list(names)

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


def advice_schema() -> dict[str, Any]:
    """The JSON Schema of ``advice.json``."""
    return record_schema(AdviceRecord, SCHEMA, "advice.json of a repair")


def advice_record(case: Case) -> AdviceRecord:
    """The record of a repair."""
    cell, request = case.ready.cell, case.ready.request
    return {
        "schema": SCHEMA,
        "cell": cell.name,
        "file": request.cell.name,
        "status": case.status,
        "duration_s": number(case.ready.duration),
        "required_clearance_mm": number(cell.checks.clearance_mm),
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


def remedy_values(outcome: TrialOutcome) -> dict[str, Any]:
    """What a remedy changes in the cell of the request, by address."""
    values: Any = outcome.figures["values"]
    return dict(values)


def _remedy(case: Case, attempt: Attempt, outcome: TrialOutcome) -> RemedyRecord:
    """One remedy; its settings are those of the file: what the request sets, then the change."""
    figures: Mapping[str, Any] = outcome.figures
    cell, values = case.ready.cell, remedy_values(outcome)
    requested = {key: value for key, value in cell.origin.changes.items() if key.partition(".")[0] != "layout"}
    settings = {**requested, **values}
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
