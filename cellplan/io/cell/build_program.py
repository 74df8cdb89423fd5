"""Conversion of the program of a cell file, in millimetres, degrees and names, to the model and back."""

from typing import Any

from cellplan.io.schema import CellDocument
from cellplan.io.schema.program import PartPlaceEntry, ProgramEntry
from cellplan.io.shapes import pose_from_entry
from cellplan.model.program import Mark, PartPlace, ProgramSettings


def build_program(entry: ProgramEntry | None) -> ProgramSettings | None:
    """A program from home to home; None when the cell has none."""
    if entry is None:
        return None
    return ProgramSettings(
        cycles=entry.cycles,
        marks=tuple(Mark(name=mark.name, dwell=mark.dwell_s) for mark in entry.all_marks),
        attach=_place(entry.attach),
        detach=_place(entry.detach),
    )


def build_order(robot: str, document: CellDocument) -> tuple[str, ...]:
    """Tasks and marks of a robot in their order; none in a cell without a program."""
    if document.program is None:
        return ()
    order = document.robots[robot].order
    return tuple(name for name, task in document.tasks.items() if task.robot == robot) if order is None else order


def written_program(document: CellDocument) -> dict[str, Any]:
    """The program as plain values, its marks with their dwells; nothing when the cell has none."""
    if document.program is None:
        return {}
    values = document.program.model_dump(exclude_none=True)
    return {"program": {**values, "marks": tuple(mark.model_dump() for mark in document.program.all_marks)}}


def _place(entry: PartPlaceEntry | None) -> PartPlace | None:
    """A place of the part in [m]."""
    if entry is None:
        return None
    return PartPlace(
        X_WP=pose_from_entry(entry.at),
        rests_on=entry.rests_on,
        rest_gap=entry.rest_gap_mm.si,
        is_clamped=entry.clamped,
        approach=entry.approach_mm.si,
        lift=entry.lift_mm.si,
        contact=None if entry.contact_mm is None else entry.contact_mm.si,
    )
