"""Static forces in the record of a run: torques of joints, what holders exert, grips, and what was not stated."""

from collections.abc import Iterator
from typing import Annotated, TypedDict

from cellplan.model.cell.cell import Cell
from cellplan.model.report.forces import ForceReport, GripUse, HolderLoad, InternalLoad, JointLoad
from cellplan.model.units import MM
from cellplan.report.record.common import Number, number


class JointLoadRecord(TypedDict):
    """Torque, or force of a prismatic joint, that balances processes and stated weights at rest; links not counted."""

    unit: Annotated[str, "`Nm` or `N`"]
    torque: Annotated[Number, "largest size by processes and weights together, as far as they are stated"]
    torque_at_s: Annotated[Number, "its time"]
    moving: Annotated[Number, "likewise, and by the accelerations of tool and part in the written motion"]
    moving_at_s: Annotated[Number, "its time"]
    by_process: Annotated[Number, "largest size by processes alone"]
    by_process_at_s: Annotated[Number, "its time"]
    by_weight: Annotated[Number, "largest size by weights of tool and part alone; null if one is not stated"]
    by_weight_at_s: Annotated[Number, "its time"]
    limit: Annotated[Number, "limit of the joint, not judged here as links load it too; null if it is not stated"]
    by_closure: Annotated[Number, "at most by the stated errors of closure; null without these or a stiffness"]


class InternalLoadRecord(TypedDict):
    """What errors of closure make a holder exert on the part, by the stiffness of all holders."""

    force_n: Annotated[Number, "largest force by the errors of the tables"]
    force_at_s: Annotated[Number, "its time"]
    moment_nm: Annotated[Number, "largest moment about the tip by these errors"]
    moment_at_s: Annotated[Number, "its time"]
    force_at_error_n: Annotated[Number, "at most by the stated errors of closure"]
    moment_at_error_nm: Annotated[Number, "likewise"]


class HolderLoadRecord(TypedDict):
    """What a holder exerts on the part at its tool tip by processes and weight, at rest."""

    force_n: Annotated[Number, "largest force"]
    force_at_s: Annotated[Number, "its time"]
    moment_nm: Annotated[Number, "largest moment about the tip"]
    moment_at_s: Annotated[Number, "its time"]
    internal: Annotated[InternalLoadRecord | None, "by errors of closure; null without several holders and stiffnesses"]


class GripRecord(TypedDict):
    """Friction of a grip where most of it is needed."""

    share: Annotated[Number, "needed share of what friction bears; above 1 the part slides"]
    share_at_s: Annotated[Number, "its time"]
    tangential_n: Annotated[Number, "force along the pads then"]
    torsion_nm: Annotated[Number, "moment about their normal then"]
    normal_n: Annotated[Number, "force along their normal then"]
    across_nm: Annotated[Number, "largest moment across the normal, which is not judged"]


class ForcesRecord(TypedDict):
    """Static forces by processes, weights and errors of closure; empty where none is stated."""

    joints: Annotated[dict[str, dict[str, JointLoadRecord]], "by robot and joint"]
    holders: Annotated[dict[str, HolderLoadRecord], "by holder of the part"]
    grips: Annotated[dict[str, GripRecord], "by holder with a stated grip"]
    sharing_length_mm: Annotated[
        Number, "length that weighs moments against forces where several holders share a load; null for one"
    ]


def forces_record(forces: ForceReport) -> ForcesRecord:
    """All static forces of a run."""
    joints: dict[str, dict[str, JointLoadRecord]] = {}
    for load in forces.joints:
        joints.setdefault(load.robot, {})[load.joint] = _joint(load)
    return {
        "joints": joints,
        "holders": {holder.robot: _holder(holder) for holder in forces.holders},
        "grips": {use.robot: _grip(use) for use in forces.grips},
        "sharing_length_mm": None if forces.length is None else number(MM * forces.length),
    }


def unstated_forces(cell: Cell) -> list[str]:
    """One line on what is not stated of forces but masses, which the line on payloads names; none for nothing."""
    missing = list(_missing(cell))
    return [f"forces not stated: {'; '.join(missing)}"] if missing else []


def _missing(cell: Cell) -> Iterator[str]:
    """Processes without a force, the stiffness of several holders, and grips of a part without a mass."""
    holders = cell.part.held_by
    tasks = [task.name for task in cell.tasks if task.process is not None and task.process.force is None]
    silent = [grasp.robot for grasp in holders if cell.closures and grasp.stiffness is None]
    grips = [grasp.robot for grasp in holders if grasp.grip is not None and cell.part.mass is None]
    if tasks:
        yield f"process.force of {', '.join(tasks)}"
    if silent:
        yield f"stiffness of the grasp of {', '.join(silent)} (internal forces not known)"
    if grips:
        yield f"mass of the part for the grip of {', '.join(grips)} (friction not judged)"


def _joint(load: JointLoad) -> JointLoadRecord:
    return {
        "unit": load.unit.name,
        "torque": number(load.total.size),
        "torque_at_s": number(load.total.at_s),
        "moving": number(load.moving.size),
        "moving_at_s": number(load.moving.at_s),
        "by_process": number(load.by_process.size),
        "by_process_at_s": number(load.by_process.at_s),
        "by_weight": None if load.by_weight is None else number(load.by_weight.size),
        "by_weight_at_s": None if load.by_weight is None else number(load.by_weight.at_s),
        "limit": number(load.limit),
        "by_closure": number(load.by_closure),
    }


def _holder(holder: HolderLoad) -> HolderLoadRecord:
    return {
        "force_n": number(holder.force.size),
        "force_at_s": number(holder.force.at_s),
        "moment_nm": number(holder.moment.size),
        "moment_at_s": number(holder.moment.at_s),
        "internal": None if holder.internal is None else _internal(holder.internal),
    }


def _internal(load: InternalLoad) -> InternalLoadRecord:
    return {
        "force_n": number(load.force.size),
        "force_at_s": number(load.force.at_s),
        "moment_nm": number(load.moment.size),
        "moment_at_s": number(load.moment.at_s),
        "force_at_error_n": number(load.force_at_error),
        "moment_at_error_nm": number(load.moment_at_error),
    }


def _grip(use: GripUse) -> GripRecord:
    return {
        "share": number(use.share),
        "share_at_s": number(use.at_s),
        "tangential_n": number(use.tangential),
        "torsion_nm": number(use.torsion),
        "normal_n": number(use.normal),
        "across_nm": number(use.across),
    }
