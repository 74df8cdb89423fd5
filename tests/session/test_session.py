"""A live cell: its answers beside plain solves, what it refuses, undo, and that equal changes answer equally."""

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live_verdicts import drags

from cellplan import edit, load_cell, solve
from cellplan.errors import InputError
from cellplan.session.blocks import LiveCell
from cellplan.session.figures import Loads, joint_figures
from cellplan.session.motion import follow
from cellplan.session.session import Session
from cellplan.session.variables import LiveVariables

CELLS = Path(__file__).resolve().parents[2] / "cells"
PAIR = CELLS / "planar_pair.yaml"
SETTINGS = ("robots.left.start_deg=[50, -85, 35]", "motion.step_s=0.01", "solver.integrator=accurate")


def settled(session: Session) -> Any:
    """The last answer at rest."""
    answer = session.answer()
    while (more := session.settle()) is not None:
        answer = more
    return answer


@pytest.fixture(scope="module")
def pair() -> Session:
    return edit(PAIR, settings=SETTINGS)


@pytest.fixture(autouse=True)
def _as_given(request: pytest.FixtureRequest) -> None:
    if "pair" in request.fixturenames:
        request.getfixturevalue("pair").do("reset")


def figure(answer: Any, name: str) -> Any:
    return next(it for it in answer["figures"] if it["name"] == name)


def test_record_of_a_page_is_plain_json(pair: Session) -> None:
    record = json.loads(json.dumps(pair.open_record(), allow_nan=False))

    assert record["schema"] == "cellplan.edit/1"
    assert record["file"] == "planar_pair.yaml"
    assert {it["kind"] for it in record["variables"]} >= {"base_x", "base_yaw", "part_x", "start"}
    assert record["view"]["kind"] == "cell"
    assert len(record["view"]["scenes"]) == 1


def test_settled_answer_has_the_figures_of_the_report(pair: Session) -> None:
    pair.move("right", x_mm=1830)
    answer = settled(pair)

    report = solve(pair.document.cell).runs[0].report
    tightest = min(report.joints, key=lambda use: use.margin)
    fastest = max(use.peak_velocity / use.velocity_limit for use in report.joints)
    assert answer["is_settled"]
    assert answer["state"] == ("planned" if report.passed else "fails")
    assert figure(answer, "margin")["value"] == pytest.approx(np.degrees(tightest.margin), abs=0.05)
    assert figure(answer, "velocity")["value"] == pytest.approx(100.0 * fastest, rel=0.01)


def test_same_changes_give_the_same_answers(pair: Session) -> None:
    def answered() -> str:
        pair.do("reset")
        for step in range(3):
            pair.move("right", x_mm=1800 + 20 * step, y_mm=10 * step)
        answer = pair.answer()
        return json.dumps([answer["figures"], answer["values"], answer["history"], answer["verdict"]])

    assert answered() == answered()


def test_way_to_a_layout_does_not_matter(pair: Session) -> None:
    pair.move("right", x_mm=1850)
    direct = pair.answer()
    pair.do("reset")
    for x in (1700, 1750, 1900, 1850):
        pair.move("right", x_mm=x)

    assert pair.answer()["figures"] == direct["figures"]


def test_tool_that_loses_its_path_says_when(pair: Session) -> None:
    answer = pair.move("right", x_mm=3300)

    assert answer["state"] == "breaks off"
    assert answer["lost_at"] == pytest.approx(0.0, abs=12.0)
    assert "path" in answer["verdict"]
    assert settled(pair)["state"] == "breaks off"


def test_undone_step_brings_the_answer_back(pair: Session) -> None:
    before = pair.answer()
    pair.move("right", x_mm=1850)
    pair.settle()  # the drag has ended
    pair.move("right", y_mm=30)

    pair.do("undo")
    assert pair.answer()["values"]["robots.right.base.x_mm"] == 1850
    answer = pair.do("undo")
    assert answer["figures"] == before["figures"]
    assert answer["history"] == before["history"]
    assert pair.do("redo")["values"]["robots.right.base.x_mm"] == 1850


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"motion.duration_s": 1.0}, "motion.duration_s: expected the address of a number that may be changed"),
        ({"robots.right.base.x_mm": float("nan")}, "robots.right.base.x_mm: expected a number from"),
        ({"robots.right.base.x_mm": 1e9}, "robots.right.base.x_mm: expected a number from"),
        ({"robots.right.base.x_mm": "x"}, "robots.right.base.x_mm: expected a number from .* mm, got 'x'"),
        ({"robots.right.base.x_mm": None}, "robots.right.base.x_mm: expected a number from .* mm, got nothing"),
        ({"robots.right.base.x_mm": True}, "robots.right.base.x_mm: expected a number from .* mm, got true"),
    ],
)
def test_other_values_are_refused_and_change_nothing(pair: Session, values: Any, message: str) -> None:
    before = pair.answer()

    with pytest.raises(InputError, match=message):
        pair.change(values)
    assert pair.answer() == before


