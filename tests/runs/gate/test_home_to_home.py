"""A program from home to home: its phases and rows, the part where the cell says, and forged programs refused."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.home_to_home import PICK_AND_PLACE
from builders.two_phases import seal_program
from builders.uncertified import uncertified

from cellplan import Solution, export_program, load_cell, open_gate, solve, verify, write_run
from cellplan.checks.joints.joins import check_joins
from cellplan.errors import InputError, InvalidFileError, NotVerifiedError
from cellplan.files.run.clock_table import parse_clock
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.cell import Cell
from cellplan.scene.kinematics.pinocchio_model import CombinedModel

pytestmark = pytest.mark.usefixtures("stored_solutions")

PHASES = (
    *("transfer-1", "grip", "lift", "transfer-2", "work-1", "transfer-3", "work-2"),
    *("transfer-4", "lower", "release", "transfer-5"),
)


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Solution]:
    """The cell file and its solution, whose clearance is left to the slow tests."""
    file = tmp_path_factory.mktemp("home") / "cell.yaml"
    file.write_text(PICK_AND_PLACE, encoding="utf-8")
    return file, uncertified(load_cell(file))


@pytest.fixture(scope="module")
def written(solved: tuple[Path, Solution]) -> tuple[Path, Solution]:
    """The cell file and its whole solution; the run is written beside it."""
    file = solved[0]
    solution = solve(load_cell(file))
    write_run(solution, file.parent / "run")
    return file, solution


def tool_poses(cell: Cell, robot: str, q: Array) -> Array:
    """Tool poses in the world by pinocchio, shape (N, 4, 4)."""
    model = CombinedModel(cell)
    return np.array([model.state(row).X_WT[cell.index(robot)] for row in q])


def test_all_phases_pass_and_share_the_rows_in_which_they_meet(solved: tuple[Path, Solution]) -> None:
    solution = solved[1]

    assert solution.passed
    assert tuple(phase.name for phase in solution.plan.phases) == PHASES
    assert all(a.end == b.begin for a, b in zip(solution.plan.phases, solution.plan.phases[1:], strict=False))
    assert not solution.motion.gaps
    for phase, run in zip(solution.plan.phases, solution.runs, strict=True):
        rows = solution.motion.q[solution.motion.rows(phase)]
        together = np.concatenate([run.report.q[robot.name] for robot in solution.cell.robots], axis=1)
        assert np.allclose(rows, together, atol=1e-13)


def test_it_begins_and_ends_at_home_at_rest(solved: tuple[Path, Solution]) -> None:
    solution = solved[1]
    home = np.concatenate([robot.home for robot in solution.cell.robots if robot.home is not None])

    assert np.array_equal(solution.motion.q[[0, -1]], [home, home])
    assert solution.cell.robot("holder").home is not None
    for phase in solution.plan.phases:  # at rest where phases meet: speeds fall to zero with the step
        rows = solution.motion.q[solution.motion.rows(phase)]
        steps = np.abs(np.diff(rows, axis=0)).max(axis=1)
        assert max(steps[0], steps[-1]) < 0.15 * steps.max()


def test_the_part_is_gripped_and_put_down_where_the_cell_says(solved: tuple[Path, Solution]) -> None:
    cell, motion = solved[1].cell, solved[1].motion
    ends = {phase.name: motion.q[motion.rows(phase)][[0, -1]] for phase in solved[1].plan.phases}
    assert cell.program is not None
    assert cell.program.attach is not None
    assert cell.program.detach is not None
    grasp = cell.part.held_by[0].X_PT
    for name, end, place, lift in (
        *(("grip", -1, cell.program.attach, 0.0), ("lift", -1, cell.program.attach, 0.05)),
        *(("lower", 0, cell.program.detach, 0.05), ("release", 0, cell.program.detach, 0.0)),
    ):
        X_WP = tool_poses(cell, "holder", ends[name][end][None])[0] @ inverse(grasp)
        expected = place.X_WP.copy()
        expected[2, 3] += lift
        assert np.allclose(X_WP, expected, atol=1e-5)


def test_lifting_is_vertical_and_gripping_along_the_tool(solved: tuple[Path, Solution]) -> None:
    cell, motion = solved[1].cell, solved[1].motion
    for phase in solved[1].plan.phases:
        if phase.name in ("grip", "lift", "lower", "release"):
            X_WT = tool_poses(cell, "holder", motion.q[motion.rows(phase)])
            assert np.ptp(X_WT[:, :2, 3], axis=0).max() < 1e-4
            assert np.ptp(X_WT[:, 2, 3]) == pytest.approx(0.05, abs=1e-4)


def test_rows_keep_the_limits_by_plain_differences(solved: tuple[Path, Solution]) -> None:
    cell, q, step = solved[1].cell, solved[1].motion.q, solved[1].cell.motion.step
    velocity = np.concatenate([robot.model.velocity for robot in cell.robots])
    speeds = np.diff(q, axis=0) / step

    assert np.all(np.abs(speeds) <= velocity * (1.0 + 1e-9))
    assert np.all(np.abs(np.diff(speeds, axis=0)) / step <= 1.05 * velocity / 0.15)


def test_the_rows_in_which_phases_meet_are_judged_by_the_steps_on_both_sides(solved: tuple[Path, Solution]) -> None:
    cell, reports = solved[1].cell, [run.report for run in solved[1].runs]
    step, q = cell.motion.step, solved[1].motion.q
    joins = [solved[1].motion.rows(phase).start for phase in solved[1].plan.phases[1:]]
    bends = np.abs(q[[row + 1 for row in joins]] - 2.0 * q[joins] + q[[row - 1 for row in joins]]) / step**2
    limits = np.concatenate([robot.model.velocity for robot in cell.robots]) / 0.25

    (check,) = [check for check in reports[0].checks if check.name == "joint_acceleration_between_phases"]
    assert check.passed
    assert check.value / check.limit <= (bends / limits).max() * (1.0 + 1e-6) * 0.25 / 0.15

    turned = {**reports[3].q, "pen": reports[3].q["pen"] + np.array([[0.5]] + [[0.0]] * (len(reports[3].times) - 1))}
    broken = check_joins(cell, [*reports[:3], replace(reports[3], q=turned), *reports[4:]])
    assert not broken.passed
    assert "at the begin of transfer-2 exceeds its acceleration limit" in broken.message


@pytest.mark.slow
def test_verification_accepts_it_from_the_cell_file_and_each_phase_by_name(written: tuple[Path, Solution]) -> None:
    file, solution = written
    assert solution.passed
    run = open_gate(file.parent / "run", cell=file)

    assert [motion.name for motion in run.motions] == list(PHASES)
    assert np.allclose(run.motion.q, solution.motion.q, atol=1e-13)
    tables = dict(solution.program.tables.items())
    report = verify(solution.cell, tables, task="transfer-3", clock=solution.program.clock)
    assert report.passed
    assert report.conditioning is None
    with pytest.raises(InputError, match=r"expected one of transfer-1, grip, .*got 'seam'"):
        verify(solution.cell, tables, task="seam", clock=solution.program.clock)
    with pytest.raises(
        InputError, match=r"clock: expected the text of tables/clock.csv, as the program goes from home"
    ):
        verify(solution.cell, tables, task="grip")


@pytest.mark.slow
def test_it_is_exported_as_one_program_for_each_robot(written: tuple[Path, Solution], tmp_path: Path) -> None:
    file, solution = written
    files = export_program(open_gate(file.parent / "run", cell=file), tmp_path / "programs")

    assert files == ("holder.csv", "pen.csv")
    rows = np.loadtxt(tmp_path / "programs" / "holder.csv", delimiter=",", skiprows=1)
    assert np.allclose(rows[:, 0], solution.motion.times, atol=1e-9)
    assert np.allclose(np.radians(rows[:, 1:]), solution.motion.q[:, solution.cell.columns("holder")], atol=1e-10)


def test_the_record_says_how_each_transfer_was_found(solved: tuple[Path, Solution]) -> None:
    texts = {name: text for run in solved[1].runs for name, text in run.transfers.items()}

    assert set(texts) == {"transfer-1", "transfer-2", "transfer-3", "transfer-4", "transfer-5"}
    assert texts["transfer-1"] == "holder straight"


def _row(run: Path, robot: str, place: int) -> tuple[list[str], int]:
    lines = (run / "tables" / f"{robot}.csv").read_text().split("\n")
    first = next(index for index, line in enumerate(lines) if line.startswith("time_s")) + 1
    return lines, first + place


def shift_joint(run: Path, robot: str, place: int, by_deg: float) -> None:
    """Turn the first joint of a robot in one row."""
    lines, line = _row(run, robot, place)
    fields = lines[line].split(",")
    fields[1] = repr(float(fields[1]) + by_deg)
    lines[line] = ",".join(fields)
    (run / "tables" / f"{robot}.csv").write_text("\n".join(lines))


def edit_clock(run: Path, edit: Callable[[str], str]) -> None:
    path = run / "tables" / "clock.csv"
    path.write_text(edit(path.read_text()))


def first_row_of(run: Path, phase: str) -> int:
    clock = parse_clock((run / "tables" / "clock.csv").read_text(), "clock.csv").table
    return clock.phases.index(phase)


FORGERIES: dict[str, tuple[Callable[[Path], None], str]] = {
    "home": (lambda run: shift_joint(run, "holder", 0, 0.01), r"holder.csv:\d+: A1: expected the home of the cell"),
    "hold": (
        lambda run: shift_joint(run, "pen", first_row_of(run, "lift") + 5, 0.01),
        r"pen.csv:\d+: shoulder_pan: expected the position at the start of the phase 'lift', in which",
    ),
    "jump": (
        lambda run: shift_joint(run, "holder", first_row_of(run, "transfer-2") + 10, 3.0),
        r"transfer-2: joint holder/A1 exceeds its (velocity|acceleration) limit",
    ),
    "start": (
        lambda run: shift_joint(run, "holder", first_row_of(run, "work-2"), 0.01),
        r"work-2: position error of task 'ring': 0.203 mm at 0.000 s, allowed 0.1 mm",
    ),
    "swapped": (
        lambda run: edit_clock(run, lambda text: text.replace(",grip,", ",gr,").replace(",lift,", ",grip,")),
        r"clock.csv:\d+: phase: expected 'grip' as in the plan of the cell, got gr",
    ),
    "renamed": (
        lambda run: edit_clock(run, lambda text: text.replace(",transfer-5,", ",home,")),
        r"clock.csv:\d+: phase: expected 'transfer-5' as in the plan of the cell, got home",
    ),
    "process": (
        lambda run: edit_clock(run, lambda text: text.replace(",work-1,0.0,1,", ",work-1,0.0,0,", 1)),
        r"clock.csv:\d+: seam_process: expected 1 as in the plan of the cell, got 0",
    ),
}


@pytest.mark.slow  # quickly in `test_program_of_phases`, of a smaller cell
@pytest.mark.parametrize("name", FORGERIES)
def test_forged_programs_are_refused_with_their_place(
    name: str, written: tuple[Path, Solution], tmp_path: Path
) -> None:
    edit, words = FORGERIES[name]
    run = tmp_path / "run"
    shutil.copytree(written[0].parent / "run", run)
    edit(run)
    seal_program(run, robots=("holder", "pen"))

    with pytest.raises((InputError, InvalidFileError, NotVerifiedError), match=words):
        open_gate(run, cell=written[0])
