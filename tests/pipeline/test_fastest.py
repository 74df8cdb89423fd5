"""Shortest cycles, by their definition: the limits hold, and a step less would break one."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.commands import run_command
from builders.two_phases import PAIR

from cellplan import Cell, load_cell, solve
from cellplan.errors import InputError
from cellplan.pipeline.fastest.scaling import scaled_values
from cellplan.pipeline.fastest.shortest import ShortestCycles, fastest

STEP = 0.01


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Cell:
    """The left arm alone."""
    head, right = PAIR.split("  right:\n", 1)
    text = head + "part:\n" + right.split("part:\n", 1)[1]
    kept = [line for line in text.splitlines() if not line.startswith("  second:")]
    file = tmp_path_factory.mktemp("fastest") / "alone.yaml"
    file.write_text("\n".join(kept).replace("pairwise", "simultaneous") + "\n", encoding="utf-8")
    return load_cell(file)


@pytest.fixture(scope="module")
def found(cell: Cell) -> ShortestCycles:
    return fastest(cell)


def test_the_time_laws_keep_all_limits_and_would_not_a_step_faster(cell: Cell, found: ShortestCycles) -> None:
    cycle = found.by_time_laws
    binding = cycle.bindings[0]

    assert found.as_written.cycle == 2.0
    assert cycle.solution.passed
    assert (binding.robot, binding.kind) == ("left", "acceleration")
    assert binding.share <= 1.0
    faster = solve(cell.with_values({"motion.duration_s": round(cycle.cycle - STEP, 6)}))
    broken = [check for check in faster.runs[0].report.checks if not check.passed]
    assert [check.name for check in broken] == ["joint_acceleration_assumed"]
    assert broken[0].subject == f"left/{binding.joint}"


def test_the_common_speed_is_faster_and_its_path_the_same(found: ShortestCycles) -> None:
    cycle, laws = found.by_common_speed, found.by_time_laws

    assert cycle.cycle < laws.cycle
    assert cycle.solution.passed
    assert max(use.peak / (use.limit or np.inf) for use in cycle.solution.runs[0].report.accelerations.joints) <= 1.0
    assert np.abs(cycle.solution.motion.q[-1] - laws.solution.motion.q[-1]).max() < 1e-7


def test_the_command_says_the_same(cell: Cell, found: ShortestCycles, tmp_path: Path) -> None:
    status, out, _ = run_command(f"cellplan fastest {cell.origin.file} --json -o {tmp_path}", tmp_path)

    record = json.loads(out)
    assert (status, record["status"], record["written_s"]) == (0, "passed", 2.0)
    both = {"time_laws": found.by_time_laws, "common_speed": found.by_common_speed}
    for name, cycle in both.items():
        said = record["cycles"][name]
        assert said["cycle_s"] == pytest.approx(cycle.cycle)
        assert said["binding"][0]["joint"] == cycle.bindings[0].joint
        assert said["failed"] == []
        report = json.loads((tmp_path / name / "report.json").read_text())
        assert report["cycle_time_s"] == said["cycle_s"]


def test_everything_that_takes_time_is_scaled(cell: Cell) -> None:
    slow = cell.with_values({"tasks.first.feed_mm_s": 600, "tasks.first.start_s": 0.25, "motion.duration_s": 4})

    values = scaled_values(slow, 1.5)

    assert values == {
        "motion.duration_s": 6.0,
        "tasks.first.start_s": 0.375,
        "tasks.first.feed_mm_s": pytest.approx(400.0),
    }


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
    strict = replace(cell, checks=replace(cell.checks, tool_speed=0.5))
    report = solve(strict).runs[0].report

    (check,) = (check for check in report.checks if not check.passed)
    assert check.name == "tool_speed"
    assert check.value == pytest.approx(1e3 * 1.875 * 0.2 * np.pi / 2.0, rel=1e-3)
    assert check.message.endswith("mm/s in the world at 1.010 s, allowed 500 mm/s")
