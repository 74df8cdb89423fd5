"""How far the real arm sticks out of the bodies of a robot table: ``python benchmarks/body_accuracy.py --help``.

The meshes of a URDF are placed at the reference configuration of the table, link by link, and compared with
the solids of the table. Printed for each link: the farthest point of the mesh outside all solids and where it is, the
distance within which 95 % of the mesh surface lies, and the same for the surface of the solids outside the convex
hull of the mesh: how much too fat they are. The first column is what ``bodies.accuracy_mm`` of the table promises.

A sister model (another length, the same castings) is measured with ``--castings``: every mesh is moved to the point of
its joint in the table.
"""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import pinocchio as pin
import trimesh
from sections import table

from cellplan.files.robots.joint_table import bundled_names, load_bundled, read_robot_table
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Solid, Sphere
from cellplan.geometry.transforms import Array, inverse, pose_from, rotation_about, transform_points
from cellplan.model.robot.robot import BASE, Body, RobotModel

SPREAD: Final = 20_000  # [-] points on the surface of one mesh
DIRECTIONS: Final = 500  # [-] in which the hull of a mesh is taken
SEED: Final = 7
SEGMENTS: Final = 48  # [-] sides round a cylinder


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkAccuracy:
    """Mesh and solids of one link compared, in [m].

    Attributes:
        link: Name of the joint that carries the link, ``base`` for the foot.
        outside: Distance of the farthest mesh point outside all solids.
        place_B: Where that point is, shape (3,).
        usual: Distance within which 95 % of the mesh surface lies.
        fat: Distance from the hull of the mesh within which 95 % of the surface of the solids lies.
    """

    link: str
    outside: float
    place_B: Array
    usual: float
    fat: float


def distance_to(shape: Solid, points: Array) -> Array:
    """Signed distance of points, shape (N, 3), to a solid in its own frame, negative inside."""
    match shape:
        case Box(size):
            beyond = np.abs(points) - 0.5 * np.asarray(size)
        case Cylinder(radius, length):
            across = np.hypot(points[:, 0], points[:, 1]) - radius
            beyond = np.stack([across, np.abs(points[:, 2]) - 0.5 * length], axis=1)
        case Capsule(radius, length):
            along = np.maximum(np.abs(points[:, 2]) - 0.5 * length, 0.0)
            return np.asarray(np.linalg.norm(np.column_stack([points[:, :2], along]), axis=1) - radius)
        case Sphere(radius):
            return np.asarray(np.linalg.norm(points, axis=1) - radius)
        case _:
            raise TypeError(f"expected a box, cylinder, capsule or ball, got {type(shape).__name__}")
    outside: Array = np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)
    return outside


def surface_points(triangles: Array, count: int) -> Array:
    """Points spread evenly over triangles of shape (M, 3, 3), shape (count, 3)."""
    rng = np.random.default_rng(SEED)
    a, b, c = np.moveaxis(triangles, 1, 0)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    chosen = triangles[rng.choice(len(triangles), size=count, p=areas / areas.sum())]
    return np.asarray(np.einsum("nij,ni->nj", chosen, rng.dirichlet(np.ones(3), size=count)))


def skin_points(body: Body, count: int) -> Array:
    """Corners of a body and points spread over its surface, in B at the reference configuration, shape (N, 3)."""
    mesh = tessellate(body.shape, SEGMENTS)
    spread = surface_points(mesh.vertices[mesh.faces], count)
    return np.asarray(transform_points(body.X_BS, np.concatenate([mesh.vertices, spread])))


