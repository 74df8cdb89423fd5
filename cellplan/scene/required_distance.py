"""What distance is demanded of a pair of bodies."""

from cellplan.model.cell import CheckSettings
from cellplan.scene.bodies import SceneBody


def demand(checks: CheckSettings, first: SceneBody, second: SceneBody) -> float:
    """Demanded distance of a pair in [m]: the cell's clearance, and the accuracy of both bodies where it is added."""
    if not checks.adds_accuracy:
        return checks.clearance
    return checks.clearance + (first.accuracy or 0.0) + (second.accuracy or 0.0)
