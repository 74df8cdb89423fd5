"""``study.json`` of a layout search: the best layout, what it was chosen from, and what decides."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Any, Final, TypedDict

import numpy as np

from cellplan.files.cell.changes import plain_values
from cellplan.jobs.drawing import drawing, footprint, swept_area
from cellplan.jobs.fastest.timed_program import Law
from cellplan.jobs.layout.finish.finish import CandidateResult, certified_cell
from cellplan.jobs.layout.given_layout import Given, GivenRecord, standing_of_given
from cellplan.jobs.layout.misplacement_record import MisplacementRecord
from cellplan.jobs.layout.trials.limits import LimitRecord
from cellplan.jobs.layout.trials.prepared import PreparedSearch, prepared, values_of
from cellplan.jobs.layout.trials.proposals import (
    BESTS,
    SIZE,
    Proposal,
    choice_of,
    choice_text,
    is_candidate,
    origin_text,
)
from cellplan.jobs.layout.trials.trial import change_of
from cellplan.jobs.layout.variable_records import PathRecord, VariableRecord, path_record, variable_records
from cellplan.model.cell.joint_limits import acceleration_limits
from cellplan.model.report.greatest_feed import cure_of
from cellplan.model.units import DEG, MM
from cellplan.report.record.common import Number, number
from cellplan.report.record.schema import record_schema
from cellplan.runs.write_run import versions
from cellplan.search.variables.choices import Choices
from cellplan.study.study import Finished
from cellplan.study.trial import StudyTrial

SCHEMA: Final = "cellplan.layout/1"
TOP: Final = 10  # [-] layouts that are listed
SAME_CYCLE: Final = 1e-6  # [s] of rounding in a record
SAME: Final = 1e-4  # [-] share by which figures of two layouts differ that are not one
SLOWED: Final = 1.02  # [-] times the cycle that the joints allow, from which on it is said what else counts
SWEPT: Final = 33  # [-] configurations that the swept area is made of
FINE: Final = 6  # decimals of figures of the search: far above rounding


class CandidateRecord(TypedDict):
    """A layout that the search ended at."""

    trial: Annotated[int, "number of the trial, from 0"]
    origin: Annotated[str, "where the trial started from"]
    status: Annotated[str, "`certified`, `rejected` by solve, `conforming` by the search, or `violating`"]
    reason: Annotated[str, "why solve rejected it; empty otherwise"]
    cycle_s: Annotated[Number, "shortest cycle; of a certified one as `solve` has it"]
    margin_deg: Annotated[Number, "smallest distance of a turning joint from its limits"]
    clearance_mm: Annotated[Number, "smallest distance of bodies; certified, or that at the keys of the search"]
    change: Annotated[Number, "cost of the change from the given layout: 1 for 100 mm or 10 deg unless weighted"]
    settings: Annotated[dict[str, Any], "by address: values of the cell file that make it"]


class ChoiceRecord(TypedDict):
    """A combination of discrete choices, and what came of it."""

    choice: Annotated[str, "what differs from the given cell"]
    status: Annotated[str, "`certified`, `conforming` by the search, `dropped`, or `not_tried`"]
    trials: Annotated[int, "number of its trials"]
    conforming: Annotated[int, "number of these that ended at a conforming layout"]
    cycle_s: Annotated[Number, "shortest cycle of these, by the search; null without one"]
    reason: Annotated[str, "why there is none, or why solve rejected it: the most frequent reason; else empty"]


class DroppedRecord(TypedDict):
    """Trials that led to no conforming layout, for one reason."""

    reason: Annotated[str, "the reason"]
    count: Annotated[int, "number of trials"]
    trial: Annotated[int, "the first of them"]


class ProgressRecord(TypedDict):
    """The search after a trial."""

    trial: Annotated[int, "number of the trial"]
    cycle_s: Annotated[Number, "cycle of what this trial ended at; null where it does not conform"]
    best_s: Annotated[Number, "best cycle so far; null before the first conforming layout"]


class FileRecord(TypedDict):
    """A file beside the result."""

    name: Annotated[str, "name in the folder"]
    sha256: Annotated[str, "its digest"]


class LayoutRecord(TypedDict):
    """A layout search."""

    schema: Annotated[str, "name and version of the format"]
    kind: Annotated[str, "`layout`"]
    cell: Annotated[str, "name of the cell"]
    file: Annotated[str, "the cell file"]
    status: Annotated[str, "`certified`, `none_certified` or `no_start`"]
    objective: Annotated[str, "`conforming`, `cycle`, `clearance` or `change`"]
    timing: Annotated[str, "`laws` or `retimed`"]
    duration_s: Annotated[Number, "duration that was demanded; null where the cycle is to be as short as possible"]
    required_clearance_mm: Annotated[Number, "demanded distance of bodies"]
    required_margin_deg: Annotated[Number, "demanded distance of turning joints from their limits"]
    has_accelerations: Annotated[bool, "whether limits of acceleration are among the demands"]
    seed: Annotated[int, "seed of the starts and perturbations"]
    trials: Annotated[int, "number of finished trials: `--trials` with this number repeats the study"]
    rounds: Annotated[int, "number of finished rounds"]
    solves: Annotated[int, "number of layouts that were solved and verified in full"]
    given: Annotated[GivenRecord, "the layout as it was given"]
    best: Annotated[CandidateRecord | None, "the best certified layout; null without one"]
    velocity_only_s: Annotated[Number, "cycle of the best layout without its limits of acceleration; null without any"]
    top: Annotated[list[CandidateRecord], "the best ten layouts, best first"]
    front: Annotated[list[CandidateRecord], "those that no other one beats in both cycle and clearance"]
    binding: Annotated[list[LimitRecord], "what holds the best layout back"]
    variables: Annotated[list[VariableRecord], "the variables with what they do at the best layout"]
    path: Annotated[PathRecord | None, "the joint path that was searched; null where none may change"]
    convergence: Annotated[list[ProgressRecord], "the search, trial after trial"]
    choices: Annotated[list[ChoiceRecord], "every combination of discrete choices; empty without any"]
    dropped: Annotated[list[DroppedRecord], "trials without a conforming layout, by reason"]
    misplacement: Annotated[
        MisplacementRecord | None, "the layout with every base off its place; null where it was not asked for"
    ]
    remarks: Annotated[list[str], "what else the user should know, as pedestals that move with their robots"]
    drawing: Annotated[dict[str, Any], "floor plan in mm: the given and the best layout from above"]
    files: Annotated[list[FileRecord], "`best.yaml` and the files that it names"]
    inputs: Annotated[dict[str, str], "SHA-256 of every input file, by name"]
    versions: Annotated[dict[str, str], "versions of cellplan and of the packages that the numbers depend on"]


def layout_schema() -> dict[str, Any]:
    """The JSON Schema of ``study.json`` of a layout search."""
    return record_schema(LayoutRecord, SCHEMA, "study.json of a layout search")


def layout_record(
    ready: PreparedSearch,
    finished: Finished,
    given: Given,
    *,
    tried: Mapping[int, CandidateResult],
    best: CandidateResult | None,
) -> LayoutRecord:
    """The search in printed units.

    Args:
        tried: What came of those that were solved in full, by number.
    """
    request, cell = ready.request, ready.cell
    listed = list(_candidates(ready, finished, tried))
    standing = best.standing if best else None if ready.unled else standing_of_given(ready)
    of_best = ready if best is None else _prepared_of(ready, finished.trials[best.trial])
    is_free = request.objective == "cycle"
    has_accelerations = bool(np.isfinite(acceleration_limits(ready.scene.cell)).any())
    return {
        "schema": SCHEMA,
        "kind": "layout",
        "cell": cell.name,
        "file": request.cell.name,
        "status": "certified" if best else _no_result(finished),
        "objective": str(request.objective),
        "timing": str(request.timing),
        "duration_s": None if is_free else number(ready.duration),
        "required_clearance_mm": number(cell.checks.clearance_mm),
        "required_margin_deg": number(DEG * float(ready.variables.settings.margin)),
        "has_accelerations": has_accelerations,
        "seed": request.seed,
        "trials": len(finished.trials),
        "rounds": -(-len(finished.trials) // SIZE),
        "solves": sum(result.solves for result in tried.values()),
        "given": given.record,
        "best": next((candidate for candidate in listed if best and candidate["trial"] == best.trial), None),
        "velocity_only_s": _velocity_only(best) if best and has_accelerations and ready.phases is None else None,
        "top": listed[:TOP],
        "front": _front(listed),
        "binding": best.standing.binding() if best else [],
        "variables": variable_records(of_best, standing, best),
        "path": path_record(of_best, best.x) if best and ready.unled else None,
        "convergence": _convergence(finished),
        "choices": _choices(ready, finished, tried),
        "dropped": _dropped(finished.trials),
        "misplacement": None,
        "remarks": [*_remarks(ready, best, given.record)],
        "drawing": _drawing(ready, given, best) if best else {},
        "files": [],
        "inputs": dict(cell.inputs),
        "versions": versions(),
    }


def _remarks(ready: PreparedSearch, best: CandidateResult | None, given: GivenRecord) -> Iterator[str]:
    """What has to be known of the best layout beside its figures."""
    yield from ready.variables.remarks
    yield from _feeds(ready, best)
    yield from _slowed(best)
    yield from no_gain(best.cycle if best else None, given)


def _feeds(ready: PreparedSearch, best: CandidateResult | None) -> Iterator[str]:
    """The feeds that were sought, with what binds them."""
    runs = () if best is None or best.program is None else best.program.solution.runs
    sought = {feed.task.name for feed in ready.opened}
    for feed in (feed for run in runs for feed in run.report.greatest_feeds if feed.task in sought):
        yield f"task {feed.task}: greatest feed {MM * feed.feed:.6g} mm/s; {feed.text}{cure_of(feed.kind)}"


def _slowed(best: CandidateResult | None) -> Iterator[str]:
    """What makes the certified cycle longer than the limits of the joints do."""
    if best is None or best.program is None:
        return
    alone, cycle = best.standing.measures.cycle, best.program.cycle
    if best.program.law is Law.TIME_LAWS and cycle > SLOWED * alone:
        yield (
            f"the limits of the joints alone would allow {alone:.4g} s; what the search does not know asks for "
            f"{cycle:.4g} s: errors of the tools between rows (a shorter motion.step_s makes them less), demanded "
            "feeds, jerk, or limits of tool speed and of the part's acceleration"
        )


def no_gain(cycle: float | None, given: GivenRecord) -> Iterator[str]:
    """That nothing is better than the given layout, where the best cycle in [s] is not shorter than that of its own."""
    shortest = given["cycle_s"]
    if (
        cycle is not None
        and shortest is not None
        and given["status"] == "conforming"
        and shortest <= cycle + SAME_CYCLE
    ):
        yield (
            f"no gain: nothing better than the given layout was found, which takes {shortest:.6g} s; search on with "
            "more trials"
        )


def _candidates(
    ready: PreparedSearch, finished: Finished, tried: Mapping[int, CandidateResult]
) -> Iterator[CandidateRecord]:
    """Layouts that trials ended at: certified ones first, then by the objective; equal ones once."""
    best = BESTS[ready.request.objective]
    sign = -1.0 if best.is_largest else 1.0
    listed = [_candidate(ready, trial, tried.get(trial.number)) for trial in finished.trials if trial.figures]
    figure = {"cycle_s": "cycle_s", "apart_mm": "clearance_mm", "change": "change"}.get(best.figure, "cycle_s")
    ranks = {"certified": 0, "conforming": 1, "rejected": 2, "violating": 3}

    def rank(candidate: CandidateRecord) -> tuple[int, float, int]:
        value: Any = candidate[figure]  # type: ignore[literal-required]
        return ranks[candidate["status"]], sign * (np.inf * sign if value is None else float(value)), candidate["trial"]

    last: CandidateRecord | None = None
    for candidate in sorted(listed, key=rank):
        if last is None or not _is_same(candidate, last):
            last = candidate
            yield candidate


def _is_same(one: CandidateRecord, other: CandidateRecord) -> bool:
    """Whether two trials ended at one layout."""
    return one["status"] == other["status"] and all(
        np.isclose(one["settings"][key], other["settings"][key], rtol=SAME, atol=1.0)
        for key in one["settings"]
        if isinstance(one["settings"][key], int | float) and isinstance(other["settings"].get(key), int | float)
    )


def _candidate(ready: PreparedSearch, trial: StudyTrial, certified: CandidateResult | None) -> CandidateRecord:
    figures, ready = trial.figures, _prepared_of(ready, trial)
    x, start = np.array(figures["x"]), np.array(figures["start"])
    status, reason = "conforming" if trial.passed else "violating", ""
    shown = {key: figures[key] for key in ("cycle_s", "margin_deg", "clearance_mm", "change")}
    if certified is not None:
        x, start = certified.x, certified.start
        status, reason = ("certified", "") if certified.passed else ("rejected", certified.reason)
        if certified.program is not None:
            shown |= {
                "cycle_s": certified.program.cycle,
                "margin_deg": certified.margin,
                "clearance_mm": certified.clearance,
                "change": change_of(ready, x),
            }
    settings = plain_values({**choice_of(trial), **values_of(ready, x, start)})
    rounded = {key: None if value is None else number(round(value, FINE)) for key, value in shown.items()}
    return {
        "trial": trial.number,
        "origin": origin_text(Proposal.of_trial(trial), is_sampled="sampled" in figures),
        "status": status,
        "reason": reason,
        "cycle_s": rounded["cycle_s"],
        "margin_deg": rounded["margin_deg"],
        "clearance_mm": rounded["clearance_mm"],
        "change": rounded["change"],
        "settings": settings,
    }


def _front(listed: list[CandidateRecord]) -> list[CandidateRecord]:
    """Layouts that no other one beats in both cycle and clearance, the shortest cycle first."""
    front: list[CandidateRecord] = []
    widest = -np.inf
    usable = [candidate for candidate in listed if candidate["status"] in {"certified", "conforming"}]
    for candidate in sorted(usable, key=lambda one: (one["cycle_s"] or np.inf, -(one["clearance_mm"] or 0.0))):
        if candidate["clearance_mm"] is not None and candidate["clearance_mm"] > widest:
            widest = candidate["clearance_mm"]
            front.append(candidate)
    return front


def _convergence(finished: Finished) -> list[ProgressRecord]:
    """The cycle of every trial and the best so far, in the order of the trials."""
    best: float | None = None
    progress: list[ProgressRecord] = []
    for trial in finished.trials:
        cycle = round(trial.figures["cycle_s"], FINE) if is_candidate(trial) else None
        best = cycle if best is None else min(best, cycle) if cycle is not None else best
        progress.append({"trial": trial.number, "cycle_s": cycle, "best_s": best})
    return progress


def _dropped(trials: Iterable[StudyTrial]) -> list[DroppedRecord]:
    """Trials without a conforming layout, by reason, the most frequent first."""
    lost = [trial for trial in trials if not trial.passed]
    counts = Counter(trial.outcome.reason for trial in lost)
    first = {reason: min(trial.number for trial in lost if trial.outcome.reason == reason) for reason in counts}
    ordered = sorted(counts.items(), key=lambda entry: (-entry[1], first[entry[0]]))
    return [{"reason": reason, "count": count, "trial": first[reason]} for reason, count in ordered]


def _choices(ready: PreparedSearch, finished: Finished, tried: Mapping[int, CandidateResult]) -> list[ChoiceRecord]:
    """What came of every combination of discrete choices, in the order in which they were tried; none without any."""
    combinations = list(Choices.of(ready.cell).values())
    if len(combinations) == 1:
        return []
    choices: list[ChoiceRecord] = []
    for choice in combinations:
        trials = [trial for trial in finished.trials if choice_of(trial) == choice]
        solved = [tried[trial.number] for trial in trials if trial.number in tried]
        passed = [trial.figures["cycle_s"] for trial in trials if trial.passed]
        reasons = [candidate.reason for candidate in solved if candidate.reason] or [
            reason["reason"] for reason in _dropped(trials)
        ]
        is_certified = any(candidate.passed for candidate in solved)
        status = "certified" if is_certified else "conforming" if passed else "dropped" if trials else "not_tried"
        choices.append(
            {
                "choice": choice_text(choice) or "as given",
                "status": status,
                "trials": len(trials),
                "conforming": len(passed),
                "cycle_s": number(round(min(passed), FINE)) if passed else None,
                "reason": reasons[0] if reasons and not is_certified else "",
            }
        )
    return choices


def _prepared_of(ready: PreparedSearch, trial: StudyTrial) -> PreparedSearch:
    """The cell with the discrete choices of a trial."""
    choice = choice_of(trial)
    return prepared(ready.request, choice) if choice else ready


def _no_result(finished: Finished) -> str:
    """Why there is no best layout."""
    is_started = any(trial.figures for trial in finished.trials)
    return "none_certified" if is_started else "no_start"


def _velocity_only(best: CandidateResult) -> float:
    """Cycle of the best layout by its limits of speed alone in [s]."""
    measures, times = best.standing.measures, best.standing.problem.times
    return round(float(measures.speeds.value.max()) * float(times[-1] - times[0]), FINE)


def _drawing(ready: PreparedSearch, given: Given, best: CandidateResult) -> dict[str, Any]:
    """Floor plan of the given and the best layout."""
    cell = certified_cell(best)
    if best.program is None:
        return {}
    scene, solution = best.program.scene, best.program.solution
    rows = np.unique(np.linspace(0, len(solution.motion.q) - 1, SWEPT).round().astype(np.intp))
    q = solution.motion.q[rows]
    return {
        "given": given.drawing,
        "best": drawing(scene, q[0], solution.runs[0].schedule),
        "swept": swept_area(scene, q),
        "reach_mm": {
            robot.name: number(round(MM * (given.reach[robot.name] + float(np.linalg.norm(robot.tool.X_FT[:3, 3]))), 3))
            for robot in cell.robots
        },
        "keep_out": {area.name: footprint(area.shape, area.X_WS) for area in ready.variables.settings.keep_out},
    }
