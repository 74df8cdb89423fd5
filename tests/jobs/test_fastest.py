"""Shortest cycles, by their definition: the limits hold, and a step less would break one."""

import csv
import json
import pickle
import re
from dataclasses import replace
from functools import partial
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from builders.commands import run_command
from builders.rod_arms import rod_values
from builders.two_phases import PAIR

from cellplan import Cell, load_cell, solve
from cellplan.errors import InputError, NoSolutionError
from cellplan.files.run.joint_tables import table_body
from cellplan.jobs.fastest.demand import calmest, read_demand, refuse_unless_possible
from cellplan.jobs.fastest.result import curve_figures, fastest_record, write_fastest
from cellplan.jobs.fastest.shortest import ShortestCycles, fastest
from cellplan.jobs.fastest.timed_program import Law, TimedProgram, scaled_values
from cellplan.model.robot.torque import RobotTorques
from cellplan.report.record.figures import LOAD, energy_proxy, figures_of

STEP = 0.01


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Cell:
    """The left arm alone."""
    head, right = PAIR.split("  right:\n", 1)
    text = head + "part:\n" + right.split("part:\n", 1)[1]
    lines = [line for line in text.splitlines() if not line.startswith("  second:")]
    file = tmp_path_factory.mktemp("fastest") / "alone.yaml"
    file.write_text("\n".join(lines).replace("pairwise", "simultaneous") + "\n", encoding="utf-8")
    return load_cell(file)


@pytest.fixture(scope="module")
def cycles(cell: Cell) -> ShortestCycles:
    return fastest(cell, demand=1500.0, points=1)


