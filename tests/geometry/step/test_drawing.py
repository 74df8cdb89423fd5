"""Edges of STEP solids against closed forms, and seams of assemblies: none missed, none false."""

from collections.abc import Iterator
from itertools import pairwise, product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from builders.roller_paths import part_of, task_on
from builders.step_files import Named, box, cut, cylinder, frustum, moved, write_step

from cellplan.geometry.curves.seam_line import SeamAngles, SeamLine
from cellplan.geometry.shapes import Box
from cellplan.geometry.step.drawing import StepDrawing, StepEdge, read_drawing
from cellplan.geometry.step.lines import chain, cut_line, reversed_line, started_near
from cellplan.geometry.transforms import Array, pose
from cellplan.model.task.seam import Seam
from cellplan.planning.path.build import build_toolpath

PART = part_of(Box((1.0, 1.0, 1.0)))
QUICK = 10  # case of which a part is run among the quick tests
MOST_OFF = 1e-6  # [m]
MOST_LEANING = np.deg2rad(1e-6)  # [rad]


def drawing(folder: Path, parts: list[Named], gap: float = 0.0) -> StepDrawing:
    return read_drawing(write_step(folder / "a.step", parts), "a.step", None, gap)


class Circle(NamedTuple):
    """A circular edge in [m]: centre, axis, radius, and normals of its walls as shares of axis and radius."""

    centre: Array
    axis: Array
    radius: float
    walls: tuple[tuple[float, float], tuple[float, float]]


def axes(seed: int) -> Array:
    """A rotation that is far from every plane of symmetry."""
    return pose(rpy=np.random.default_rng(seed).uniform(-1.2, 1.2, 3))[:3, :3]


def quick_first(count: int, *quick: int) -> list[object]:
    """Numbers of cases, of which all but some are slow."""
    return [pytest.param(k, marks=() if k in quick else pytest.mark.slow) for k in range(count)]


@pytest.mark.parametrize("seed", quick_first(11, QUICK))
def test_edges_of_a_turned_box_are_straight_and_the_tool_is_halfway_between_its_faces(
    tmp_path: Path, seed: int
) -> None:
    R, size = axes(seed), np.random.default_rng(seed).uniform(15.0, 90.0, 3)
    X = pose((10.0, -20.0, 30.0))
    X[:3, :3] = R
    edges = drawing(tmp_path, [Named("BOX", moved(box((0, 0, 0), size), X))]).edges

    assert len(edges) == 12
    assert sorted(edge.length for edge in edges) == pytest.approx(sorted(np.repeat(size, 4) / 1e3), abs=1e-12)
    for edge in edges[::3] if seed == QUICK else edges:
        poses = tool_poses(edge)
        local = (1e3 * poses[:, :3, 3] - X[:3, 3]) @ R  # [mm] in the frame of the box
        off = np.minimum(np.abs(local), np.abs(local - size))
        assert np.sort(off, axis=1)[:, :2].max() <= 1e3 * MOST_OFF  # two coordinates are those of faces
        middle = local.mean(axis=0)
        outward = np.where(np.abs(middle) < 1e-6, -1.0, np.where(np.abs(middle - size) < 1e-6, 1.0, 0.0))
        expected = -R @ outward / np.sqrt(2.0)
        assert edge.bend == "convex"
        assert np.degrees(edge.angle) == pytest.approx(90.0, abs=1e-9)
        assert angles(poses[:, :3, 2], expected) <= MOST_LEANING


