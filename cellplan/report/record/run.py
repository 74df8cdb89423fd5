"""``report.json``: the record of a run in printed units (deg, mm, s), built from typed records."""

from collections.abc import Sequence
from typing import Annotated, Final, Protocol, TypedDict

from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import CAUTION, Report
from cellplan.report.record.common import (
    CheckRecord,
    Number,
    OriginRecord,
    Provenance,
    check_record,
    number,
    origin_record,
)
from cellplan.report.record.figures import FiguresRecord, figures_record
from cellplan.report.record.phases import PhaseRecord, clock_from, missing_moves, phases_record
from cellplan.report.record.sections.accelerations import AccelerationsRecord, accelerations_record
from cellplan.report.record.sections.base_reactions import BaseReactionRecord, base_reactions_record
from cellplan.report.record.sections.clearance import (
    ClosestPair,
    Contact,
    ExclusionRecord,
    LeftOutRecord,
    MinimumRecord,
    ProofRecord,
    clearance_proof_record,
    clearance_record,
    closest_pairs_record,
    contacts_record,
    left_out_record,
)
from cellplan.report.record.sections.forces import ForcesRecord, forces_record
from cellplan.report.record.sections.joints import (
    JointRecord,
    LockedJointRecord,
    RepeatabilityRecord,
    joints_record,
    locked_joints_record,
    repeatability_record,
)
from cellplan.report.record.sections.rests_on import (
    OpenSurfaceRecord,
    RestsOnRecord,
    open_surfaces_record,
    rests_on_record,
)
from cellplan.report.record.sections.skew import SkewKey, skew_record
from cellplan.report.record.sections.solver import NOT_PLANNED, PlanningFacts, SolverRecord, solver_record
from cellplan.report.record.sections.stops import StopsKey, stops_record
from cellplan.report.record.sections.tasks import TaskRecord, tasks_record
from cellplan.report.record.sections.tool_errors import RunClosureRecord, closures_record
from cellplan.report.record.sections.torques import TorquesKey, torques_record
from cellplan.report.record.sections.world_motion import (
    MotionShareRecord,
    SingularityRecord,
    SpeedRecord,
    motion_share_record,
    singularity_record,
    speed_record,
)

SCHEMA: Final = "cellplan.report/1"


class BeginRecord(TypedDict):
    """Keys with which the record of a run and the record of several runs begin."""

    schema: Annotated[str, "`cellplan.report/1`, always the first key"]
    cell: Annotated[str, "name of the cell"]
    status: Annotated[str, "`passed` or `failed`"]
    mode: Annotated[str, "`simultaneous`, `pairwise`, `part_at_rest` or `semi_coordinated`"]
    cycle_time_s: Annotated[Number, "duration of the motion"]
    clock_from: Annotated[
        str,
        "what determines the duration: `motion.duration_s`; `step after motion.duration_s` if that is not a "
        "multiple of the step; `tasks` if the cell states no duration; `motion.timing` if the program is retimed",
    ]


class HeadRecord(OriginRecord, BeginRecord):
    """What the record of a run and the record of several runs have in common."""

    phases: Annotated[list[PhaseRecord], "phases of the whole program"]
    tasks: Annotated[dict[str, TaskRecord], "by task"]
    joints: Annotated[dict[str, dict[str, JointRecord]], "by robot and joint"]
    repeatability: Annotated[
        dict[str, RepeatabilityRecord], "by task, or under `all` for several tasks; empty if a path is open"
    ]
    clearance: Annotated[dict[str, MinimumRecord], "for `whole`, `robot_robot`, `self`, `part` and `environment`"]
    figures: Annotated[FiguresRecord, "by phase, quantity and subject: what was measured, in the unit of the quantity"]
    required_clearance_mm: Annotated[Number, "`checks.clearance_mm` of the cell"]
    accelerations: Annotated[AccelerationsRecord, "accelerations in the world"]
    forces: Annotated[ForcesRecord, "static forces by processes, weights and errors of closure"]
    not_in_program: Annotated[list[str], "moves that the program does not contain"]
    base_reactions: Annotated[
        dict[str, BaseReactionRecord], "by robot whose masses are stated: what its base must hold"
    ]
    rests_on: Annotated[RestsOnRecord, "assumptions on which the values rest"]
    open_surfaces: Annotated[list[OpenSurfaceRecord], "bodies whose mesh is not closed"]
    remarks: Annotated[list[str], "what was not read of the files of robots"]
    left_out: Annotated[list[LeftOutRecord], "pairs that were not judged in full"]
    solver: Annotated[SolverRecord, "how the motion was computed"]
    caution: Annotated[str, "limits of an offline result"]


