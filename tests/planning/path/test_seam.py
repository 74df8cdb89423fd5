"""Tools follow the walls beside their paths: closed forms, derivatives, and what does not stand beside a path."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from builders.roller_paths import EX, EY, EZ, ROLLER, circle, part_of, residual_of_twists, task_on

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.seam_line import SeamAngles, SeamLine
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Cylinder
from cellplan.model.task.seam import Seam, WallPlace
from cellplan.model.task.task import SpacePolylinePath, Task
from cellplan.model.task.toolpath import Toolpath
from cellplan.planning.path.build import build_toolpath

PLATE = part_of(Box((0.6, 0.6, 0.1)))
TUBE = {"plate": EZ, "tube": WallPlace.LEFT}  # of a circle that runs round counter-clockwise
TILT = 45.0


def on(path: Any, walls: dict[str, Any], *, work: float = TILT, travel: float = 0.0, **words: Any) -> Task:
    stand = words.pop("standoff", 0.0)
    angles = SeamAngles(face=next(iter(walls)), work=np.deg2rad(work), travel=np.deg2rad(travel), standoff=stand)
    return task_on(path, seam=Seam(walls=walls, angles=angles), **words)


def radial(X: Array) -> tuple[Array, Array]:
    outward = X[:, :3, 3] * np.array([1.0, 1.0, 0.0])
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    return outward, np.cross(EZ, outward)


@pytest.mark.parametrize("travel", [0.0, 15.0, -20.0])
def test_fillet_round_a_tube_has_its_bisector_everywhere(travel: float) -> None:
    path = build_toolpath(on(circle(), TUBE, travel=travel, plane_offset=0.05), PLATE)
    X = path.spread(301)
    outward, along = radial(X)
    v = np.deg2rad(travel)
    axes = -np.cos(v) * np.sqrt(0.5) * (EZ + outward) + np.sin(v) * along

    assert np.abs(X[:, :3, 2] - axes).max() <= 1e-12
    assert np.abs(np.linalg.norm(X[:, :2, 3], axis=1) - 0.1).max() <= 1e-15


def test_standoff_makes_a_smaller_circle_above_a_fillet_inside_a_ring() -> None:
    inside = {"plate": EZ, "ring": WallPlace.RIGHT}
    path = build_toolpath(on(circle(), inside, standoff=0.012, plane_offset=0.05), PLATE)
    X = path.spread(301)

    assert np.abs(np.linalg.norm(X[:, :2, 3], axis=1) - (0.1 - 0.012 * np.sqrt(0.5))).max() <= 1e-8
    assert np.abs(X[:, 2, 3] - (0.05 + 0.012 * np.sqrt(0.5))).max() <= 1e-8


def seams() -> dict[str, Callable[[], Toolpath]]:
    dome = {"surface": WallPlace.SURFACE}
    rough = lambda: part_of(tessellate(Cylinder(0.25, 0.5), 400), ROLLER.X_PS)  # noqa: E731
    line = SpacePolylinePath(points=((-0.1, 0.0, 0.05), (0.1, 0.0, 0.05), (0.1, 0.1, 0.05)), is_closed=False)
    return {
        "circle": lambda: build_toolpath(on(circle(), TUBE, travel=15.0, standoff=0.01), PLATE),
        "projected": lambda: build_toolpath(on(circle(), dome, work=10.0, travel=20.0, project=EZ), ROLLER),
        "projected, small": lambda: build_toolpath(on(circle(0.04), dome, work=10.0, travel=-20.0, project=EZ), ROLLER),
        "projected, off": lambda: build_toolpath(on(circle(), dome, work=10.0, standoff=0.02, project=EZ), ROLLER),
        "mesh": lambda: build_toolpath(on(circle(0.04), dome, work=10.0, travel=-20.0, project=EZ), rough()),
        "rounded corner": lambda: build_toolpath(on(line, TUBE, travel=10.0, blend=0.02, standoff=0.01), PLATE),
    }


@pytest.mark.parametrize("kind", ["circle", "projected", "projected, off", "rounded corner"])
def test_twists_are_the_derivatives_of_poses(kind: str) -> None:
    assert residual_of_twists(seams()[kind]()) <= 2e-6


def test_tool_on_a_fine_mesh_is_held_as_on_the_smooth_surface() -> None:
    mesh, smooth = (seams()[kind]().spread(201)[:, :3, 2] for kind in ("mesh", "projected, small"))

    assert np.abs(mesh - smooth).max() <= np.deg2rad(1.0)  # facets of 0.9 deg


def test_projected_tool_keeps_its_angles_to_the_surface() -> None:
    path = seams()["projected"]()
    X = path.spread(201)
    normals = X[:, :3, 3] * np.array([0.0, 1.0, 1.0]) / 0.25
    s = np.linspace(0.0, path.length, 201)[1:-1]
    twists = path.targets(np.zeros(len(s), dtype=int), s)[1]

    assert np.allclose(np.sum(X[:, :3, 2] * normals, axis=1), -np.cos(np.deg2rad(10.0)) * np.cos(np.deg2rad(20.0)))
    assert np.allclose(np.sum(X[1:-1, :3, 2] * twists[:, :3], axis=1), np.sin(np.deg2rad(20.0)))


def test_corner_at_which_the_tool_would_jump_is_refused_with_its_cure() -> None:
    line = SpacePolylinePath(points=((-0.1, 0.0, 0.05), (0.1, 0.0, 0.05), (0.1, 0.1, 0.05)), is_closed=False)
    with pytest.raises(InputError, match=r"cell.yaml:14: tasks.ring.path: .*\(100, 0, 50\) mm it would turn by 60 deg"):
        build_toolpath(on(line, TUBE), PLATE)

    upright = build_toolpath(on(line, {"plate": EZ}, work=0.0), PLATE)
    assert len(upright.pieces) == 2


def test_wall_that_a_path_runs_into_is_refused() -> None:
    line = SpacePolylinePath(points=((-0.1, 0.0, 0.05), (0.1, 0.0, 0.05)), is_closed=False)
    with pytest.raises(InputError, match=r"tasks.ring.path.walls.web: .* runs into it at 90 deg; give left or right"):
        build_toolpath(on(line, {"floor": EZ, "web": EX}), PLATE)


def arc_line(count: int = 65) -> SeamLine:
    """A quarter turn of radius 0.1 m that goes on from a straight side, then a stop and a side along +y."""
    a = np.linspace(0.0, np.pi / 2.0, count)[1:]
    points = np.vstack(
        [[[-0.1, -0.1, 0.0], [0.0, -0.1, 0.0]], np.stack([0.1 * np.sin(a), -0.1 * np.cos(a), 0.0 * a], axis=1)]
    )
    tangents = np.vstack([[EX, EX], np.stack([np.cos(a), np.sin(a), 0.0 * a], axis=1)])
    behind = np.concatenate([[0.0, 0.1], 0.1 + 0.1 * a])
    web = np.vstack([[-EY, -EY], np.stack([np.sin(a), -np.cos(a), 0.0 * a], axis=1)])
    return SeamLine(
        source="weld",
        points=np.vstack([points, points[-1:], points[-1:] + 0.05 * EY]),
        tangents=np.vstack([tangents, [EY, EY]]),
        behind=np.concatenate([behind, behind[-1:], behind[-1:] + 0.05]),
        walls={"floor": np.tile(EZ, (count + 3, 1)), "web": np.vstack([web, [EX, EX]])},
        is_closed=False,
    )


def test_seam_line_lies_on_its_arc_between_its_points_and_stops_where_a_point_stands_twice() -> None:
    line = arc_line()
    path = build_toolpath(task_on(line, seam=Seam(walls={}, angles=SeamAngles(face="floor", work=0.5))), PLATE)
    s = 0.1 + np.linspace(0.0, 0.1 * np.pi / 2.0, 400)
    X = path.poses(s)
    a = (s - 0.1) / 0.1
    outward = np.stack([np.sin(a), -np.cos(a), 0.0 * a], axis=1)

    assert path.length == pytest.approx(0.15 + 0.1 * np.pi / 2.0, abs=1e-10)
    assert path.behind == pytest.approx([0.0, 0.1 + 0.1 * np.pi / 2.0, path.length], abs=1e-10)
    assert np.abs(X[:, :3, 3] - 0.1 * outward).max() <= 1e-9
    assert np.abs(X[:, :3, 2] + np.cos(0.5) * EZ + np.sin(0.5) * outward).max() <= 1e-4  # by normals at 65 points
    assert residual_of_twists(path) <= 1e-5


def test_rounding_the_corners_of_a_seam_line_is_refused() -> None:
    seam = Seam(walls={}, angles=SeamAngles(face="floor"))
    with pytest.raises(InputError, match=r"cell.yaml:30: motion.corners: expected stop for a chain of edges"):
        build_toolpath(task_on(arc_line(), seam=seam, blend=0.005), PLATE)
