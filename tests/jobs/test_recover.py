"""Recoveries: judged by brute force, by what is done to their tables, and by what is refused."""

import csv
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.pen import PEN
from builders.stored_cells import solve_into
from builders.view_pages import data_of
from recoveries import judged as brute_force
from recoveries import random_stops

from cellplan.cli.main import run as run_command
from cellplan.errors import InputError
from cellplan.files.run.joint_tables import TableHeader, parse_table, render_table
from cellplan.jobs.recover.judge import judged
from cellplan.jobs.recover.planner import RecoveryPlanner
from cellplan.jobs.recover.programs import recovery_programs
from cellplan.jobs.recover.recover import Recovery, recover
from cellplan.jobs.recover.result import write_recovery
from cellplan.jobs.recover.state import RunPlaces, stopped_state
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.model.settings.program import TransferEntry
from cellplan.runs.gate.open_gate import open_gate

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def pen(tmp_path_factory: pytest.TempPathFactory) -> VerifiedRun:
    """A pen of six joints on a box that lies."""
    folder = tmp_path_factory.mktemp("pen")
    (folder / "pen.yaml").write_text(PEN, encoding="utf-8")
    solve_into(folder / "pen.yaml", folder / "run")
    return open_gate(folder / "run")


@pytest.fixture(scope="module")
def stopped(pen: VerifiedRun) -> Recovery:
    """The recovery from one stop of it."""
    return recover(pen, at=0.73)


@pytest.fixture(scope="module")
def pair(sound: Path) -> VerifiedRun:
    """Arms of three joints that leave the part in no direction."""
    return open_gate(sound / "run", cell=sound / "cell" / "small.yaml")


def test_recoveries_from_random_stops_are_free_by_brute_force(pen: VerifiedRun) -> None:
    places, rng = RunPlaces.of(pen), np.random.default_rng(3)
    for at, frozen in random_stops(pen, 2, rng)[1:]:  # one in which the robot stands at another time
        recovery = recover(pen, at=at, frozen=frozen)

        assert recovery.judgement is not None, recovery.reason
        assert next(phase.kind for phase in recovery.judgement.phases) == "retract"
        result = brute_force(recovery, places, rng, moments=10)
        assert result.faults == []
        assert result.smallest >= 0.005 - 1e-4  # what coal's distances leave open


def test_a_recovery_begins_at_rest_in_the_stopped_state_and_ends_off_the_start(
    pen: VerifiedRun, stopped: Recovery
) -> None:
    table = parse_table(stopped.tables["pen"], "pen")

    at = np.array([np.interp(0.73, pen.motion.times, column) for column in pen.motion.q.T])
    np.testing.assert_allclose(table.q[0], at, atol=1e-11)
    chain = RunPlaces.of(pen).scenes.held.chains["pen"]
    end, start = chain.tool_poses(np.stack([table.q[-1], pen.motion.q[0]]))
    off = (end[:3, 3] - start[:3, 3]) @ -start[:3, 2]
    assert off > 0.005  # along the tool at the start of the program, farther than is demanded
    np.testing.assert_allclose(end[:3, 3], start[:3, 3] - off * start[:3, 2], atol=1e-6)


def test_all_moves_of_a_recovery_keep_the_speeds_that_are_given(pen: VerifiedRun, stopped: Recovery) -> None:
    slow = recover(pen, at=0.73, transfer=TransferEntry(speed_percent=25.0, tcp_mm_s=100.0))

    assert slow.judgement is not None
    checks = {check.name: check for check in slow.judgement.checks}
    assert 0.9 < checks["transfer_speed"].value / 100.0 <= 1.0
    assert checks["transfer_joint_speed"].value <= 25.0
    table, chain = parse_table(slow.tables["pen"], "pen"), RunPlaces.of(pen).scenes.held.chains["pen"]
    steps = np.linalg.norm(np.diff(chain.tool_poses(table.q)[:, :3, 3], axis=0), axis=1)
    assert steps.max() / 0.02 <= 0.1
    assert slow.duration > stopped.duration
    fast = {check.name for check in stopped.judgement.checks} if stopped.judgement else set()
    assert fast == set(checks) - {"transfer_speed", "transfer_joint_speed"}


def test_the_same_stop_gives_the_same_bytes(pen: VerifiedRun, stopped: Recovery, tmp_path: Path) -> None:
    write_recovery(stopped, tmp_path / "one")
    write_recovery(recover(pen, at=0.73), tmp_path / "other")

    files = sorted(path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*") if path.is_file())
    assert [str(name) for name in files] == ["recovery.json", "tables/clock.csv", "tables/pen.csv"]
    for name in files:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "other" / name).read_bytes()


