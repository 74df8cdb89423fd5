"""What is watched of the flange and tool of a further holder: all that lies outside the zone in which it grips."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.shapes import HalfSpace
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.cell import Cell, Grasp
from cellplan.model.units import MM
from cellplan.scene.bodies import SceneBody, part_body
from cellplan.scene.collision.bodies import BodyPoses, CollisionBody, prepare
from cellplan.scene.collision.engine import Engine
from cellplan.scene.collision.overlap.contact_zone import outside_grip
from cellplan.scene.collision.overlap.containment import is_inside
from cellplan.scene.collision.overlap.depth import overlap_depth
from cellplan.scene.pairs import Rule

GRIP_TOL: Final = 1e-4  # [m] by which the face of a grip may lie deeper than the grip: what counts there is its depth
COMPONENT_COUNT: Final = 6  # [-] components of a grasp that leaves nothing open
RIGID: Final = "checked for contact only: rigidly attached to a flange that holds the part"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GripWatch:
    """What is demanded of a further holder's body and the part."""

    rule: Rule  # what is demanded
    reason: str  # why less than the full distance is
    is_whole: bool  # whether the whole body is watched
    outside: CollisionBody | None  # what of it is watched otherwise; None when nothing is


def grip_watch(cell: Cell, body: SceneBody, grasp: Grasp) -> GripWatch:
    """The surface of a co-holder's body that must not touch the part.

    The first holder carries the part, and of what is rigid with its flange only the depth is judged. A further one may
    touch the part near its tool tip, and with the face in the plane of the tip; everything behind is watched at every
    instant, whether the grasp leaves axes free or not. A body that is too deep in the part by its grasp is not watched
    as well: its depth fails the cell, and no start could be found.

    ``InputError`` where by a grasp that leaves no axis free the body touches the part elsewhere.
    """
    if isinstance(body.shape, HalfSpace):  # no tool is one
        return GripWatch(rule=Rule.CONTACT, reason=RIGID, is_whole=False, outside=None)
    robot, zone = cell.robot(grasp.robot), cell.checks.contact_zone_mm.si
    X_ST = inverse(body.X_BS) @ robot.model.X_BF @ robot.tool.X_FT
    surface, is_in_zone = outside_grip(body.shape, X_ST, radius=zone, layer=grasp.depth + GRIP_TOL)
    watched = prepare(body.name, body.shape if surface is None or not is_in_zone else surface)
    outside = watched if is_in_zone and surface is not None else None
    if len(grasp.axes) == COMPONENT_COUNT and (outside is not None or not is_in_zone):
        if closed_depth(cell, body, grasp) > grasp.depth:
            outside, is_in_zone = None, True
        else:
            _require_free(cell, body, grasp, watched)
    if not is_in_zone:
        return GripWatch(rule=Rule.CONTACT, reason=RIGID, is_whole=True, outside=None)
    reason = (
        f"grips the part: may touch within {MM * zone:g} mm of the tool tip and with the face at the tip, at most "
        f"{MM * grasp.depth:g} mm deep; checked for contact behind it"
    )
    return GripWatch(rule=Rule.GRIP, reason=reason, is_whole=False, outside=outside)


def closed_depth(cell: Cell, body: SceneBody, grasp: Grasp) -> float:
    """How deep a body of a holder is in the part in [m] where its tool stands on the part just as the grasp says."""
    solid = prepare(body.name, body.shape)  # type: ignore[arg-type] # no half-space
    engine, poses = _gripped(cell, body, grasp, solid)
    return overlap_depth(engine, (0, 1), poses, sample=0)


def closed_gap(cell: Cell, body: SceneBody, grasp: Grasp) -> float:
    """How far in [m] a body of a holder that is not in the part is from it, where its tool stands as the grasp says."""
    solid = prepare(body.name, body.shape)  # type: ignore[arg-type] # no half-space
    engine, poses = _gripped(cell, body, grasp, solid)
    return 0.0 if engine.touch(0, 1, poses, sample=0) else engine.surface_distance(0, 1, poses, sample=0)


def _require_free(cell: Cell, body: SceneBody, grasp: Grasp, outside: CollisionBody) -> None:
    """Refuse a grasp by which what lies outside the zone touches the part."""
    engine, poses = _gripped(cell, body, grasp, outside)
    if engine.touch(0, 1, poses, sample=0) or is_inside(engine, (0, 1), poses, sample=0):
        number = cell.positioners.index(grasp.robot)
        zone = cell.checks.contact_zone_mm
        raise InputError(
            f"{cell.origin.at(f'part.held_by[{number}].at')}: expected '{grasp.robot}' to touch the part near its tool "
            f"tip (checks.contact_zone_mm = {zone:g}) or with the face at the tip, got {body.name} that touches it "
            "elsewhere: is the grasp the right way round? If so permitted, name the pair under checks.exclude"
        )


def _gripped(cell: Cell, body: SceneBody, grasp: Grasp, solid: CollisionBody) -> tuple[Engine, BodyPoses]:
    """A solid of the holder and the part, where the closed grasp has them, seen from the holder's base."""
    part = part_body(cell, cell.part, grasp)
    engine = Engine([solid, prepare(part.name, part.shape)])  # type: ignore[arg-type] # no half-space
    X: Array = np.stack([body.X_BS, part.X_BS])
    return engine, BodyPoses(X[:, None, :3, :3], X[:, None, :3, 3])