@pytest.fixture(scope="module")
def folder(cycles: ShortestCycles, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The shortest cycles as they are written."""
    folder = tmp_path_factory.mktemp("written") / "fastest"
    write_fastest(cycles, folder)
    return folder


@pytest.mark.slow
def test_the_time_laws_keep_all_limits_and_would_not_a_step_faster(cell: Cell, cycles: ShortestCycles) -> None:
    cycle = cycles.by_time_laws
    binding = cycle.bindings[0]

    assert cycles.as_written.cycle == 2.0
    assert cycle.solution.passed
    assert (binding.robot, binding.kind) == ("left", "acceleration")
    assert binding.share <= 1.0
    faster = solve(cell.with_values({"motion.duration_s": round(cycle.cycle - STEP, 6)}))
    broken = [check for check in faster.runs[0].report.checks if not check.passed]
    assert [check.name for check in broken] == ["joint_acceleration_assumed"]
    assert broken[0].subject == f"left/{binding.joint}"


def test_the_common_speed_is_faster_and_its_path_the_same(cycles: ShortestCycles) -> None:
    cycle, laws = cycles.by_common_speed, cycles.by_time_laws

    assert cycle.cycle < laws.cycle
    assert cycle.solution.passed
    assert max(use.peak / (use.limit or np.inf) for use in cycle.solution.runs[0].report.accelerations.joints) <= 1.0
    assert np.abs(cycle.solution.motion.q[-1] - laws.solution.motion.q[-1]).max() < 1e-7


@pytest.mark.slow
def test_the_command_says_the_same(cell: Cell, cycles: ShortestCycles, tmp_path: Path) -> None:
    status, out, err = run_command(f"cellplan fastest {cell.origin.file} --json --points 0 --quiet", tmp_path)

    record = json.loads(out)
    assert (status, record["status"], record["exit"], record["written_s"], err) == (0, "passed", 0, 2.0, "")
    assert (record["demand"], len(record["curve"])) == (None, 2)
    for name in ("time_laws", "common_speed", "reduced_speed"):
        said, program = record["cycles"][name], cycles.programs[name]
        assert said["cycle_s"] == pytest.approx(program.cycle)
        assert said["binding"][0]["joint"] == program.bindings[0].joint
        assert said["failed"] == []


@pytest.mark.slow
def test_a_torque_that_binds_is_named_and_kept_by_every_program(cell: Cell, cycles: ShortestCycles) -> None:
    limited = fastest(cell.with_values(rod_values(["left"], {"A": 4.0, "B": 2.0, "C": 0.4})), points=0)
    record = fastest_record(limited)
    for name in ("time_laws", "common_speed"):
        program, binding = limited.programs[name], limited.programs[name].bindings[0]
        assert program.cycle > cycles.programs[name].cycle
        assert (binding.kind, program.solution.passed) == ("torque", True)
        assert "% of its torque limit" in record["cycles"][name]["binding"][0]["text"]
        torques = [check for check in program.solution.runs[0].report.checks if check.name == "joint_torque"]
        assert 0.95 < max(check.value / check.limit for check in torques) <= 1.0
        assert program.load == pytest.approx(binding.time_share)
        assert record["cycles"][name]["figures"]["energy_j"] > 0.0


def test_the_work_of_a_program_is_known_where_that_of_every_robot_is(cycles: ShortestCycles) -> None:
    report = cycles.by_common_speed.solution.runs[0].report
    known, unknown = RobotTorques(robot="left", energy=12.5), RobotTorques(robot="right", missing=("no masses",))

    def work(*torques: RobotTorques) -> float | None:
        return figures_of([replace(report, torques=torques), replace(report, torques=torques, phase="b")]).recorded(
            "energy_j"
        )

    assert [work(known), work(known, known), work(known, unknown), work()] == [25.0, 50.0, None, None]


def test_loads_fall_with_the_cycle_as_the_scaling_law_says(cycles: ShortestCycles) -> None:
    """Along one path velocities go with 1/T, accelerations with 1/T^2, the integral of velocity squared with 1/T.

    Rows 10 ms apart see the peaks of a motion of a second to a per cent.
    """
    for law in (Law.TIME_LAWS, Law.COMMON_SPEED):
        points = [point.figures for point in cycles.curve if point.law is law]
        times = np.array([point["cycle_time_s"] for point in points])
        assert len(points) == 2
        assert times[0] == cycles.programs[str(law)].cycle
        np.testing.assert_allclose(times / times[0], [1.0, 3.0], rtol=0.01)
        for name, order in (("max_velocity_ratio", 1), ("max_acceleration_ratio", 2), ("energy_proxy_s", 1)):
            values = np.array([point[name] for point in points])
            np.testing.assert_allclose(values * times**order, values[0] * times[0] ** order, rtol=0.012)
        assert all(a["load_ratio"] > b["load_ratio"] for a, b in pairwise(points))


def test_the_tool_speed_of_the_time_laws_is_that_of_a_quintic(cycles: ShortestCycles) -> None:
    """Its peak is 15/8 of the mean speed; chords of 10 ms are a little slower."""
    for point in (point.figures for point in cycles.curve if point.law is Law.TIME_LAWS):
        peak = 1.875 * 200.0 * np.pi / point["cycle_time_s"]
        assert point["max_tool_speed_mm_s"] == pytest.approx(peak, rel=1e-3)
        assert point["parts_per_h"] == pytest.approx(3600.0 / point["cycle_time_s"])


def test_the_energy_proxy_of_a_quintic_is_its_integral(cycles: ShortestCycles) -> None:
    """The integral of the squared rate of a quintic from 0 to 1 in a time T is 10/7 / T."""
    report = cycles.by_time_laws.solution.runs[0].report
    times, travel = np.linspace(0.0, 2.0, 2001), np.array([0.5, -1.0, 2.0])
    u = times / 2.0
    q = travel * (u**3 * (10.0 - 15.0 * u + 6.0 * u**2))[:, None]
    limits = np.array([use.velocity_limit for use in report.joints])
    moved = replace(report, times=times, qd={"left": np.diff(q, axis=0) / np.diff(times)[:, None]})

    assert energy_proxy(moved) == pytest.approx(10.0 / 7.0 / 2.0 * np.sum((travel / limits) ** 2), rel=1e-5)


def test_the_calmest_program_meets_the_demand_and_is_what_solve_gives(cycles: ShortestCycles, folder: Path) -> None:
    demand = cycles.demand
    assert demand is not None
    assert demand.allowed == pytest.approx(2.4)
    assert demand.program.cycle == pytest.approx(2.4)
    assert demand.program.load < min(cycles.by_time_laws.load, cycles.by_common_speed.load)
    slower = [point for point in cycles.curve if point.figures["cycle_time_s"] >= demand.program.cycle]
    assert all(point.figures["load_ratio"] < demand.program.load for point in slower if point.law is Law.COMMON_SPEED)

    again = solve(load_cell(folder / "demand.yaml"))

    assert again.passed
    for name, text in again.program.tables.items():
        assert table_body((folder / "demand" / "tables" / f"{name}.csv").read_text()) == table_body(text)


def test_what_a_demand_saves_is_the_share_by_which_the_load_falls(cycles: ShortestCycles) -> None:
    record = fastest_record(cycles)
    demand = record["demand"]
    assert demand is not None
    calm, short = demand["program"]["figures"], record["cycles"]["common_speed"]["figures"]
    assert demand["saving_against_shortest"].pop("energy_j") is None  # no masses are stated
    for name, share in demand["saving_against_shortest"].items():
        assert calm[name] == pytest.approx((1.0 - share) * short[name])
    # a cycle longer by f has velocities lower by f
    assert demand["saving_against_shortest"]["max_velocity_ratio"] == pytest.approx(
        1.0 - cycles.by_common_speed.cycle / 2.4, abs=0.005
    )


def test_a_demand_below_all_reason_leaves_the_robots_waiting(cell: Cell, cycles: ShortestCycles) -> None:
    calls = []

    def solved(law: Law, values: dict[str, object], _title: str) -> TimedProgram:
        calls.append((law, values))
        return cycles.by_time_laws

    met = calmest(
        cell,
        12.0,
        written=cycles.as_written,
        laws=cycles.by_time_laws,
        common=cycles.by_common_speed,
        solved=solved,
    )

    assert met.allowed == pytest.approx(300.0)
    assert dict(calls)[Law.COMMON_SPEED] == {
        "motion.timing": {"cycle_s": pytest.approx(10.0 * cycles.by_common_speed.cycle)}
    }


@pytest.mark.parametrize(("text", "per_hour"), [("900/h", 900.0), ("15/min", 900.0), ("1.5 / min", 90.0)])
def test_a_demand_is_parts_in_an_hour_or_a_minute(text: str, per_hour: float) -> None:
    assert read_demand(text) == per_hour


@pytest.mark.parametrize("text", ["900", "0/h", "-3/h", "nan/h", "1e3/h", "900/s", "/h", "", "9" * 20 + "/h"])
def test_another_demand_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"^--demand: expected parts in a time, N/h or N/min with N above 0, got "):
        read_demand(text)


def test_a_demand_that_cannot_be_met_is_refused_with_what_binds(cycles: ShortestCycles) -> None:
    shortest = cycles.by_common_speed

    refuse_unless_possible(3600.0 / shortest.cycle, shortest, STEP)
    with pytest.raises(NoSolutionError) as caught:
        refuse_unless_possible(5940.0, shortest, STEP)
    assert re.fullmatch(
        r"--demand: expected at most 3495\.1/h, one part in 1\.03 s, where left B (binds at|reaches) \S+ % of its "
        r"(acceleration|jerk) limit; got 5940/h, one part in 0\.606061 s",
        str(caught.value),
    )


def test_the_command_refuses_another_demand_at_once(cell: Cell, tmp_path: Path) -> None:
    status, out, err = run_command(f"cellplan fastest {cell.origin.file} --demand 900 -o out", tmp_path)

    assert (status, out) == (2, "")
    assert err.startswith("error: --demand: expected parts in a time, N/h or N/min with N above 0, got '900'")
    assert not list(tmp_path.iterdir())


def test_the_tools_are_slow_enough_for_a_first_run(cycles: ShortestCycles) -> None:
    """The circle of 628 mm takes at least 2.51 s at 250 mm/s."""
    program = cycles.programs["reduced_speed"]
    figures = program.figures.record(LOAD)

    assert program.law is Law.REDUCED_SPEED
    assert program.cycle > 0.2 * np.pi / 0.25
    assert 245.0 < figures["max_tool_speed_mm_s"] <= 250.0
    assert figures["share_above_250_mm_s"] == 0.0
    assert program.bindings[0].kind == "tool speed"
    assert cycles.by_common_speed.figures.recorded("share_above_250_mm_s") > 0.5


def test_the_folder_holds_the_record_the_page_the_curve_and_every_program(cycles: ShortestCycles, folder: Path) -> None:
    record = json.loads((folder / "fastest.json").read_text())

    assert record == json.loads(json.dumps(fastest_record(cycles)))
    assert sorted(path.name for path in folder.iterdir()) == sorted(
        ["fastest.json", "fastest.html", "curve.csv", "demand.yaml", *cycles.programs]
    )
    for name, program in cycles.programs.items():
        assert json.loads((folder / name / "report.json").read_text())["cycle_time_s"] == pytest.approx(program.cycle)
    rows = list(csv.DictReader((folder / "curve.csv").open()))
    assert [row["law"] for row in rows] == [
        "as_written",
        *["time_laws"] * 2,
        *["common_speed"] * 2,
        "reduced_speed",
        "demand",
    ]
    assert [float(row["energy_proxy_s"]) for row in rows[1:5]] == [
        point["figures"]["energy_proxy_s"] for point in record["curve"]
    ]


class Page(HTMLParser):
    """Texts of table cells, open elements, and what a page would fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.cells: list[str] = []
        self.open: list[str] = []
        self.fetched: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in {"meta", "br"}:
            self.open.append(tag)
        if tag in {"td", "th"}:
            self.cells.append("")
        self.fetched += [value or "" for name, value in attrs if name in {"src", "href", "xlink:href"}]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        pass

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] in {"td", "th"}:
            self.cells[-1] += data


