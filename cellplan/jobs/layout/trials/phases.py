"""The phases of a program with work, made ready for a search: their jobs, starts and bodies, and what lies between."""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final, Self

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.joint_limits import acceleration_limits
from cellplan.model.cell.layout import VariableKind
from cellplan.planning.sequence.stages import Stage, program_stages
from cellplan.runs.plan.retiming import joint_bounds, transfer_retimer
from cellplan.runs.plan.sequence import Pass, PlannedProgram, PlannedStage, plan_work, via_points
from cellplan.runs.solution import Solution
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.kernel.job import MOST, Job, enough_nodes
from cellplan.search.programs.layout_problem import LayoutProblem
from cellplan.search.programs.problem import Point
from cellplan.search.programs.program_problem import ProgramProblem
from cellplan.search.programs.transfers import HOME, Transfers
from cellplan.search.variables.phase_variables import PhaseVariables
from cellplan.search.variables.variables import Variables
from cellplan.search.variables.written import written_start, written_task_start

SAME: Final = 1e-4  # [rad] or [m] within which a home that is found is the start of a phase
NODE: Final = 1e6  # [rad] or [m] beyond any joint: what is added to the number of a node in place of a configuration
WINDOW: Final = 2.0  # [-] times that the jerk takes to the full acceleration: from speeding up to braking at once
FEWER: Final = 4  # [-] times fewer nodes of a straight move that grips or puts down the part


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProgramPhases:
    """The phases of a program with work, P of them."""

    work: PlannedProgram  # the phases of the given layout, with all starts and homes
    variables: Variables  # what may change
    bodies: tuple[CellDistances, ...]  # the bodies of each phase
    between: tuple[CellDistances, ...]  # the bodies during each transfer
    detours: tuple[float, ...] = ()  # see ``Transfers``; empty while none are known

    @classmethod
    def of(cls, cell: Cell, variables: Variables, bodies: CellDistances) -> "ProgramPhases":
        """Plan the work of a cell.

        Args:
            bodies: The bodies while the part is held, or fixed.

        Raises:
            NoSolutionError: A phase has no start, or a tool loses its path.
        """
        return cls.of_work(plan_work(cell, drops_far=True), variables, bodies)

    @classmethod
    def of_work(cls, work: PlannedProgram, variables: Variables, bodies: CellDistances) -> "ProgramPhases":
        """The phases of planned work with all that may change; see ``of``."""
        of_phases = [
            bodies if planned.stage.move is None else CellDistances.of(planned.scene, _variables(variables, planned))
            for planned in work.stages
        ]
        lying = dict[bytes, CellDistances]()
        between = []
        for stage in _transfer_stages(work):
            if stage.place is None:
                between.append(bodies)
                continue
            part = PhaseVariables(whole=variables, begins_there=False, lying=stage.cell.part)
            key = stage.place.X_WP.tobytes()
            if key not in lying:
                lying[key] = CellDistances.of(work.scenes.of_stage(stage), part)
            between.append(lying[key])
        return cls(work=work, variables=variables, bodies=tuple(of_phases), between=tuple(between))

    @property
    def start(self) -> Array:
        """The start postures of all phases, one after the other, in [rad] or [m], shape (P nq,)."""
        return starts_of(self.work)

    @property
    def duration(self) -> float:
        """Time of all phases in [s], as the cell has it."""
        return sum(float(planned.schedule.times[-1]) for planned in self.work.stages)

    def problem(self, nodes: int) -> ProgramProblem:
        """The problem with about so many nodes in each phase, and as many as the given layout needs."""
        phases = [
            self._phase_problem(planned, bodies, nodes)
            for planned, bodies in zip(self.work.stages, self.bodies, strict=True)
        ]
        transfers = self._transfers([len(it.times) for it in phases])
        idle = [self._is_idle(planned) for planned in self.work.stages]
        return ProgramProblem(phases=tuple(phases), transfers=transfers, homes=np.where(idle, self._homes, HOME))

    def _phase_problem(self, planned: PlannedStage, bodies: CellDistances, nodes: int) -> LayoutProblem:
        """The problem of one phase; the tools follow their paths in the given layout, as its plan has shown."""
        stage, schedule = planned.stage, planned.schedule
        enough = enough_nodes(schedule, nodes if stage.move is None else nodes // FEWER)
        problem = LayoutProblem(
            job=Job.of(stage.cell, schedule, moving=tuple(stage.phase.moving), nodes=enough),
            variables=_variables(self.variables, planned),
            bodies=bodies,
            acceleration=acceleration_limits(planned.scene.cell),
        )
        while problem.evaluate(problem.given, planned.motion.q[0]) is None and enough < MOST:
            enough = 2 * enough - 1
            problem = problem.finer(schedule, nodes=enough)
        return problem

    def values(self, x: Array, start: Array) -> dict[str, object]:
        """What to write into the given cell file: the layout, and the start of each task.

        Args:
            x: Values of the variables, shape (n,).
            start: Starts of the phases in [rad] or [m], shape (P nq,).
        """
        values, base = self.variables.numbers(x), self.variables.base
        for planned, q in zip(self.work.stages, start.reshape(len(self.work.stages), -1), strict=True):
            for task in planned.stage.cell.tasks if planned.stage.move is None else ():
                values |= written_task_start(base, task, q[base.columns(task.robot)])
        for name in sorted({it.name for it in self.variables.settings.ranges if it.kind is VariableKind.START}):
            values |= written_start(base, base.robot(name), self.variables.state(x).starts[base.columns(name)])
        return values

    @property
    def _homes(self) -> Indices:
        """The phase at whose start each joint is at a home that is found; or ``HOME`` where it is elsewhere, (nq,)."""
        cell, homes = self.work.cell, np.full(self.work.cell.joint_count, HOME)
        at_home = np.concatenate([robot.home for robot in cell.robots if robot.home is not None])
        is_open = {robot.name for robot in self.variables.base.robots if robot.home is None}
        for number, planned in reversed(list(enumerate(self.work.stages))):
            for name in is_open.intersection(planned.stage.phase.roles) if planned.stage.move is None else ():
                columns = cell.columns(name)
                is_there = np.allclose(planned.motion.q[0, columns], at_home[columns], rtol=0.0, atol=SAME)
                if is_there and name not in planned.stage.phase.idle:
                    homes[columns] = number
        return homes

    def _is_idle(self, planned: PlannedStage) -> Flags:
        """The joints of the robots that are idle in a phase, shape (nq,)."""
        is_idle = np.zeros(self.work.cell.joint_count, dtype=bool)
        for name in planned.stage.phase.idle:
            is_idle[self.work.cell.columns(name)] = True
        return is_idle

    def with_detours(self, problem: ProgramProblem, point: Point, solution: Solution) -> Self:
        """The same with the detours that the transfers of a solved program take, from a point near it."""
        names = {stage.phase.name for stage in _transfer_stages(self.work)}
        seconds = [run.report.cycle_time for run in solution.runs if run.phase.name in names]
        return replace(self, detours=tuple(problem.transfers.learned(point.x, point.q, seconds).detours.tolist()))

    def _transfers(self, counts: list[int]) -> Transfers:
        """The transfers between the phases with so many nodes, from home and back home."""
        cell, firsts = self.work.cell, np.cumsum([0, *counts])
        home = np.concatenate([robot.home for robot in cell.robots if robot.home is not None])
        homes = np.where(self._homes == HOME, home, NODE + firsts[self._homes])
        stages, passed, number, last = program_stages(cell), list[list[Pass]](), 0, homes
        for place, stage in enumerate(stages):
            if stage.phase.tasks:
                number, last = number + 1, np.full(cell.joint_count, NODE + firsts[number + 1] - 1)
            elif stage.dwell is None:
                goal = np.full(cell.joint_count, NODE + firsts[number]) if number < len(counts) else homes
                passed.append(via_points(stages, place, (last, goal), home))
        of = np.repeat(np.arange(len(passed)), [len(stops) - 1 for stops in passed])
        legs = np.array([[leg[0][0], leg[1][0]] for stops in passed for leg in pairwise(stops)]).swapaxes(0, 1)
        retimer = transfer_retimer(self.work.scenes.held)
        return Transfers(
            parts=tuple(slice(*edge) for edge in pairwise(firsts.tolist())),
            ends=np.where(legs >= NODE, legs - NODE, HOME).astype(np.intp),
            home=np.where(legs >= NODE, 0.0, legs),
            of=of,
            bounds=retimer.bounds,
            bodies=tuple(self.between[transfer] for transfer in of),
            step=retimer.step,
            stays=np.array([sum(stays for _, stays in stops) for stops in passed]),
            detours=np.array(self.detours or [1.0] * len(passed)),
            window=WINDOW * joint_bounds(cell).build_up,
        )


def _transfer_stages(work: PlannedProgram) -> list[Stage]:
    """The stages in which robots move from one phase to the next."""
    return [stage for stage in program_stages(work.cell) if not stage.phase.tasks and stage.dwell is None]


def starts_of(work: PlannedProgram) -> Array:
    """The start postures of all phases with work, one after the other, in [rad] or [m], shape (P nq,)."""
    return np.concatenate([planned.motion.q[0] for planned in work.stages])


def _begins_there(planned: PlannedStage) -> bool:
    """Whether a phase begins with the holder at its start, not where a task or the part has it."""
    return planned.stage.move is None and all(task.holder_posture is None for task in planned.stage.cell.tasks)


def _variables(variables: Variables, planned: PlannedStage) -> PhaseVariables:
    stage = planned.stage
    lying = None if stage.place is None else stage.cell.part
    tasks = tuple(stage.phase.tasks)
    return PhaseVariables(whole=variables, begins_there=_begins_there(planned), lying=lying, tasks=tasks)
