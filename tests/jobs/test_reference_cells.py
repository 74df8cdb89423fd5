"""The four robots of Ribeiro 2010, chapter 5, in the three modes, and the planar pair of appendix E."""

import json
from dataclasses import replace

import numpy as np
import pytest
from builders.solution_memo import solved_anew
from builders.timed_cells import case_of
from builders.two_phases import PAIR
from builders.uncertified import uncertified

from cellplan import load_cell, solve, verify, write_run
from cellplan.files.cell.write import render_cell
from cellplan.model.settings.task import ToleranceEntry
from cellplan.model.solver import Integrator
from cellplan.runs.overrides import with_overrides

pytestmark = pytest.mark.usefixtures("stored_solutions")

COARSE = {"motion.step_s": 0.005, "solver.gain_per_s": 200}  # the gain goes with the step


@pytest.fixture(scope="module")
def four_robots(cells):
    return solve(load_cell(cells / "four_robots.yaml"))


@pytest.fixture(scope="module")
def coarse(cells):
    """The same cell on a clock of 5 ms, for what holds on every clock."""
    return solve(load_cell(cells / "four_robots.yaml").with_values(COARSE))


@pytest.fixture(scope="module")
def initial(cells):
    return uncertified(load_cell(cells / "four_robots_initial.yaml"))


@pytest.fixture(scope="module")
def pairs(cells):
    return solve(with_overrides(load_cell(cells / "four_robots.yaml"), mode="pairwise"))


@pytest.fixture(scope="module")
def at_rest(cells):
    return uncertified(with_overrides(load_cell(cells / "four_robots.yaml"), mode="part_at_rest"))


def failed(report, name):
    return {check.subject: check for check in report.checks if check.name == name and not check.passed}


def tightest_margin(report):
    return np.degrees(min(use.margin for use in report.joints))


def highest_speed(report):
    return max(use.peak_velocity / use.velocity_limit for use in report.joints)


def largest_errors(report):
    """Position in mm and orientation in deg over all tasks."""
    position = max(np.linalg.norm(a.position_error, axis=1).max() for a in report.accuracy)
    orientation = max(np.linalg.norm(a.orientation_error, axis=1).max() for a in report.accuracy)
    return 1e3 * position, np.degrees(orientation)


def test_four_robots_conform_at_four_seconds(four_robots):
    report = four_robots.runs[0].report
    position, orientation = largest_errors(report)

    assert four_robots.passed
    assert len(report.times) == 4001
    assert report.cycle_time == 4.0
    assert position <= 0.003
    assert orientation <= 0.001
    assert tightest_margin(report) == pytest.approx(37.0, abs=1.0)
    assert highest_speed(report) == pytest.approx(0.35, abs=0.02)


def test_first_layout_breaks_kuka_b2_and_staubli_c4(initial):
    broken = failed(initial.runs[0].report, "joint_position")

    assert not initial.passed
    assert set(broken) == {"kuka/B2", "staubli/C4"}
    assert "beyond its upper limit 35 deg" in broken["kuka/B2"].message
    assert "beyond its upper limit 150 deg" in broken["staubli/C4"].message
    assert not failed(initial.runs[0].report, "joint_velocity")


@pytest.mark.slow
def test_pairwise_passes_for_each_task_while_the_others_stand_still(pairs):
    assert pairs.passed
    assert [run.name for run in pairs.runs] == ["circle", "rhombus", "rectangle"]
    for run in pairs.runs:
        operator = run.schedule.tasks[0].task.robot
        still = {robot: np.ptp(q, axis=0).max() for robot, q in run.report.q.items()}
        assert {robot for robot, range_ in still.items() if range_ > 0} == {"reis", operator}
        assert largest_errors(run.report)[0] <= 0.003


def test_with_the_part_at_rest_staubli_d4_and_f4_break_position_and_speed(at_rest):
    report = at_rest.runs[0].report

    assert not at_rest.passed
    assert set(failed(report, "joint_position")) == {"staubli/D4", "staubli/F4"}
    assert set(failed(report, "joint_velocity")) == {"staubli/D4", "staubli/F4"}
    assert np.ptp(report.q["reis"], axis=0).max() == 0.0


