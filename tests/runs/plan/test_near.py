"""A small change keeps the branch: seeds near their tasks, and the branches of an earlier run."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from builders.home_to_home import PICK_AND_PLACE

from cellplan import load_cell
from cellplan.cli.main import run
from cellplan.files.run.joint_tables import parse_table
from cellplan.geometry.transforms import pose
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.start.seeds import led_to, with_seeds
from cellplan.scene.kinematics.screw_chain import ScrewChain

ONE_ARM = """\
cellplan: 1
name: one-arm-at-a-box
robots:
  kuka: {model: kuka_kr6, base: {xyz_mm: [0, 0, 0]}, tool: {xyz_mm: [0, 0, 150]}, start_deg: auto}
  idle: {model: kuka_kr6, base: {xyz_mm: [0, 2500, 0]}, start_deg: auto}
part: {geometry: {box: {size_mm: [200, 400, 400]}}, at: {xyz_mm: [950, 0, 700]}}
tasks:
  ring: {robot: kuka, path: {circle: {radius_mm: 40, plane: yz}, project: -x}, tool_axis: normal, tool_x: +z}
motion: {mode: simultaneous, duration_s: 4, step_s: 0.02, time_law: quintic}
"""
MOVED = ONE_ARM.replace("[0, 0, 0]", "[30, -20, 10]")


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def first_row(folder: Path, robot: str) -> np.ndarray:
    return parse_table((folder / "tables" / f"{robot}.csv").read_text(encoding="utf-8"), robot).q[0]


@pytest.fixture(scope="module")
def earlier(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run of one arm beside another that is idle."""
    folder = tmp_path_factory.mktemp("near")
    assert run(["solve", str(write(folder, "cell.yaml", ONE_ARM)), "-o", str(folder / "run"), "-q"]) == 0
    return folder / "run"


@pytest.mark.parametrize("seed", range(4))
def test_a_tool_that_is_led_arrives_and_no_joint_jumps(tmp_path: Path, seed: int) -> None:
    cell = load_cell(write(tmp_path, "cell.yaml", ONE_ARM))
    robot, task = cell.robot("kuka"), cell.task("ring")
    chain, rng = ScrewChain(robot), np.random.default_rng(seed)
    q = np.radians([20.0, -90.0, 120.0, 30.0, 60.0, -20.0]) + rng.uniform(-0.2, 0.2, 6)
    goal = chain.tool_poses(q[None])[0] @ pose(rng.uniform(-0.03, 0.03, 3), rng.uniform(-0.05, 0.05, 3))

    arrived = led_to(chain, task, q, goal, X_WR=np.eye(4))

    assert arrived is not None
    np.testing.assert_allclose(chain.tool_poses(arrived[None])[0], goal, atol=1e-10)  # the search closes to 1e-12
    assert np.abs(arrived - q).max() < np.radians(20.0)
    assert np.sign(np.sin(arrived[4])) == np.sign(np.sin(q[4]))  # the wrist is on its side


def test_the_seed_of_a_configuration_that_fits_is_that_configuration(tmp_path: Path) -> None:
    cell = load_cell(write(tmp_path, "cell.yaml", ONE_ARM))
    chain, q = ScrewChain(cell.robot("kuka")), np.radians([20.0, -90.0, 120.0, 30.0, 60.0, -20.0])
    goal = chain.tool_poses(q[None])[0]

    assert np.array_equal(led_to(chain, cell.task("ring"), q, goal, X_WR=np.eye(4)), q)


def test_a_holder_near_its_grasp_is_moved_onto_it(cells: Path) -> None:
    """A start that a second holder would be refused for: it closes the loop from a degree away."""
    cell = load_cell(cells / "load_sharing_planar.yaml")
    toolpaths = {task.name: build_toolpath(task, cell.part) for task in cell.tasks}
    from dataclasses import replace

    from cellplan.planning.start.given import examine_given_starts
    from cellplan.planning.start.search import choose_start
    from cellplan.planning.timing.schedule import clock_paths
    from cellplan.scene.scene import Scene

    q = choose_start(Scene.from_cell(cell), clock_paths(cell, toolpaths.values())).start
    starts = {robot.name: q[cell.columns(robot.name)] for robot in cell.robots}
    starts["right"] = starts["right"] + np.radians([0.3, -0.4, 1.0])
    off = replace(cell, robots=tuple(replace(robot, start=starts[robot.name]) for robot in cell.robots))

    placed, (moved,) = with_seeds(off, toolpaths)

    assert examine_given_starts(placed, toolpaths) is None
    np.testing.assert_allclose(placed.robot("right").start, q[cell.columns("right")], atol=1e-9)
    assert (moved.robot, moved.task) == ("right", "right@part")
    assert abs(moved.moved) == pytest.approx(np.radians(1.0), abs=1e-9)


