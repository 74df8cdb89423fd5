"""Promises: what is promised of an export, why not more, and when nothing can be promised."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.commands import run_command

from cellplan import VerifiedRun, open_gate
from cellplan.errors import InputError, NotVerifiedError
from cellplan.model.report.exported import Moves, Promise
from cellplan.model.report.verified_run import ACCESS_TOKEN
from cellplan.model.settings.controllers import ControllerEntry, KindName, RobotControlEntry
from cellplan.model.task.task import Service
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.export.choice import Choice, exported_robots
from cellplan.programs.export.prepare import prepare
from cellplan.programs.formats.csv import CSV
from cellplan.programs.promises.promises import ONE_CLOCK, choose_promise
from cellplan.programs.promises.skew import ClockPair, RunSkew

EVERY = ("left", "right", "idle")
IN_STEP = replace(CSV, name="in-step", promises=(Promise.SYNCHRONISED, Promise.SEQUENCE_ONLY))


@pytest.fixture(scope="module")
def run(sound: Path) -> VerifiedRun:
    return open_gate(sound / "run", cell=sound / "cell" / "small.yaml")


def on_controllers(run: VerifiedRun, controllers: dict[str, ControllerEntry], **robots: str) -> VerifiedRun:
    """The run with some of its robots on controllers."""
    placed = tuple(
        replace(robot, control=RobotControlEntry(id=robots[robot.name])) if robot.name in robots else robot
        for robot in run.cell.robots
    )
    cell = replace(run.cell, robots=placed, controllers=controllers)
    return replace(run, cell=cell, token=ACCESS_TOKEN)


def controllers(*names: str, kind: KindName = "kuka", latency_ms: float | None = None) -> dict[str, ControllerEntry]:
    return dict.fromkeys(names, ControllerEntry(kind=kind, latency_ms=latency_ms))


def test_robots_without_controllers_are_timed_for_one_controller(run: VerifiedRun) -> None:
    promise = choose_promise(run, CSV, EVERY)

    assert (promise.promise, promise.reasons, promise.remarks) == (Promise.TIMED, (), (ONE_CLOCK,))


def test_robots_of_one_controller_share_its_clock(run: VerifiedRun) -> None:
    one = on_controllers(run, controllers("c"), left="c", right="c", idle="c")

    assert choose_promise(one, CSV, EVERY).remarks == ()


@pytest.mark.parametrize(("form", "kind"), [("stream", "ur"), ("stream", "abb"), ("any", None)])
def test_an_interface_that_lags_needs_its_latency(run: VerifiedRun, form: str, kind: KindName | None) -> None:
    dialect = replace(CSV, name=form, lags=kind is None)
    bare = on_controllers(run, controllers("c", kind=kind or "kuka"), left="c")
    stated = on_controllers(run, controllers("c", kind=kind or "kuka", latency_ms=50.0), left="c")

    with pytest.raises(InputError, match=rf"controllers\.c\.latency_ms: expected .* {form} sends to them, got none"):
        choose_promise(bare, dialect, EVERY)
    promise = choose_promise(stated, dialect, EVERY)
    assert promise.promise is Promise.TIMED
    assert "controller c follows 50 ms late: start it that much earlier" in promise.remarks
    assert choose_promise(bare, dialect, ("right",)).promise is Promise.TIMED  # the other one is not exported


def test_a_stated_skew_beyond_the_allowed_one_is_not_timed(run: VerifiedRun) -> None:
    skew = RunSkew(pairs=(ClockPair(first="left", second="right", allowed=0.01, stated=0.025, reason="x"),), cycle=1.0)

    with pytest.raises(NotVerifiedError) as refusal:
        choose_promise(run, CSV, EVERY, skew=skew)

    said = str(refusal.value)
    assert "'left' and 'right': the stated skew of 25 ms is more than the allowed 10 ms" in said
    assert "a cycle of 2.5 s or more" in said  # the same motion at 1/2.5 of its speed
    alone = choose_promise(run, CSV, ("right",), skew=skew)
    assert alone.promise is Promise.TIMED
    assert any(remark.startswith("not to be played together with") for remark in alone.remarks)
    skewed = replace(skew, pairs=(replace(skew.pairs[0], stated=0.01),))
    assert choose_promise(run, CSV, EVERY, skew=skewed).promise is Promise.TIMED


def test_two_robots_of_one_controller_are_synchronised(run: VerifiedRun) -> None:
    both = on_controllers(run, controllers("c", "d"), left="c", right="c", idle="d")

    promise = choose_promise(both, IN_STEP, ("left", "right"))

    assert promise.promise is Promise.SYNCHRONISED
    assert promise.reasons == ("not timed: in-step programs cannot state it",)


def test_tools_are_moved_on_lines_in_step_only_where_a_format_has_targets_on_the_part(run: VerifiedRun) -> None:
    both = on_controllers(run, controllers("c", "d"), left="c", right="c", idle="d")
    on_lines = replace(IN_STEP, moves=tuple(Moves))

    with pytest.raises(NotVerifiedError) as refusal:
        choose_promise(both, on_lines, ("left", "right"), moves=Moves.LINEAR)
    assert "not synchronised: in-step moves tools by joints where robots move in step (--moves joints)" in str(
        refusal.value
    )
    for dialect, moves in ((replace(on_lines, has_part_targets=True), Moves.LINEAR), (on_lines, Moves.AUTO)):
        assert choose_promise(both, dialect, ("left", "right"), moves=moves).promise is Promise.SYNCHRONISED


def test_lines_in_step_are_those_of_the_only_arm(run: VerifiedRun) -> None:
    """Others move by joints, which is said where lines may be and refused where they must be."""
    both = on_controllers(run, controllers("c", "d"), left="c", right="c", idle="d")
    dialect, arms = replace(IN_STEP, moves=tuple(Moves), has_seams_in_step=True), ("left", "right")

    auto = choose_promise(both, dialect, arms, moves=Moves.AUTO)

    assert "no lines: in-step moves tools by joints where other than one arm move in step" in auto.remarks
    with pytest.raises(NotVerifiedError, match=r"where other than one arm move in step \(--moves joints\)"):
        choose_promise(both, dialect, arms, moves=Moves.LINEAR)


def test_programs_without_times_say_that_they_do_not_wait_while_a_tool_is_cleaned(run: VerifiedRun) -> None:
    one = on_controllers(run, controllers("c"), left="c", right="c", idle="c")
    service = Service(posture=np.zeros(6), takes=8.0, most=1)
    tasks = tuple(replace(it, via_before=(None, service)) if it.robot == "right" else it for it in one.cell.tasks)
    robots = tuple(replace(it, service=service if it.name == "right" else None) for it in one.cell.robots)
    cleaned = replace(one, cell=replace(one.cell, tasks=tasks, robots=robots), token=ACCESS_TOKEN)

    line = "no wait is written for the 8 s in which the tool of 'right' is cleaned"
    assert [line in it for it in choose_promise(cleaned, IN_STEP, EVERY).remarks] == [False, True]
    assert not any("is cleaned" in it for it in choose_promise(cleaned, CSV, EVERY).remarks)


@pytest.mark.parametrize(
    ("robots", "reason"),
    [
        (("right",), "it takes two robots on one controller, and only 'right' is exported"),
        (("left", "right"), r"the robots are on 2 controllers \(c, d\)"),
        (("right", "idle"), "left moves too and is not in the program of controller d"),
    ],
)
def test_what_is_not_synchronised_and_no_free_order_either_is_refused(
    run: VerifiedRun, robots: tuple[str, ...], reason: str
) -> None:
    apart = on_controllers(run, controllers("c", "d"), left="c", right="d", idle="d")

    with pytest.raises(NotVerifiedError, match=reason) as refusal:
        choose_promise(apart, IN_STEP, robots)

    first, detail, cure = refusal.value.findings
    assert cure.startswith("  cure: ")
    assert detail.startswith("  not synchronised: ")
    assert first.startswith("in-step: not sequence only: phase 'all tasks', ")
    assert first.endswith(
        "the part moves while the tool of 'right' is in process ('path'): another order spoils the tool path"
    )


def test_a_format_of_a_maker_writes_the_robots_of_its_controllers(run: VerifiedRun) -> None:
    dialect = replace(CSV, name="krl", kinds=frozenset({"kuka"}))
    cell = on_controllers(run, controllers("c") | controllers("d", kind="abb"), left="c", right="d").cell

    assert exported_robots(cell, dialect, ()) == ("left",)
    assert exported_robots(cell, CSV, ("idle", "left")) == ("left", "idle")
    with pytest.raises(InputError, match=r"robots\.idle\.controller: expected the controller that plays krl, got none"):
        exported_robots(cell, dialect, ("idle",))
    with pytest.raises(
        InputError, match=r"robots\.right\.controller: expected a controller of kind kuka, .*'d' of kind"
    ):
        exported_robots(cell, dialect, ("right",))
    with pytest.raises(InputError, match=r"robots\.left\.controller: expected the controller that plays krl, got none"):
        exported_robots(run.cell, dialect, ())
    with pytest.raises(InputError, match=r"--robot: expected one of left, right, idle, got 'rihgt', did you mean"):
        exported_robots(cell, dialect, ("rihgt",))


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        ({"split": 1}, "--split: expected 2 to 100 rows with other, got 1"),
        ({"split": 101}, "--split: expected 2 to 100 rows"),
        ({"thin_mm": 0.0}, "--thin-mm: expected a positive number, got 0"),
        ({"thin_deg": float("nan")}, "--thin-deg: expected a positive number, got nan"),
    ],
)
def test_choices_that_a_format_cannot_keep_are_refused(choice: dict[str, float], message: str) -> None:
    other = replace(CSV, name="other", split=100, is_thinned=True)

    with pytest.raises(InputError, match=message):
        Choice(**choice).refuse_for(other)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="with csv, whose"):
        Choice(**choice).refuse_for(CSV)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        ("--format krl --thin-mm 0", "--thin-mm: expected a positive number, got 0"),
        ("--format csv --split 20", "--split: expected no --split with csv, whose files have no limit"),
        ("--format csv --moves linear", "--moves: expected joints with csv, got linear"),
        ("--format wide --robot left", "--format: expected no choice of robots, rows or targets with wide, a table of"),
    ],
)
def test_a_choice_that_no_run_allows_is_refused_before_the_run_is_opened(
    choice: str, message: str, tmp_path: Path
) -> None:
    status, _, errors = run_command(f"cellplan export nowhere {choice} --without-cell -q", tmp_path)

    assert status == 2
    assert errors.splitlines()[0].startswith(f"error: {message}")
    assert len(errors.splitlines()) == 1


def test_robots_that_are_exported_apart_start_and_end_together(run: VerifiedRun) -> None:
    placed = on_controllers(run, controllers("a", "b"), left="a", right="b")
    cycles = {"left": 0.004, "right": 0.012}
    robots = tuple(
        replace(robot, control=robot.control and robot.control.changed(cycle_ms=1e3 * cycles[robot.name]))
        for robot in placed.cell.robots
    )
    apart = replace(placed, cell=replace(placed.cell, robots=robots), token=ACCESS_TOKEN)

    left, right, both = (
        prepare(apart, DIALECTS["stream"], Choice(robots=names)) for names in ((EVERY[:1]), EVERY[1:2], EVERY)
    )

    assert left.lead == right.lead == both.lead == pytest.approx(0.108, abs=1e-12)
    ends = [rows.times[-1] for made in (left, right, both) for rows in made.job.programs[0].robots.values()]
    assert ends == pytest.approx([ends[0]] * 5, abs=1e-9)
