"""Shortest cycles of the four-robot cell under several limits: ``python benchmarks/shortest_cycle.py``.

Every program is solved at its cycle time, its tables are read back and verified, and its clearance is certified.
"""

import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from sections import Goal, Section, machine, table

from cellplan import load_cell
from cellplan.jobs.fastest.shortest import ShortestCycles, fastest
from cellplan.jobs.fastest.timed_program import TimedProgram

CELL: Final = Path(__file__).resolve().parent.parent / "cells" / "four_robots.yaml"
USUAL: Final = {"full_speed_in_s": [0.25, 0.25, 0.25, 0.15]}
NO_ACCELERATION: Final = "acceleration unlimited"
NO_JERK: Final = "full speed in 0.25 s and 0.15 s, jerk unlimited"
WITH_JERK: Final = "full speed in 0.25 s and 0.15 s, jerk from 0.05 s"
LIMITS: Final[Mapping[str, Mapping[str, object]]] = {
    NO_ACCELERATION: {"acceleration": {"unlimited": "measured without"}},
    NO_JERK: {"acceleration": USUAL, "motion.jerk_build_up_s": "unlimited"},
    WITH_JERK: {"acceleration": USUAL, "motion.jerk_build_up_s": 0.05},
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Shortest:
    """Shortest cycles under some limits, and the processor time that they took in [s]."""

    cycles: ShortestCycles
    cpu: float


def main() -> int:
    """Print the section; 1 if a goal is missed."""
    result = {name: measured(values) for name, values in LIMITS.items()}
    goals = list(goals_of({name: value.cycles for name, value in result.items()}))
    rows = [row for name, value in result.items() for row in rows_of(name, value)]
    head = ("limits", "program", "cycle s", "what binds", "largest tool error mm", "clearance mm", "checks", "CPU s")
    lines = [f"`{CELL.name}`, 4 s as written. Measured on: {machine()}.", "", *table(head, rows)]
    print(Section(title="Shortest cycles", lines=lines, goals=goals).text())
    return 0 if all(goal.met for goal in goals) else 1


def measured(values: Mapping[str, object]) -> Shortest:
    """The shortest cycles under some limits."""
    begun = time.process_time()
    cycles = fastest(load_cell(CELL).with_values(values), points=0)
    return Shortest(cycles=cycles, cpu=time.process_time() - begun)


def rows_of(name: str, shortest: Shortest) -> Iterator[tuple[str, ...]]:
    """A row for each program."""
    programs = shortest.cycles.programs
    for number, (law, program) in enumerate(programs.items()):
        figures = program.figures
        errors = [accuracy for run in program.solution.runs for accuracy in run.report.accuracy]
        worst = max(1e3 * max((error.between.position.largest if error.between else 0.0) for error in errors), 0.0)
        clearance = figures["min_clearance_mm"]
        yield (
            "" if number else name,
            law.replace("_", " "),
            f"{program.cycle:.3f}",
            program.bindings[0].text,
            f"{worst:.5f}",
            "-" if clearance is None else f"{clearance:.2f}",
            "passed" if program.solution.passed else "failed",
            "" if number else f"{shortest.cpu:.0f}",
        )


def goals_of(result: Mapping[str, ShortestCycles]) -> Iterator[Goal]:
    """What is to come out."""
    laws = {name: value.by_time_laws for name, value in result.items()}
    common = {name: value.by_common_speed for name, value in result.items()}
    yield goal("by the time laws, acceleration unlimited: 1.40 s ± 0.03 s", laws[NO_ACCELERATION], 1.37, 1.43)
    binding = laws[NO_ACCELERATION].bindings[0]
    is_b2 = (binding.robot, binding.joint) == ("kuka", "B2")
    yield Goal(text="where B2 of the KUKA binds", measured=f"{binding.robot} {binding.joint}", met=is_b2)
    yield goal("by the time laws, 0.25 s and 0.15 s: 2.76 s ± 0.05 s", laws[NO_JERK], 2.71, 2.81)
    yield goal("the same with the jerk limit", laws[WITH_JERK], 2.71, 2.81)
    yield goal("by the common speed, 0.25 s and 0.15 s: at most 1.68 s", common[NO_JERK], 0.0, 1.68)
    for name in result:
        slower = laws[name].cycle
        yield goal(f"the common speed is not slower than the time laws: {name}", common[name], 0.0, slower)
    programs = [program for value in result.values() for program in value.programs.values()]
    passed = sum(program.solution.passed for program in programs)
    text = "every program passes every check, its clearance certified"
    yield Goal(text=text, measured=f"{passed} of {len(programs)}", met=passed == len(programs))


def goal(text: str, program: TimedProgram, least: float, most: float) -> Goal:
    """A cycle time between two bounds in [s]."""
    return Goal(text=text, measured=f"{program.cycle:.3f} s", met=least <= program.cycle <= most)


if __name__ == "__main__":
    sys.exit(main())