def round_solids() -> Iterator[tuple[Named, list[Circle]]]:
    """Twenty solids with circular edges at places known by hand."""
    for seed in range(8):
        R, r, h = axes(seed), 8.0 + 5.0 * seed, 20.0 + 3.0 * seed
        at = np.array([5.0, seed, -7.0])
        ends = [Circle(at / 1e3, R[:, 2], r / 1e3, ((-1.0, 0.0), (0.0, 1.0)))]
        ends += [Circle((at + h * R[:, 2]) / 1e3, R[:, 2], r / 1e3, ((1.0, 0.0), (0.0, 1.0)))]
        yield Named("PIN", cylinder(r, h, at, R[:, 2])), ends
    for seed in range(6):
        R, low, high, h = axes(10 + seed), 30.0 + seed, 12.0, 25.0
        slope = np.hypot(h, low - high)
        side = ((low - high) / slope, h / slope)
        ends = [Circle(np.zeros(3), R[:, 2], low / 1e3, ((-1.0, 0.0), side))]
        ends += [Circle(h * R[:, 2] / 1e3, R[:, 2], high / 1e3, ((1.0, 0.0), side))]
        yield Named("CONE", frustum(low, high, h, along=R[:, 2])), ends
    for seed in range(6):
        r = 6.0 + 2.0 * seed
        plate = cut(box((0, 0, 0), (80, 60, 9)), cylinder(r, 30, (35 + seed, 28, -5)))
        centre, axis = np.array([35.0 + seed, 28.0, 0.0]) / 1e3, np.array([0.0, 0.0, 1.0])
        ends = [Circle(centre, axis, r / 1e3, ((-1.0, 0.0), (0.0, -1.0)))]
        ends += [Circle(centre + 9e-3 * axis, axis, r / 1e3, ((1.0, 0.0), (0.0, -1.0)))]
        yield Named("PLATE", plate), ends


@pytest.mark.parametrize("place", quick_first(20, 9))
def test_round_edges_follow_their_circle_and_the_tool_is_halfway_between_its_faces(tmp_path: Path, place: int) -> None:
    part, circles = list(round_solids())[place]
    edges = [edge for edge in drawing(tmp_path, [part]).edges if edge.kind == "circle"]

    assert len(edges) == len(circles) == 2
    for circle in circles:
        edge = min(edges, key=lambda it: abs((it.line.points[0] - circle.centre) @ circle.axis))
        poses = tool_poses(edge)
        p = poses[:, :3, 3] - circle.centre
        radial = (p - np.outer(p @ circle.axis, circle.axis)) / circle.radius
        walls = [a * circle.axis + b * radial for a, b in circle.walls]
        expected = -(walls[0] + walls[1]) / np.linalg.norm(walls[0] + walls[1], axis=1, keepdims=True)
        assert edge.line.is_closed
        assert edge.length == pytest.approx(2.0 * np.pi * circle.radius, abs=1e-11)
        assert np.abs(p @ circle.axis).max() <= MOST_OFF
        assert np.abs(np.linalg.norm(p, axis=1) - circle.radius).max() <= MOST_OFF
        assert edge.bend == "convex"
        assert angles(poses[:, :3, 2], expected) <= MOST_LEANING


def tool_poses(edge: StepEdge) -> Array:
    """Tool poses along an edge, between the points of its line too, shape (N, 4, 4)."""
    angles = SeamAngles(face=next(iter(edge.line.walls)), work=None)
    path = build_toolpath(
        task_on(edge.line, tool_x=np.array([0.31, 0.53, 0.79]), seam=Seam(walls={}, angles=angles)), PART
    )
    assert path.length == pytest.approx(edge.length, abs=1e-10)
    return path.poses(np.linspace(0.0, path.length, 401))


def angles(axis: Array, expected: Array) -> float:
    """Largest angle in [rad] between unit vectors."""
    return float(2.0 * np.arcsin(0.5 * np.linalg.norm(axis - expected, axis=1).max()))


def test_names_of_the_file_are_those_of_edges_and_faces_and_others_are_numbers(tmp_path: Path) -> None:
    part = Named("PLATE", box((0, 0, 0), (30, 20, 10)), {3: "WELD_1"}, {2: "PAD"})
    content = drawing(tmp_path, [part])

    numbers = [f"E{k}" for k in range(1, 13)]
    assert [edge.name for edge in content.edges if edge.name != "WELD_1"] == [
        number for number, edge in zip(numbers, content.edges, strict=True) if edge.name != "WELD_1"
    ]
    assert [edge.name for edge in content.edges].count("WELD_1") == 1
    assert [face.name for face in content.faces] == ["F1", "F2", "PAD", "F4", "F5", "F6"]
    assert sum("PAD" in edge.line.walls for edge in content.edges) == 4
    assert content.edge("WELD_2") is None


