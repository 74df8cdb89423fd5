"""Demanded feeds, delays and dwells in programs as written and retimed: speeds of their rows, and forged ones."""

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from builders.three_feeds import THREE_FEEDS, approached
from builders.two_phases import seal_program

from cellplan import Cell, Solution, load_cell, open_gate, solve, write_run
from cellplan.errors import InputError
from cellplan.files.run.clock_table import parse_clock
from cellplan.model.motion.motion import ClockTable
from cellplan.model.report.report import Check

FEEDS = {"bead": 40.0, "seam": 50.0, "ring": 60.0}  # [mm/s]
ROBOTS = ("left", "right", "top")
TOP = 4  # header lines of the clock


def cell_of(folder: Path, text: str) -> Cell:
    file = folder / "cell.yaml"
    file.write_text(text, encoding="utf-8")
    return load_cell(file)


@pytest.fixture(scope="module")
def stretched(tmp_path_factory: pytest.TempPathFactory) -> Solution:
    return solve(cell_of(tmp_path_factory.mktemp("stretched"), THREE_FEEDS))


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Cell:
    return cell_of(tmp_path_factory.mktemp("approached"), approached())


@pytest.fixture(scope="module")
def solved(cell: Cell) -> tuple[Path, Solution]:
    """The run folder and its solution."""
    run = Path(cell.origin.file).parent / "run"
    solution = solve(cell)
    write_run(solution, run)
    return run, solution


@pytest.fixture(scope="module")
def as_written(cell: Cell) -> Solution:
    return solve(cell.with_values({"motion.timing": "as_written"}))


def feed_checks(solution: Solution) -> dict[str, Check]:
    return {check.subject: check for check in solution.runs[0].report.checks if check.name == "process_feed"}


def clock_of(solution: Solution) -> ClockTable:
    return parse_clock(solution.program.clock, "clock.csv").table


def steady_speeds(solution: Solution, task: str, feed: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Speeds in [mm/s] along a path between rows of the written clock, without 0.1 s of ramps at both ends."""
    clock = clock_of(solution)
    s, length = 1e3 * clock.lengths[task], 1e3 * clock.lengths[task][-1]
    ramp = 0.5 * 0.1 * feed + 1e-6
    inside = (s[:-1] > ramp) & (s[1:] < length - ramp)
    return (np.diff(s) / np.diff(clock.times))[inside]


def test_a_singularity_beside_a_demanded_feed_fails_with_place_and_joint(stretched: Solution) -> None:
    assert not stretched.passed
    assert {check.name for check in stretched.runs[0].report.checks if not check.passed} == {"process_feed"}
    ring = feed_checks(stretched)["ring"]
    words = r"feed of task 'ring': \S+ mm/s at (\S+) mm of its path, \S+ s, demanded 60 mm/s within 5 %; "
    place = float(_match(words + r"top B is at \S+ % of its acceleration limit there", ring.message))
    assert place == pytest.approx(0.75 * 60.0 * np.pi, abs=3.0)  # nearest to the stretched arm
    assert steady_speeds(stretched, "ring", 60.0).min() < 0.95 * 60.0


def _match(pattern: str, text: str) -> str:
    match = re.search(pattern, text)
    assert match, text
    return match.group(1)


def test_all_feeds_hold_where_only_the_approach_has_to_slow_down(
    solved: tuple[Path, Solution], as_written: Solution
) -> None:
    failed = {check.subject for check in as_written.runs[0].report.checks if not check.passed}
    assert failed <= {"top/A", "top/B", "top/C", "top A", "top B", "top C"}
    assert failed
    for solution in (as_written, solved[1]):
        assert all(check.passed for check in feed_checks(solution).values())
        for task, feed in FEEDS.items():
            assert np.abs(steady_speeds(solution, task, feed) / feed - 1.0).max() < 0.01 / 3.0  # s: whole steps
        for errors in solution.runs[0].report.accuracy:
            assert np.abs(errors.position_error).max() < 1e-6  # m: the tools keep their paths
    assert solved[1].passed
    approach = [solution.plan.process["ring"][0][0] for solution in (as_written, solved[1])]
    assert approach == [0.5, 0.5]  # nominal
    motion = solved[1].motion
    assert motion.sigma[1] < 0.8 * motion.times[1]  # beside the stretched posture


def test_processes_delays_and_dwells_last_as_long_as_the_cell_says(
    solved: tuple[Path, Solution], as_written: Solution
) -> None:
    """On for the delays, two half ramps more than length through feed: 0.1 + 100/40 + 0.1 + 0.1, 0.2 + 100/50 + 0.1."""
    demanded = {"bead": 2.8, "seam": 2.3, "ring": 0.1 + 60.0 * np.pi / 60.0}
    for solution in (as_written, solved[1]):
        clock = clock_of(solution)
        for task, seconds in demanded.items():
            on = clock.times[clock.process[task]]
            assert on[-1] - on[0] == pytest.approx(seconds, abs=0.021)
        s = clock.lengths["seam"]
        assert np.count_nonzero(s == 0.0) >= 20  # its delay
    assert np.ravel(solved[1].plan.dwells).tolist() == pytest.approx([0.5, 0.6, 0.5, 0.7, 2.8, 3.0, 3.2, 3.3])


def test_the_gate_verifies_it(solved: tuple[Path, Solution]) -> None:
    assert np.array_equal(open_gate(solved[0]).motion.sigma, solved[1].motion.sigma)


def without_delay(rows: list[list[str]]) -> None:
    """Rows of a delay at nominal times near its end."""
    for row in rows:
        if 0.52 < float(row[1]) < 0.6:
            row[1] = repr(0.58 + 0.25 * (float(row[1]) - 0.52))


def flipped(rows: list[list[str]]) -> None:
    rows[-20][-1] = "0" if rows[-20][-1] == "1" else "1"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (without_delay, r"clock\.csv:\d+: sigma_s: expected at most 0\.01 s more than in the row before, as the delay"),
        (flipped, r"clock\.csv:\d+: ring_process: expected \d as in the plan of the cell, got \d"),
    ],
)
def test_a_dropped_delay_and_a_flipped_process_are_refused(
    solved: tuple[Path, Solution], tmp_path: Path, change: Callable[[list[list[str]]], None], words: str
) -> None:
    run = tmp_path / "run"
    shutil.copytree(solved[0], run)
    path = run / "tables" / "clock.csv"
    lines = path.read_text().splitlines()
    rows = [line.split(",") for line in lines[TOP:]]
    change(rows)
    path.write_text("\n".join([*lines[:TOP], *(",".join(row) for row in rows)]) + "\n")
    seal_program(run, ROBOTS)
    with pytest.raises(InputError, match=words):
        open_gate(run)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("tasks.ring.feed_mm_s", 5, r"tasks\.ring\.feed_mm_s: unexpected key, process decides how fast"),
        ("tasks.ring.process.ramp_s", 4, r"process\.ramp_s: expected ramps that leave the feed of 60 mm/s some of"),
        ("motion.grid_ms", 15, r"motion\.grid_ms: expected a multiple of step_s = 0\.01 s, got 15"),
    ],
)
def test_what_does_not_go_together_is_named(cell: Cell, key: str, value: float, words: str) -> None:
    with pytest.raises(InputError, match=words):
        solve(cell.with_values({key: value}))
