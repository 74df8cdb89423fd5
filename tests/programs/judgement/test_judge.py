"""The judgement of written rows: sound ones pass, and whatever is changed in them is found."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.plain_dialect import dialect, job_of, read_back
from builders.two_phases import PAIR

from cellplan import load_cell, open_gate, solve, write_run
from cellplan.model.report.exported import Interpolation, ProgramRows, Promise, RobotRows
from cellplan.model.report.verified_run import ACCESS_TOKEN, VerifiedRun
from cellplan.model.settings.controllers import RobotControlEntry
from cellplan.programs.elements.corners import row_shares
from cellplan.programs.judgement.compare_rows import other_rows
from cellplan.programs.judgement.judge import judge
from cellplan.programs.judgement.round_rows import stops_left, with_rounding
from cellplan.programs.rows.resample import lead_time, resampled
from cellplan.programs.rows.rows import essential_rows, full_rows
from cellplan.programs.rows.thin import ThinningLimits, thinned
from cellplan.programs.shared import Shared
from cellplan.scene.scene import Scene

pytestmark = pytest.mark.usefixtures("stored_solutions")
CYCLES = {"left": 0.004, "right": 0.008, "idle": 0.012}
LIMITS = ThinningLimits(turn=5e-3, slide=1e-3, tool=5e-4)
DEGREE = float(np.deg2rad(1.0))
Change = Callable[[RobotRows], RobotRows]


@pytest.fixture(scope="module")
def run(sound: Path) -> VerifiedRun:
    return open_gate(sound / "run", cell=sound / "cell" / "small.yaml")


@pytest.fixture(scope="module")
def turns(tmp_path_factory: pytest.TempPathFactory) -> VerifiedRun:
    folder = tmp_path_factory.mktemp("turns")
    (folder / "cell.yaml").write_text(PAIR, encoding="utf-8")
    write_run(solve(load_cell(folder / "cell.yaml")), folder / "run")
    return open_gate(folder / "run", cell=folder / "cell.yaml")


def _changed(programs: tuple[ProgramRows, ...], robot: str, change: Change) -> tuple[ProgramRows, ...]:
    first = programs[0]
    return (replace(first, robots={**first.robots, robot: change(first.robots[robot])}), *programs[1:])


def _one_degree(rows: RobotRows) -> RobotRows:
    q = rows.q.copy()
    q[20, 1] += DEGREE
    return replace(rows, q=q)


def _swapped(rows: RobotRows) -> RobotRows:
    order = np.arange(len(rows))
    order[[15, 16]] = 16, 15
    return replace(rows, q=rows.q[order])


def _dropped(rows: RobotRows) -> RobotRows:
    left = np.delete(np.arange(len(rows)), 18)
    return replace(rows, q=rows.q[left], qd=rows.qd[left], times=rows.times[left], process=rows.process[left])


def _late(rows: RobotRows) -> RobotRows:
    return replace(rows, times=rows.times + 0.002 * (np.arange(len(rows)) > 20))


def _not_a_number(rows: RobotRows) -> RobotRows:
    return replace(rows, q=np.where(np.arange(len(rows))[:, None] == 5, np.nan, rows.q))


def test_all_rows_of_a_run_pass_and_hardly_deviate(run: VerifiedRun) -> None:
    job = job_of(run, full_rows(run))

    judgement = judge(run, dialect(decimals=9), job, read_back(job, decimals=9))

    assert judgement.findings == ()
    assert {deviation.subject for deviation in judgement.deviations} >= {"left/A", "right/C", "the tool of task 'path'"}
    assert max(deviation.largest for deviation in judgement.deviations) < 1e-6


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (_one_degree, r"robot 'right': row 21: expected joint B at "),
        (_swapped, r"robot 'right': row 16: expected joint A at "),
        (_dropped, r"robot 'right': expected 41 rows of 3 joints, read 40 of 3"),
        (_late, r"robot 'right': row 22: expected the time 0.525 s, read 0.527 s"),
        (_not_a_number, r"robot 'right': read a position that is not a finite number"),
        (lambda rows: replace(rows, marks=(0,)), r"robot 'right': expected waits at rows \[\], read \[0\]"),
        (lambda rows: replace(rows, process=~rows.process), "expected a process that is on from row 1 on, read off"),
    ],
)
def test_what_was_changed_after_it_was_written_is_found(run: VerifiedRun, change: Change, message: str) -> None:
    job = job_of(run, full_rows(run))

    judgement = judge(run, dialect(decimals=9), job, _changed(read_back(job, decimals=9), "right", change))

    assert len(judgement.findings) == 1
    assert re.search(message, judgement.findings[0])


def test_a_missing_robot_or_program_is_found(run: VerifiedRun) -> None:
    job = job_of(run, full_rows(run))
    read = read_back(job, decimals=9)
    fewer = replace(read[0], robots={name: rows for name, rows in read[0].robots.items() if name != "idle"})

    assert judge(run, dialect(decimals=9), job, ()).findings == ("expected 1 programs, read 0",)
    assert judge(run, dialect(decimals=9), job, (fewer,)).findings == (
        "expected rows of left, right, idle, read those of left, right",
    )


def test_rows_that_were_wrong_before_they_were_written_are_found_by_the_checks(run: VerifiedRun) -> None:
    """The writer and the reader agree: only the demands of the cell can tell."""
    job = job_of(run, _changed(full_rows(run), "right", _one_degree))

    judgement = judge(run, dialect(decimals=9), job, read_back(job, decimals=9))

    assert any("position error of task 'path'" in finding for finding in judgement.findings)
    assert any("exceeds its acceleration limit" in finding for finding in judgement.findings)
    largest = max(judgement.deviations, key=lambda deviation: deviation.largest if deviation.unit == "deg" else 0.0)
    assert (largest.subject, largest.at_s) == ("right/B", 0.5)
    assert largest.largest == pytest.approx(1.0, abs=1e-6)


def _turned_to(*degrees: float) -> Change:
    """A robot that stands somewhere else."""
    return lambda rows: replace(rows, q=np.zeros_like(rows.q) + np.deg2rad(degrees))


def test_a_row_beyond_a_limit_is_found_whatever_is_promised(run: VerifiedRun) -> None:
    job = job_of(run, _changed(full_rows(run), "left", _turned_to(171, 0, 0)), promise=Promise.SEQUENCE_ONLY)
    without_times = {name: replace(rows, times=None) for name, rows in job.programs[0].robots.items()}

    judgement = judge(run, dialect(decimals=9), job, (replace(job.programs[0], robots=without_times),))

    assert any("joint left/A is 1 deg beyond its upper limit 170 deg" in finding for finding in judgement.findings)
    assert judgement.not_judged == (
        "speeds, accelerations, feeds and loads: the controllers choose their own times",
        "times: the files state none",
    )


def test_robots_that_meet_are_found(turns: VerifiedRun) -> None:
    """The arm that waits lies across the other one."""
    job = job_of(turns, _changed(full_rows(turns), "right", _turned_to(-30, 0, 0)), promise=Promise.SEQUENCE_ONLY)

    result = judge(turns, dialect(decimals=9), job, read_back(job, decimals=9)).findings

    assert result[0].startswith("robot 'right' holds from 0.000 to 2.000 s: joint B is ")
    assert any(finding.startswith("first: clearance: left/") and " touch, at " in finding for finding in result[1:])


def test_pairs_that_come_nearer_than_demanded_are_named_with_the_amount_and_a_cure(run: VerifiedRun) -> None:
    """Rows as they are, of a cell that demands half a metre: findings say which pair, how near, and what helps."""
    strict = replace(run.cell, checks=run.cell.checks.changed(clearance_mm=500.0))
    job = job_of(run, full_rows(run), promise=Promise.SEQUENCE_ONLY)

    judgement = judge(
        replace(run, cell=strict, token=ACCESS_TOKEN), dialect(decimals=9), job, read_back(job, decimals=9)
    )

    near = [finding for finding in judgement.findings if finding.startswith("clearance: ")]
    assert len(near) > 1
    wording = r"(come as near as|are proved to keep) [0-9.]+ mm"
    form = rf"clearance: \S+ and \S+ {wording} .*, at [0-9.]+ s, demanded 500 mm; let "
    assert all(re.match(form, finding) for finding in near)


def test_every_program_of_a_run_is_judged(turns: VerifiedRun) -> None:
    full = full_rows(turns)
    job = job_of(turns, full)
    wrong = (full[0], replace(full[1], robots={**full[1].robots, "right": _one_degree(full[1].robots["right"])}))
    other = job_of(turns, wrong)

    assert [program.name for program in full] == ["first", "second"]
    assert judge(turns, dialect(decimals=9), job, read_back(job, decimals=9)).findings == ()
    result = judge(turns, dialect(decimals=9), other, read_back(other, decimals=9)).findings
    assert any(finding.startswith("second: position error of task 'second'") for finding in result)
    assert not any(finding.startswith("first: ") for finding in result)


def test_resampled_rows_pass_on_their_own_cycles(run: VerifiedRun) -> None:
    job = job_of(run, [resampled(run.cell, program, CYCLES) for program in full_rows(run)])

    judgement = judge(run, dialect(), job, read_back(job, decimals=6), lead=lead_time(CYCLES))
    early = judge(run, dialect(), job, read_back(job, decimals=6), lead=0.0)

    assert judgement.findings == ()
    assert any("position error" in finding for finding in early.findings)


def test_a_cubic_is_judged_between_its_rows(run: VerifiedRun) -> None:
    """Speeds that do not fit the rows leave every row in its place and take the tool off its path between them."""

    def other_speed(rows: RobotRows) -> RobotRows:
        qd = rows.qd.copy()
        qd[20] += 1.5
        return replace(rows, qd=qd)

    cubic = dialect(decimals=9, interpolation=Interpolation.CUBIC)
    job = job_of(run, full_rows(run))
    read = read_back(job, decimals=9)

    assert judge(run, cubic, job, read).findings == ()
    result = judge(run, cubic, job, _changed(read, "right", other_speed)).findings
    assert any("position error of task 'path'" in finding for finding in result)


def test_thinned_rows_without_times_are_judged_as_a_path(run: VerifiedRun) -> None:
    scene, names = Scene.from_cell(run.cell), [robot.name for robot in run.cell.robots]
    programs = [
        thinned(scene, program, groups=[names], limits=LIMITS, essential_rows=essential)
        for program, essential in zip(full_rows(run), essential_rows(run), strict=True)
    ]
    job = job_of(run, programs, promise=Promise.SEQUENCE_ONLY)
    sparse = dialect(decimals=5, is_thinned=True)

    judgement = judge(run, sparse, job, read_back(job, decimals=5, with_times=False))

    assert judgement.findings == ()
    tool = next(
        deviation
        for deviation in judgement.deviations
        if deviation.subject == "the tool of task 'path'" and deviation.unit == "mm"
    )
    assert 0.01 < tool.largest <= 1e3 * LIMITS.tool + 0.01


def _trembling(rows: RobotRows) -> RobotRows:
    """A robot at rest that goes to and fro by little: slow, but with large accelerations."""
    q = rows.q.copy()
    q[:, 0] += np.where(np.arange(len(q)) % 2 == 0, 2e-3, -2e-3)
    return replace(rows, q=q)


def test_rows_on_the_cycle_of_a_controller_are_judged_as_they_are_played(run: VerifiedRun) -> None:
    """As rows that are written one by one; a format that is thinned otherwise leaves its profile to the controller."""
    one_by_one, sparse = dialect(decimals=9), dialect(decimals=9, is_thinned=True)
    on_cycle = replace(sparse, at_cycle=True)
    job = job_of(run, _changed(full_rows(run), "idle", _trembling))
    read = read_back(job, decimals=9)

    result = {
        name: judge(run, form, job, read)
        for name, form in {"one": one_by_one, "sparse": sparse, "cycle": on_cycle}.items()
    }

    assert any("acceleration" in finding for finding in result["cycle"].findings)
    assert result["cycle"].findings == result["one"].findings
    assert not any("acceleration" in finding for finding in result["sparse"].findings)
    assert result["cycle"].not_judged == ()
    assert len(result["sparse"].not_judged) == 1


def test_decimals_of_a_robot_count_in_the_language_of_its_controller_only(run: VerifiedRun) -> None:
    stated = replace(run.cell.robot("right"), control=RobotControlEntry(id="one", decimals=2))
    cell = replace(run.cell, robots=tuple(stated if robot.name == "right" else robot for robot in run.cell.robots))
    job = job_of(run, full_rows(run))
    job = replace(job, frame=replace(job.frame, cell=cell))
    read = _changed(read_back(job, decimals=9), "right", lambda rows: replace(rows, q=rows.q + 0.004 * DEGREE))
    table = dialect(decimals=9)

    assert list(other_rows(replace(table, kinds=frozenset({"kuka"})), job, read)) == []
    assert len(list(other_rows(table, job, read))) == 1


def test_robots_that_are_not_exported_move_as_in_the_run(run: VerifiedRun) -> None:
    exported = tuple(replace(rows, robots={"right": rows.robots["right"]}) for rows in full_rows(run))
    job = job_of(run, exported)

    other = job_of(run, _changed(exported, "right", _one_degree))

    assert judge(run, dialect(decimals=9), job, read_back(job, decimals=9)).findings == ()
    result = judge(run, dialect(decimals=9), other, read_back(other, decimals=9)).findings
    assert any("position error of task 'path'" in finding for finding in result)


@pytest.mark.parametrize(("limits", "stops"), [(LIMITS, False), (replace(LIMITS, turn=0.1, tool=0.01), True)])
def test_rounded_corners_count_with_what_they_may_be_off(
    run: VerifiedRun, limits: ThinningLimits, *, stops: bool
) -> None:
    """Half of each segment may be rounded where rows are dense; some rows stay stops where segments are long."""
    scene, names = Scene.from_cell(run.cell), [robot.name for robot in run.cell.robots]
    few = [
        thinned(scene, program, groups=[names], limits=limits, essential_rows=essential)
        for program, essential in zip(full_rows(run), essential_rows(run), strict=True)
    ]
    sparse, job = dialect(decimals=9, is_thinned=True), job_of(run, few, promise=Promise.SEQUENCE_ONLY)

    chosen = with_rounding(sparse, job, shared=Shared(run))

    judgement = judge(run, sparse, chosen, read_back(chosen, decimals=9))
    left, count = stops_left(chosen)
    assert judgement.findings == ()
    assert (0 < left < count) if stops else left == 0
    assert judgement.rounded[0] == count - left
    wide = judge(run, sparse, replace(job, blend=0.5), read_back(job, decimals=9)).findings
    assert any("position error of task 'path'" in finding for finding in wide) == stops


def test_rows_that_are_read_with_more_rounding_than_written_are_found(run: VerifiedRun) -> None:
    """Units of fewer than six axes count as rounded by half."""
    job = replace(job_of(run, full_rows(run), promise=Promise.SEQUENCE_ONLY), blend=0.1)
    (read,) = read_back(job, decimals=9)
    name = next(iter(read.robots))
    allowed = row_shares(job, job.programs[0])[name]
    row = int(np.flatnonzero(allowed > 0.0)[0])

    def result(rounding: np.ndarray) -> tuple[str, ...]:
        robots = {**read.robots, name: replace(read.robots[name], rounding=rounding)}
        return judge(run, dialect(decimals=9), job, (replace(read, robots=robots),)).findings

    assert result(allowed) == ()
    assert result(np.zeros(len(allowed))) == ()
    wide = allowed.copy()
    wide[row] = 0.6
    assert result(wide) == (
        f"robot '{name}': row {row + 1}: expected rounding of at most 0.5 of the shorter segment, read 0.6",
    )


def test_what_rounded_rows_may_add_is_stated(run: VerifiedRun) -> None:
    job = job_of(run, full_rows(run), promise=Promise.SEQUENCE_ONLY)

    none, some, more = (
        judge(run, dialect(decimals=9), replace(job, blend=blend), read_back(job, decimals=9))
        for blend in (0.0, 0.1, 0.25)
    )

    assert none.corners == ()
    assert none.rounded[0] == 0 < some.rounded[0] == more.rounded[0] < more.rounded[1]
    assert {corner.subject for corner in some.corners} == {"the tool of task 'path'"}
    assert {corner.unit for corner in some.corners} == {"mm", "deg"}
    assert all(corner.largest > 0.0 for corner in some.corners)
    assert more.corners == some.corners  # units of fewer than six axes count as rounded by half