def frame(gap: float = 0.0) -> tuple[list[Named], set[tuple[tuple[float, ...], tuple[float, ...]]]]:
    """A welded frame in [mm] with its forty fillets: two webs on a plate and four ribs between them."""
    webs, ribs, top = (100.0, 300.0), (110.0, 230.0, 350.0, 470.0), 90.0
    parts = [Named("PLATE", box((0, 0, 0), (600, 410, 10)))]
    parts += [Named(f"WEB_{k}", box((20, y, 10), (580, y + 8, top))) for k, y in enumerate(webs, start=1)]
    inner = (webs[0] + 8.0 + gap, webs[1] - gap)
    parts += [Named(f"RIB_{k}", box((x, inner[0], 10), (x + 8, inner[1], top))) for k, x in enumerate(ribs, start=1)]
    lines = []
    for y, outer in ((webs[0], webs[0]), (webs[1], webs[1] + 8.0)):
        lines += [((x, y, 10.0), (x, y + 8.0, 10.0)) for x in (20.0, 580.0)]
        lines += [((20.0, outer, 10.0), (580.0, outer, 10.0))]
        face = y + 8.0 if y == outer else y
        ends = [20.0, *(x for rib in ribs for x in (rib, rib + 8.0)), 580.0]
        lines += [((a, face, 10.0), (b, face, 10.0)) for a, b in list(pairwise(ends))[::2]]
    for x in (x for rib in ribs for x in (rib, rib + 8.0)):
        lines += [((x, inner[0], 10.0), (x, inner[1], 10.0))]
        lines += [((x, face, 10.0), (x, face, top)) for face in (webs[0] + 8.0, webs[1])]
    return parts, {tuple(sorted(line)) for line in lines}


@pytest.mark.slow
@pytest.mark.parametrize("gap", [0.0, 0.6])
def test_forty_fillets_of_a_welded_frame_are_there_none_missed_and_none_false(tmp_path: Path, gap: float) -> None:
    parts, expected = frame(gap)

    fillets = [edge for edge in drawing(tmp_path, parts, 1e-3 if gap else 0.0).edges if edge.is_fillet]

    lines = {tuple(sorted(tuple(np.round(1e3 * p, 3) + 0.0) for p in edge.line.points[[0, -1]])) for edge in fillets}
    assert len(expected) == len(fillets) == 40
    assert lines == expected
    assert {np.round(1e3 * edge.gap, 6) for edge in fillets} == {0.0, gap}


@pytest.mark.slow
def test_plates_with_a_gap_that_is_not_allowed_have_no_seam_between_them(tmp_path: Path) -> None:
    parts, _ = frame(0.6)

    fillets = [edge for edge in drawing(tmp_path, parts, 0.5e-3).edges if edge.is_fillet]

    assert {part[:3] for edge in fillets for part in edge.parts} == {"PLA", "WEB", "RIB"}
    assert not [edge for edge in fillets if {part[:3] for part in edge.parts} == {"WEB", "RIB"}]


BASE = Named("BASE", box((0, 0, 0), (200, 100, 10)))
JOINTS = {
    "T": ([BASE, Named("WEB", box((0, 46, 10), (200, 54, 60)))], 2, 200.0, 90.0),
    "lap": ([BASE, Named("LAP", box((50, 20, 10), (120, 80, 15)))], 4, 60.0, 90.0),
    "corner": ([BASE, Named("END", box((0, 0, 10), (200, 8, 50)))], 1, 200.0, 90.0),
    "butt": ([BASE, Named("NEXT", box((0, 102, 0), (200, 180, 10)))], 2, 200.0, 180.0),
}


@pytest.mark.parametrize("kind", JOINTS)
def test_joints_are_told_apart(tmp_path: Path, kind: str) -> None:
    parts, count, least, angle = JOINTS[kind]

    seams = [edge for edge in drawing(tmp_path, parts, 2e-3).edges if edge.joint is not None]
    long = [edge for edge in seams if 1e3 * edge.length >= least - 1e-3 and (kind == "butt" or edge.is_fillet)]

    assert [edge.joint for edge in long] == [kind] * count
    assert [np.degrees(edge.angle) for edge in long] == pytest.approx([angle] * count, abs=1e-6)


def test_seam_of_a_butt_joint_runs_in_the_middle_of_its_gap(tmp_path: Path) -> None:
    seams = [edge for edge in drawing(tmp_path, JOINTS["butt"][0], 2e-3).edges if edge.joint == "butt"]

    assert {round(1e3 * float(p[1]), 6) for seam in seams for p in seam.line.points} == {101.0}
    assert {round(1e3 * seam.gap, 6) for seam in seams} == {2.0}


