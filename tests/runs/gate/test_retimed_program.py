"""Programs that are retimed: limits and tool paths of their rows, what the gate takes from them, and forged ones."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from builders.two_phases import PAIR, seal_program

from cellplan import Cell, Solution, export_program, load_cell, open_gate, solve, verify, write_run
from cellplan.errors import InputError, NotVerifiedError
from cellplan.files.run.clock_table import parse_clock

FEED = 700.0  # [mm/s]
TOP = 4  # header lines of the clock


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Cell:
    file = tmp_path_factory.mktemp("retimed") / "pair.yaml"
    text = PAIR.replace("step_s: 0.01}", "step_s: 0.01, timing: fastest}")
    file.write_text(text.replace("robot: left,", f"robot: left, feed_mm_s: {FEED:g},"), encoding="utf-8")
    return load_cell(file)


@pytest.fixture(scope="module")
def solved(cell: Cell) -> tuple[Path, Solution]:
    """The run folder and its solution."""
    run = Path(cell.origin.file).parent / "run"
    solution = solve(cell)
    write_run(solution, run)
    return run, solution


def test_a_joint_or_a_feed_binds_and_no_limit_is_exceeded(solved: tuple[Path, Solution]) -> None:
    first, second = (run.report for run in solved[1].runs)

    assert first.passed
    assert second.passed
    for report in (first, second):
        shares = [use.peak / use.limit for use in report.accelerations.joints if use.limit is not None]
        shares += [use.peak_velocity / use.velocity_limit for use in report.joints]
        assert max(shares) <= 1.0
    assert 0.9 < 1e3 * first.accelerations.process["first"].peak / FEED <= 1.0
    assert max(use.peak / (use.limit or np.inf) for use in second.accelerations.joints) > 0.9
    assert second.times[-1] < 0.6 * 2.0


def test_the_tools_stay_on_their_paths_and_the_order_of_events_stays(solved: tuple[Path, Solution]) -> None:
    motion = solved[1].motion

    assert np.array_equal(motion.times, np.round(0.01 * np.arange(len(motion.times)), 12))
    for run in solved[1].runs:
        assert np.abs(run.report.accuracy[0].position_error).max() < 1e-9
        rows = motion.rows(run.phase)
        assert motion.sigma[rows][[0, -1]].tolist() == [run.phase.begin, run.phase.end]
        assert np.all(np.diff(motion.sigma[rows]) > 0.0)
    begins = [phase.begin for phase in solved[1].runs[0].report.phases]
    assert begins == [0.0, *motion.times[[motion.rows(solved[1].plan.program[0]).stop - 1, -1 - len_of(solved[1], 1)]]]


def len_of(solution: Solution, place: int) -> int:
    """Steps of one phase."""
    return len(solution.runs[place].report.times) - 1


def test_the_gate_verifies_it_and_export_takes_it(solved: tuple[Path, Solution], tmp_path: Path) -> None:
    run = open_gate(solved[0])

    assert np.array_equal(run.motion.sigma, solved[1].motion.sigma)
    assert [len(motion.schedule.times) - 1 for motion in run.motions] == [len_of(solved[1], 0), len_of(solved[1], 1)]
    assert len(export_program(run, tmp_path / "programs")) == 4


def test_tables_are_verified_with_their_clock_only(solved: tuple[Path, Solution]) -> None:
    solution, program = solved[1], solved[1].program

    report = verify(solution.cell, program.tables, task="first", clock=program.clock)

    assert report.passed
    with pytest.raises(
        InputError, match=r"clock: expected the text of tables/clock\.csv, as motion\.timing is fastest"
    ):
        verify(solution.cell, program.tables, task="first")


def test_a_demanded_cycle_is_kept_to_the_row_and_a_shorter_one_refused(
    cell: Cell, solved: tuple[Path, Solution]
) -> None:
    least = 0.01 * len_of(solved[1], 0)
    slower = solve(cell.with_values({"motion.timing": {"cycle_s": 1.5}}), task="first")

    assert slower.motion.times[-1] == 1.5
    fast, slow = (entry.runs[0].report.accelerations.process["first"].peak for entry in (solved[1], slower))
    assert slow == pytest.approx(fast * least / 1.5, rel=0.01)
    with pytest.raises(InputError, match=rf"motion\.timing: expected a cycle of at least {least:g} s, in which all"):
        solve(cell.with_values({"motion.timing": {"cycle_s": 0.5}}), task="first")


def test_what_has_a_time_of_its_own_cannot_be_retimed(cell: Cell) -> None:
    with pytest.raises(InputError, match=r"tasks\.first\.settle_s: expected 0 in a program that is retimed"):
        cell.with_values({"tasks.first.settle_s": 0.1})
    with pytest.raises(InputError, match=r"timing\.cycle_s: expected a multiple of step_s = 0\.01, got 1\.005"):
        cell.with_values({"motion.timing": {"cycle_s": 1.005}})


def clock_rows(change: Callable[[list[list[str]]], None]) -> Callable[[Path], None]:
    """An edit of the fields of all lines behind the header of the clock."""

    def edit(run: Path) -> None:
        path = run / "tables" / "clock.csv"
        lines = path.read_text().splitlines()
        rows = [line.split(",") for line in lines[TOP:]]
        change(rows)
        path.write_text("\n".join([*lines[:TOP], *(",".join(row) for row in rows)]) + "\n")

    return edit


def shifted(rows: list[list[str]]) -> None:
    rows[40][1] = repr(float(rows[40][1]) + 0.004)


def swapped(rows: list[list[str]]) -> None:
    rows[40][1:], rows[41][1:] = rows[41][1:], rows[40][1:]


def still(rows: list[list[str]]) -> None:
    rows[41][1:] = rows[40][1:]


def without_begin(rows: list[list[str]]) -> None:
    gap = next(k for k, row in enumerate(rows) if row[0].startswith("#"))
    rows[gap + 1][1] = repr(float(rows[gap + 1][1]) + 0.001)


def without_end(rows: list[list[str]]) -> None:
    rows[-1][1] = repr(float(rows[-1][1]) - 0.001)


FORGERIES: dict[str, tuple[Callable[[list[list[str]]], None], str]] = {
    "sigma shifted in one row": (shifted, "clock.csv:45: first_s_mm: expected "),
    "two rows swapped": (swapped, "clock.csv:46: sigma_s: expected a time that never falls, got"),
    "sigma that stands still": (still, "clock.csv:46: sigma_s: expected more than in the row before, got"),
    "the begin of a phase missing": (
        without_begin,
        "sigma_s: expected 2.01, at which the phase 'second' begins, got 2.01",
    ),
    "the end missing": (without_end, "sigma_s: expected 4.01, at which the phase 'second' ends, got 4.00"),
}


@pytest.mark.parametrize("kind", FORGERIES)
def test_forged_nominal_times_are_refused_with_file_and_line(
    kind: str, solved: tuple[Path, Solution], tmp_path: Path
) -> None:
    forge, message = FORGERIES[kind]
    shutil.copytree(solved[0], tmp_path / "run")
    clock_rows(forge)(tmp_path / "run")
    seal_program(tmp_path / "run")

    with pytest.raises(InputError) as caught:
        open_gate(tmp_path / "run")

    assert message in str(caught.value)
    assert str(tmp_path / "run" / "tables" / "clock.csv") in str(caught.value)


def test_nominal_times_that_are_forged_with_their_lengths_fail_as_tool_errors(
    solved: tuple[Path, Solution], tmp_path: Path
) -> None:
    from cellplan.files.run.clock_table import render_clock
    from cellplan.planning.path.build import build_toolpath
    from cellplan.planning.timing.schedule import clock_path

    shutil.copytree(solved[0], tmp_path / "run")
    file = tmp_path / "run" / "tables" / "clock.csv"
    written = parse_clock(file.read_text(), "clock.csv")
    table, cell = written.table, solved[1].cell
    table.sigma[40] += 0.004
    path = clock_path(cell, cell.task("first"), build_toolpath(cell.task("first"), cell.part))
    table.lengths["first"][40] = path.targets(table.sigma[40:41])[2][0]
    file.write_text(render_clock(table, cell=written.cell, program=written.program))
    seal_program(tmp_path / "run")

    with pytest.raises(NotVerifiedError, match=r"tables: first: position error of task 'first'"):
        open_gate(tmp_path / "run")
