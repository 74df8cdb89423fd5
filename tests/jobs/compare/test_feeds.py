"""The greatest feeds of programs in comparisons and layout searches: closed forms of a tool on an axis that slides."""

import re
from pathlib import Path

import numpy as np
import pytest
from builders.study_trials import InThisProcess

from cellplan import CompareJob, LayoutRequest, Stop, compare, load_cell, search_layout
from cellplan.errors import InputError
from cellplan.runs.overrides import feed_settings

ACCELERATION = 1500.0  # [mm/s2] limit of the axis
RAMPS = {"bead": 50.0, "seam": 25.0}  # [mm] by the task, each in a file of its name
ROBOT = f"""\
robot: slide
source: made for a test
joints:
  x: {{type: prismatic, axis: [1, 0, 0], lower_mm: -400, upper_mm: 400, velocity_mm_s: 2000,
      acceleration_mm_s2: {ACCELERATION}}}
flange: {{xyz_mm: [0, 0, 200]}}
bodies: {{accuracy_mm: 1, source: made for a test, solids: []}}
"""

pytestmark = pytest.mark.usefixtures("stored_solutions")


def greatest(ramp: float) -> float:
    """Feed in mm/s at which the acceleration along a ramp of a length in mm, 3v²/4L, is the limit of the axis."""
    return float(np.sqrt(4.0 * ACCELERATION * ramp / 3.0))


@pytest.fixture
def files(tmp_path: Path) -> list[Path]:
    """Two programs with tasks of different names."""
    (tmp_path / "slide.yaml").write_text(ROBOT, encoding="utf-8")
    for task, ramp in RAMPS.items():
        text = f"""\
cellplan: 1
name: {task}
robots:
  axis:
    model: slide.yaml
    tool: {{xyz_mm: [0, 0, 0], rpy_deg: [180, 0, 0]}}
    start: auto
    home: {{x_mm: -150}}
part:
  geometry: {{box: {{size_mm: [300, 100, 10]}}}}
  at: {{xyz_mm: [0, 0, 195]}}
tasks:
  {task}:
    robot: axis
    path: {{polyline: {{points_mm: [[-100, 0], [100, 0]], plane: xy}}, offset_mm: 5}}
    tool_axis: -z
    axes: [x]
    process: {{feed_mm_s: 100, ramp_mm: {ramp}}}
program: {{}}
motion: {{step_s: 0.004, jerk_build_up_s: unlimited}}
"""
        (tmp_path / f"{task}.yaml").write_text(text, encoding="utf-8")
    return [tmp_path / f"{task}.yaml" for task in RAMPS]


@pytest.mark.slow
def test_each_cell_of_a_comparison_has_the_greatest_feed_of_its_tasks(files: list[Path], tmp_path: Path) -> None:
    job = CompareJob(subjects=tuple(files), feed="greatest", runs=tmp_path / "study")

    record = compare(job, tmp_path / "study", workers=InThisProcess())

    assert record["settings"] == {"feed": "greatest"}
    solved = [file.read_text(encoding="utf-8") for file in sorted((tmp_path / "study").rglob("cell.yaml"))]
    feeds = [float(re.findall(r"feed_mm_s: ([\d.]+)", text)[0]) for text in solved]
    assert feeds == pytest.approx([greatest(ramp) for ramp in RAMPS.values()], rel=2e-3)


@pytest.mark.slow
def test_the_best_layout_of_a_program_states_its_greatest_feed(files: list[Path], tmp_path: Path) -> None:
    settings = feed_settings(load_cell(files[0]), (), "greatest")
    request = LayoutRequest(cell=files[0], settings=settings, vary=("axis.base={x_mm: [-50, 50]}",))

    result = search_layout(request, tmp_path / "study", stop=Stop(trials=1), workers=InThisProcess())

    assert result.record["status"] == "certified"
    (best,) = load_cell(tmp_path / "study" / "best.yaml").tasks
    assert best.process is not None
    assert best.process.feed_mm_s == pytest.approx(greatest(RAMPS["bead"]), rel=2e-3)


def test_a_feed_goes_to_a_process_that_is_set_beside_it(files: list[Path]) -> None:
    settings = ("tasks.bead.process={feed_mm_s: 20, ramp_mm: 30}",)

    assert feed_settings(load_cell(files[0]), settings, "[30, 40]") == (
        *settings,
        "tasks.bead.process.feed_mm_s=[30, 40]",
    )


@pytest.mark.parametrize("feed", ["", "nan", "[20"])
def test_what_is_no_feed_is_refused_by_its_option(files: list[Path], feed: str) -> None:
    message = f"--feed: expected a number in mm/s, greatest or a range [40, 90], got '{feed}'"

    with pytest.raises(InputError, match=re.escape(message)):
        feed_settings(load_cell(files[0]), (), feed)


def test_a_run_has_its_feed(files: list[Path], tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    job = CompareJob(subjects=(files[0], tmp_path / "run"), feed="greatest")

    with pytest.raises(InputError, match=r"--feed: expected cell files only, as a run stays as it is, got the run"):
        compare(job, tmp_path / "study")