def test_fixed_station_is_locked() -> None:
    layout = "layout={vary: {right.base: {x_mm: [1500, 2100]}, left.base: {x_mm: [-10, 10]}}, fixed: [left.base]}"
    session = edit(PAIR, settings=(*SETTINGS, layout))

    with pytest.raises(InputError, match=r"robots.left.base.x_mm: is locked by layout.fixed"):
        session.move("left", x_mm=1)
    right = next(it for it in session.open_record()["variables"] if it["address"] == "robots.right.base.x_mm")
    assert (right["lower"], right["upper"], right["is_varied"]) == (1500, 2100, True)


@pytest.mark.slow
def test_base_that_is_moved_and_the_world_with_it_changes_no_figure() -> None:
    cell = load_cell(CELLS / "fixed_part.yaml")
    [live] = LiveCell.of(cell).planned()
    x = live.variables.layout.given.copy()
    block = live.blocks[0]
    before = follow(block, x)
    for place, variable in enumerate(live.variables.layout.tied.ranges):
        if variable.address.endswith((".base.x_mm", "part.at.x_mm")):
            x[place] += 0.2
    after = follow(block, x)

    assert np.abs(after.q - before.q).max() < 1e-6


@pytest.mark.slow
def test_live_figures_are_those_of_the_planner() -> None:
    [live] = LiveCell.of(load_cell(CELLS / "two_robots.yaml")).planned()
    block = live.blocks[0]
    x = live.variables.layout.given
    run = solve(load_cell(CELLS / "two_robots.yaml")).runs[0]
    motion = follow(block, x)

    figures = {it.name: it for it in joint_figures(block.cell, motion, Loads.of(block.cell, motion))}
    margin = min(use.margin for use in run.report.joints)
    assert figures["margin"].value == pytest.approx(np.degrees(margin), abs=0.1)
    assert figures["velocity"].value == pytest.approx(
        100.0 * max(use.peak_velocity / use.velocity_limit for use in run.report.joints), rel=0.005
    )


@pytest.mark.slow
def test_arrow_tells_what_a_step_does() -> None:
    session = edit(CELLS / "four_robots_initial.yaml")
    answer = settled(session)
    arrow = max(answer["advice"], key=lambda it: it["step_mm"])
    name = session.open_record()["view"]["scenes"][0]["robots"][arrow["robot"]]["name"]
    step = 1.0  # [mm], small enough for the derivative
    said = float(arrow["text"].split(": ")[1].split(" deg")[0]) / arrow["step_mm"]

    values = {
        f"{axis}_mm": answer["values"][f"robots.{name}.base.{axis}_mm"] + step * part
        for axis, part in zip("xyz", arrow["direction"], strict=True)
    }
    moved = session.move(name, **values)
    before = next(it for it in session.do("undo")["figures"] if it["name"] == "margin")["value"]
    assert figure(moved, "margin")["value"] - before == pytest.approx(said, rel=0.05)


def test_arrows_are_worked_out_between_changes_once_in_a_while(pair: Session) -> None:
    settled(pair)
    arrows = []
    for step in range(25):
        answer = pair.move("right", x_mm=1830 + step)
        arrows.append(json.dumps(answer["advice"]))
        while pair.advise():
            pass

    assert arrows[0] != "[]"
    assert len(set(arrows)) == 2
    pair.do("reset")
    assert json.dumps(settled(pair)["advice"]) == arrows[0]


@pytest.mark.slow
def test_program_shows_all_blocks() -> None:
    session = edit(CELLS / "in_turn.yaml")
    assert [it["state"] for it in session.answer()["strip"]] == ["planned", "unknown", "unknown"]

    answer = settled(session)
    assert [it["state"] for it in answer["strip"]] == ["planned"] * 3
    answer = session.change({}, block=2)
    assert answer["block"] == 2


@pytest.mark.slow
@pytest.mark.parametrize("action", ["settle", "save"])
def test_base_that_is_moved_takes_the_starts_of_all_its_tasks_along(tmp_path: Path, action: str) -> None:
    path = tmp_path / "cell.yaml"
    path.write_text((CELLS / "in_turn.yaml").read_text())
    session = edit(path)
    session.move("abb", x_mm=2200, y_mm=60)  # at work in the second block, the first one is shown
    settled(session) if action == "settle" else session.do("save")

    cell = session.document.cell
    assert solve(cell).passed
    if action == "settle":
        settings = session.document.settings
        assert settled(session)["history"] == [f"--set '{it}'" if "[" in it else f"--set {it}" for it in settings]
        session.do("undo")
        settled(session)
        assert session.document.settings == []


