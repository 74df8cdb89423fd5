"""APT and CLDATA are read as they are meant: points, tool axes, feeds, rapids, units and continued lines."""

from pathlib import Path

import numpy as np
import pytest
from builders.cam_files import APT_HEAD, dome, dome_apt, settings, written

from cellplan.files.cell.paths.apt import read_apt
from cellplan.geometry.transforms import pose
from cellplan.model.task.task import ProgrammedPath

Read = tuple[ProgrammedPath, str]


@pytest.fixture
def read(tmp_path: Path):
    def read_text(text: str, **values: object) -> Read:
        return read_apt(written(tmp_path, text), settings(**values))

    return read_text


def test_points_and_axes_are_those_of_the_file_and_axes_point_into_the_part(read) -> None:
    path, remark = read(f"{APT_HEAD}GOTO/1,-2,3.5,0,0,1\nGOTO/4,5,6,0,3,4\n")

    assert path.points.tolist() == [[0.001, -0.002, 0.0035], [0.004, 0.005, 0.006]]
    assert path.axes == pytest.approx(np.array([[0.0, 0.0, -1.0], [0.0, -0.6, -0.8]]), abs=1e-15)
    assert path.speeds.tolist() == [0.01]
    assert remark == "part.apt: not part of the path: PARTNO (1)"


def test_lines_go_on_after_a_dollar_and_end_at_two(read) -> None:
    text = "units / mm $$ of the drawing\nfedrat/60\ngoto/0,0,$ x and y\n  0\n$$ nothing\nGoto/1,0,0\n"
    path, _ = read(text)

    assert path.points.tolist() == [[0.0, 0.0, 0.0], [0.001, 0.0, 0.0]]
    assert path.lines == (3, 6)
    assert path.axes is None


def test_inches_are_25_4_mm_for_points_and_feeds(read) -> None:
    path, _ = read(
        "UNITS/INCHES\nFEDRAT/60\nGOTO/0,0,0\nGOTO/1,0,0\nFEDRAT/IPM,30\nGOTO/2,0,0\nFEDRAT/120,MMPM\nGOTO/3,0,0\n"
    )

    assert path.points[:, 0] == pytest.approx([0.0, 0.0254, 0.0508, 0.0762], rel=1e-15)
    assert path.speeds == pytest.approx([0.0254, 0.0127, 0.002], rel=1e-15)


def test_a_rapid_holds_for_one_point_and_a_feed_until_the_next(read) -> None:
    path, _ = read(f"{APT_HEAD}GOTO/0,0,0\nGOTO/1,0,0\nRAPID\nGOTO/2,0,0\nGOTO/3,0,0\nFEDRAT/60\nGOTO/4,0,0\n")

    assert path.is_rapid.tolist() == [False, True, False, False]
    assert path.speeds.tolist() == [0.01, 0.25, 0.01, 0.001]
    assert path.feeds.tolist() == [0.001, 0.01]


def test_rapids_before_the_first_feed_and_after_the_last_are_left_out_and_counted(read) -> None:
    text = "FROM/0,0,90\nRAPID\nGOTO/0,0,50\nGOTO/0,0,0\nGOTO/1,0,0\nRAPID\nGOTO/1,0,50\nSPINDL/OFF\nFINI\n"
    path, remark = read(APT_HEAD + text)

    assert path.points[:, 2].tolist() == [0.05, 0.0, 0.0]
    assert "moves before the first feed and after the last (2), PARTNO" not in remark
    assert "PARTNO (1), SPINDL (1), moves before the first feed and after the last (2)" in remark


def test_repeated_points_are_one_point_and_counted(read) -> None:
    path, remark = read(f"{APT_HEAD}GOTO/0,0,0\nGOTO/0,0,0.0005\nGOTO/1,0,0\nGOTO/1,0,0\n")

    assert len(path.points) == 2
    assert "repeated points (2)" in remark


def test_the_frame_of_the_file_may_stand_anywhere_on_the_part(read) -> None:
    text = f"{APT_HEAD}GOTO/1,0,0,0,0,1\nGOTO/2,0,0,0,0,1\n"
    X_PF = pose(np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.5 * np.pi, 0.0]))
    path, _ = read(text, X_PF=X_PF)

    assert path.points == pytest.approx(np.array([[0.1, 0.2, 0.299], [0.1, 0.2, 0.298]]), abs=1e-15)
    assert path.axes == pytest.approx(np.tile([-1.0, 0.0, 0.0], (2, 1)), abs=1e-15)


def test_words_of_systems_that_move_nothing_are_counted(read) -> None:
    text = "TOOL PATH/MILL,TOOL,T1\nTLDATA/MILL,10,5\nMSYS/0,0,0,1,0,0,0,1,0\nPPRINT any words, a/b\nEND-OF-PATH\n"
    _, remark = read(f"{APT_HEAD}{text}GOTO/0,0,0\nGOTO/1,0,0\n")

    assert remark.split(": ")[-1] == "END-OF-PATH (1), MSYS (1), PARTNO (1), PPRINT (1), TLDATA (1), TOOL PATH (1)"


def test_a_raster_on_a_dome_is_read_point_by_point(read) -> None:
    points = dome(200.0, 40.0, 12)
    path, _ = read(dome_apt(points, (600.0, 480.0), rapid_every=4, lift=20.0))

    on_dome = np.linalg.norm(path.points, axis=1) < 0.2001
    assert np.count_nonzero(on_dome) == 144
    assert np.abs(path.points[on_dome] - 1e-3 * points.reshape(-1, 3)).max() < 1e-7
    assert np.abs(path.axes + path.points / np.linalg.norm(path.points, axis=1, keepdims=True)).max() < 1e-6
    assert np.count_nonzero(path.is_rapid) == 6
