"""The part of ``study.json`` of a layout search about bases that are off their places."""

from typing import Annotated, TypedDict

from cellplan.report.record.common import Number


class CornerRecord(TypedDict):
    """A layout with displaced bases that was solved and verified in full."""

    what: Annotated[str, "why it was chosen"]
    bases: Annotated[dict[str, float], "displacements in mm and deg, by address"]
    margin_deg: Annotated[Number, "smallest verified distance of a turning joint from its limits"]
    clearance_mm: Annotated[Number, "smallest certified distance of bodies"]
    reason: Annotated[str, "why it failed; empty where every check was passed"]


class ToleranceRecord(TypedDict):
    """How far one base may be off along one direction, all else in place."""

    robot: Annotated[str, "robot"]
    direction: Annotated[str, "`x`, `y`, `z` of the world, or `yaw` about the vertical"]
    unit: Annotated[str, "`mm` or `deg`"]
    minus: Annotated[Number, "displacement the one way that passed every check; 0 where none did"]
    plus: Annotated[Number, "the same the other way"]
    first_minus: Annotated[str, "what is missed beyond it the one way; empty where nothing was, as far as was asked"]
    first_plus: Annotated[str, "the same the other way"]


class MisplacementRecord(TypedDict):
    """What was sampled with every base off its place and the motion planned anew."""

    position_mm: Annotated[Number, "by how much every base is off along each axis"]
    orientation_deg: Annotated[Number, "by how much every base is off about the vertical"]
    cycle_s: Annotated[
        Number, "the one cycle in which the layout and all its corners keep their limits; of a program its longest"
    ]
    nominal_cycle_s: Annotated[
        Number, "shortest cycle with all bases in place, by the search; of a program the certified one"
    ]
    seeded: Annotated[int, "seeded random corners"]
    seeded_kept: Annotated[int, "those of them that passed every check in this cycle"]
    by_derivatives: Annotated[int, "corners that are the worst for a limit, to first order"]
    by_derivatives_kept: Annotated[int, "those of them that passed every check"]
    ends: Annotated[int, "displacements of one base in one direction by the full amount"]
    ends_kept: Annotated[int, "those of them that passed every check"]
    solved: Annotated[list[CornerRecord], "the worst of them, with their smallest distances"]
    tolerances: Annotated[list[ToleranceRecord], "how far each base may be off"]
