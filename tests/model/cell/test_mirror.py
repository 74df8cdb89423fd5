"""Mirror images of parts and tasks: poses are those mirrored by hand, twice is as before, and push stays push."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from builders.roller_paths import EX, EY, EZ, ROLLER, circle, part_of, sampled, task_on

from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.seam_line import SeamAngles
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Mesh, Sphere
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Part
from cellplan.model.cell.mirror import OF_TOOL, mirrored_part, mirrored_task, signs_of
from cellplan.model.task.seam import Seam, WallPlace, Weave, WeaveForm
from cellplan.model.task.task import CirclePath, PlaneName, PolygonPath, RunDirection, SpacePolylinePath, Task
from cellplan.planning.path.build import build_toolpath

BLOCK = part_of(Box((0.6, 0.5, 0.1)), pose((0.05, 0.02, 0.0)))
AXES = np.array([[0.0, 0.0, -1.0], [0.6, 0.0, -0.8], [0.0, 0.6, -0.8], [0.0, 0.0, -1.0]])
POINTS = [[0.0, 0.0, 0.06], [0.05, 0.01, 0.06], [0.1, 0.0, 0.06], [0.15, 0.02, 0.06]]
TURNED = np.array([[[np.cos(t), -np.sin(t), 0], [-np.sin(t), -np.cos(t), 0], [0, 0, -1]] for t in (0, 0.3, 0.5, 0.2)])
RING = CirclePath(
    plane=PlaneName.XY, center=(0.05, 0.02), radius=0.1, start=(0.6, 0.8), direction=RunDirection.CLOCKWISE
)
KITE = PolygonPath(
    plane=PlaneName.XY,
    corners=((0.1, 0.0), (0.0, 0.05), (-0.1, 0.0), (0.0, -0.08)),
    is_closed=True,
    direction=RunDirection.COUNTERCLOCKWISE,
)
LINE = SpacePolylinePath(points=((-0.1, 0.03, 0.05), (0.1, 0.03, 0.05)), is_closed=False)
WEAVE = Weave(form=WeaveForm.SINE, side=0.003, wavelength=0.0077, dwells=(0.001, 0.0005))


def seam(walls: Mapping[str, Any], **angles: Any) -> Seam:
    return Seam(walls=walls, angles=SeamAngles(**({"face": next(iter(walls)), "work": 0.6, "travel": 0.2} | angles)))


TUBE = seam({"plate": EZ, "tube": WallPlace.LEFT}, side=0.002, out=0.003, standoff=0.01)
WORK: dict[str, tuple[Task, Part]] = {
    "tube": (task_on(RING, seam=TUBE, plane_offset=0.05, weave=WEAVE, spin=0.3, turn=0.5), BLOCK),
    "one wall": (task_on(LINE, seam=seam({"floor": EZ}, side=0.002), weave=WEAVE), BLOCK),
    "fillet": (task_on(LINE, seam=seam({"floor": EZ, "web": -EY})), BLOCK),
    "projected": (task_on(circle(0.1), project=EZ, tool_x=np.array([0.6, 0.8, 0.0])), ROLLER),
    "kite": (task_on(KITE, project=EZ), BLOCK),
    "axis": (task_on(KITE, tool_axis=np.array([0.0, 0.6, -0.8]), plane_offset=0.05, blend=0.01), BLOCK),
    "axis in the plane": (task_on(KITE, tool_axis=EY, plane_offset=0.05), BLOCK),
    "file": (task_on(sampled(POINTS, axes=AXES, is_smooth=True), tool_x=EX + EY), BLOCK),
    "rotations": (task_on(sampled(POINTS, rotations=TURNED, is_smooth=True)), BLOCK),
}


def image(X: Array, plane: PlaneName) -> Array:
    S = signs_of(plane)
    mirrored = X.copy()
    mirrored[:, :3, 3] = S * X[:, :3, 3]
    mirrored[:, :3, :3] = S[:, None] * X[:, :3, :3] * OF_TOOL
    return mirrored


@pytest.mark.parametrize("plane", PlaneName)
@pytest.mark.parametrize("name", WORK)
def test_poses_are_those_mirrored_by_hand(name: str, plane: PlaneName) -> None:
    task, part = WORK[name]
    plain = build_toolpath(task, part).spread(211)
    mirrored = build_toolpath(mirrored_task(task, plane), mirrored_part(part, plane)).spread(211)

    assert np.abs(mirrored - image(plain, plane)).max() <= 1e-9


@pytest.mark.parametrize("plane", PlaneName)
@pytest.mark.parametrize("name", WORK)
def test_mirrored_twice_is_as_before(name: str, plane: PlaneName) -> None:
    task, part = WORK[name]
    again = mirrored_task(mirrored_task(task, plane), plane)

    assert np.abs(build_toolpath(again, part).spread(53) - build_toolpath(task, part).spread(53)).max() <= 1e-12


def test_mesh_keeps_its_outside_and_its_volume() -> None:
    part = part_of(tessellate(Sphere(0.1), 12), pose((0.3, 0.2, 0.1)))
    mirrored = mirrored_part(part, PlaneName.YZ)
    assert isinstance(part.shape, Mesh)
    assert isinstance(mirrored.shape, Mesh)

    volumes = [
        float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)
        for a, b, c in (np.moveaxis(it.vertices[it.faces], 1, 0) for it in (part.shape, mirrored.shape))
    ]
    assert volumes[0] == pytest.approx(volumes[1], rel=1e-12)
    assert volumes[0] > 0.0
    assert mirrored.X_PS[:3, 3] == pytest.approx([-0.3, 0.2, 0.1])