def test_a_transfer_that_is_not_found_has_its_pair_its_place_and_a_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    home = "home_deg: [10, 45, 0, -56, -90, -79]  # the arm reaches down into the floor\n    start_deg"
    (tmp_path / "pen.yaml").write_text(PEN.replace("start_deg", home), encoding="utf-8")
    solve_into(tmp_path / "pen.yaml", tmp_path / "run")

    arguments = ["recover", str(tmp_path / "run"), "--cell", str(tmp_path / "pen.yaml"), "-q", "--at", "0.73"]
    assert run_command([*arguments, "-o", str(tmp_path / "out")]) == 3

    page, said = tmp_path / "out" / "view.html", capsys.readouterr().out
    assert said.rstrip().endswith(f"3-D page of the best try: {page}")
    record = json.loads((tmp_path / "out" / "recovery.json").read_text(encoding="utf-8"))
    assert "floor" in record["blocked"]["pair"]
    assert record["blocked"]["place_mm"][2] < 5.0
    assert "the goal of the transfer move of 'pen' comes too close: " in record["reason"]
    (scene,) = data_of(page.read_text(encoding="utf-8"))["scenes"]
    (failure,) = scene["failures"]
    assert {scene["bodies"][body]["name"] for body in failure["bodies"]} == set(record["blocked"]["pair"])
    assert run_command([*arguments, "-o", str(tmp_path / "out")]) == 3  # it is replaced, its page too


def test_the_clock_names_the_phase_of_each_row(stopped: Recovery, tmp_path: Path) -> None:
    record = write_recovery(stopped, tmp_path / "out")

    text = (tmp_path / "out" / "tables" / "clock.csv").read_text(encoding="utf-8")
    clock = list(csv.DictReader(line for line in text.splitlines() if line[0] != "#"))
    lines = (tmp_path / "out" / "tables" / "pen.csv").read_text(encoding="utf-8").splitlines()
    assert [row["time_s"] for row in clock] == [line.split(",")[0] for line in lines if line[0].isdigit()]
    assert [phase["kind"] for phase in record["phases"]] == ["retract", "transfer"]
    for number, phase in enumerate(record["phases"], start=1):
        rows = [row for row in clock if row["number"] == str(number)]
        times = [float(row["time_s"]) for row in rows]
        assert {(row["phase"], row["robots"]) for row in rows} == {(phase["kind"], "pen")}
        assert times[0] == phase["begin_s"]
        assert times[-1] <= phase["end_s"]
    assert float(clock[-1]["time_s"]) == record["duration_s"]


def test_the_page_of_the_record_lists_its_keys(stopped: Recovery, pen: VerifiedRun, tmp_path: Path) -> None:
    result = write_recovery(stopped, tmp_path / "found", {"csv": recovery_programs(pen, stopped, "csv")})
    none = write_recovery(recover(pen, at=0.5, keep=["pen"]), tmp_path / "none")
    text = (ROOT / "docs" / "reference" / "recovery-json.md").read_text(encoding="utf-8")
    sections = dict(part.split("\n", 1) for part in text.split("\n## ")[1:])

    def listed(section: str) -> set[str]:
        cells = re.findall(r"^\| ((?:`[^`]+`(?:, )?)+) \|", sections[section], re.MULTILINE)
        return {key for cell in cells for key in re.findall(r"`([^`]+)`", cell)}

    robot = result["state"]["robots"]["pen"]
    assert listed("Record") == set(result) | set(none)
    assert listed("State") == set(result["state"]) | {f"robots.NAME.{key}" for key in robot}
    assert listed("Phase") == set(result["phases"][0])
    assert listed("Programs") == set(result["programs"]["csv"])
    assert listed("Clearance") == set(result["clearance"])
    assert listed("Pair") == set(result["begins_too_near"][0])
    assert listed("Check") == set(result["checks"][0])
    header = (tmp_path / "found" / "tables" / "clock.csv").read_text(encoding="utf-8").splitlines()[3]
    assert listed("clock.csv") == set(header.split(","))
    gone = [*none, *re.findall(r"`(\w+)`", text.split("With `not_found` there are no ")[1].split(".")[0])]
    assert sorted(gone) == sorted(set(result) | set(none))