class RunRecord(HeadRecord, SkewKey, StopsKey, TorquesKey):
    """The record of a run."""

    phase: Annotated[str | None, "name of the phase that it is for; null for the only one of a program"]
    samples: Annotated[int, "number of samples"]
    step_s: Annotated[Number, "time between two samples"]
    closure: Annotated[dict[str, RunClosureRecord], "by co-holder; empty if one robot holds the part"]
    locked_joints: Annotated[list[LockedJointRecord], "joints that fail during the motion"]
    pair_count: Annotated[int, "number of pairs that were checked"]
    contacts: Annotated[list[Contact], "all contacts"]
    exclusions: Annotated[list[ExclusionRecord], "pairs with reduced requirements"]
    closest_pairs: Annotated[list[ClosestPair], "the ten closest pairs, nearest first"]
    clearance_proof: Annotated[ProofRecord, "evidence for the distances between the samples"]
    singularity: Annotated[SingularityRecord | None, "distance to singularities; null where no task is worked on"]
    motion_share: Annotated[dict[str, MotionShareRecord], "by robot"]
    speeds: Annotated[dict[str, SpeedRecord], "by robot"]
    checks: Annotated[list[CheckRecord], "every verified statement"]
    idle: Annotated[list[str], "idle robots of this run; their tables keep them at their homes"]


class ReportedPhase(Protocol):
    """A phase of a program with its report, just planned or read back."""

    @property
    def report(self) -> Report:
        """What the checks found."""

    @property
    def cell(self) -> Cell:
        """The cell as it is in the phase."""


def begin_record(reports: Sequence[Report], cell: Cell) -> BeginRecord:
    """The first keys of the record of one phase, or of several that follow one another."""
    return {
        "schema": SCHEMA,
        "cell": cell.name,
        "status": "passed" if all(report.passed for report in reports) else "failed",
        "mode": reports[0].mode,
        "cycle_time_s": number(sum(report.cycle_time for report in reports)),
        "clock_from": clock_from(cell),
    }


def run_record(phase: ReportedPhase, *, provenance: Provenance, planning: PlanningFacts = NOT_PLANNED) -> RunRecord:
    """The record of one phase of a program, or of its only one."""
    report, cell = phase.report, phase.cell
    return {
        **begin_record([report], cell),
        "phase": report.phase,
        "samples": len(report.times),
        "step_s": number(report.cycle_time / (len(report.times) - 1)),
        "phases": phases_record(report.phases),
        "tasks": tasks_record(report, cell),
        "joints": joints_record(report.joints, report.accelerations.joints),
        "repeatability": repeatability_record(report),
        "locked_joints": locked_joints_record(report, cell),
        "clearance": clearance_record(report.clearance.minima),
        "figures": figures_record([report]),
        "required_clearance_mm": number(cell.checks.clearance_mm),
        "pair_count": report.clearance.pair_count,
        "contacts": contacts_record(report.clearance),
        "exclusions": [{"pair": list(pair), "reason": why} for *pair, why in report.clearance.exclusions],
        "singularity": singularity_record(report.conditioning, report.times),
        "motion_share": motion_share_record(report, cell),
        "speeds": {robot: speed_record(speed) for robot, speed in report.speeds.items()},
        "checks": [check_record(check) for check in report.checks],
        "idle": list(report.idle),
        "not_in_program": missing_moves(cell, {None: report.tasks}),
        **origin_record(cell, provenance),
        "caution": CAUTION,
        "rests_on": rests_on_record(cell, report.loads, report.standoffs, report.torques),
        "base_reactions": base_reactions_record(it.reaction for it in report.torques),
        "closest_pairs": closest_pairs_record(report.clearance),
        "clearance_proof": clearance_proof_record(report.clearance),
        "open_surfaces": open_surfaces_record(cell),
        "remarks": [text for _, text in cell.remarks],
        "left_out": left_out_record(report.clearance.left_out),
        "closure": closures_record(report, cell),
        "solver": solver_record(cell.solver, planning),
        "accelerations": accelerations_record(report.accelerations),
        "forces": forces_record(report.forces),
        **skew_record(report),
        **stops_record(report),
        **torques_record(report.torques),
    }
