"""What the figures of a report rest on: how good link bodies are, and what was not stated and so not judged."""

from collections.abc import Mapping, Sequence

from cellplan.model.cell import Cell
from cellplan.model.payload import LoadUse
from cellplan.model.report import ClearanceClass, ClearanceMinimum
from cellplan.report.record.payload import loads_record, unjudged_loads
from cellplan.report.record.run import Record, number

Accuracies = Sequence[float | None]  # of the two bodies of a pair in [mm]; None where it is not stated


def rests_on_record(cell: Cell, loads: Sequence[LoadUse]) -> Record:
    """What the figures rest on, and one line on each thing that was not stated."""
    return {
        "bodies": bodies_record(cell),
        "body_accuracy": "add" if cell.checks.adds_accuracy else "report",
        "payload": loads_record(loads),
        "lines": [*unstated_bodies(cell), *unjudged_loads(loads)],
    }


def bodies_record(cell: Cell) -> Record:
    """How good the link bodies of each robot are and who says so; nothing for a robot without bodies."""
    record: Record = {}
    for robot in cell.robots:
        stated, own = robot.model.body_accuracy, [body for body in robot.model.bodies if body.accuracy is not None]
        if robot.model.bodies:
            record[robot.name] = {
                "accuracy_mm": None if stated is None else number(1e3 * stated.distance),
                "source": "not stated" if stated is None else stated.source,
                "own_accuracy_mm": {body.name: number(1e3 * (body.accuracy or 0.0)) for body in own},
            }
    return record


def unstated_bodies(cell: Cell) -> list[str]:
    """One line on the robots whose bodies have no stated accuracy; none when all are stated."""
    models = {robot.name: robot.model for robot in cell.robots}
    unknown = [name for name, model in models.items() if any(model.accuracy_of(body) is None for body in model.bodies)]
    return [f"accuracy of bodies of {', '.join(unknown)} not stated"] if unknown else []


def with_accuracies(clearance: Record, minima: Mapping[ClearanceClass, ClearanceMinimum]) -> Record:
    """The record of the smallest distances, each with how good the two bodies are."""
    known = {minimum.pair: minimum.accuracies for minimum in minima.values() if minimum.pair is not None}
    return {kind: {**entry, "accuracies_mm": _accuracies(entry, known)} for kind, entry in clearance.items()}


def _accuracies(
    entry: Record, known: Mapping[tuple[str, str], tuple[float | None, float | None] | None]
) -> list[float | None] | None:
    """How good the bodies of a smallest distance are, in [mm]."""
    found = known.get(tuple(entry["pair"])) if entry["pair"] else None
    return None if found is None else [None if value is None else number(1e3 * value) for value in found]


def good_to(pair: Sequence[str], accuracies: Accuracies | None) -> str:
    """How good the two bodies of a pair are, in words; empty when nothing is known of them.

    A body that is taken as exact is passed over where the other is not.
    """
    if accuracies is None:
        return ""
    unknown = [name for name, value in zip(pair, accuracies, strict=True) if value is None]
    if unknown:
        return f"accuracy of {' and '.join(unknown)} not stated"
    stated = [(name, value) for name, value in zip(pair, accuracies, strict=True) if value]
    if not stated:
        return "between bodies taken as exact"
    if len(stated) == len(accuracies) and len(set(accuracies)) == 1:
        return f"between bodies good to {stated[0][1]:g} mm"
    return f"between bodies good to {' and '.join(f'{value:g} mm ({name})' for name, value in stated)}"