def test_the_page_is_whole_and_shows_the_figures_of_the_record(folder: Path) -> None:
    record = json.loads((folder / "fastest.json").read_text())
    page = Page()
    page.feed((folder / "fastest.html").read_text())

    assert page.open == []
    assert all(target.startswith("#") for target in page.fetched)
    every = [record["as_written"], *(point["figures"] for point in record["curve"])]
    every += [record["cycles"]["reduced_speed"]["figures"], record["demand"]["program"]["figures"]]
    for figures in every:
        place = page.cells.index(f"{figures['cycle_time_s']:.3f}")
        shown = page.cells[place : place + 9]
        assert shown[1] == f"{figures['parts_per_h']:.1f}"
        assert float(shown[2].removesuffix(" %")) == pytest.approx(100.0 * figures["max_velocity_ratio"], abs=0.06)
        assert float(shown[4].removesuffix(" %")) == pytest.approx(100.0 * figures["max_acceleration_ratio"], abs=0.06)
        assert float(shown[6]) == pytest.approx(figures["max_tool_speed_mm_s"], abs=0.51)
        assert float(shown[7]) == pytest.approx(figures["energy_proxy_s"], rel=0.006)


def test_an_interruption_leaves_nothing_behind(cycles: ShortestCycles, tmp_path: Path) -> None:
    def interrupt(stage: str, _share: float) -> None:
        if stage == "writing the report":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_fastest(cycles, tmp_path / "fastest", progress=interrupt)

    assert not list(tmp_path.iterdir())