@pytest.mark.slow
def test_positioner_works_harder_together_than_in_pairs_and_operators_hardest_alone(four_robots, pairs, at_rest):
    """The qualitative conclusion of section 5.6: travel of the REIS and of the operators in modes 1, 2 and 3."""

    def travel(run, robot):
        return sum(use.travel for use in run.report.joints if use.robot == robot)

    alone, together = at_rest.runs[0], four_robots.runs[0]
    for run in pairs.runs:
        operator = run.schedule.tasks[0].task.robot
        assert travel(together, "reis") > travel(run, "reis")
        assert travel(alone, operator) > travel(run, operator)


def test_planar_pair_of_appendix_e(cells):
    report = solve(load_cell(cells / "planar_pair.yaml")).runs[0].report
    position, orientation = largest_errors(report)
    assert len(report.times) == 12001
    assert position < 0.003
    assert np.radians(orientation) < 1e-12


@pytest.mark.slow
def test_euler_reference_agrees_with_a_finer_one(cells):
    """The redundancy is resolved too: the final configuration at half the step is the same to first order."""
    cell = with_overrides(load_cell(cells / "four_robots.yaml"), duration=4.0)
    gain = cell.motion.step * cell.solver.gain
    ends = []
    for step in (2e-3, 1e-3):
        timed = replace(
            cell, motion=replace(cell.motion, step=step), solver=cell.solver.changed(gain_per_s=gain / step)
        )
        ends.append(case_of(timed).resolved(integrator=Integrator.EULER).q[-1])
    assert np.degrees(np.abs(ends[0] - ends[1]).max()) < 0.06  # Euler at 1 ms is 0.024 deg from the limit


