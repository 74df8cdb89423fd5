"""Keys of seams: what they make of a task, that they are written as they were read, and every refusal word for word."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import render_cell
from cellplan.model.cell.cell import Cell
from cellplan.model.task.seam import WallPlace
from cellplan.model.task.task import SpacePolylinePath

Load = Callable[..., Cell]
Refuse = Callable[..., list[str]]
PROJECTED = "    path: {circle: {radius_mm: 100, plane: xy}, project: +z}\n    tool_axis: normal\n"
LINE = "polyline: {points_mm: [[-100, 0, 250], [100, 0, 250]]}"


def path(words: str, shape: str = LINE, rest: str = "") -> tuple[str, str]:
    return PROJECTED, f"    path: {{{shape}, {words}}}\n{rest}"


def test_keys_become_walls_and_angles(load: Load) -> None:
    words = "walls: {floor: +z, web: [0, -2, 0]}, from: web, work_deg: 30, drag_deg: 10, standoff_mm: 12"
    seam = load(path(words)).tasks[0].seam
    assert seam is not None

    assert list(seam.walls) == ["floor", "web"]
    assert np.array_equal(np.array(list(seam.walls.values())), [[0, 0, 1], [0, -1, 0]])
    assert seam.angles.face == "web"
    assert [seam.angles.work, seam.angles.travel, seam.angles.standoff] == pytest.approx(
        [np.pi / 6.0, -np.pi / 18.0, 0.012], rel=1e-15
    )


def test_projected_path_has_the_surface_as_its_wall(load: Load) -> None:
    seam = load(path("project: +z, push_deg: 15", "circle: {radius_mm: 100, plane: xy}")).tasks[0].seam
    assert seam is not None

    assert dict(seam.walls) == {"surface": WallPlace.SURFACE}
    assert (seam.angles.face, seam.angles.work) == ("surface", 0.0)


def test_seam_is_written_as_it_was_read(load: Load, tmp_path: Path) -> None:
    words = "walls: {floor: +z, web: left}, from: floor, work_deg: 40, push_deg: 10, standoff_mm: 12"
    cell = load(path(words, "polyline: {points_mm: [[-100, 0], [100, 0]], plane: xy}"))
    (tmp_path / "again").write_text(render_cell(cell), encoding="utf-8")
    again = load_cell("again")

    assert render_cell(again) == render_cell(cell)
    assert "from: floor" in render_cell(cell)
    assert again.tasks[0].seam is not None
    assert again.tasks[0].seam.angles == cell.tasks[0].seam.angles  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            "work_deg: 45",
            "c:19: tasks.ring.path.walls: missing, expected the walls beside the path, such as {floor: +z, web: -y}, "
            "or project: +z (or another side)",
        ),
        (
            "walls: {floor: +z, web: -y}, work_deg: 45",
            "c:19: tasks.ring.path.from: missing, expected the wall that work_deg is measured from: floor or web",
        ),
        (
            "walls: {floor: +z}, from: web",
            "c:19: tasks.ring.path.from: expected one of the walls floor, got 'web'",
        ),
        (
            "walls: {floor: +z}, push_deg: 5, drag_deg: 5",
            "c:19: tasks.ring.path.drag_deg: expected either push_deg or drag_deg, got both",
        ),
        (
            "walls: {floor: surface}",
            "c:19: tasks.ring.path.walls.floor: expected a direction on a path without project, got surface",
        ),
        (
            "walls: {web: left}",
            "c:19: tasks.ring.path.walls.web: expected a wall beside it that is no side of travel, got left",
        ),
        (
            "walls: {floor: up}",
            "c:19: tasks.ring.path.walls.floor: expected surface, left, right, +x, -x, +y, -y, +z, -z or a direction "
            "[x, y, z], got 'up'",
        ),
        (
            "walls: {floor: +z}, work_deg: 120",
            "c:19: tasks.ring.path.work_deg: expected a number of degrees of at most 90, got 120",
        ),
    ],
)
def test_words_that_make_no_seam_are_refused(refuse: Refuse, words: str, message: str) -> None:
    assert refuse(path(words)) == [message]


def test_misspelt_key_is_refused_with_the_one_that_is_meant(refuse: Refuse) -> None:
    (message,) = refuse(path("walls: {floor: +z}, form: floor"))

    assert message.startswith("c:19: tasks.ring.path.form: unknown key, did you mean 'from'?; allowed: circle, ")


def test_tool_axis_is_refused_beside_a_seam(refuse: Refuse) -> None:
    assert refuse(path("walls: {floor: +z}", rest="    tool_axis: -z\n")) == [
        "c:20: tasks.ring.tool_axis: unexpected key, the walls and angles of the path say how the tool is held"
    ]


def test_file_with_axes_is_refused_beside_a_seam(refuse: Refuse, tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("x_mm,y_mm,z_mm,i,j,k\n-100,0,250,0,0,-1\n100,0,250,0,0,-1\n", encoding="utf-8")

    assert refuse(path("walls: {floor: +z}", "csv: p.csv")) == [
        "c:19: tasks.ring.path: expected no walls and angles beside p.csv, which gives the tool's orientation already"
    ]


WELD = "    process: {feed_mm_s: 8}\n"


def test_times_of_a_weave_become_lengths_at_the_feed(load: Load) -> None:
    words = "walls: {floor: +z}, weave: {side_mm: 3, frequency_hz: 2, dwell_left_s: 0.1, dwell_right_s: 0.05}"
    weave = load(path(words, rest=WELD), ("motion: {duration_s: 4}", "motion: {}")).tasks[0].weave
    assert weave is not None

    assert (weave.form, weave.side, weave.wavelength) == ("sine", 0.003, pytest.approx(0.004, rel=1e-15))
    assert weave.dwells == pytest.approx((0.0008, 0.0004), rel=1e-15)


@pytest.mark.parametrize(
    ("weave", "message"),
    [
        (
            "side_mm: 3, wavelength_mm: 4, dwell: standing",
            "c:19: tasks.ring.path.weave.dwell: expected dwell_left_s or dwell_right_s beside it, got neither",
        ),
        ("side_mm: 3", "c:19: tasks.ring.path.weave: expected either wavelength_mm or frequency_hz, got neither"),
        (
            "side_mm: 3, wavelength_mm: 4, form: triangle",
            "c:19: tasks.ring.path.weave.out_mm: missing, expected the distance of the edges from the path, out of the "
            "part",
        ),
        (
            "side_mm: 3, wavelength_mm: 4, out_mm: 2",
            "c:19: tasks.ring.path.weave.out_mm: unexpected key, a weave of the form sine stays at one distance",
        ),
        (
            "side_mm: 3, wavelength_mm: 4, form: circle, dwell_left_s: 0.1",
            "c:19: tasks.ring.path.weave.form: expected no dwells, a circle has no edges",
        ),
        (
            "side_mm: 3, wavelength_mm: 4, form: sinus",
            "c:19: tasks.ring.path.weave.form: expected sine, zigzag, triangle or circle, got 'sinus', "
            "did you mean 'sine'?",
        ),
        (
            "side_mm: 3, wavelength_mm: 4, dwell_left_s: 0.5",
            "c:19: tasks.ring.path.weave.dwell_left_s: expected dwells of at most 0.8 of the period of 0.5 s, got "
            "0.5 s",
        ),
    ],
)
def test_words_that_make_no_weave_are_refused(refuse: Refuse, weave: str, message: str) -> None:
    assert refuse(path(f"walls: {{floor: +z}}, weave: {{{weave}}}", rest=WELD)) == [message]


def test_times_of_a_weave_need_a_feed(refuse: Refuse) -> None:
    assert refuse(path("walls: {floor: +z}, weave: {side_mm: 3, frequency_hz: 2}")) == [
        "c:19: tasks.ring.path.weave.frequency_hz: expected a process, whose feed says how long it is along the path"
    ]


CONTROLLER = """\
controllers:
  welder:
    kind: abb
    process:
      on: 'ArcLStart {point}, {speed}, seam1, weld1 \\Weave:=weave1, {zone}, {tool} \\WObj:={frame};'
      inner: 'ArcL {point}, {speed}, seam1, weld1 \\Weave:=weave1, {zone}, {tool} \\WObj:={frame};'
      off: 'ArcLEnd {point}, {speed}, seam1, weld1 \\Weave:=weave1, {zone}, {tool} \\WObj:={frame};'
      weave_mm: 2
