"""Phases of the program in the record of a run."""

from collections.abc import Iterable
from typing import Annotated, TypedDict

from cellplan.model.phase import Phase
from cellplan.report.record.common import Number, number


class PhaseRecord(TypedDict):
    """An interval of the program in which no robot changes its role."""

    name: Annotated[str, "name of the phase"]
    begin_s: Annotated[Number, "begin on the clock of the whole program"]
    end_s: Annotated[Number, "end on the clock of the whole program"]
    in_program: Annotated[bool, "whether the joint tables hold this motion"]
    roles: Annotated[dict[str, str], "by robot: `carry`, `work: TASK`, `transfer: TARGET`, `hold at home` or `hold`"]


def phases_record(phases: Iterable[Phase]) -> list[PhaseRecord]:
    """All phases of the program in their order."""
    return [
        {
            "name": phase.name,
            "begin_s": number(phase.begin),
            "end_s": number(phase.end),
            "in_program": phase.in_program,
            "roles": {robot: str(role) for robot, role in phase.roles.items()},
        }
        for phase in phases
    ]