def mesh_points(
    urdf: Path,
    model: RobotModel,
    *,
    turn: float = 0.0,
    is_moved: bool = False,
    is_visual: bool = False,
    count: int = SPREAD,
) -> dict[int, Array]:
    """Points on the meshes of each link of a URDF, in B of the table at its reference configuration.

    Args:
        urdf: The file; its joints read zero where those of the table do. Packages are looked up in the folders above.
        model: The robot of the table.
        turn: Angle in [rad] about z from the base of the URDF to that of the table.
        is_moved: Whether each mesh is moved to the point of its joint in the table.
        count: Points spread over each mesh, beside its vertices.
        is_visual: Whether the meshes for pictures are taken, not those for collisions, which are often hulls.
    """
    kinematics = pin.buildModelFromUrdf(str(urdf))
    folders = [str(folder) for folder in urdf.resolve().parents]
    kind = pin.GeometryType.VISUAL if is_visual else pin.GeometryType.COLLISION
    shapes = pin.buildGeomFromUrdf(kinematics, str(urdf), kind, package_dirs=folders)
    data, places = kinematics.createData(), shapes.createData()
    pin.forwardKinematics(kinematics, data, pin.neutral(kinematics))
    pin.updateGeometryPlacements(kinematics, data, shapes, places)
    X = pose_from(rotation_about(np.array([0.0, 0.0, 1.0]), turn), np.zeros(3))
    results: dict[int, list[Array]] = {}
    for shape, place in zip(shapes.geometryObjects, places.oMg, strict=True):
        link = shape.parentJoint - 1
        if link >= len(model.joints) or not Path(shape.meshPath).is_file() or "hand" in shape.name:
            continue  # a gripper
        mesh = trimesh.load(shape.meshPath, force="mesh")
        spread = np.concatenate([mesh.vertices, surface_points(np.asarray(mesh.triangles), count)])
        points = transform_points(X @ place.homogeneous, spread * shape.meshScale)
        if is_moved and link != BASE:
            points = points + model.joints[link].point_B - X[:3, :3] @ data.oMi[link + 1].translation
        results.setdefault(link, []).append(points)
    return {link: np.concatenate(parts) for link, parts in results.items()}


def compare(model: RobotModel, points_B: dict[int, Array]) -> list[LinkAccuracy]:
    """Each link of a table compared with points on its mesh in B at the reference configuration."""
    directions = np.random.default_rng(SEED).normal(size=(DIRECTIONS, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    results = []
    for link, points in sorted(points_B.items()):
        solids = [body for body in model.bodies if body.link == link]
        distances = [distance_to(body.shape, transform_points(inverse(body.X_BS), points)) for body in solids]
        missed = np.maximum(np.min(distances, axis=0), 0.0)
        hull = (points @ directions.T).max(axis=0)
        skin = np.concatenate([skin_points(body, SPREAD // 10) for body in solids])
        beyond = np.maximum((skin @ directions.T - hull).max(axis=1), 0.0)
        results.append(
            LinkAccuracy(
                link="base" if link == BASE else model.joints[link].name,
                outside=float(missed.max()),
                place_B=points[int(np.argmax(missed))],
                usual=float(np.percentile(missed, 95)),
                fat=float(np.percentile(beyond, 95)),
            )
        )
    return results


def main(arguments: list[str]) -> None:
    """Print the comparison."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robot", help="a bundled robot, or a joint-axis table (.yaml)")
    parser.add_argument("urdf", type=Path, help="the same robot with meshes")
    parser.add_argument("--turn-deg", type=float, default=0.0, help="about z, from the URDF's base to the table's")
    parser.add_argument("--castings", action="store_true", help="move each mesh to its joint in the table")
    parser.add_argument("--visual", action="store_true", help="take the meshes for pictures, not those for collisions")
    chosen: Any = parser.parse_args(arguments)
    is_bundled = chosen.robot in bundled_names()
    model = load_bundled(chosen.robot) if is_bundled else read_robot_table(Path(chosen.robot))
    points_B = mesh_points(
        chosen.urdf,
        model,
        turn=np.radians(chosen.turn_deg),
        is_moved=chosen.castings,
        is_visual=chosen.visual,
    )
    rows = compare(model, points_B)
    head = ["link", "farthest outside [mm]", "at [mm]", "95 % within [mm]", "95 % of the solids within [mm]"]
    lines = [
        [row.link, f"{1e3 * row.outside:.1f}", np.array2string(1e3 * row.place_B, precision=0), *_in_mm(row)]
        for row in rows
    ]
    print("\n".join(table(head, lines)))
    print(f"\nlargest: {1e3 * max(row.outside for row in rows):.1f} mm")


def _in_mm(row: LinkAccuracy) -> list[str]:
    """The two last columns."""
    return [f"{1e3 * row.usual:.1f}", f"{1e3 * row.fat:.1f}"]


if __name__ == "__main__":
    main(sys.argv[1:])
