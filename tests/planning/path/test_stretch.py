"""Stretches of paths: where they begin and end, which way they run, and how the tool is held meanwhile."""

from typing import Any

import numpy as np
import pytest
from builders.roller_paths import EX, EY, EZ, ROLLER, circle, part_of, residual_of_twists, sampled, task_on
from hypothesis import given, settings
from hypothesis import strategies as st

from cellplan.errors import InputError
from cellplan.geometry.curves.seam_line import SeamAngles
from cellplan.geometry.shapes import Box
from cellplan.model.task.seam import Seam, Stretch, WallPlace
from cellplan.model.task.task import SpacePolylinePath, Task
from cellplan.planning.path.build import build_toolpath

PLATE = part_of(Box((0.6, 0.6, 0.1)))
LINE = SpacePolylinePath(points=((-0.1, 0.0, 0.05), (0.1, 0.0, 0.05)), is_closed=False)
ROUND = 0.2 * np.pi


def on(path: Any, walls: dict[str, Any], stretch: Stretch | None = None, **words: Any) -> Task:
    angles = {"face": next(iter(walls)), "work": 0.6, "travel": 0.2} | words
    return task_on(path, seam=Seam(walls=walls, angles=SeamAngles(**angles)), stretch=stretch, plane_offset=0.05)


FILLET = {"floor": EZ, "web": -EY}
TUBE = {"plate": EZ, "tube": WallPlace.LEFT}


@settings(max_examples=25)
@given(begin=st.floats(0.0, 0.09), more=st.floats(0.01, 0.1), is_reversed=st.booleans())
def test_stretch_of_a_line_lies_between_its_lengths(begin: float, more: float, is_reversed: bool) -> None:
    stretch = Stretch(begin=begin, end=begin + more, is_reversed=is_reversed)
    path = build_toolpath(on(LINE, FILLET, stretch), PLATE)
    x = path.spread(3)[:, 0, 3]
    ends = [begin - 0.1, begin + more - 0.1]

    assert path.length == pytest.approx(more, abs=1e-12)
    assert x[[0, 2]] == pytest.approx(ends[::-1] if is_reversed else ends, abs=1e-12)


@pytest.mark.parametrize(("line", "walls"), [(LINE, FILLET), (circle(), TUBE)])
def test_reversed_seam_has_its_walls_where_they_are_and_still_pushes(line: Any, walls: dict[str, Any]) -> None:
    there, back = (build_toolpath(on(line, walls, Stretch(is_reversed=it)), PLATE) for it in (False, True))
    one, other = there.spread(101), back.spread(101)[::-1]
    s = np.linspace(0.0, there.length, 101)
    travel = there.targets(np.zeros(101, dtype=int), s)[1][:, :3]

    assert np.abs(one[:, :3, 3] - other[:, :3, 3]).max() <= 1e-12
    off = other[:, :3, 2] - one[:, :3, 2]
    assert np.abs(off + 2.0 * np.sin(0.2) * travel).max() <= 1e-9


def test_closed_seam_goes_on_smoothly_past_its_start() -> None:
    path = build_toolpath(on(circle(), TUBE, Stretch(overlap=0.03)), PLATE)
    X = path.poses(np.array([0.02, ROUND + 0.02]))

    assert path.length == pytest.approx(ROUND + 0.03, abs=1e-12)
    assert len(path.pieces) == 1
    assert not path.is_closed
    assert np.abs(X[0] - X[1]).max() <= 1e-9
    assert residual_of_twists(path) <= 2e-6


def test_reversed_seam_overlaps_the_other_way_round() -> None:
    path = build_toolpath(on(circle(), TUBE, Stretch(overlap=0.03, is_reversed=True)), PLATE)
    X = path.poses(np.array([0.0, 0.02, ROUND + 0.02]))

    assert X[0, :3, 3] == pytest.approx([0.1, 0.0, 0.05], abs=1e-12)
    assert X[1, 1, 3] < 0.0
    assert np.abs(X[1] - X[2]).max() <= 1e-9


