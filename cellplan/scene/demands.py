"""What distance is demanded of a pair of bodies, and how good the bodies are."""

from cellplan.model.cell import Cell
from cellplan.scene.bodies import Kind, SceneBody


def accuracy(cell: Cell, body: SceneBody) -> float | None:
    """How far the real thing may stick out of a body in [m]; None when nobody states it.

    Link bodies are as good as the robot's file or the cell says. What the user draws (tools, part, attachments,
    pedestals, surroundings) is taken as exact.
    """
    if body.kind is not Kind.LINK or body.robot is None:
        return 0.0
    stated = cell.robot(body.robot).model.body_accuracy
    return None if stated is None else stated.distance


def demand(cell: Cell, first: SceneBody, second: SceneBody) -> float:
    """Demanded distance of a pair in [m]: the cell's clearance, and the accuracy of both bodies where it is added."""
    checks = cell.checks
    if not checks.adds_accuracy:
        return checks.clearance
    return checks.clearance + (accuracy(cell, first) or 0.0) + (accuracy(cell, second) or 0.0)