def test_a_table_in_which_the_tool_goes_deeper_first_fails(pen: VerifiedRun) -> None:
    places = RunPlaces.of(pen)
    state = stopped_state(places, at=0.5, frozen={})
    phases = RecoveryPlanner(places, state, lambda *_: None).phases()
    robot, retract = places.cell.robots[0], phases[0].q
    step = retract[1:4] - retract[0]
    q = retract.copy()
    q[1:4] = retract[0] - step  # the other way at first
    times = 0.02 * np.arange(len(q))

    def checks(rows: np.ndarray) -> dict[str, bool]:
        text = render_table(robot, times, rows, header=_header())
        judgement = judged({"pen": text}, [replace(phases[0], q=rows)], places=places, state=state)
        return {check.name: check.passed for check in judgement.checks if check.name in {"coming_apart", "begin"}}

    assert checks(retract) == {"coming_apart": True, "begin": True}
    assert checks(q) == {"coming_apart": False, "begin": True}
    assert checks(retract + 0.001)["begin"] is False


def test_a_robot_that_cannot_leave_the_part_goes_back_along_the_program(pair: VerifiedRun) -> None:
    recovery = recover(pair, at=0.5)

    assert recovery.judgement is not None
    assert [phase.kind for phase in recovery.judgement.phases] == ["back"]
    tables = [parse_table(recovery.tables[robot.name], robot.name) for robot in pair.cell.robots]
    q = np.concatenate([table.q for table in tables], axis=1)
    np.testing.assert_allclose(q[-1], pair.motion.q[0], atol=1e-11)
    rows = pair.motion.q[pair.motion.times <= 0.5]
    farthest = max(float(np.abs(rows - entry).max(axis=1).min()) for entry in q)
    assert farthest < float(np.abs(np.diff(rows, axis=0)).max())  # never farther from the program than its rows
    assert "no millimetre off" in recovery.tried[0]


def test_where_nothing_is_found_the_reason_is_written_and_no_table(pair: VerifiedRun, tmp_path: Path) -> None:
    recovery = recover(pair, at=0.5, frozen={"right": 0.45})
    record = write_recovery(recovery, tmp_path / "out")

    assert not recovery.succeeded
    assert "right: its tool comes no millimetre off" in recovery.reason
    assert "robots stand at different times" in recovery.reason
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["recovery.json"]
    written = json.loads((tmp_path / "out" / "recovery.json").read_text(encoding="utf-8"))
    assert written == record
    assert (written["status"], written["files"]) == ("not_found", {})
    assert written["state"]["robots"]["right"]["at_s"] == 0.45


def test_a_robot_that_is_kept_on_the_part_cannot_be_recovered(pen: VerifiedRun) -> None:
    recovery = recover(pen, at=0.5, keep=["pen"])

    assert not recovery.succeeded
    assert "no robot that may move takes them apart" in recovery.reason
    assert "'pen', which is to stand still" in recovery.reason


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"at": 2.5}, "--at: expected a time of the program, 0 to 2 s, got 2.5"),
        ({"at": float("nan")}, "--at: expected a time of the program, 0 to 2 s, got nan"),
        ({"at": 1.0, "frozen": {"pen": -1.0}}, "--frozen pen: expected a time of the program, 0 to 2 s, got -1"),
        ({"at": 1.0, "frozen": {"pan": 1.0}}, "--frozen: expected the name of a robot (pen), got 'pan'"),
        ({"at": 1.0, "keep": ["pan"]}, "--keep: expected the name of a robot (pen), got 'pan'"),
    ],
)
def test_a_state_that_is_none_is_one_line(pen: VerifiedRun, given: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as refused:
        recover(pen, **given)

    assert str(refused.value) == message


@pytest.mark.slow
@pytest.mark.parametrize("name", ["turntable", "rail", "load_sharing", "four_robots", "three_tasks_each"])
def test_recoveries_of_shipped_cells_are_free_by_brute_force(name: str, tmp_path: Path) -> None:
    cell = ROOT / "cells" / f"{name}.yaml"
    solve_into(cell, tmp_path / "run")
    run, rng = open_gate(tmp_path / "run", cell=cell), np.random.default_rng(5)
    places = RunPlaces.of(run)
    for at, frozen in random_stops(run, 9, rng):
        recovery = recover(run, at=at, frozen=frozen)
        if not recovery.succeeded:
            assert recovery.reason
            continue
        assert brute_force(recovery, places, rng).faults == []


def _header() -> TableHeader:
    return TableHeader(cell="pen-on-box", mode="part_at_rest", digests={})