@pytest.mark.slow
def test_obstacle_is_met_in_all_blocks_of_a_program() -> None:
    post = "environment.post={box: {size_mm: [100, 100, 2000]}, at: {xyz_mm: [582, 5000, 1000]}}"
    session = edit(CELLS / "in_turn.yaml", settings=[post])
    near = [session.change({"environment.post.at.y_mm": 1900}, block=block) for block in range(3)]  # beside the kuka
    far = [session.change({"environment.post.at.y_mm": 5000}, block=block) for block in range(3)]

    assert [figure(it, "clearance")["is_met"] for it in (*near, *far)] == [False] * 3 + [True] * 3


@pytest.mark.slow
def test_program_without_a_plan_is_opened() -> None:
    session = edit(CELLS / "in_turn.yaml", settings=["robots.kuka.base.xyz_mm[1]=6000"])

    answer = settled(session)
    assert len(answer["strip"]) == 3
    assert answer["strip"][0]["state"] == "breaks off"
    json.dumps(session.open_record(), allow_nan=False)
    session.close()


@pytest.mark.slow
def test_values_that_do_not_go_together_are_said_at_rest() -> None:
    session = edit(CELLS / "four_robots.yaml")
    session.change({"robots.abb.base.roll_deg": 0.9, "robots.abb.base.pitch_deg": 0.9})  # its column is upright

    answer = settled(session)
    assert answer["state"] == "breaks off"
    assert answer["verdict"].startswith("breaks off: four_robots.yaml:")
    assert answer["is_settled"]
    assert session.do("undo")["state"] == "planned"
    redone = session.do("redo")
    assert redone["values"]["robots.abb.base.roll_deg"] == 0.9
    assert (redone["state"], redone["verdict"]) == (answer["state"], answer["verdict"])
    assert session.do("undo")["state"] == "planned"


@pytest.mark.parametrize(
    ("cell", "address", "bounds"),
    [
        ("four_robots", "robots.abb.base.pitch_deg", (-1.0, 1.0)),  # of a base on a column
        ("in_turn", "robots.abb.tool.rod.length_mm", (60 / 2 + 3 * 12 + 12 + 1, 2000)),  # round ends that meet
    ],
)
def test_ranges_hold_what_a_cell_may_have(cell: str, address: str, bounds: tuple[float, float]) -> None:
    variable = LiveVariables.of(load_cell(CELLS / f"{cell}.yaml")).variable(address)

    assert (variable.lower, variable.upper) == pytest.approx(bounds)


@pytest.mark.slow
def test_saved_cell_passes_as_it_was_said(tmp_path: Path) -> None:
    path = tmp_path / "cell.yaml"
    path.write_bytes((CELLS / "two_robots.yaml").read_bytes())
    with edit(path) as session:
        session.move("pen", x_mm=2010)
        said = settled(session)
        saved = session.do("save")

        assert (saved["is_saved"], saved["history"]) == (True, [])
        assert [event["state"] for event in session.poll()] == ["saved"]
        assert said["state"] == "planned"
        assert solve(load_cell(path)).passed
        assert "x_mm" not in path.read_text(encoding="utf-8")  # written in place, as the file has poses


def test_values_that_do_not_go_together_are_not_saved(tmp_path: Path) -> None:
    path = tmp_path / "cell.yaml"
    path.write_bytes((CELLS / "two_robots.yaml").read_bytes())
    with edit(path) as session:
        session.change({"part.held_by[0].at.z_mm": 80.0})  # into the links of its holder
        with pytest.raises(InputError, match=r"cell\.yaml:\d+ .*expected a part clear of the links"):
            session.do("save")

        assert path.read_bytes() == (CELLS / "two_robots.yaml").read_bytes()
        assert session.do("undo")["state"] == "planned"


@pytest.mark.slow
def test_certified_state_is_that_of_its_values_alone() -> None:
    with edit(CELLS / "two_robots.yaml") as session:
        session.move("pen", x_mm=2010)
        session.do("certify")
        until = time.monotonic() + 60.0
        events: list[Any] = []
        while time.monotonic() < until and not any(it["event"] == "answer" for it in events):
            events += session.poll()
            time.sleep(0.05)

        verdict = next(it for it in events if it["event"] == "verdict")
        assert verdict["passed"]
        assert events[-1]["answer"]["state"] == "certified"
        assert session.move("pen", x_mm=2011)["state"] == "planned"
        assert session.do("undo")["state"] == "planned"  # of the same step


def test_what_is_not_offered_cannot_be_taken(pair: Session) -> None:
    with pytest.raises(InputError, match="take: expected a number below 0, got 3"):
        pair.do("take", 3)
    with pytest.raises(InputError, match="expected one that is known, got 'dance'"):
        pair.do("dance")
    with pytest.raises(InputError, match="take: expected a number with it, got 'x'"):
        pair.do("take", "x")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="block: expected the number of one, got 'x'"):
        pair.change({}, block="x")  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two_robots", "four_robots_initial"])
def test_settled_verdicts_are_those_of_solve(name: str) -> None:
    for drag in drags(name, 5):
        assert drag.is_agreed, drag
        assert drag.is_small, drag
