"""Searches of cells with joints that turn without end: an infinite margin is no reason to lose a trial."""

from pathlib import Path

import pytest
from builders.endless_arms import NAMES, limits, write_endless_arm
from builders.layout_search import CELL, searched_pair
from builders.study_trials import InThisProcess

from cellplan import BaseGrid, LayoutResult, MapRequest, map_study
from cellplan.jobs.base_map.result import map_lines


def searched(folder: Path, **endless: tuple[str, ...]) -> LayoutResult:
    """Search the planar pair with some joints of the robots endless."""
    write_endless_arm(folder / "endless.urdf")
    settings = [
        text
        for robot, names in endless.items()
        for text in (f"robots.{robot}.model=endless.urdf", f"robots.{robot}.limits={limits(*names)}")
    ]
    return searched_pair(folder, *settings)


@pytest.mark.slow
def test_an_endless_joint_changes_nothing_where_two_turns_do_not_bind(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    endless, bounded = (searched(tmp_path_factory.mktemp("pair"), left=names).record for names in (("A",), ()))

    assert endless["status"] == bounded["status"] == "certified"
    assert endless["top"] == bounded["top"]


@pytest.mark.slow
def test_a_cell_in_which_no_joint_has_limits_has_no_margin(tmp_path: Path) -> None:
    record = searched(tmp_path, left=NAMES, right=NAMES).record

    assert record["status"] == "certified"
    assert record["best"] is not None
    assert record["best"]["margin_deg"] is None


def test_a_map_of_a_robot_without_limits_is_judged_everywhere(tmp_path: Path) -> None:
    write_endless_arm(tmp_path / "endless.urdf")
    arm = f"endless.urdf\n    limits: {limits(*NAMES)}"
    text = CELL.read_text().replace("planar_3r", arm)
    (tmp_path / "cell.yaml").write_text(text)
    settings = ("motion.duration_s=2", "motion.step_s=0.02")
    request = MapRequest(
        cell=tmp_path / "cell.yaml",
        robot="right",
        grid=BaseGrid(x=(1700, 2100), y=(100, 500), step=200),
        settings=settings,
    )

    record = map_study(request, tmp_path / "map", workers=InThisProcess())

    assert record["counts"]["passes"] > 0
    assert "not_judged" not in record["counts"]
    assert "no joint with limits" in "\n".join(map_lines(record, tmp_path))