def test_seam_round_a_tube_on_a_plate_is_one_circle(tmp_path: Path) -> None:
    parts = [BASE, Named("TUBE", cut(cylinder(20, 50, (100, 50, 10)), cylinder(16, 50, (100, 50, 10))))]

    outer, inner = sorted(
        (edge for edge in drawing(tmp_path, parts).edges if edge.joint), key=lambda edge: -edge.length
    )

    assert outer.line.is_closed
    assert outer.joint == "T"
    assert outer.length == pytest.approx(2.0 * np.pi * 0.02, abs=1e-9)
    assert inner.length == pytest.approx(2.0 * np.pi * 0.016, abs=1e-9)
    poses = tool_poses(outer)
    radial = (poses[:, :3, 3] - [0.1, 0.05, 0.01]) / 0.02
    expected = -(radial + np.array([0.0, 0.0, 1.0])) / np.sqrt(2.0)
    assert angles(poses[:, :3, 2], expected) <= MOST_LEANING


def line_of(*points: tuple[float, float]) -> SeamLine:
    """A straight line along the floor with the floor on its left and a web on its right."""
    p = np.array([(x, y, 0.0) for x, y in points])
    t = (p[-1] - p[0]) / np.linalg.norm(p[-1] - p[0])
    web = np.array([-t[1], t[0], 0.0])
    walls = {"floor": np.tile([0.0, 0.0, 1.0], (len(p), 1)), "web": np.tile(web, (len(p), 1))}
    behind = np.linalg.norm(p - p[0], axis=1)
    return SeamLine(source="a", points=p, tangents=np.tile(t, (len(p), 1)), behind=behind, walls=walls, is_closed=False)


def test_chain_turns_lines_so_that_each_goes_on_from_the_last_one_and_leaves_a_corner() -> None:
    lines = [line_of((0.0, 0.0), (0.3, 0.0)), line_of((0.3, 0.2), (0.3, 0.0))]

    line = chain(lines)

    assert isinstance(line, SeamLine)
    np.testing.assert_allclose(line.points[:, :2], [[0.0, 0.0], [0.3, 0.0], [0.3, 0.0], [0.3, 0.2]])
    np.testing.assert_allclose(line.tangents[:, :2], [[1.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 1.0]])
    np.testing.assert_allclose(line.behind, [0.0, 0.3, 0.3, 0.5])
    assert not line.is_closed


def test_chain_of_lines_that_run_on_has_no_corner_and_one_with_a_break_says_where() -> None:
    straight = chain([line_of((0.0, 0.0), (0.3, 0.0)), line_of((0.3, 0.0), (0.4, 0.0))])

    assert isinstance(straight, SeamLine)
    assert len(straight.points) == 3
    assert chain([line_of((0.0, 0.0), (0.3, 0.0)), line_of((0.31, 0.0), (0.4, 0.0))]) == 1


def test_turning_a_line_round_twice_changes_nothing(tmp_path: Path) -> None:
    line = drawing(tmp_path, [Named("PIN", cylinder(20, 50))]).edges[0].line

    twice = reversed_line(reversed_line(line))

    for one, other in zip(
        (line.points, line.tangents, line.behind, *line.walls.values()),
        (twice.points, twice.tangents, twice.behind, *twice.walls.values()),
        strict=True,
    ):
        np.testing.assert_allclose(one, other, atol=1e-15)
    assert list(twice.walls) == list(line.walls)


def test_a_circle_is_cut_and_begun_where_it_is_told(tmp_path: Path) -> None:
    edge = drawing(tmp_path, [Named("PIN", cylinder(20, 50))]).edges[0]
    toward = np.array([np.cos(1.1), np.sin(1.1)])

    begun = started_near(edge.line, np.array([*(0.5 * toward), edge.line.points[0, 2]]))
    quarter = cut_line(begun, 0.0, 0.005 * np.pi)
    ends = quarter.points[[0, -1], :2]

    assert begun.is_closed
    assert begun.behind[-1] == pytest.approx(0.04 * np.pi, abs=1e-11)
    assert np.linalg.norm(ends[0] - 0.02 * toward) <= 1e-8  # where a distance is least it is flat
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(0.04 * np.sin(np.pi / 8.0), abs=1e-9)
    assert list(product([quarter.is_closed], [len(quarter.points) > 9])) == [(False, True)]
