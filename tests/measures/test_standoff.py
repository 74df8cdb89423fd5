"""Distances of a tool tip from a part against closed forms, at chosen poses and at random ones."""

import numpy as np
import pytest
from builders.scene_builders import work
from builders.tool_over_part import DOWN, PEN, tool_over_part

from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Cylinder, Mesh, Solid, Sphere
from cellplan.geometry.transforms import Array, pose
from cellplan.measures.standoff import standoff_on
from cellplan.model.report.report import Standoff

PLATE = Box((0.2, 0.2, 0.02))


def standoff_at(X_PT: Array, part: Solid) -> Standoff:
    cell = tool_over_part(PEN, part, work("gun"))
    return standoff_on(cell, cell.tasks[0], X_PT[None])


@pytest.mark.parametrize("part", [PLATE, tessellate(PLATE)])
@pytest.mark.parametrize(
    ("point", "rpy", "nearest", "along"),
    [
        ((0.0, 0.0, 0.01), DOWN, 0.0, 0.0),
        ((0.0, 0.0, 0.07), DOWN, 0.06, 0.06),
        ((0.0, 0.0, 0.005), DOWN, 0.0, 0.0),  # inside: its depth is another check
        ((0.16, 0.0, 0.0), DOWN, 0.06, np.inf),  # beside the edge, looking past it
        ((0.11, 0.0, 0.01), (0.0, -3 * np.pi / 4, 0.0), 0.01, 0.01 * np.sqrt(2.0)),  # 10 mm beside it, at 45 deg to it
        ((0.0, 0.0, 0.05), (np.pi + np.pi / 3, 0.0, 0.0), 0.04, 0.08),  # leaning by 60 deg
        ((0.0, 0.0, 0.07), (0.0, 0.0, 0.0), 0.06, np.inf),  # looking away
    ],
)
def test_both_distances_are_those_of_the_closed_form(
    part: Solid, point: tuple[float, ...], rpy: tuple[float, float, float], nearest: float, along: float
) -> None:
    standoff = standoff_at(pose(point, rpy), part)

    assert standoff.worst_nearest == pytest.approx(nearest, abs=6e-5)
    assert standoff.worst_along == pytest.approx(along, abs=1e-9)


@pytest.mark.parametrize("part", [Sphere(0.05), Cylinder(0.05, 0.02), tessellate(Cylinder(0.05, 0.02), 96)])
def test_round_parts_are_as_far_as_their_surface(part: Solid) -> None:
    standoff = standoff_at(pose((0.08, 0.0, 0.0), (0.0, -np.pi / 2, 0.0)), part)

    sagitta = 0.05 * (1.0 / np.cos(np.pi / 96) - 1.0) if isinstance(part, Mesh) else 0.0
    assert standoff.worst_nearest == pytest.approx(0.03, abs=6e-5 + sagitta)
    assert standoff.worst_along == pytest.approx(0.03, abs=1e-9 + sagitta)


def test_distances_from_a_plate_are_those_of_its_slabs_at_random_poses() -> None:
    """The nearest point by clamping to the box; the point ahead by the interval in which a line is inside all slabs."""
    generator, half = np.random.default_rng(8), 0.5 * np.array(PLATE.size)
    for _ in range(60):
        X_PT = pose(generator.uniform(-0.15, 0.15, 3), generator.uniform(-3.0, 3.0, 3))
        tip, axis = X_PT[:3, 3], X_PT[:3, 2]
        crossings = np.sort([(-half - tip) / axis, (half - tip) / axis], axis=0)
        enter, leave = crossings[0].max(), crossings[1].min()
        ahead = max(enter, 0.0) if enter < leave and leave > 0.0 else np.inf

        standoff = standoff_at(X_PT, PLATE)

        assert standoff.worst_along == pytest.approx(ahead, abs=1e-9)
        assert standoff.worst_nearest == pytest.approx(np.linalg.norm(tip - np.clip(tip, -half, half)), abs=6e-5)
