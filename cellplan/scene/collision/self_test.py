"""Start-up test: pairs of bodies with known distances, as an engine that fails silently reports no contact."""

from functools import cache

import numpy as np

from cellplan.errors import CellplanError, SelfTestError
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Solid, Sphere
from cellplan.geometry.transforms import Array, pose
from cellplan.scene.collision.bodies import BodyPoses, checked_poses, prepare
from cellplan.scene.collision.distance import measure
from cellplan.scene.collision.engine import Engine
from cellplan.scene.collision.overlap.containment import is_inside
from cellplan.scene.collision.separation import heights

DISTANCE_TOL = 1.5e-4  # [m] measured distances may lie below the truth by 0.1 mm

HITS: tuple[tuple[Solid, Solid, float], ...] = (
    (Box((1.0, 1.0, 1.0)), Box((1.0, 1.0, 1.0)), 0.9),
    (Cylinder(0.3, 1.0), Box((1.0, 1.0, 1.0)), 0.7),
    (Capsule(0.1, 1.0), Sphere(0.2), 0.29),
    (tessellate(Box((1.0, 1.0, 1.0))), Cylinder(0.3, 1.0), 0.7),
)
DISTANCES: tuple[tuple[Solid, Solid, float, float], ...] = (
    (Box((1.0, 1.0, 1.0)), Box((1.0, 1.0, 1.0)), 3.0, 2.0),
    (Cylinder(0.3, 1.0), Cylinder(0.2, 0.5), 1.0, 0.5),
    (Capsule(0.1, 1.0), Sphere(0.2), 0.5, 0.2),
    (tessellate(Box((1.0, 1.0, 1.0))), Box((1.0, 1.0, 1.0)), 1.5, 0.5),
)


@cache
def prove_engine() -> None:
    """Ask the engine what is known, once in each process; ``SelfTestError`` where no verdict can be trusted."""
    for first, second, y in HITS:
        engine, poses = _side_by_side(first, second, y)
        _expect(measure(engine, (0, 1), poses, sample=0).touches, f"{_names(first, second)} {y} m apart touch")
    for first, second, y, distance in DISTANCES:
        engine, poses = _side_by_side(first, second, y)
        reading = measure(engine, (0, 1), poses, sample=0)
        right = not reading.touches and distance - DISTANCE_TOL <= reading.bound <= distance + 1e-9
        _expect(right, f"{_names(first, second)} {y} m apart have {distance} m between them")
    engine, poses = _side_by_side(tessellate(Box((1.0, 1.0, 1.0))), Sphere(0.1), 0.0)
    _expect(is_inside(engine, (0, 1), poses, sample=0), "a ball in a closed mesh is inside it")
    _expect(_refuses(np.full((1, 4, 4), np.nan)), "a pose that is not a number is refused")
    _expect(_refuses(2.0 * np.eye(4)[None]), "a scaled rotation is refused")
    R, p = np.eye(3)[None], np.array([[0.0, 0.0, 0.7]])
    above = float(heights(Box((1.0, 1.0, 1.0)), R, p, X_WS=np.eye(4))[0])
    _expect(abs(above - 0.2) < 1e-12, "a box 0.7 m above the floor has 0.2 m below it")


def _side_by_side(first: Solid, second: Solid, y: float) -> tuple[Engine, BodyPoses]:
    """Two bodies, the second moved along y."""
    engine = Engine((prepare("first", first), prepare("second", second)))
    return engine, checked_poses([pose()[None], pose((0.0, y, 0.0))[None]])


def _refuses(X: Array) -> bool:
    try:
        checked_poses([X])
    except CellplanError:
        return True
    return False


def _names(first: Solid, second: Solid) -> str:
    """Kinds of two shapes."""
    return f"{type(first).__name__.lower()} and {type(second).__name__.lower()}"


def _expect(holds: bool, statement: str) -> None:
    """Stop the program when a known statement does not hold."""
    if not holds:
        raise SelfTestError(f"collision engine self-test failed: expected that {statement}; no verdict can be trusted")
