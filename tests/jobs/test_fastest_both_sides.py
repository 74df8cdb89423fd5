"""The shortest cycle where loads do not simply fall with the time, and feeds that no cycle is long enough for."""

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from builders.three_feeds import THREE_FEEDS
from builders.two_phases import PAIR

from cellplan import Cell, load_cell, solve
from cellplan.errors import InputError, NoSolutionError
from cellplan.jobs.fastest.result import fastest_lines, fastest_record
from cellplan.jobs.fastest.shortest import fastest
from cellplan.jobs.fastest.time_laws import RootBracket
from cellplan.jobs.fastest.timed_program import Binding, Law, TimedProgram, scaled_values
from cellplan.model.progress import silent

CELLS = Path(__file__).resolve().parents[2] / "cells"


def cell_of(folder: Path, text: str) -> Cell:
    file = folder / "cell.yaml"
    file.write_text(text, encoding="utf-8")
    return load_cell(file)


@pytest.mark.parametrize("load", [lambda n: 100.0 / n, lambda n: (37.5 / n) ** 0.5, lambda n: 0.75 + (n < 48) * 0.5])
@pytest.mark.parametrize("begin", [30, 400])
def test_a_bracket_closes_where_a_step_less_fails(load: object, begin: int) -> None:
    """Loads of any slope; the last one is flat above its limit, as that of a start that is off its path."""
    bracket, number = RootBracket(), begin
    for trial in range(40):
        bracket.note(number, holds=load(number) <= 1.0)
        if bracket.is_closed:
            break
        number = bracket.following(int(-(-number * load(number) // 1)), trial=trial)

    assert bracket.is_closed
    assert bracket.holds is not None
    assert load(bracket.holds) <= 1.0 < load(bracket.holds - 1)


def alone(folder: Path) -> Cell:
    """The left arm of the pair."""
    head, right = PAIR.split("  right:\n", 1)
    lines = [line for line in (head + "part:\n" + right.split("part:\n", 1)[1]).splitlines() if "second:" not in line]
    return cell_of(folder, "\n".join(lines).replace("pairwise", "simultaneous") + "\n")


@pytest.mark.slow
@pytest.mark.parametrize(("name", "longest"), [("mesh_part_csv", 5.1), ("fixed_part", np.inf)])
def test_the_shortest_by_the_time_laws_is_not_a_step_too_long(name: str, longest: float) -> None:
    """On a mesh the load at one cycle says little of that at another: it is that of single rows."""
    cell = load_cell(CELLS / f"{name}.yaml")

    result = fastest(cell, points=0).by_time_laws

    assert result.load <= 1.0
    assert result.cycle <= longest
    base = cell.with_values({"motion.timing": "as_written"})
    share = (result.cycle - cell.motion.step) / solve(base).motion.times[-1]
    assert TimedProgram.solved(base, Law.TIME_LAWS, scaled_values(base, share), task=None, progress=silent).load > 1.0


def test_a_path_shorter_than_its_steps_takes_the_fewest_steps(tmp_path: Path) -> None:
    slow = alone(tmp_path).with_values({"motion.step_s": 0.25, "motion.duration_s": 20.0})

    retimed_motion = fastest(slow, points=0)

    assert retimed_motion.by_time_laws.cycle == pytest.approx(2.5)  # ten steps
    lines = "\n".join(fastest_lines(fastest_record(retimed_motion)))
    assert "nothing binds" in lines
    assert "none is shorter: a step less (motion.step_s)" in lines


@pytest.mark.parametrize(
    ("share", "verb"), [(0.9951, "binds at 99.51 %"), (0.98, "reaches 98 %"), (0.29, "reaches 29 %")]
)
def test_a_limit_binds_from_99_percent_of_it(share: float, verb: str) -> None:
    binding = Binding(phase="work", robot="arm", joint="A", kind="jerk", share=share, time_share=share ** (1 / 3))

    assert binding.text == f"arm A {verb} of its jerk limit"


@pytest.mark.slow
def test_a_feed_that_no_joint_can_hold_is_named_with_the_greatest_that_holds(tmp_path: Path) -> None:
    cell = cell_of(tmp_path, THREE_FEEDS)

    with pytest.raises(NoSolutionError) as caught:
        fastest(cell, points=0)

    match = re.fullmatch(
        r".*cell\.yaml:46: tasks\.ring\.process\.feed_mm_s: feed 60 mm/s cannot be held: joint top B, acceleration, at "
        r"14\S+ mm; the greatest is (\S+) mm/s",
        str(caught.value),
    )
    assert match, str(caught.value)
    greatest = float(match[1])
    as_written = cell.with_values({"motion.timing": "as_written"})
    passes = [
        solve(as_written.with_values({"tasks.ring.process.feed_mm_s": feed})) for feed in (greatest, 1.02 * greatest)
    ]
    failed = [[c.name for run in one.runs for c in run.report.checks if not c.passed] for one in passes]
    assert failed[0] == []
    assert "joint_acceleration_assumed" in failed[1]


@pytest.mark.slow
def test_two_feeds_that_do_not_hold_are_both_named(tmp_path: Path) -> None:
    cell = cell_of(tmp_path, THREE_FEEDS.replace("feed_mm_s: 50", "feed_mm_s: 900"))

    with pytest.raises((NoSolutionError, InputError)) as caught:
        fastest(cell, points=0)

    named = re.findall(r"tasks\.(\w+)\.process\.feed_mm_s: feed \d+ mm/s cannot be held", str(caught.value))
    assert sorted(named) == ["ring", "seam"]
    assert all(a != b for a, b in pairwise(named))
