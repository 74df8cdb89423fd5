"""``study.json`` of a layout search: the best layout, what it was chosen from, and what decides."""

from typing import Annotated, Any, Final, TypedDict

from cellplan.report.record.common import Number
from cellplan.report.record.misplacement import MisplacementRecord

SCHEMA: Final = "cellplan.layout/1"


class LimitRecord(TypedDict):
    """A limit that a layout breaks or that holds it back."""

    kind: Annotated[
        str, "`position`, `velocity`, `acceleration`, `distance`, `singular`, `bound`, `start`, `path` or `check`"
    ]
    subject: Annotated[str, "robot and joint, pair of bodies, or variable"]
    text: Annotated[str, "one line of text"]


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


class VariableRecord(TypedDict):
    """A variable of the search."""

    name: Annotated[str, "its address in the cell file"]
    unit: Annotated[str, "`mm`, `deg` or empty"]
    lower: Annotated[Number, "lower bound"]
    upper: Annotated[Number, "upper bound"]
    given: Annotated[Number, "value in the given cell"]
    best: Annotated[Number, "value in the best layout; null without one"]
    step: Annotated[Number, "step that the effects are stated for"]
    cycle_s: Annotated[Number, "effect of a step on the cycle, by the joint that decides it"]
    margin_deg: Annotated[Number, "effect on the smallest margin of a turning joint"]
    clearance_mm: Annotated[Number, "effect on the smallest distance of bodies"]


class PathRecord(TypedDict):
    """The joint path of the best layout."""

    robot: Annotated[str, "whose joints follow it"]
    coefficients: Annotated[int, "number of coefficients of each joint"]
    degree: Annotated[int, "degree of the spline"]
    is_given: Annotated[bool, "whether the given cell has a path; else the given motion is that without one"]
    departure_deg: Annotated[Number, "by how much a turning joint leaves the given motion at most; null without one"]
    departure_mm: Annotated[Number, "by how much a sliding joint does; null without one"]


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


class GivenRecord(TypedDict):
    """The layout as it was given."""

    status: Annotated[str, "`conforming` or `violating`, as `solve` has it"]
    reason: Annotated[str, "why it has no motion; empty where it has one"]
    cycle_s: Annotated[Number, "shortest verified cycle of the same motion; null where another objective is sought"]
    margin_deg: Annotated[Number, "smallest distance of a turning joint from its limits; negative beyond them"]
    clearance_mm: Annotated[Number, "smallest certified distance of bodies"]
    violations: Annotated[list[LimitRecord], "what it breaks, worst first"]


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
