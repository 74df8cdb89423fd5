"""Mounting: penetration depth of bodies that hold, carry or stand on each other, against their limits."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from cellplan.certify.depths import PairDepth, mounted_depths
from cellplan.geometry.transforms import Array
from cellplan.model.report.report import Check
from cellplan.model.units import MM
from cellplan.scene.bodies import Kind, is_ground
from cellplan.scene.grips import closed_gap
from cellplan.scene.mounting import Mount
from cellplan.scene.scene import Scene

DEPTH_TOL: Final = 1e-6  # [m] poses are worked out to less than that: bodies that just touch are not deep
CURES: Final = {
    Mount.GRIP: "is the grasp the right way round? If so deep a grip is intended, state it as depth_mm of the grasp",
    Mount.MOUNT: "is the tool in front of the flange? If contact is permitted, name the pair under checks.exclude",
    Mount.STANDING: "is it placed correctly? Place one on top of the other, or name the pair under checks.exclude",
}
DISPLAY_TOL: Final = 1e-3  # [-] of 0.01 mm: a depth of 3 mm that is worked out as 3.000000001 is shown as 3
FARTHEST_GRIP: Final = 1e-3  # [m] from the part of a body that grips it: what is farther away holds nothing
PIT_CURE: Final = "is there a pit? Place the base on the floor, or name the pair under checks.exclude"


def check_mounting(scene: Scene, q: Array, times: Array | None = None) -> tuple[Check, ...]:
    """Judge the depth of all bodies that hold, carry or stand on each other.

    There is one check for each body that holds the part, and one for each pair beyond its limit; what stands passes in
    one check together.

    Args:
        q: Stacked joint positions in [rad] or [m], shape (N, nq).
        times: Times of the samples in [s], shape (N,); None where there is no motion.
    """
    depths = mounted_depths(scene, q)
    standing = [depth for depth in depths if depth.pair.mount is Mount.STANDING]
    checks = [_check(scene, depth, times) for depth in depths if depth.pair.mount is not Mount.STANDING]
    failed = [_check(scene, depth, times) for depth in standing if not _passed(depth)]
    return (*checks, *(failed or _all_standing(scene, standing, times)))


def _passed(depth: PairDepth) -> bool:
    """Whether a depth is within its limit, apart from rounding."""
    return depth.depth <= depth.pair.limit + DEPTH_TOL


def _check(scene: Scene, mounted: PairDepth, times: Array | None) -> Check:
    pair, (inner, outer) = mounted.pair, _named(scene, mounted)
    depth, limit = MM * mounted.depth if mounted.depth > DEPTH_TOL else 0.0, MM * pair.limit
    at_s = None if times is None or not pair.moves else float(times[mounted.row])
    instant = "" if at_s is None else f" at {at_s:.3f} s"
    share = f" ({limit - MM * pair.accuracy:g} mm beyond the accuracy of its body)" if pair.accuracy else ""
    gap = MM * _gap(scene, mounted)
    if gap > 0.0:
        message = f"{inner} is {gap:.4g} mm away from {outer}: is the gripper open too far?"
    else:
        held = f"is {_shown(depth)} mm deep in {outer}{instant}" if depth > 0.0 else f"does not reach into {outer}"
        message = f"{inner} {held}, allowed {limit:g} mm{share}"
    passed, cure = _passed(mounted), PIT_CURE if is_ground(scene.bodies[pair.second]) else CURES[pair.mount]
    message, value = message if passed else f"{message}: {cure}", -gap if gap > 0.0 else depth
    bodies = f"{inner} - {outer}"
    return Check(str(pair.mount), bodies, passed, message, value=value, limit=limit, unit="mm", at_s=at_s)


def _gap(scene: Scene, depth: PairDepth) -> float:
    """How far in [m] a body that the cell names as gripping is from the part, where that is too far to grip it."""
    if depth.pair.mount is not Mount.GRIP or depth.depth > 0.0:
        return 0.0
    name, _ = _named(scene, depth)
    body = next(body for body in scene.bodies if body.name == name)
    grasp = next((holder for holder in scene.cell.part.held_by if name in (holder.bodies or ())), None)
    gap = 0.0 if grasp is None else closed_gap(scene.cell, body, grasp)
    return gap if gap > FARTHEST_GRIP else 0.0


def _all_standing(scene: Scene, standing: Sequence[PairDepth], times: Array | None) -> list[Check]:
    """One passed check for all that stands, with the deepest; none where nothing stands."""
    if not standing:
        return []
    deepest = max(standing, key=lambda depth: depth.depth)
    check = _check(scene, deepest, times)
    if deepest.depth > DEPTH_TOL:
        return [check]
    limit = MM * deepest.pair.limit
    message = f"no mounted body is deeper in its support than the allowed {limit:g} mm"
    return [replace(check, subject="cell", value=0.0, message=message)]


def _named(scene: Scene, depth: PairDepth) -> tuple[str, str]:
    """The body that reaches into the other, and the other: holders into the part, robots and the part into things."""
    bodies = [scene.bodies[depth.pair.first], scene.bodies[depth.pair.second]]
    hosts = (Kind.PART,) if depth.pair.mount is Mount.GRIP else (Kind.OBSTACLE, Kind.LINK)
    if bodies[0].kind in hosts and bodies[1].kind not in hosts:
        bodies.reverse()
    return bodies[0].name, bodies[1].name


def _shown(depth_mm: float) -> str:
    """A depth rounded up to 0.01 mm, never less than there is; four digits are enough."""
    return f"{abs(math.ceil(100.0 * depth_mm - DISPLAY_TOL)) / 100.0:.4g}"
