"""``advice.json``: what makes a failing cell pass, smallest change first, and what was tried and does not."""

from typing import Annotated, Any, Final, TypedDict

from cellplan.report.record.common import CheckRecord, Number

SCHEMA: Final = "cellplan.advice/1"


class EffectRecord(TypedDict):
    """What a remedy does to a check that fails as the cell is given."""

    check: Annotated[str, "name of the check"]
    subject: Annotated[str, "robot and joint, task, or pair of bodies"]
    before: Annotated[Number, "figure in the given cell: a margin, a share of a limit, a distance or an error"]
    after: Annotated[Number, "figure with the remedy"]
    unit: Annotated[str, "unit of both"]
    text: Annotated[str, "one line of text"]


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
