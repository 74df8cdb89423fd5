"""``advice.json``: what makes a failing cell pass, smallest change first, and what was tried and does not."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final, TypedDict

from cellplan.files.yaml.writer import flow_text
from cellplan.jobs.layout.trials.prepared import PreparedSearch
from cellplan.jobs.repair.attempts import Attempt, RemedyKind, listed_names
from cellplan.jobs.repair.neat import written_at
from cellplan.jobs.repair.solved import MARGIN
from cellplan.model.cell.cell import Cell
from cellplan.model.report.check_kinds import JOINT_LIMITS, PASSED_BY_TIME
from cellplan.model.units import DEG
from cellplan.report.record.common import CheckRecord, Number, number
from cellplan.report.record.schema import record_schema
from cellplan.runs.write_run import versions
from cellplan.search.variables.pedestals import with_pedestals
from cellplan.study.trial import TrialOutcome, TrialStatus

SCHEMA: Final = "cellplan.advice/1"
Tried = tuple[Attempt, TrialOutcome]
DIGITS: Final = 6  # of a cost
AXES: Final = {"x_mm": ("+x", "-x"), "y_mm": ("+y", "-y"), "z_mm": ("up", "down")}
TURNS: Final = ("roll_deg", "pitch_deg", "yaw_deg")
SHOWN: Final = 0.005  # [deg] below which a joint of a start posture counts as unchanged


class EffectRecord(TypedDict):
    """What a remedy does to a check that fails as the cell is given."""

    check: Annotated[str, "name of the check"]
    subject: Annotated[str, "robot and joint, task, or pair of bodies"]
    before: Annotated[Number, "figure in the given cell: a margin, a share of a limit, a distance or an error"]
    after: Annotated[Number, "figure with the remedy"]
    unit: Annotated[str, "unit of both"]
    text: Annotated[str, "one line of text"]


def effects(given: Mapping[str, Any], figures: Mapping[str, Any]) -> list[EffectRecord]:
    """What a remedy does to the checks that fail as the cell is given."""
    after = dict[tuple[str, str], Mapping[str, Any]]()
    for check in figures["checks"]:  # all phases have the same ones: of each the one that is nearest to its limit
        key = (check["name"], check["subject"])
        if key not in after or _left(check) < _left(after[key]):
            after[key] = check
    effects: list[EffectRecord] = []
    for check in given["failed"]:
        subject = check["subject"]
        if check["name"] in {"joint_position", MARGIN}:
            old, new = (figures_of["margins"][subject] for figures_of in (given, figures))
            unit = given["units"][subject]
            text = f"{subject.replace('/', ' ')} margin {new - old:+.3g} {unit} to {new:.3g} {unit}"
            effects.append(_effect(check, old, new, unit, text))
            continue
        now = after.get((check["name"], subject))
        name = check["name"].removeprefix("joint_").removesuffix("_assumed").replace("_", " ")
        unit, old = check["unit"], check["value"]
        if name == "collision":
            effects.append(_effect(check, old, 0.0, unit, f"{subject}: no contact"))
        elif now is not None and check["name"] in PASSED_BY_TIME:
            shares = [100.0 * values["value"] / values["limit"] for values in (check, now)]
            text = f"{subject.replace('/', ' ')} {name} {shares[0]:.4g} % -> {shares[1]:.4g} % of its limit"
            effects.append(_effect(check, shares[0], shares[1], "%", text))
        elif now is not None:
            effects.append(
                _effect(check, old, now["value"], unit, f"{name} {subject} {old:.3g} -> {now['value']:.3g} {unit}")
            )
    return effects


def _left(check: Mapping[str, Any]) -> float:
    """How far a check is from its limit, in its unit; infinitely far without numbers."""
    value, limit = check["value"], check["limit"]
    return float("inf") if value is None or limit is None else abs(float(value) - float(limit))


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
        return failed_checks(self.given)

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


def failed_checks(given: TrialOutcome) -> list[dict[str, Any]]:
    """Failed checks of a cell that was solved."""
    checks: Any = given.figures.get("failed", ())
    return list(checks)


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


def change_text(cell: Cell, attempt: Attempt, values: Mapping[str, Any]) -> str:
    """What changes, in one line."""
    match attempt.kind:
        case RemedyKind.DURATION:
            motion = cell.motion.duration
            keys = {"motion.duration_s": motion}
            texts = [f"{old:g} s -> {values[key]:g} s" for key, old in keys.items() if key in values and old]
            return texts[0] if texts else "all times of the tasks longer"
        case RemedyKind.FREE_SPIN:
            return f"free the spin of the tool of {listed_names(attempt.robots)}, if the process allows it"
        case RemedyKind.METHOD | RemedyKind.STEP:
            return attempt.text
        case RemedyKind.BRANCH:
            return f"another start branch of {listed_names(attempt.robots)}"
        case _:
            texts = list(_changes(cell, attempt, values))
            return "; ".join(texts) if texts else "no change"


def _changes(cell: Cell, attempt: Attempt, values: Mapping[str, Any]) -> Iterator[str]:
    """What changes, one text for each base, tool, start posture and the like."""
    document = cell.origin.document
    groups: dict[str, dict[str, tuple[Any, Any]]] = {}
    for address, value in values.items():
        entry, _, component = address.rpartition(".")
        groups.setdefault(entry, {})[component] = (written_at(document, address), value)
    for entry, parts in groups.items():
        name = entry.removeprefix("robots.")
        if name.endswith((".base", ".mount")) or entry == "part.at" or ".held_by" in entry or entry.startswith("part."):
            yield from _of_pose(name.removesuffix(".base"), parts)
        elif name.endswith(".tool.rod"):
            yield f"rod of {name.removesuffix('.tool.rod')}: {_arrows(parts)}"
        elif entry.startswith("tasks.") and not {"start", "start_deg"} & parts.keys():
            yield f"tool of task {entry.removeprefix('tasks.')}: {_arrows(parts)}"
        elif not entry.startswith("tasks."):
            yield from _of_robot(cell, name, attempt, parts)


def _of_pose(name: str, parts: Mapping[str, tuple[Any, Any]]) -> Iterator[str]:
    """A base, a grasp or the part that is moved and turned."""
    moved, turned = [], []
    for component, (old, new) in parts.items():
        by = float(new) - float(old or 0.0)
        if component in AXES:
            moved.append((abs(by), f"{abs(by):.4g} mm {AXES[component][by < 0.0]}"))
        elif component in TURNS:
            turned.append(f"{by:+.4g} deg {component.removesuffix('_deg')}")
    if moved:
        yield f"move {name} {', '.join(text for _, text in sorted(moved, key=lambda move: -move[0]))}"
    if turned:
        yield f"turn {name} {', '.join(turned)}"


def _of_robot(cell: Cell, name: str, attempt: Attempt, parts: Mapping[str, tuple[Any, Any]]) -> Iterator[str]:
    """Start posture and weights of a robot; start postures that follow from other changes are not named."""
    varies_start = any("start" in address and address.startswith(f"robots.{name}.") for address in attempt.addresses)
    for component, (old, new) in parts.items():
        if component == "path":
            rows = new.get("coefficients_deg") or new["coefficients"]
            yield f"joint path of {name}: {len(rows)} coefficients a joint"
        elif component == "weights":
            yield f"joint weights of {name}: {_by_joint(cell, name, old, new, '')}"
        elif component in {"start_deg", "start"} and varies_start:
            yield f"start of {name}: {_by_joint(cell, name, old, new, ' deg')}"


def _by_joint(cell: Cell, name: str, old: Any, new: Any, unit: str) -> str:
    """Joints whose number changes."""
    joints = cell.robot(name).model.joint_names
    before = _listed(old, len(joints))
    texts = [
        f"{joint} {was:.4g} -> {value:.4g}{unit}" if was is not None else f"{joint} {value:.4g}{unit}"
        for joint, was, value in zip(joints, before, _listed(new, len(joints)), strict=True)
        if value is not None and (was is None or abs(value - was) > SHOWN)
    ]
    return ", ".join(texts)


def _listed(values: Any, count: int) -> list[float | None]:
    """Numbers of a list or of a mapping; None for each where there are none."""
    listed: Sequence[Any] = list(values.values()) if isinstance(values, Mapping) else values
    if isinstance(listed, str) or listed is None or len(listed) != count:
        return [None] * count
    return [float(value) for value in listed]


def _arrows(parts: Mapping[str, tuple[Any, Any]]) -> str:
    """Old and new numbers."""
    texts = []
    for component, (old, new) in parts.items():
        unit = next((unit for unit in ("mm", "deg") if component.endswith(f"_{unit}")), "")
        texts.append(f"{component.removesuffix(f'_{unit}')} {float(old or 0.0):.4g} -> {float(new):.4g} {unit}")
    return ", ".join(texts)


def _effect(check: Mapping[str, Any], old: float, new: float, unit: str, text: str) -> EffectRecord:
    return {
        "check": check["name"],
        "subject": check["subject"],
        "before": number(old),
        "after": number(new),
        "unit": unit,
        "text": text,
    }