def test_tool_goes_back_at_the_end_held_as_it_came() -> None:
    path = build_toolpath(on(LINE, FILLET, Stretch(back=0.004)), PLATE)
    X = path.poses(np.array([0.196, 0.2, 0.204]))

    assert path.behind == pytest.approx([0.0, 0.2, 0.204], abs=1e-12)
    assert X[:, 0, 3] == pytest.approx([0.096, 0.1, 0.096], abs=1e-12)
    assert np.abs(X[:, :3, :3] - X[0, :3, :3]).max() <= 1e-15


@pytest.mark.parametrize("kind", ["projected", "file", "rotations"])
def test_paths_of_every_kind_have_stretches(kind: str) -> None:
    stretch = Stretch(begin=0.02, end=0.1, is_reversed=True, back=0.01)
    points = [[0.0, 0.0, 0.05], [0.05, 0.01, 0.05], [0.1, 0.0, 0.05], [0.15, 0.02, 0.05]]
    axes = np.array([[0.0, 0.0, -1.0], [0.6, 0.0, -0.8], [0.0, 0.6, -0.8], [0.0, 0.0, -1.0]])
    a = np.array([0.0, 0.3, 0.5, 0.2])
    turned = np.array([[[np.cos(t), -np.sin(t), 0], [-np.sin(t), -np.cos(t), 0], [0, 0, -1]] for t in a])
    task, part = {
        "projected": (task_on(circle(), project=EZ, stretch=stretch), ROLLER),
        "file": (task_on(sampled(points, axes=axes, is_smooth=True), stretch=stretch), PLATE),
        "rotations": (task_on(sampled(points, rotations=turned, is_smooth=True), stretch=stretch), PLATE),
    }[kind]
    path, whole = build_toolpath(task, part), build_toolpath(task_on(task.path, project=task.project), part)

    assert path.length == pytest.approx(0.09, abs=1e-10)
    assert np.abs(path.poses(np.linspace(0.0, 0.08, 33)) - whole.poses(np.linspace(0.1, 0.02, 33))).max() <= 1e-9
    assert residual_of_twists(path) <= 2e-4


@pytest.mark.parametrize(
    ("stretch", "message"),
    [
        (Stretch(end=0.3), r"tasks.ring.path.to_mm: expected at most 200 mm, the length of the path, got 300"),
        (Stretch(begin=0.3), r"tasks.ring.path.from_mm: expected at most 200 mm, the length of the path, got 300"),
        (Stretch(begin=0.2), r"tasks.ring.path.from_mm: expected an end behind the begin, got 200 to 200 mm of 200 mm"),
        (Stretch(overlap=0.01), r"tasks.ring.path.overlap_mm: expected a closed path, got one with two ends"),
        (Stretch(back=0.3), r"tasks.ring.path.back_mm: expected at most 200 mm, the length of the path, got 300"),
    ],
)
def test_stretches_that_are_not_on_the_path_are_refused(stretch: Stretch, message: str) -> None:
    with pytest.raises(InputError, match=message):
        build_toolpath(on(LINE, FILLET, stretch), PLATE)


@pytest.mark.parametrize(("toward", "across"), [(None, 1.0), ("web", 1.0), ("floor", -1.0)])
def test_passes_of_a_fillet_lie_across_its_weld_face_and_out_of_it(toward: str | None, across: float) -> None:
    root = np.sqrt(0.5)
    words = {"travel": 0.0, "side": 0.003, "out": 0.005, "toward": toward}
    p = build_toolpath(on(LINE, FILLET, **words), PLATE).spread(5)[:, :3, 3]
    expected = 0.005 * root * (EZ - EY) + across * 0.003 * root * (EY + EZ)  # up the web is towards it

    assert np.abs(p - np.linspace(-0.1, 0.1, 5)[:, None] * EX - 0.05 * EZ - expected).max() <= 1e-12


def test_pass_beside_one_wall_is_positive_to_the_left() -> None:
    p = build_toolpath(on(LINE, {"floor": EZ}, side=0.003, out=0.002, travel=0.0), PLATE).spread(3)[:, :3, 3]

    assert np.abs(p[:, 1:] - [0.003, 0.052]).max() <= 1e-12
