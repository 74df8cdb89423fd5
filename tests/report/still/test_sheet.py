"""The picture of an instant as SVG text."""

import re
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np

from cellplan.geometry.shapes import Box
from cellplan.geometry.transforms import pose
from cellplan.report.still.camera import Camera, view_axes
from cellplan.report.still.painter import Painter
from cellplan.report.still.picture import Colour, ShownName, ShownSolid, StillPicture
from cellplan.report.still.sheet import best_axes, still_svg

GREY = {"grey": Colour(light="#808080", dark="#808080"), "red": Colour(light="#ff0000", dark="#ff0000")}
NS = "{http://www.w3.org/2000/svg}"


def box(name: str, xyz: tuple[float, float, float], size: tuple[float, float, float] = (0.2, 0.2, 0.2)) -> ShownSolid:
    return ShownSolid(name=name, shape=Box(size), X_WS=pose(xyz), material="red" if name == "red" else "grey")


def picture(*solids: ShownSolid, mark: np.ndarray | None = None) -> StillPicture:
    return StillPicture(
        title="Clearance too small at 1.250 s",
        notes=("left & right",),
        is_bad=True,
        solids=solids,
        lines=(),
        names=(ShownName(text="<arm>", at=np.zeros(3)),),
        materials=GREY,
        mark=np.zeros((0, 3)) if mark is None else mark,
        label="12.5 mm",
        floor=-0.5,
    )


def from_the_front() -> Painter:
    camera = Camera(
        axes=view_axes(np.radians(-90.0), 0.0), middle=np.zeros(2), scale=1000.0, place=np.array([500.0, 500.0])
    )
    return Painter(camera, np.zeros(2), np.array([1000.0, 1000.0]))


def test_of_a_box_seen_from_the_front_one_face_is_drawn_where_it_is() -> None:
    text = from_the_front().paths([box("one", (0.1, 0.0, 0.0))], [])

    (x, y), steps = (
        [int(entry) for entry in part.split()] for part in re.search(r"M([\d ]+)l([-\d ]+)z", text).groups()
    )
    corners = np.cumsum([(x, y), *zip(steps[::2], steps[1::2], strict=True)], axis=0)
    assert len(re.findall("z", text)) == 1
    assert {tuple(entry) for entry in corners.tolist()} == {(500, 600), (700, 600), (700, 400), (500, 400)}


def test_of_a_box_seen_from_a_corner_three_faces_are_drawn() -> None:
    camera = Camera(axes=view_axes(0.7, 0.5), middle=np.zeros(2), scale=1000.0, place=np.array([500.0, 500.0]))

    text = Painter(camera, np.zeros(2), np.array([1000.0, 1000.0])).paths([box("one", (0.0, 0.0, 0.0))], [])

    assert len(re.findall("z", text)) == 3


def test_what_is_nearer_is_painted_later() -> None:
    near, far = box("red", (0.0, -1.0, 0.0)), box("far", (0.0, 1.0, 0.0))
    painter = from_the_front()
    for solids in ([near, far], [far, near]):
        text = painter.paths(solids, [])
        red = next(name for (material, _), name in painter.classes.items() if material == "red")
        assert re.findall(r'class="(c\d+)"', text)[-1] == red


def test_the_view_leaves_the_connection_long_and_unhidden() -> None:
    ends = np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0]])
    screen = box("screen", (0.02, -0.5, 0.1), (0.4, 0.02, 0.6))
    shown = picture(box("a", (-0.1, 0.0, 0.0)), box("b", (0.15, 0.0, 0.0)), screen, mark=ends)

    axes = best_axes(shown, 1.5)

    assert np.linalg.norm(axes[:2] @ (ends[1] - ends[0])) > 0.8 * 0.05  # drawn at four fifths of its length at least
    assert axes[2, 1] > 0.0 or axes[2, 2] > 0.7  # not from behind the screen


def test_a_picture_is_one_element_with_title_and_escaped_names() -> None:
    svg = still_svg(picture(box("a", (0.0, 0.0, 0.0)), mark=np.array([[0.1, 0.0, 0.0], [0.1125, 0.0, 0.0]])))

    root = ET.fromstring(svg)  # noqa: S314 - our own text
    words = ["".join(entry.itertext()) for entry in root.iter(f"{NS}text")]
    assert root.find(f"{NS}title").text == "Clearance too small at 1.250 s"
    assert root.find(f"{NS}desc").text == "left & right. Robots: <arm>."
    assert {"<arm>", "12.5 mm", "left & right"} <= set(words)
    assert {root.get("role"), root.get("aria-labelledby")} == {"img", "still-title still-desc"}
    assert "http" not in svg.replace("http://www.w3.org/2000/svg", "")


def test_a_detail_is_drawn_only_where_it_is_larger() -> None:
    small = picture(
        box("a", (0.0, 0.0, 0.0)), box("b", (2.0, 0.0, 0.0)), mark=np.array([[0.1, 0.0, 0.0], [0.11, 0.0, 0.0]])
    )
    wide = replace(small, mark=np.array([[0.1, 0.0, 0.0], [1.9, 0.0, 0.0]]))

    assert "enlarged" in still_svg(small)
    assert "enlarged" not in still_svg(wide)


def test_a_long_title_is_written_smaller_and_stays_on_the_sheet() -> None:
    title = "Joint acceleration too high where phases meet at 12.000 s of a_task_with_a_name_of_forty_letters_____"
    for words in (title, title[:60], title[:50]):
        (text,) = re.findall(r'<text class="title" [^>]*>[^<]*', still_svg(replace(picture(), title=words)))

        size = float(re.search(r"font-size:(\d+)px", text).group(1))
        assert 120 <= size < 235
        assert 0.68 * size * len(text.partition(">")[2]) <= 7200 - 2 * 220


def test_a_long_name_is_shortened_and_stays_on_the_sheet() -> None:
    long = replace(picture(box("one", (0, 0, 0))), names=(ShownName(text=40 * "N", at=np.array([-9.0, 0.0, 0.0])),))
    ((x, text),) = re.findall(r'<text class="name" x="(-?\d+)" [^>]*>([^<]*)', still_svg(long))

    assert len(text) == 20
    assert int(x) - 0.5 * 0.68 * 165 * len(text) + 1 >= 0