"""


def woven_by_controller(side: float) -> tuple[tuple[str, str], ...]:
    weave = f"walls: {{floor: +z}}, weave: {{side_mm: {side:g}, wavelength_mm: 4}}"
    control = ("    model: abb_irb1600\n", "    model: abb_irb1600\n    controller: {id: welder}\n")
    whole = ("motion: {duration_s: 4}\n", f"motion: {{}}\n{CONTROLLER}")
    return path(weave, rest=WELD), control, whole


def test_controller_that_weaves_leaves_the_rows_on_the_path(load: Load) -> None:
    cell = load(*woven_by_controller(2))

    assert cell.tasks[0].weave is None
    assert ("tasks.ring.path.weave", "the controller of 'worker' weaves, rows stay on the path") in cell.remarks


def test_controller_that_weaves_stands_nowhere(refuse: Refuse) -> None:
    task, *rest = woven_by_controller(2.0)
    standing = (task[0], task[1].replace("wavelength_mm: 4", "wavelength_mm: 4, dwell_left_s: 0.1, dwell: standing"))
    assert refuse(standing, *rest) == [
        "c:20: tasks.ring.path.weave.dwell: expected moving, as controllers.welder weaves and would be behind the "
        "feed, got standing"
    ]


def test_controller_that_weaves_by_another_amplitude_is_refused(refuse: Refuse) -> None:
    assert refuse(*woven_by_controller(3)) == [
        "c:20: tasks.ring.path.weave.side_mm: expected 2, as controllers.welder.process.weave_mm weaves, got 3"
    ]


def test_mirrored_cell_has_its_tasks_on_the_other_side_and_is_written_as_read(load: Load, tmp_path: Path) -> None:
    mirror = ("  geometry: {cylinder", "  mirror: {plane: xz}\n  geometry: {cylinder")
    line = "polyline: {points_mm: [[-100, 30, 250], [100, 30, 250]]}"
    cell = load(mirror, path("walls: {floor: +z, web: -y}, from: floor", line))
    (tmp_path / "again").write_text(render_cell(cell), encoding="utf-8")
    task = cell.tasks[0]

    assert isinstance(task.path, SpacePolylinePath)
    assert task.path.points == ((-0.1, -0.03, 0.25), (0.1, -0.03, 0.25))
    assert task.seam is not None
    assert np.array_equal(task.seam.walls["web"], [0, 1, 0])
    assert render_cell(load_cell("again")) == render_cell(cell)
