"""Headers of the tables of a program: what solving writes above the rows, and what verification expects there."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from cellplan.files.input.findings import listed
from cellplan.files.run.joint_tables import TableHeader
from cellplan.model.cell.acceleration import JointAcceleration, MotionAccelerations
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.idle import not_in_program
from cellplan.model.motion.plan import NOT_IN_PROGRAM, Phase
from cellplan.model.report.report import Report
from cellplan.report.record.phases import missing_moves
from cellplan.report.record.sections.accelerations import table_line
from cellplan.report.record.sections.rests_on import zero_text


def table_headers(
    cell: Cell, phases: Sequence[Phase], reports: Sequence[Report], *, digests: Mapping[str, str], remark: str = ""
) -> dict[str, TableHeader]:
    """Header of every table of a program whose checks passed, by robot.

    Args:
        digests: SHA-256 by what it is the digest of.
    """
    header = TableHeader(
        cell=cell.name,
        mode=str(cell.motion.mode),
        verdict="passed",
        digests=digests,
        remark="; ".join(filter(None, [remark, left_out_of_program(cell, phases)])),
    )
    moved = zip(phases, reports, strict=True)
    accelerations = _hardest([_on_clock(report.accelerations, phase.begin) for phase, report in moved])
    return {
        robot.name: replace(header, accelerations=table_line(accelerations, robot.name), zero=zero_text(robot.model))
        for robot in cell.robots
    }


def left_out_of_program(cell: Cell, phases: Sequence[Phase]) -> str:
    """One line on moves that a program leaves out, those of each phase after its name; empty when there are none."""
    if cell.program.is_home_to_home:
        return ""
    if len(phases) == 1:
        return not_in_program(cell, phases[0].tasks)
    names = listed(phase.name for phase in phases)
    moves = missing_moves(cell, {phase.label: phase.tasks for phase in phases})
    return "; ".join([f"phases {names}: the motion from each to the next is {NOT_IN_PROGRAM}", *moves])


def _on_clock(accelerations: MotionAccelerations, begin: float) -> MotionAccelerations:
    """Accelerations of the joints in a phase with times on the clock of the program."""
    joints = (
        replace(use, peak_at_s=use.peak_at_s + begin, peak_jerk_at_s=use.peak_jerk_at_s + begin)
        for use in accelerations.joints
    )
    return replace(accelerations, joints=tuple(joints))


def _hardest(phases: Sequence[MotionAccelerations]) -> MotionAccelerations:
    """Of each joint the largest acceleration and the largest jerk of all phases."""
    uses: dict[tuple[str, str], list[JointAcceleration]] = {}
    for use in (use for phase in phases for use in phase.joints):
        uses.setdefault((use.robot, use.joint), []).append(use)
    joints = []
    for of_joint in uses.values():
        jerk = max(of_joint, key=lambda use: use.peak_jerk)
        most = max(of_joint, key=lambda use: use.peak)
        joints.append(replace(most, peak_jerk=jerk.peak_jerk, peak_jerk_at_s=jerk.peak_jerk_at_s))
    return MotionAccelerations(joints=tuple(joints))
