"""A program of two phases: its rows on one clock, what the gate says of forged ones, and how it is exported."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from builders.two_phases import PAIR, seal_program

from cellplan import Solution, export_program, load_cell, open_gate, solve, verify, write_run
from cellplan.errors import InputError, NotVerifiedError
from cellplan.files.run.clock_table import parse_clock
from cellplan.files.run.joint_tables import parse_table
from cellplan.model.motion.plan import Hold, Transfer

pytestmark = pytest.mark.usefixtures("stored_solutions")

ROWS = 201  # of each phase: 2 s in steps of 10 ms


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Solution]:
    """The cell file and its solution; the run is written beside it."""
    file = tmp_path_factory.mktemp("phases") / "pair.yaml"
    file.write_text(PAIR, encoding="utf-8")
    solution = solve(load_cell(file))
    write_run(solution, file.parent / "run")
    return file, solution


def test_the_plan_has_a_phase_for_each_task_and_says_what_lies_between(solved: tuple[Path, Solution]) -> None:
    first, between, second = solved[1].plan.phases

    assert [(phase.name, phase.begin, phase.end) for phase in (first, between, second)] == [
        ("first", 0.0, 2.0),
        ("first to second", 2.0, 2.01),
        ("second", 2.01, 4.01),
    ]
    assert (first.in_program, between.in_program, second.in_program) == (True, False, True)
    assert set(between.roles.values()) == {Transfer("second")}
    assert first.roles["right"] == second.roles["left"] == Hold(at_home=True)
    assert solved[1].plan.process == {"first": ((0.0, 2.0),), "second": ((2.01, 4.01),)}
    assert all(run.report.phases == solved[1].plan.phases for run in solved[1].runs)


def test_all_phases_stand_in_one_table_per_robot_with_a_line_between_them(solved: tuple[Path, Solution]) -> None:
    folder = solved[0].parent / "run"
    assert sorted(path.name for path in (folder / "tables").iterdir()) == ["clock.csv", "left.csv", "right.csv"]
    assert sorted(path.name for path in folder.iterdir()) == [
        *("cell.yaml", "first", "floor_plan.svg", "manifest.json", "report.html", "report.json", "second"),
        *("still.svg", "tables", "view.html"),
    ]
    for robot in ("left", "right"):
        text = (folder / "tables" / f"{robot}.csv").read_text()
        table = parse_table(text, robot)
        assert table.gaps == {ROWS: "first to second"}
        assert "# remark: phases first, second: the motion from each to the next is not part of the program; " in text
        for place, run in enumerate(solved[1].runs):
            rows = table.q[place * ROWS : (place + 1) * ROWS]
            assert np.array_equal(rows, run.report.q[robot])


def test_the_clock_states_phase_length_and_process_of_every_row(solved: tuple[Path, Solution]) -> None:
    text = (solved[0].parent / "run" / "tables" / "clock.csv").read_text()
    clock = parse_clock(text, "clock.csv").table

    assert np.array_equal(clock.times, np.round(0.01 * np.arange(2 * ROWS), 12))
    assert np.array_equal(clock.sigma, clock.times)
    assert clock.phases == ("first",) * ROWS + ("second",) * ROWS
    assert clock.lengths["first"][[0, ROWS - 1, -1]] == pytest.approx([0.0, 0.2 * np.pi, 0.2 * np.pi], rel=1e-6)
    assert clock.lengths["second"][[0, ROWS, -1]] == pytest.approx([0.0, 0.0, 0.2 * np.pi], rel=1e-6)
    assert clock.process["first"].tolist() == [True] * ROWS + [False] * ROWS
    assert clock.process["second"].tolist() == [False] * ROWS + [True] * ROWS


def test_the_gate_verifies_each_phase_and_export_cuts_the_program_there(
    solved: tuple[Path, Solution], tmp_path: Path
) -> None:
    run = open_gate(solved[0].parent / "run", cell=solved[0])

    assert [motion.name for motion in run.motions] == ["first", "second"]
    assert run.motion.plan == solved[1].plan
    assert len(run.motion.times) == 2 * ROWS
    files = export_program(run, tmp_path / "programs")
    assert sorted(files) == ["first/left.csv", "first/right.csv", "second/left.csv", "second/right.csv"]
    for name in files:
        rows = (tmp_path / "programs" / name).read_text().splitlines()[1:]
        assert (len(rows), rows[0].split(",")[0]) == (ROWS, "0.000000000")


def test_tables_of_a_program_are_verified_phase_by_phase(solved: tuple[Path, Solution]) -> None:
    cell, solution = solved[1].cell, solved[1]
    report = verify(cell, solution.program.tables, task="second")

    assert report.passed
    assert report.accuracy[0].task == "second"
    assert np.array_equal(report.q["right"], solution.runs[1].report.q["right"])
    with pytest.raises(InputError) as caught:
        verify(cell, solution.program.tables)
    assert str(caught.value) == "task: this cell has one phase per task: expected one of first, second, got none"


def edited(name: str, old: str, new: str) -> Callable[[Path], None]:
    def edit(run: Path) -> None:
        path = run / "tables" / name
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new, 1))

    return edit


def without_line(name: str, start: str) -> Callable[[Path], None]:
    def edit(run: Path) -> None:
        path = run / "tables" / name
        lines = path.read_text().splitlines(keepends=True)
        path.write_text("".join(line for line in lines if not line.startswith(start)))

    return edit


def swapped_phases(run: Path) -> None:
    """The rows of the second phase first, on the clock of the first one, in every table."""
    for path in (run / "tables").iterdir():
        lines = path.read_text().splitlines()
        top = next(k for k, line in enumerate(lines) if line.startswith("time_s")) + 1
        first, gap, second = lines[top : top + ROWS], lines[top + ROWS], lines[top + ROWS + 1 :]
        times = [line.split(",")[: 2 if path.stem == "clock" else 1] for line in first + second]
        rows = [line.split(",")[len(times[0]) :] for line in second + first]
        both = [",".join(clock + row) for clock, row in zip(times, rows, strict=True)]
        path.write_text("\n".join([*lines[:top], *both[:ROWS], gap, *both[ROWS:]]) + "\n")


def moved_holder(run: Path) -> None:
    """The idle robot moves a little in the first phase, and is back at its end."""
    path = run / "tables" / "right.csv"
    lines = path.read_text().splitlines()
    top = next(k for k, line in enumerate(lines) if line.startswith("time_s")) + 1
    fields = lines[top + 100].split(",")
    lines[top + 100] = ",".join([fields[0], repr(float(fields[1]) + 1e-5), *fields[2:]])
    path.write_text("\n".join(lines) + "\n")


def moved_by_a_step(run: Path) -> None:
    """The gap stands one row later in every table, the clock among them."""
    for path in (run / "tables").iterdir():
        lines = path.read_text().splitlines()
        gap = next(k for k, line in enumerate(lines) if line.startswith("# not part of"))
        lines[gap], lines[gap + 1] = lines[gap + 1], lines[gap]
        path.write_text("\n".join(lines) + "\n")


FORGERIES: dict[str, tuple[Callable[[Path], None], str]] = {
    "sigma shifted in one row": (
        edited("clock.csv", "\n1.0,1.0,first", "\n1.0,1.0049,first"),
        "tables/clock.csv:105: sigma_s: expected 1.0 as in the plan of the cell, got 1.0049",
    ),
    "sigma that falls": (
        edited("clock.csv", "\n1.0,1.0,first", "\n1.0,0.5,first"),
        "tables/clock.csv:105: sigma_s: expected a time that never falls, got 0.5 after 0.99",
    ),
    "a row of another phase": (
        edited("clock.csv", "\n2.0,2.0,first", "\n2.0,2.0,second"),
        "tables/clock.csv:205: phase: expected first as in the plan of the cell, got second",
    ),
    "process flipped": (
        edited("clock.csv", "\n2.01,2.01,second,628.318530718,0,", "\n2.01,2.01,second,628.318530718,1,"),
        "tables/clock.csv:207: first_process: expected 0 as in the plan of the cell, got 1",
    ),
    "another length": (
        edited("clock.csv", "\n4.01,4.01,second,628.318530718,0,628.3", "\n4.01,4.01,second,628.318530718,0,629.3"),
        "tables/clock.csv:407: second_s_mm: expected 628.31853071",
    ),
    "a time of its own": (
        edited("clock.csv", "\n1.0,1.0,first", "\n1.001,1.0,first"),
        "tables/clock.csv:105: time_s: expected 1.0 as in the plan of the cell, got 1.001",
    ),
    "no gap in the clock": (
        without_line("clock.csv", "# not part of"),
        "tables/clock.csv:206: expected the line '# not part of the program: first to second' "
        "before this row, got none",
    ),
    "no gap in a table": (
        without_line("left.csv", "# not part of"),
        "tables/left.csv:214: expected the line '# not part of the program: first to second'",
    ),
    "gaps one row later": (moved_by_a_step, "expected the line '# not part of the program: first to second'"),
    "a gap of another name": (
        edited("right.csv", "program: first to second", "program: second to first"),
        "before this row, got 'second to first'",
    ),
    "swapped phases": (swapped_phases, "tables/clock.csv:5: phase: expected first as in the plan of the cell, got"),
    "an idle robot that moves": (
        moved_holder,
        "A: expected the position at the start of the phase 'first', in which 'right' holds still, got another one",
    ),
    "another cell": (edited("clock.csv", "# cell: in-turns", "# cell: other"), "tables/clock.csv:2: cell: expected"),
    "other tasks": (
        edited("clock.csv", "first_s_mm,first_process,second_s_mm,second_process", "a_s_mm,a_process,b_s_mm,b_process"),
        "tables/clock.csv:4: expected the tasks first, second, got a, b",
    ),
}


@pytest.mark.parametrize("kind", FORGERIES)
def test_a_forged_program_is_refused_with_file_and_line(
    kind: str, solved: tuple[Path, Solution], tmp_path: Path
) -> None:
    forge, message = FORGERIES[kind]
    shutil.copytree(solved[0].parent / "run", tmp_path / "run")
    forge(tmp_path / "run")
    seal_program(tmp_path / "run")

    with pytest.raises(InputError) as caught:
        open_gate(tmp_path / "run", cell=solved[0])

    assert message in str(caught.value)
    assert str(tmp_path / "run" / "tables") in str(caught.value)


def test_a_clock_of_another_program_is_refused(solved: tuple[Path, Solution], tmp_path: Path) -> None:
    shutil.copytree(solved[0].parent / "run", tmp_path / "run")
    clock = tmp_path / "run" / "tables" / "clock.csv"
    lines = clock.read_text().splitlines(keepends=True)
    seal_program(tmp_path / "run")
    clock.write_text("".join([*lines[:2], f"# program digest: sha256 {'0' * 64}\n", *lines[3:]]))
    record = json.loads((tmp_path / "run" / "manifest.json").read_text())
    from cellplan.files.input.files import digest

    data = clock.read_bytes()
    record["files"]["tables/clock.csv"] = {"bytes": len(data), "sha256": digest(data)}
    (tmp_path / "run" / "manifest.json").write_text(json.dumps(record, indent=2, ensure_ascii=False) + "\n")

    with pytest.raises(InputError, match=r"clock\.csv:3: program digest: differs from that of this run"):
        open_gate(tmp_path / "run", cell=solved[0])


def test_a_row_that_was_edited_is_named_in_the_second_phase_too(solved: tuple[Path, Solution], tmp_path: Path) -> None:
    shutil.copytree(solved[0].parent / "run", tmp_path / "run")
    path = tmp_path / "run" / "tables" / "right.csv"
    lines = path.read_text().splitlines()
    row = next(k for k, line in enumerate(lines) if line.startswith("3.0,"))
    fields = lines[row].split(",")
    lines[row] = ",".join([fields[0], repr(float(fields[1]) + 0.5), *fields[2:]])
    path.write_text("\n".join(lines) + "\n")

    with pytest.raises(InputError, match=rf"right\.csv:{row + 1}: A: expected .* as in series\.json, got"):
        open_gate(tmp_path / "run", cell=solved[0])


def test_a_defect_of_the_second_phase_fails_its_checks(solved: tuple[Path, Solution], tmp_path: Path) -> None:
    shutil.copytree(solved[0].parent / "run", tmp_path / "run")
    path = tmp_path / "run" / "tables" / "right.csv"
    lines = path.read_text().splitlines()
    row = next(k for k, line in enumerate(lines) if line.startswith("3.0,"))
    fields = lines[row].split(",")
    lines[row] = ",".join([fields[0], repr(float(fields[1]) + 0.5), *fields[2:]])
    path.write_text("\n".join(lines) + "\n")
    seal_program(tmp_path / "run")

    with pytest.raises(NotVerifiedError, match=r"tables: second: position error of task 'second'"):
        open_gate(tmp_path / "run", cell=solved[0])
