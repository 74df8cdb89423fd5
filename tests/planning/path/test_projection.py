"""Paths on meshes are those of the shapes they stand for, and steps are edges."""

import numpy as np
import pytest
from builders.roller_paths import ALONG_X, CYLINDER, EZ, ON_ROLLER, ROLLER, circle, part_of, task_on

from cellplan.errors import InputError
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Mesh
from cellplan.planning.path.build import build_toolpath


@pytest.mark.parametrize("name", ON_ROLLER)
def test_a_fine_mesh_gives_the_path_of_the_closed_form(name: str) -> None:
    fine = part_of(tessellate(CYLINDER, 256), ALONG_X)
    exact, path = build_toolpath(ON_ROLLER[name], ROLLER), build_toolpath(ON_ROLLER[name], fine)
    shares = np.linspace(0.0, 1.0, 301)

    X, Y = exact.poses(shares * exact.length), path.poses(shares * path.length)

    sagitta = 0.25 * (1.0 / np.cos(np.pi / 256) - 1.0)  # the mesh stands round the cylinder
    assert len(path.pieces) == len(exact.pieces)
    assert np.abs(X - Y)[:, :3, 3].max() <= 1.1 * sagitta
    assert np.abs(X - Y)[:, :3, :3].max() <= 1e-4  # interpolated normals: far less than the facets' 0.7 deg
    assert path.length == pytest.approx(exact.length, rel=1e-4)


def test_twists_on_a_mesh_are_the_derivative_of_its_poses() -> None:
    path = build_toolpath(ON_ROLLER["circle"], part_of(tessellate(CYLINDER, 64), ALONG_X))
    knots = path.arc.behind_knots(path.tip.knots)
    s = 0.5 * (knots[1:] + knots[:-1])
    h = 0.05 * np.diff(knots).min()

    above, below = path.poses(s + h), path.poses(s - h)
    linear = (above - below)[:, :3, 3] / (2.0 * h)

    assert np.abs(linear - path.pieces[0].twists_per_length(s)[:, :3]).max() <= 1e-3  # strong curvature at the facets


def test_a_mesh_of_a_box_behaves_like_the_box() -> None:
    block = Box((0.4, 0.4, 0.4))
    task = task_on(circle(0.1, center=(0.05, -0.02)), project=EZ)

    exact, path = build_toolpath(task, part_of(block)), build_toolpath(task, part_of(tessellate(block)))
    shares = np.linspace(0.0, 1.0, 97)

    assert np.abs(exact.poses(shares * exact.length) - path.poses(shares * path.length)).max() <= 1e-9


def stair() -> Mesh:
    """Two blocks side by side, the second 50 mm higher."""
    low, high = tessellate(Box((0.2, 0.2, 0.1))), tessellate(Box((0.2, 0.2, 0.2)))
    vertices = np.vstack([low.vertices, high.vertices + np.array([0.2, 0.0, 0.05])])
    return Mesh(
        vertices=vertices, faces=np.vstack([low.faces, high.faces + len(low.vertices)]), source="stair", is_closed=True
    )


def test_a_step_between_parallel_faces_of_a_mesh_is_an_edge() -> None:
    with pytest.raises(InputError, match=r"runs over an edge at \((100|99\.\d+|100\.\d+), "):
        build_toolpath(task_on(circle(0.05, center=(0.1, 0.0)), project=EZ), part_of(stair()))
