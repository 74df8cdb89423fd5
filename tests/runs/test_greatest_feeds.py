"""The greatest feeds: what holds while a little more does not, what binds where, and how several tasks share them."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.home_to_home import PICK_AND_PLACE
from builders.three_feeds import THREE_FEEDS, approached

from cellplan import Cell, Solution, export_program, load_cell, open_gate, solve, write_run
from cellplan.checks.joints.greatest_feeds import greatest_feeds
from cellplan.errors import InputError, NoSolutionError
from cellplan.model.progress import silent
from cellplan.model.report.between_rows import BetweenError, BetweenRows
from cellplan.model.report.greatest_feed import BETWEEN_ROWS, GreatestFeed
from cellplan.runs.greatest_feeds import open_feeds
from cellplan.runs.solve import solve_motion
from cellplan.scene.scene import Scene

WRITTEN = {"motion.timing": "as_written"}


def cell_of(folder: Path, text: str, **feeds: object) -> Cell:
    file = folder / "cell.yaml"
    file.write_text(text, encoding="utf-8")
    return load_cell(file).with_values(WRITTEN | {f"tasks.{task}.process.feed_mm_s": it for task, it in feeds.items()})


def planned(cell: Cell) -> Solution:
    return solve_motion(cell, task=None, progress=silent)[1]


def answers(solution: Solution) -> dict[str, GreatestFeed]:
    return {feed.task: feed for run in solution.runs for feed in run.report.greatest_feeds}


def feeds_of(solution: Solution) -> dict[str, float]:
    return {task.name: task.process.feed_mm_s for task in solution.cell.tasks}


def failed(solution: Solution) -> set[str]:
    return {check.name for run in solution.runs for check in run.report.checks if not check.passed}


@pytest.fixture(scope="module")
def common(tmp_path_factory: pytest.TempPathFactory) -> Solution:
    folder = tmp_path_factory.mktemp("common")
    return planned(cell_of(folder, THREE_FEEDS, bead="greatest", seam="greatest", ring="greatest"))


@pytest.mark.slow
def test_the_greatest_feed_holds_and_a_little_more_does_not(tmp_path: Path, common: Solution) -> None:
    more = cell_of(tmp_path, THREE_FEEDS, **{task: 1.003 * feed for task, feed in feeds_of(common).items()})

    assert "joint_acceleration_assumed" not in failed(common)
    assert "joint_acceleration_assumed" in failed(planned(more))


@pytest.mark.slow
def test_one_feed_for_all_and_what_binds_it_is_named_with_its_place(common: Solution) -> None:
    assert len(set(feeds_of(common).values())) == 1
    ring = answers(common)["ring"]
    assert ring.greatest == pytest.approx(ring.feed, rel=2e-3)
    assert (ring.binding, ring.kind, ring.is_in_ramp) == ("top B", "acceleration", False)
    assert ring.at == pytest.approx(0.75 * 2.0 * np.pi * 0.03, rel=0.01)  # where the arm is stretched
    assert re.fullmatch(r"joint top B, acceleration, at 14\d(\.\d)? mm", ring.text)


@pytest.mark.slow
def test_the_resolved_cell_states_the_feeds_and_gives_the_same_tables(tmp_path: Path, common: Solution) -> None:
    again = planned(cell_of(tmp_path, THREE_FEEDS, **feeds_of(common)))

    assert again.program.tables == common.program.tables


def test_the_curve_scales_with_the_feed_it_was_run_along_at(tmp_path: Path) -> None:
    """Between the ramps: at half the feed the same joints move along the same path."""
    text = approached()
    curves = [
        answers(planned(cell_of(tmp_path, text, ring=feed).with_values({"motion.step_s": 0.4 / feed})))["ring"]
        for feed in (60, 30)
    ]
    inside = np.linspace(0.01, 0.17, 200)

    fast, slow = (np.interp(inside, curve.travelled, curve.feeds) for curve in curves)

    assert np.allclose(fast, slow, rtol=0.02)  # differences over rows 0.4 mm and 0.2 mm apart


@pytest.mark.slow
def test_feeds_keep_their_ratios(tmp_path: Path) -> None:
    text = THREE_FEEDS.replace("process: {feed_mm_s: 50,", "process: {feed_mm_s: greatest, feed_ratio: 2,")

    feeds = feeds_of(planned(cell_of(tmp_path, text, ring="greatest")))

    assert feeds["seam"] == pytest.approx(2.0 * feeds["ring"], rel=1e-5)
    assert feeds["bead"] == 40.0


@pytest.mark.slow
def test_leximin_lets_the_others_rise_beyond_the_one_that_binds(tmp_path: Path, common: Solution) -> None:
    text = THREE_FEEDS.replace("timing: fastest", "greatest_feeds: leximin")

    feeds = feeds_of(planned(cell_of(tmp_path, text, bead=[10, 80], seam="greatest", ring="greatest")))

    assert feeds["ring"] == pytest.approx(feeds_of(common)["ring"], rel=1e-2)
    assert feeds["bead"] == pytest.approx(80.0, rel=6e-3)
    assert feeds["seam"] > 81.0


@pytest.mark.slow
def test_the_greatest_feed_holds_in_the_rows_of_a_retimed_program_too(tmp_path: Path) -> None:
    cell = cell_of(tmp_path, THREE_FEEDS, ring="greatest").with_values({"motion.timing": "fastest"})

    solution = solve(cell)

    assert solution.passed
    assert answers(solution)["ring"].greatest >= answers(solution)["ring"].feed


@pytest.mark.slow
def test_blocks_of_a_program_have_feeds_of_their_own(tmp_path: Path) -> None:
    process = "process: {feed_mm_s: greatest, ramp_mm: 20}\n    standoff_mm: [0, 5000]\n    path: {"
    text = PICK_AND_PLACE.replace("path: {", process).replace("duration_s: 3, ", "")

    solution = solve(cell_of(tmp_path, text))

    assert solution.passed
    assert {run.phase.name for run in solution.runs if run.report.greatest_feeds} == {"work-1", "work-2"}
    feeds = answers(solution)
    assert len({feed.feed for feed in feeds.values()}) == 2
    for feed in feeds.values():
        assert feed.feed <= feed.greatest <= 1.002 * feed.feed


@pytest.mark.slow
def test_a_range_without_a_feed_that_holds_is_refused_with_what_binds(tmp_path: Path) -> None:
    with pytest.raises(NoSolutionError) as caught:
        planned(cell_of(tmp_path, THREE_FEEDS, ring=[55, 90]))

    match = re.fullmatch(
        r".*tasks\.ring\.process\.feed_mm_s: feed 55 mm/s cannot be held: joint top B, acceleration, at 14\S+ mm; "
        r"the greatest is (\S+) mm/s",
        str(caught.value),
    )
    assert match, str(caught.value)
    assert 30.0 < float(match[1]) < 50.0


def test_ranges_without_one_feed_for_both_are_refused_by_the_other_task(tmp_path: Path) -> None:
    cell = cell_of(tmp_path, THREE_FEEDS, bead=[10, 20], ring=[30, 60])

    message = r"tasks\.ring\.process\.feed_mm_s: expected at most 20 mm/s .* task 'bead' .*, got 30;"
    with pytest.raises(InputError, match=message):
        planned(cell)


def test_a_feed_that_the_rows_are_too_few_for_is_said_with_the_cure(tmp_path: Path) -> None:
    (opened,) = open_feeds(cell_of(tmp_path, THREE_FEEDS, ring="greatest"))
    places = np.array([0.0, 0.1])
    greatest = GreatestFeed(
        task="ring",
        feed=0.05,
        travelled=places,
        feeds=places + 0.04,
        binding="ring",
        kind=BETWEEN_ROWS,
        at=0.02,
        at_s=1.0,
    )

    assert opened.refusal(0.06, greatest).endswith(
        ": tasks.ring.process.feed_mm_s: feed 60 mm/s cannot be held: ring, tolerance between rows, at 20 mm; the "
        "greatest is 50 mm/s; a smaller motion.step_s allows more"
    )


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"tasks.ring.process.feed_mm_s": "greatest", "motion.duration_s": 9},
            "tasks.ring.process.feed_mm_s: expected a number beside motion.duration_s, as a feed that is sought sets "
            "the clock; leave motion.duration_s out",
        ),
        (
            {"tasks.ring.process.feed_mm_s": [10, 90], "motion.timing": {"cycle_s": 9}},
            "tasks.ring.process.feed_mm_s: expected a number beside motion.timing.cycle_s, as a feed that is sought "
            "sets the clock; leave motion.timing.cycle_s out",
        ),
        (
            {"tasks.ring.process.feed_mm_s": [90, 10]},
            "tasks.ring.process.feed_mm_s: expected [low, high], got [90, 10]: the smaller feed comes first",
        ),
        (
            {"tasks.ring.process.feed_mm_s": "fastest"},
            "tasks.ring.process.feed_mm_s: expected a number above 0 in mm/s, greatest or [low, high], got 'fastest'",
        ),
        (
            {"tasks.ring.process.feed_ratio": 2},
            "tasks.ring.process.feed_ratio: unexpected key, the feed is stated: write feed_mm_s: greatest, or leave "
            "it out",
        ),
    ],
)
def test_what_contradicts_an_open_feed_is_refused(tmp_path: Path, values: dict[str, object], message: str) -> None:
    cell = cell_of(tmp_path, THREE_FEEDS)

    with pytest.raises(InputError, match=re.escape(message)):
        cell.with_values(values)


def test_with_ramps_of_a_length_all_motion_scales_with_the_feed(tmp_path: Path) -> None:
    text = approached().replace("process: {feed_mm_s: 60}", "process: {feed_mm_s: 60, ramp_mm: 20}")
    cells = (cell_of(tmp_path, text, ring=feed) for feed in (30, 60))
    steps = ({"motion.step_s": s, "motion.controller_cycle_ms": 1000.0 * s} for s in (0.01, 0.005))
    slow, fast = (planned(cell.with_values(values)) for cell, values in zip(cells, steps, strict=True))

    ends = [next(run.report.accuracy[2].end_s - 0.5 for run in one.runs) for one in (slow, fast)]

    assert ends[0] == pytest.approx(2.0 * ends[1])
    inside = np.linspace(0.01, 0.17, 200)  # away from the approach, which keeps its time
    curves = [np.interp(inside, answers(one)["ring"].travelled, answers(one)["ring"].feeds) for one in (slow, fast)]
    assert np.allclose(*curves, rtol=1e-5)


def test_either_a_time_or_a_length_of_ramps(tmp_path: Path) -> None:
    cell = cell_of(tmp_path, THREE_FEEDS)

    with pytest.raises(InputError, match=r"process\.ramp_mm: expected either ramp_s or ramp_mm, got both"):
        cell.with_values({"tasks.ring.process.ramp_s": 0.1, "tasks.ring.process.ramp_mm": 5})
    with pytest.raises(InputError, match=r"process\.ramp_mm: expected ramps that leave the feed of 60 mm/s some of"):
        planned(cell.with_values({"tasks.ring.process.ramp_mm": 95}))


def run_in(folder: Path, **changes: object) -> Cell:
    """The ring of the top arm with its runs, on which it comes to its feed and to rest."""
    text = approached().replace("process: {feed_mm_s: 60}", "process: {feed_mm_s: 60, run_in_mm: 20, run_out_mm: 15}")
    text = re.sub(r"start_deg: \[2\.3276.*\]", "start_deg: auto", text).replace("approach_mm: 60", "approach_mm: 5")
    return cell_of(folder, text).with_values({f"tasks.ring.{key}": value for key, value in changes.items()})


@pytest.mark.slow
def test_the_feed_holds_all_along_the_work_where_the_tool_runs_in_and_out(tmp_path: Path) -> None:
    (run,) = planned(run_in(tmp_path)).runs
    ring = run.schedule.tasks[2]
    ((begin, end),) = ring.process_on
    inside = (run.schedule.times >= begin) & (run.schedule.times <= end)

    speeds = np.diff(ring.travelled[inside]) / np.diff(run.schedule.times[inside])

    assert np.allclose(speeds, 0.06, rtol=1e-3)
    assert end - begin == pytest.approx(2.0 * np.pi * 0.03 / 0.06)
    assert ring.length == pytest.approx(2.0 * np.pi * 0.03 + 0.035)
    (answer,) = [it for it in run.report.greatest_feeds if it.task == "ring"]
    assert answer.travelled[0] == pytest.approx(-0.02)  # places count from the start of the work
    speed = run.report.accelerations.process["ring"]
    assert (speed.steady_share, speed.slower) == (1.0, ())
    assert speed.mean == pytest.approx(0.06, rel=1e-3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"process.on_delay_s": 1}, "process.on_delay_s: unexpected key beside a run in which the tool comes to its"),
        ({"process.off_delay_s": 1}, "process.off_delay_s: unexpected key beside a run in which the tool slows down"),
        ({"process.ramp_s": 1}, "process.ramp_s: unexpected key beside a run in which the tool comes to its feed"),
        ({"process.run_out_mm": 0, "process.lead_s": 0.1}, "process.lead_s: expected run_in_mm and run_out_mm beside"),
        (
            {"process.run_in_mm": 0, "process.run_out_mm": 0, "process.lift_mm": 5},
            "process.lift_mm: unexpected key without a run: write run_in_mm or run_out_mm",
        ),
        (
            {"process.lead_s": 0.7},
            "process.lead_s: expected at most 0.6667 s, which the tool takes along its run-in, got 0.7; make",
        ),
        (
            {"process.run_in_mm": 0, "process.ramp_mm": 195},
            "or make it shorter than 188.5 mm",
        ),
        (
            {"process.run_arc_mm": 5},
            "process.run_arc_mm: expected a tool that points across its path at both ends",
        ),
        ({"repeat": 2}, "process.run_in_mm: expected none beside repeat; leave one of them out"),
        (
            {"path.circle": None, "path.rectangle": {"sides_mm": [30, 30], "plane": "xy", "center_mm": [0, 120]}},
            "process.run_in_mm: expected a path without stops between its ends, got 3; round the corners",
        ),
        ({"process.run_in_mm": 900}, "expected a run-in within the reach of 'top', got one of 900 mm: 150 mm from the"),
        (
            {"process.run_tolerance_mm": 0.05},
            "process.run_tolerance_mm: expected at least 0.1 mm, the tolerance of the task, got 0.05; leave it out",
        ),
    ],
)
def test_runs_that_cannot_be_are_refused(tmp_path: Path, changes: dict[str, object], message: str) -> None:
    with pytest.raises((InputError, NoSolutionError), match=re.escape(message)):
        planned(run_in(tmp_path, **changes))


def test_the_share_of_a_controller_lowers_the_feeds_that_its_joints_bind(tmp_path: Path) -> None:
    cell = cell_of(tmp_path, THREE_FEEDS)
    full, lower = (answers(planned(cell.with_values({"robots.top.controller_share": share}))) for share in (1.0, 0.8))

    assert lower["ring"].greatest == pytest.approx(0.8 * full["ring"].greatest)
    assert lower["seam"].greatest == full["seam"].greatest


def controlled(decimals: int) -> dict[str, object]:
    """Values by which all three arms are programmed in step, with so many decimals of a degree."""
    tasks = {f"T_ROB{place}": f"ROB_{place}" for place in (1, 2, 3)}
    arms = zip(("left", "right", "top"), tasks, strict=True)
    control = {f"robots.{arm}.controller": {"id": "irc5", "task": task, "decimals": decimals} for arm, task in arms}
    return {"controllers": {"irc5": {"kind": "abb", "tasks": tasks}}} | control


@pytest.mark.parametrize("decimals", [2, 3, 4, None])
def test_rounding_of_programs_takes_its_part_of_the_tolerance_between_rows(
    tmp_path: Path, decimals: int | None
) -> None:
    """A turn of each of three parallel axes by half a unit moves the tip by that times its distance from the axis."""
    cell = cell_of(tmp_path, approached(), ring=60).with_values({} if decimals is None else controlled(decimals))
    solution = planned(cell)
    (run,), q = solution.runs, solution.motion.q
    angles = np.cumsum(q[:, cell.columns("top")], axis=1)
    arms = np.cumsum(([0.5, 0.4, 0.2] * np.exp(1j * angles))[:, ::-1], axis=1)
    off = 0.0 if decimals is None else np.deg2rad(0.5 * 10.0**-decimals) * np.abs(arms).sum(axis=1).max()
    none = BetweenError(largest=0.0, at_s=0.0, bound=0.0)
    large = BetweenRows(position=replace(none, largest=4e-4, at_s=run.report.accuracy[2].end_s - 1.0), orientation=none)
    accuracy = [replace(it, between=large) for it in run.report.accuracy]
    positions = {robot.name: q[:, cell.columns(robot.name)] for robot in cell.robots}

    ring = greatest_feeds(Scene.from_cell(cell), run.schedule, positions, accuracy)[-1]

    assert (ring.task, ring.kind) == ("ring", BETWEEN_ROWS)
    assert ring.greatest == pytest.approx(0.06 * ((1e-4 - min(off, 5e-5)) / 4e-4) ** 0.5, rel=1e-6)


@pytest.mark.slow
def test_programs_of_a_run_at_its_greatest_feeds_hold_the_tolerance_between_rows(tmp_path: Path) -> None:
    feeds = {"process": {"feed_mm_s": "greatest", "ramp_mm": 20}}
    cell = run_in(tmp_path, **{"process.feed_mm_s": "greatest", "retract_mm": 5})
    others = {f"tasks.{task}.{key}": value for task in ("bead", "seam") for key, value in feeds.items()}
    solution = solve(cell.with_values(controlled(3) | others | {"motion.step_s": 0.0625}))
    assert answers(solution)["ring"].kind == BETWEEN_ROWS
    write_run(solution, tmp_path / "run")

    names = export_program(open_gate(tmp_path / "run"), tmp_path / "rapid", form="rapid")

    assert {"left.mod", "right.mod", "top.mod"} <= set(names)
