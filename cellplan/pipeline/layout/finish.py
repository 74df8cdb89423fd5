"""Finish: a layout of the search improved at more nodes, then solved and verified until it passes or is given up."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.model.cell import Cell
from cellplan.model.progress import Progress
from cellplan.model.report import ClearanceClass
from cellplan.model.units import DEG, MM
from cellplan.pipeline.fastest.scaling import scaled_values, whole_steps
from cellplan.pipeline.fastest.timed_program import Law, TimedProgram
from cellplan.pipeline.layout.limits import Standing, standing_of
from cellplan.pipeline.layout.prepared import Prepared, prepared, values_of
from cellplan.search.programs.improve import improve
from cellplan.search.programs.objective import Demands, Effort, Objective, Room, Timing
from cellplan.search.variables.variables import Variables

NODES: Final = 129  # [-] of the finish
KEYS: Final = 25  # [-] configurations at which distances are asked there
ITERATIONS: Final = 25
ROUNDS: Final = 4  # [-] times that a layout is improved and solved before it is given up
DURATIONS: Final = 4  # [-] durations tried until the limits hold
SLOWED: Final = {
    "position_error_between_rows": 0.5,
    "orientation_error_between_rows": 0.5,
    "closure_position_error_between_rows": 0.5,
    "closure_orientation_error_between_rows": 0.5,
    "joint_jerk": 1.0 / 3.0,
    "part_acceleration": 0.5,
    "tool_speed": 1.0,
}  # checks that pass when the motion is slow enough: how the time that they ask for grows with their value
MORE_ANGLE: Final = np.radians(0.05)  # [rad] asked for beyond what was missed
MORE_LENGTH: Final = 0.0005  # [m] likewise
MORE_OWN: Final = 0.00002  # [m] and of a robot's own bodies
MORE_TIME: Final = 0.002  # [-] likewise
ROUNDING: Final = 1e-9  # [deg] by which a margin may be missed: of printed numbers


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Certified:
    """A layout that solve passed, or why it did not.

    Attributes:
        trial: Number of the trial that it comes from.
        x: Variables, shape (n,).
        start: Start posture in [rad] or [m], shape (nq,).
        program: The program, solved and verified; None where there is none.
        reason: Why it is rejected; empty where it passed.
        standing: How it stands at the nodes of the finish.
        solves: How often it was solved in full.
    """

    trial: int
    x: Array
    start: Array
    program: TimedProgram | None
    reason: str
    standing: Standing
    solves: int

    @property
    def passed(self) -> bool:
        """Whether every check and every demand of the search was passed."""
        return self.program is not None and not self.reason

    @property
    def margin(self) -> float | None:
        """Smallest verified distance of a turning joint from its limits in [deg]; None without one."""
        return None if self.program is None else margin_of(self.program)

    @property
    def clearance(self) -> float | None:
        """Smallest certified distance in [mm]; None without pairs."""
        return None if self.program is None else clearance_of(self.program)

    @property
    def apart(self) -> float | None:
        """The same of bodies that do not belong to one robot."""
        return None if self.program is None else clearance_of(self.program, is_own=False)


@dataclass(slots=True)
class _Room:
    """What is asked for beyond the demands, as verified motions have shown to be needed."""

    angle: float = Room().margin
    length: float = Room().distance
    own: float = Room().own
    time: float = Room().time
    nodes: int = NODES
    keys: int = KEYS

    @property
    def effort(self) -> Effort:
        """As the local optimisation is asked."""
        room = Room(margin=self.angle, distance=self.length, own=self.own, time=self.time)
        return Effort(iterations=ITERATIONS, keys=self.keys, room=room, trust=0.2)


@dataclass(slots=True, kw_only=True)
class Finish:
    """The finish of layouts of one cell.

    Attributes:
        ready: The cell.
        progress: Called with the stage and the fraction done.
        solves: How often a layout was solved in full so far.
        choice: Discrete choices that the cell was made ready with.
    """

    ready: Prepared
    progress: Progress
    solves: int = 0
    choice: Mapping[str, object] = field(default_factory=dict)
    _problems: dict[tuple[Prepared, int], Any] = field(default_factory=dict)

    def use(self, choice: Mapping[str, object]) -> None:
        """Make the cell ready with other discrete choices."""
        self.ready, self.choice = prepared(self.ready.request, choice), choice

    def ordered(self, trials: Sequence[dict[str, Any]]) -> Sequence[dict[str, Any]]:
        """Trials that conform by the search, best first, in the order in which they are finished."""
        return trials

    def certified(self, trial: int, figures: Mapping[str, Any]) -> Certified:
        """A layout of the search, certified or with the reason why not.

        Args:
            trial: Number of its trial.
            figures: Figures of the trial.
        """
        x, start = np.array(figures["x"], dtype=float), np.array(figures["start"], dtype=float)
        room, is_first, before = _Room(), True, self.solves
        while True:
            x, start, standing, demands = self._improved(x, start, room, is_first=is_first)
            program, reason = self._solved(x, start, standing)
            found = Certified(
                trial=trial,
                x=x,
                start=start,
                program=program,
                reason=reason,
                standing=standing,
                solves=self.solves - before,
            )
            if found.passed or program is None or found.solves >= ROUNDS or not _enlarged(room, program, demands):
                return found
            is_first = False

    def _improved(
        self, x: Array, start: Array, room: _Room, *, is_first: bool
    ) -> tuple[Array, Array, Standing, Demands]:
        """The layout improved at more nodes; one that only has to conform is taken as it is at first."""
        demands, problem = self.ready.demands(), self._problem(room.nodes)
        if is_first and demands.objective is Objective.CONFORMING:
            problem, effort = self.ready.coarse, Effort()
            point = problem.evaluate(x, start)
            if point is not None:
                return x, start, standing_of(problem, point, demands, effort), demands
        found = improve(problem, x, start, demands, room.effort)
        if found is None:
            problem = self.ready.coarse
            point = problem.evaluate(x, start)
            if point is None:
                raise NoSolutionError("a tool cannot follow its path")
            return x, start, standing_of(problem, point, demands, room.effort), demands
        return found.x, found.start, standing_of(problem, found.point, demands, room.effort), demands

    def _problem(self, nodes: int) -> Any:
        """The layout problem at about so many nodes."""
        key = (self.ready, nodes)
        if key not in self._problems:
            self._problems[key] = self.ready.problem(nodes)
        return self._problems[key]

    def _solved(self, x: Array, start: Array, standing: Standing) -> tuple[TimedProgram | None, str]:
        """The program of a layout, solved and verified in full, and why it is rejected."""
        self.solves += 1
        try:
            cell = self.ready.variables.given_cell.with_values(values_of(self.ready, x, start))
            program = self._timed(cell, standing.measures.cycle).certified(self.progress)
        except (InputError, NoSolutionError) as error:
            return None, str(error).splitlines()[0]
        return program, rejection_of(program, self.ready.variables)

    def _timed(self, cell: Cell, cycle: float) -> TimedProgram:
        """The program at the shortest cycle, or at the duration of the cell."""
        is_cycle = self.ready.request.objective is Objective.CYCLE
        if self.ready.request.timing is Timing.RETIMED:
            timing: object = "fastest" if is_cycle else {"cycle_s": self.ready.duration}
            law = Law.COMMON_SPEED if is_cycle else Law.REDUCED_SPEED
            return TimedProgram.solved(cell, law, {"motion.timing": timing}, task=None, progress=self.progress)
        if not is_cycle:
            return TimedProgram.solved(cell, Law.AS_WRITTEN, {}, task=None, progress=self.progress)
        factor = whole_steps(cell, cycle / self.ready.duration)
        for _ in range(DURATIONS):
            program = self._at(cell, factor)
            load = load_of(program)
            if 1.0 - MORE_TIME < load <= 1.0:
                break
            following = whole_steps(cell, factor * load, longer_than=factor if load > 1.0 else 0.0)
            if following == factor:
                break
            factor = following
        for _ in range(DURATIONS):
            asked = max(load_of(program), time_asked(program))
            if asked <= 1.0:
                break
            factor = whole_steps(cell, factor * asked, longer_than=factor)
            program = self._at(cell, factor)
        return program

    def _at(self, cell: Cell, factor: float) -> TimedProgram:
        """The program slower or faster by a factor, verified but for its clearance."""
        return TimedProgram.solved(cell, Law.TIME_LAWS, scaled_values(cell, factor), task=None, progress=self.progress)


def rejection_of(program: TimedProgram, variables: Variables) -> str:
    """Why a program is rejected; empty where it passed every check and keeps the margins of the search."""
    failed = [check.message for run in program.solution.runs for check in run.report.checks if not check.passed]
    if failed:
        return failed[0]
    demanded, margin = DEG * float(variables.margin.max(initial=0.0)), margin_of(program)
    if margin is not None and margin < demanded - ROUNDING:
        return f"smallest margin {margin:.4g} deg, {demanded:.4g} deg demanded"
    return ""


def load_of(program: TimedProgram) -> float:
    """Share of its time in which the limits of speed and acceleration of the joints would allow the same motion."""
    figures = program.figures
    return max(figures["max_velocity_ratio"] or 0.0, (figures["max_acceleration_ratio"] or 0.0) ** 0.5)


def time_asked(program: TimedProgram) -> float:
    """How many times as long the motion must last for what is no limit of a joint but gets less when it is slower."""
    checks = [check for run in program.solution.runs for check in run.report.checks if not check.passed]
    asked = [(check.value / check.limit) ** SLOWED[check.name] for check in checks if check.name in SLOWED]
    return max(asked, default=1.0)


def certified_cell(found: Certified) -> Cell:
    """The cell file's cell of a certified layout: what ``solve`` read.

    Raises:
        ValueError: The layout has no program.
    """
    if found.program is None:
        raise ValueError("expected a layout with a program, got one without")
    return found.program.solution.cell


def _enlarged(room: _Room, program: TimedProgram, demands: Demands) -> bool:
    """Ask for what the verified motion missed; False where it missed nothing that can be asked for."""
    is_asked = False
    margin, demanded = margin_of(program), DEG * float(demands.margin.max(initial=0.0))
    if margin is not None and margin < demanded:
        room.angle += np.radians(demanded - margin) + MORE_ANGLE
        is_asked = True
    required = MM * program.solution.cell.checks.clearance
    found = (clearance_of(program, is_own=each) for each in (False, True))
    others, own = (required if each is None else each for each in found)
    if others < required:
        room.length += (required - others) / MM + MORE_LENGTH
    if own < required:
        room.own += (required - own) / MM + MORE_OWN
    if min(others, own) < required:
        room.keys = 2 * room.keys - 1
        is_asked = True
    if load_of(program) > 1.0:
        room.time += load_of(program) - 1.0 + MORE_TIME
        is_asked = True
    room.nodes = 2 * room.nodes - 1 if is_asked else room.nodes
    return is_asked


def margin_of(program: TimedProgram) -> float | None:
    """Smallest distance of a turning joint from its limits in [deg]; None without one."""
    found = [use.margin for run in program.solution.runs for use in run.report.joints if use.is_revolute]
    return DEG * min(found) if found else None


def clearance_of(program: TimedProgram, *, is_own: bool | None = None) -> float | None:
    """Smallest certified distance in [mm], of a robot's own bodies or of others only if asked; None without pairs."""
    found = [
        minimum.minimum
        for run in program.solution.runs
        for kind, minimum in run.report.clearance.minima.items()
        if minimum.minimum is not None and is_own in {None, kind is ClearanceClass.SELF}
    ]
    return MM * min(found) if found else None