@pytest.mark.slow
def test_moving_the_whole_cell_changes_nothing(coarse):
    cell = coarse.cell
    X = np.eye(4)
    X[:3, :3] = [[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]
    X[:3, 3] = [3.0, -1.0, 0.0]  # the floor stays where it is
    elsewhere = replace(cell, robots=tuple(replace(r, X_WB=X @ r.X_WB) for r in cell.robots))

    moved = solve(elsewhere).runs[0]

    assert np.abs(moved.motion.q - coarse.runs[0].motion.q).max() < 1e-9  # rounding over all steps
    for kind, minimum in coarse.runs[0].report.clearance.minima.items():
        assert moved.report.clearance.minima[kind].minimum == pytest.approx(
            minimum.minimum, abs=2e-4
        )  # [m] twice 0.1 mm


@pytest.mark.slow
def test_written_tables_verify_and_any_edit_shows(coarse):
    tables = dict(coarse.runs[0].program.tables)
    assert verify(coarse.cell, tables).passed

    lines = tables["kuka"].split("\n")
    time, first, *rest = lines[400].split(",")
    lines[400] = ",".join([time, f"{float(first) + 1.0:.6f}", *rest])
    report = verify(coarse.cell, tables | {"kuka": "\n".join(lines)})

    assert not report.passed
    assert set(failed(report, "position_error")) == {"circle"}
    assert set(failed(report, "joint_velocity")) == {"kuka/A2"}


def test_swapped_or_missing_tables_are_refused(sound):
    from cellplan.errors import InputError

    cell = load_cell(sound / "cell" / "small.yaml")
    tables = dict(solve(cell).runs[0].program.tables)
    with pytest.raises(InputError, match="expected one for each of"):
        verify(cell, {name: text for name, text in tables.items() if name != "left"})
    with pytest.raises(InputError):
        verify(cell, tables | {"left": tables["right"]})


def test_run_folder_holds_what_it_promises(four_robots, tmp_path):
    folder = tmp_path / "run"
    write_run(four_robots, folder)
    record = json.loads((folder / "report.json").read_text())

    assert {path.name for path in folder.iterdir()} == {
        "cell.yaml",
        "floor_plan.svg",
        "manifest.json",
        "plots",
        "report.html",
        "report.json",
        "series.json",
        "still.svg",
        "tables",
        "view.html",
    }
    assert {path.stem for path in (folder / "tables").iterdir()} == {"reis", "kuka", "abb", "staubli", "clock"}
    assert record["status"] == "passed"
    assert record["cycle_time_s"] == 4.0
    assert record["tasks"]["circle"]["max_position_error_mm"] <= 0.003
    assert record["joints"]["reis"]["B1"]["margin"] == pytest.approx(37.0, abs=1.0)


@pytest.mark.slow
def test_same_input_gives_the_same_bytes(coarse, cells, tmp_path):
    """For pictures: what they are painted from; that painting repeats itself is tested with the plots."""
    write_run(coarse, tmp_path / "first")
    with solved_anew():
        again = solve(load_cell(cells / "four_robots.yaml").with_values(COARSE))
    write_run(again, tmp_path / "second")
    files = sorted(path.relative_to(tmp_path / "first") for path in (tmp_path / "first").rglob("*") if path.is_file())
    assert len(files) > 20
    for name in files:
        assert (tmp_path / "first" / name).read_bytes() == (tmp_path / "second" / name).read_bytes(), name


def test_resolved_cell_gives_the_same_motion(cells, tmp_path):
    coarse = uncertified(load_cell(cells / "four_robots.yaml").with_values(COARSE))
    (tmp_path / "cell.yaml").write_text(render_cell(coarse.cell), encoding="utf-8")
    again = uncertified(load_cell(tmp_path / "cell.yaml"))
    np.testing.assert_array_equal(again.runs[0].motion.q, coarse.runs[0].motion.q)


@pytest.mark.slow
def test_failed_run_leaves_no_tables_unless_asked(cells, tmp_path):
    initial = solve(load_cell(cells / "four_robots_initial.yaml"))
    write_run(initial, tmp_path / "plain")
    write_run(initial, tmp_path / "kept", keep_rejected=True)

    assert not (tmp_path / "plain" / "tables").exists()
    assert not (tmp_path / "plain" / "rejected").exists()
    assert not (tmp_path / "kept" / "tables").exists()
    tables = {path.stem: path.read_text() for path in (tmp_path / "kept" / "rejected").iterdir()}
    assert set(tables) == {"clock", *(robot.name for robot in initial.cell.robots)}
    for robot in initial.cell.robots:
        assert "# verdict: REJECTED: joint kuka/B2 is" in tables[robot.name]


@pytest.mark.slow
def test_pairwise_writes_one_program_and_a_report_for_each_task(pairs, tmp_path):
    write_run(pairs, tmp_path / "run")
    record = json.loads((tmp_path / "run" / "report.json").read_text())
    assert list(record["runs"]) == ["circle", "rhombus", "rectangle"]
    assert (tmp_path / "run" / "tables" / "staubli.csv").is_file()
    for name in record["runs"]:
        assert not (tmp_path / "run" / name / "tables").exists()
        assert json.loads((tmp_path / "run" / name / "report.json").read_text())["status"] == "passed"


@pytest.mark.slow
def test_idle_robots_stand_at_homes_that_are_free_of_the_part(pairs, cells, tmp_path):
    """At their own tasks two of them would be in its way; the thesis takes them out of the cell altogether."""
    cell = load_cell(cells / "four_robots.yaml")
    write_run(pairs, tmp_path / "run")
    record = json.loads((tmp_path / "run" / "report.json").read_text())
    assert record["status"] == "passed"
    assert "before_you_run" not in record
    (line,) = [line for line in record["not_in_program"] if line.startswith("rectangle: ")]
    assert line.startswith("rectangle: idle in this run: kuka, abb stand at their homes; moves to and from home")
    homes = [check.subject for check in pairs.runs[2].report.checks if check.name == "home" and check.passed]
    assert homes == ["kuka", "abb"]
    for name in homes:
        assert not np.allclose(pairs.cell.robot(name).home, cell.robot(name).start, atol=1e-3)


def test_one_failed_run_withholds_the_tables_of_all(tmp_path):
    """With 1 nm allowed Euler's first circle cannot pass; the second alone would, but the job as a whole did not."""
    (tmp_path / "cell.yaml").write_text(PAIR, encoding="utf-8")
    cell = with_overrides(load_cell(tmp_path / "cell.yaml"), integrator="euler")
    first, second = (
        replace(task, tolerance=ToleranceEntry(position_mm=1e3 * position, orientation_deg=np.degrees(1e-3)))
        for task, position in zip(cell.tasks, (1e-9, 1e-3), strict=True)
    )
    cell = replace(cell, tasks=(first, second))
    solution = solve(cell)
    assert [run.report.passed for run in solution.runs] == [False, True]

    write_run(solution, tmp_path / "plain")
    write_run(solution, tmp_path / "kept", keep_rejected=True)

    assert not list((tmp_path / "plain").rglob("*.csv"))
    assert not list((tmp_path / "kept").rglob("tables"))
    header = (tmp_path / "kept" / "rejected" / "right.csv").read_text()
    assert "# verdict: REJECTED: first: position error of task 'first'" in header