@pytest.mark.slow
def test_the_same_cell_near_its_run_is_the_same_program(earlier: Path, tmp_path: Path) -> None:
    assert (
        run(["solve", str(earlier.parent / "cell.yaml"), "--near", str(earlier), "-o", str(tmp_path / "r"), "-q"]) == 0
    )

    for table in (earlier / "tables").iterdir():
        assert (tmp_path / "r" / "tables" / table.name).read_bytes() == table.read_bytes()
    record = json.loads((tmp_path / "r" / "report.json").read_text(encoding="utf-8"))
    assert record["solver"]["moved_starts"] == []
    assert "near:run" in record["inputs"]


def test_a_moved_base_keeps_the_branch_and_the_report_says_by_how_much(
    earlier: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cell = write(tmp_path, "placed.yaml", MOVED)

    assert run(["solve", str(cell), "--near", str(earlier), "-o", str(tmp_path / "r"), "-q"]) == 0

    out = capsys.readouterr().out
    assert np.abs(first_row(tmp_path / "r", "kuka") - first_row(earlier, "kuka")).max() < np.radians(15.0)
    assert np.array_equal(first_row(tmp_path / "r", "idle"), first_row(earlier, "idle"))
    assert f"of the run 'run' its tool is {np.linalg.norm([30, -20, 10]):.3f} mm and 0.000 deg off" in out
    (moved,) = json.loads((tmp_path / "r" / "report.json").read_text(encoding="utf-8"))["solver"]["moved_starts"]
    assert (moved["robot"], moved["task"], moved["run"]) == ("kuka", "ring", "run")
    assert "moved: of the run" in (tmp_path / "r" / "report.html").read_text(encoding="utf-8")
    assert run(["verify", str(tmp_path / "r"), "--cell", str(cell), "-q"]) == 0
    assert run(["verify", str(tmp_path / "r"), "-q"]) == 0


def test_the_start_of_a_run_in_the_cell_is_a_seed_after_the_base_moved(earlier: Path, tmp_path: Path) -> None:
    start = np.degrees(first_row(earlier, "kuka")).tolist()
    cell = write(tmp_path, "given.yaml", MOVED.replace("150]}, start_deg: auto", f"150]}}, start_deg: {start}"))

    assert run(["solve", str(cell), "-o", str(tmp_path / "r"), "-q"]) == 0

    assert np.abs(first_row(tmp_path / "r", "kuka") - first_row(earlier, "kuka")).max() < np.radians(10.0)
    (moved,) = json.loads((tmp_path / "r" / "report.json").read_text(encoding="utf-8"))["solver"]["moved_starts"]
    assert moved["run"] is None
    assert run(["verify", str(tmp_path / "r"), "--cell", str(cell), "-q"]) == 0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            ONE_ARM.replace("  idle:", "  other:"),
            r":3: robots: expected the robots idle, kuka as in the run '.*run' of",
        ),
        (
            ONE_ARM.replace("idle: {model: kuka_kr6", "idle: {model: ur10e"),
            r":5: robots\.idle\.model: expected the joints .* as in the run '.*run' of --near, got shoulder_pan, ",
        ),
        (ONE_ARM.replace("  ring:", "  disc:"), r":7: tasks: expected a task of the same name and robot as in the run"),
    ],
    ids=["robots", "joints", "tasks"],
)
def test_a_run_that_does_not_fit_is_one_located_line(
    earlier: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, said: str
) -> None:
    cell = write(tmp_path, "cell.yaml", text)

    assert run(["solve", str(cell), "--near", str(earlier), "-o", str(tmp_path / "r"), "-q"]) == 2

    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert re.search(rf"cell\.yaml{said}", err)