def test_a_folder_of_the_user_is_not_replaced(cycles: ShortestCycles, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "curve.csv").write_text("of another kind")

    with pytest.raises(InputError, match=r"holds 'curve\.csv', which cellplan did not write"):
        write_fastest(cycles, tmp_path / "mine")


def test_what_the_processes_of_the_curve_get_can_be_sent(cell: Cell) -> None:
    values = {"motion.duration_s": 3.0}
    sent = pickle.loads(pickle.dumps(partial(TimedProgram.solved, cell, Law.TIME_LAWS, values)))  # noqa: S301 - ours

    assert sent.args[0].with_values(values).motion.duration == 3.0
    assert sent.args[1] is Law.TIME_LAWS


def test_everything_that_takes_time_is_scaled(cell: Cell) -> None:
    slow = cell.with_values({"tasks.first.feed_mm_s": 600, "tasks.first.start_s": 0.25, "motion.duration_s": 4})

    values = scaled_values(slow, 1.5)

    assert values == {
        "motion.duration_s": 6.0,
        "tasks.first.start_s": 0.375,
        "tasks.first.feed_mm_s": pytest.approx(400.0),
    }


@pytest.mark.slow
def test_a_cycle_that_feeds_alone_decide_has_no_calmer_one_and_no_plot(cell: Cell, tmp_path: Path) -> None:
    welding = cell.with_values({"motion.duration_s": None, "tasks.first.process": {"feed_mm_s": 150}})
    cycles = fastest(welding, points=2)
    record = fastest_record(cycles)

    assert [point["law"] for point in record["curve"] if point["figures"]] == ["time_laws", "common_speed"]
    alike = {**record, "curve": record["curve"][:1]}
    assert curve_figures(alike) == {}
    write_fastest(cycles, tmp_path / "fastest")
    assert (tmp_path / "fastest" / "fastest.html").exists()


def test_times_that_do_not_follow_the_clock_are_refused(cell: Cell) -> None:
    with pytest.raises(InputError, match=r"tasks\.first\.settle_s: expected 0 where the shortest cycle is sought"):
        fastest(cell.with_values({"tasks.first.settle_s": 0.1}))


def test_the_tools_keep_their_speed_in_the_world(cell: Cell) -> None:
    """The circle of 628 mm takes at least 2.09 s at 300 mm/s."""
    values = {"motion.timing": "fastest", "checks.tool_speed_mm_s": 300}
    report = solve(cell.with_values(values)).runs[0].report

    (check,) = (check for check in report.checks if check.name == "tool_speed")
    assert report.passed
    assert (check.subject, check.limit, check.unit) == ("left", 300.0, "mm/s")
    assert 297.0 <= check.value <= 300.0
    assert 0.2 * np.pi / 0.3 < report.times[-1] < 1.1 * 0.2 * np.pi / 0.3


def test_a_tool_that_is_too_fast_in_the_world_fails_by_what_it_exceeds(cell: Cell) -> None:
    """As written, its quintic law has 1.875 times the mean speed."""
    strict = replace(cell, checks=cell.checks.changed(tool_speed_mm_s=500.0))
    report = solve(strict).runs[0].report

    (check,) = (check for check in report.checks if not check.passed)
    assert check.name == "tool_speed"
    assert check.value == pytest.approx(1e3 * 1.875 * 0.2 * np.pi / 2.0, rel=1e-3)
    assert check.message.endswith("mm/s in the world at 1.010 s, allowed 500 mm/s")