def test_what_is_no_run_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cell = write(tmp_path, "cell.yaml", ONE_ARM)

    assert run(["solve", str(cell), "--near", str(tmp_path), "-o", str(tmp_path / "r"), "-q"]) == 2

    assert capsys.readouterr().err == f"error: {tmp_path}: expected the folder of a run, got no manifest.json in it\n"


def test_a_branch_that_ends_before_the_task_is_no_solution(
    earlier: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cell = write(tmp_path, "far.yaml", ONE_ARM.replace("[0, 0, 0]", "[-900, 0, 0]"))

    assert run(["solve", str(cell), "--near", str(earlier), "-o", str(tmp_path / "r"), "-q"]) == 3

    said = capsys.readouterr().err
    assert "far.yaml:4: robots.kuka.start_deg: the branch of the run 'run' leads 'kuka' to the start of task " in said
    assert "its tool began 900 mm" in said


@pytest.mark.slow
def test_every_block_of_a_program_keeps_its_branch(tmp_path: Path) -> None:
    open_starts = re.sub(r"    start_deg: \[7.*\n", "", PICK_AND_PLACE)
    first = write(tmp_path, "first.yaml", open_starts)
    second = write(tmp_path, "second.yaml", open_starts.replace("[1300, 950, 500]", "[1330, 930, 500]"))
    assert run(["solve", str(first), "-o", str(tmp_path / "a"), "-q"]) == 0

    assert run(["solve", str(first), "--near", str(tmp_path / "a"), "-o", str(tmp_path / "b"), "-q"]) == 0
    assert run(["solve", str(second), "--near", str(tmp_path / "a"), "-o", str(tmp_path / "c"), "-q"]) == 0

    for table in (tmp_path / "a" / "tables").iterdir():
        assert (tmp_path / "b" / "tables" / table.name).read_bytes() == table.read_bytes()
    for phase in ("grip", "work-1", "work-2", "lower"):
        before, after = (
            json.loads((tmp_path / run / phase / "series.json").read_text(encoding="utf-8"))["joints"] for run in "ac"
        )
        for robot, joints in before.items():
            for joint, curves in joints.items():
                assert after[robot][joint]["position_deg"][0] == pytest.approx(curves["position_deg"][0], abs=10.0)
    record = json.loads((tmp_path / "c" / "report.json").read_text(encoding="utf-8"))
    assert {moved_start["task"] for moved_start in record["solver"]["moved_starts"]} == {"seam", "ring"}
    assert run(["verify", str(tmp_path / "c"), "--cell", str(second), "-q"]) == 0


def test_check_never_passes_beside_a_trial_with_a_fault(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cell = write(tmp_path, "hasty.yaml", ONE_ARM.replace("duration_s: 4", "duration_s: 0.2"))

    assert run(["check", str(cell), "-q"]) == 1

    out = capsys.readouterr().out
    assert out.startswith("one-arm-at-a-box: failed\n")
    assert re.search(r"no trial was without fault: kuka/\w+ is .* above its top speed; cellplan solve decides", out)


def test_check_names_what_collides_on_trial(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A post that the tool comes to in the middle of its path, free at the start."""
    post = "environment:\n  post: {box: {size_mm: [60, 20, 20]}, at: {xyz_mm: [800, -40, 700]}}\n"
    rod = "[0, 0, 150], bodies: [{capsule: {radius_mm: 10, length_mm: 120}, at: {xyz_mm: [0, 0, 70]}}]}, start"
    text = ONE_ARM.replace("[0, 0, 150]}, start", rod).replace("motion:", f"{post}motion:")
    cell = write(tmp_path, "post.yaml", text)

    status = run(["check", str(cell), "--json", "-q"])

    record = json.loads(capsys.readouterr().out)
    trial = next(check for check in record["checks"] if check["name"] == "start_trial")
    assert (status, trial["passed"], record["status"]) == (1, False, "failed")
    assert re.search(r"'kuka/[^']+' touches 'post' at \d+ % of the way", trial["message"])
