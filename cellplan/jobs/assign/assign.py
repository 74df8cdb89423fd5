"""Assign: a draft becomes a program from home to home that passed every check, with a lower bound of its cycle.

In each round the block model chooses who does which tasks together, the sequencer orders the blocks and chooses the
modes, and the transfers are certified; the program is then solved as any other. Blocks that fail a check are not chosen
again.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

from cellplan.errors import ImpossibleTasksError, NoSolutionError
from cellplan.jobs.assign.columns import verified_columns
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.jobs.assign.written import mirrored_goals, written_cell, written_points
from cellplan.model.cell.cell import Cell, Timing
from cellplan.model.presented import Presented
from cellplan.model.progress import Progress, silent
from cellplan.runs.plan.retiming import joint_bounds, transfer_retimer
from cellplan.runs.solution import Run, Solution
from cellplan.runs.solve import solve
from cellplan.scene.scene import Scene
from cellplan.search.assign.blocks import BlockAnswer, solve_blocks
from cellplan.search.assign.clearance import AssignmentClearance
from cellplan.search.assign.durations import with_stand_offs
from cellplan.search.assign.goals import TaskGoal, task_goals
from cellplan.search.assign.greedy import greedy_schedule, improved
from cellplan.search.assign.instance import Instance, find_conflicts, least_transfer, with_rules
from cellplan.search.assign.moving_blocks import joint_angles, with_columns
from cellplan.search.assign.order import SequencedBlocks, Sequencer
from cellplan.search.assign.refined import Refinement
from cellplan.search.assign.rules import TaskRules, tasks_before
from cellplan.search.assign.solver import is_installed
from cellplan.search.assign.stations import choose_stations
from cellplan.search.assign.table import Key, ModeSearch, ModeTable, TaskMode
from cellplan.search.assign.transfers import TransferCertifier

ROUNDS: Final = 4  # programs that are solved until one passes
EFFORT: Final = (2.0, 5.0, 15.0, 60.0, 240.0)  # of the block model, in units of deterministic time, by --effort
NEARLY: Final = 1.05  # [-] of the cycle of the program: so long are those of its alternatives at most
LOOKED_FOR: Final = ("torch and weld position", "reach", "joint limits", "path", "tool by the part", "collisions")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Assignment(Presented):
    """Who does which task, in which order, at which pose of the part; and what is proved of it.

    Attributes:
        draft: The cell that was given, each open task with the first of its robots.
        cell: The program, with nothing open.
        solution: The program, solved and verified.
        instance: What was chosen from.
        sequenced: The blocks in their order, with a mode of every task.
        bound: No program in blocks at these stations, with these modes, is shorter, in [s]; None where that is not
            known: without OR-Tools, or where the part cools between the tasks of a retimed program.
        is_proved: Whether no schedule of the block model is better than the one that was first sequenced.
        greedy: Cycle in [s] of the greedy schedule, scarce tasks first, by the model.
        alternatives: Other schedules of the first round that are nearly as good by the model, the best one first; they
            are not certified.
        without: Cycle in [s] by the model without each robot; None where it has to work.
        rounds: Number of programs that were solved.
        counts: Numbers of goals, modes, certificates and refusals.
        left_out: Why tasks are not in the program, one line for each; empty where it has all.
    """

    draft: Cell
    cell: Cell
    solution: Solution
    instance: Instance
    sequenced: SequencedBlocks
    bound: float | None
    is_proved: bool
    greedy: float
    alternatives: tuple[SequencedBlocks, ...]
    without: Mapping[str, float | None]
    rounds: int
    counts: Mapping[str, int]
    left_out: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether the program has all tasks and passed every check."""
        return self.solution.passed and not self.left_out

    @property
    def cycle(self) -> float:
        """Time of the program from home to home in [s]."""
        return sum(run.report.cycle_time for run in self.solution.runs)

    @property
    def model_cycle(self) -> float:
        """The same by the model, in [s]."""
        return self.sequenced.steps * self.instance.step

    def __repr__(self) -> str:
        """One line without arrays."""
        verdict = "passed" if self.passed else "failed"
        bound = "" if self.bound is None else f", at least {self.bound:.4g} s"
        return f"<Assignment of '{self.cell.name}': {self.cycle:.4g} s{bound}; {verdict}>"


def assign(draft: AssignmentDraft, *, effort: int = 2, progress: Progress = silent) -> Assignment:
    """Choose robots, order, directions, spins and poses of the part for all tasks.

    Without OR-Tools blocks are improved by exchanges alone, and no lower bound is known. Where a robot is not available
    and no other one can do some tasks, they are left out with all that come after them.

    Args:
        draft: The cell with open tasks.
        effort: Work of the block model, from 1 to 5.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: Something in the cell cannot be assigned.
        NoSolutionError: A task can be done by no robot at any pose of the part, or no program passed.
    """
    try:
        return _program_of(draft, effort, progress)
    except ImpossibleTasksError as error:
        partial = draft.without(error.tasks)
        if partial is None:
            raise
        return replace(_program_of(partial, effort, progress), left_out=tuple(error.findings))


def _program_of(draft: AssignmentDraft, effort: int, progress: Progress) -> Assignment:
    """The program of all tasks of a draft."""
    progress("table of modes", 0.0)
    search = _Search(draft, effort)
    first = instance = search.instance(progress)
    counts = search.counts
    for number in range(1, ROUNDS + 1):
        progress("blocks", (number - 1) / ROUNDS)
        planned = search.planned(instance, is_refined=number == 1)
        cell = written_cell(draft, instance, planned.sequenced)
        solution = _solved(cell, progress)
        if number == 1:
            steps = None if has_open_rests(draft.cell, instance) else planned.bound
            bound = None if steps is None else steps * instance.step
            is_proved, others = planned.is_proved, planned.others
        if not isinstance(solution, str) and (solution.passed or number == ROUNDS):
            return Assignment(
                draft=draft.cell,
                cell=cell,
                solution=solution,
                instance=instance,
                sequenced=planned.sequenced,
                bound=bound,
                is_proved=is_proved,
                greedy=planned.greedy * instance.step,
                alternatives=alternatives_to(planned.sequenced, others),
                without={name: search.without(first, name) for name in instance.robots},
                rounds=number,
                counts=counts | {"certificates": planned.examined, "refused": planned.refused},
            )
        instance = without_failed(instance, planned.sequenced, solution)
    raise NoSolutionError(
        f"{draft.cell.origin.at('tasks')}: no program passed in {ROUNDS} rounds; the last one: {solution}"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Planned:
    """A schedule with its modes, and what is known of it."""

    sequenced: SequencedBlocks
    bound: int | None  # [steps]
    is_proved: bool
    greedy: int  # [steps]
    others: tuple[SequencedBlocks, ...]  # other schedules
    examined: int
    refused: int


class _Search:
    """The search of one draft."""

    def __init__(self, draft: AssignmentDraft, effort: int) -> None:
        self.draft, self._effort = draft, EFFORT[effort - 1]
        self._scene = Scene.from_cell(draft.cell)
        self.counts: dict[str, int] = {}

    def instance(self, progress: Progress) -> Instance:
        """Stations, modes and conflicts.

        Raises:
            NoSolutionError: A task can be done nowhere.
        """
        draft, settings = self.draft, self.draft.settings
        cell, stations = draft.cell, draft.stations()
        goals = [self._as_given(goal) for goal in task_goals(cell, draft.robots)]
        clearance = AssignmentClearance(
            scene=self._scene, home=draft.home, stations=stations, conflict=settings.conflict_mm.si
        )
        directed, fits = [*goals, *mirrored_goals(draft, goals)], clearance.tool_fits
        search = ModeSearch(cell=cell, goals=directed, stations=stations, spins=draft.spins(), tool_fits=fits)
        table = search.table()
        certifier = TransferCertifier(scene=self._scene, home=draft.home, retimer=transfer_retimer(self._scene))
        self._refinement = Refinement(search=search, clearance=clearance, certifier=certifier)
        progress("stations", 0.0)
        rules = TaskRules.of(cell)
        used, modes = choose_stations(table, goals, clearance, most=settings.most_stations, rules=rules)
        columns = verified_columns(draft, goals, self._scene, progress) if settings.groups else []
        able = {it.task for column in columns for it in column.modes} | {task for task, _, _ in modes}
        refuse_impossible_tasks(draft, goals, table, able)
        progress("conflicts", 0.0)
        joints, bounds = {it.name: cell.columns(it.name) for it in cell.robots}, transfer_retimer(self._scene).bounds
        instance = Instance(
            goals={goal.name: self._timed(goal, modes) for goal in goals},
            robots=draft.operators,
            modes=modes,
            stations=stations,
            used=used,
            conflicts=find_conflicts(modes, clearance),
            homes={name: draft.home[at] for name, at in joints.items()},
            bounds={name: bounds.of(at) for name, at in joints.items()},
            step=cell.motion.step,
        )
        instance = with_rules(with_columns(instance, columns), rules)
        self.counts = {
            "tasks": len(goals),
            "poses": len(stations.q),
            "modes": sum(map(len, table.modes.values())),
            "stations": len(used),
            "free_modes": sum(map(len, modes.values())),
            "conflicts": len(instance.conflicts),
        } | ({"moving_blocks": len(columns)} if settings.groups else {})
        return instance

    def planned(self, instance: Instance, *, is_refined: bool) -> _Planned:
        """The best schedule of an instance, with certified transfers."""
        sequencer, least = Sequencer(instance), least_transfer(instance)
        greedy = greedy_schedule(instance)
        nearest = sequencer.sequenced(greedy).steps
        exchanged = sequencer.ordered(improved(instance, greedy)).schedule
        answer = BlockAnswer(schedule=None, bound=None, is_proved=False)
        if is_installed():
            answer = solve_blocks(instance, least=least, effort=self._effort, hint=exchanged)
        certifier = self._refinement.certifier
        schedules = [exchanged] if answer.schedule is None else [exchanged, answer.schedule]
        certified = sorted((certifier.best(sequencer, it) for it in schedules), key=lambda it: it.steps)
        best, refined = certified[0], instance
        if is_refined:
            best, refined = self._refinement.shortened(best, sequencer)
        bound = answer.bound
        if bound is not None and (shorter := least_transfer(refined)) < least:
            bound = solve_blocks(refined, least=shorter, effort=self._effort, hint=best.schedule).bound
        return _Planned(
            sequenced=best,
            bound=bound,
            is_proved=answer.is_proved,
            greedy=nearest,
            others=(*certified[1:], *map(sequencer.ordered, answer.others)),
            examined=certifier.examined,
            refused=len(sequencer.refusals),
        )

    def without(self, instance: Instance, robot: str) -> float | None:
        """Cycle in [s] by the model if a robot did no task, its transfers straight; None where a task is its alone."""
        others = instance.without(robot)
        if others.tasks != instance.tasks:
            return None
        try:
            schedule = improved(others, greedy_schedule(others))
        except NoSolutionError:  # the rules between tasks
            return None
        if is_installed():
            least = least_transfer(others)
            schedule = solve_blocks(others, least=least, effort=EFFORT[0], hint=schedule).schedule or schedule
        return Sequencer(others).ordered(schedule).steps * others.step

    def _timed(self, goal: TaskGoal, modes: Mapping[Key, Sequence[TaskMode]]) -> TaskGoal:
        """The goal with the time that it takes at least where its program is retimed."""
        cell = self.draft.cell
        if cell.motion.timing is Timing.AS_WRITTEN:
            return goal
        limits = {robot.name: joint_bounds(cell).of(cell.columns(robot.name)) for robot in cell.robots}
        return with_stand_offs(goal, modes, limits, cell.motion.step)

    def _as_given(self, goal: TaskGoal) -> TaskGoal:
        """The goal with what its task states, and with what is not free: direction, spin, station and start."""
        cell, free = self.draft.cell, self.draft.settings.free
        task, holder = cell.task(goal.name), cell.positioners[:1]
        station = task.holder_posture
        if station is None and holder and "station" not in free:
            station = self.draft.holder_start
        is_free = "direction" in free and task.start_posture is None and written_points(cell, goal.name) is not None
        return replace(
            goal,
            after=tasks_before(cell)[goal.name],
            is_reversible=goal.is_reversible and is_free,
            holder_q=station,
            start_q=task.start_posture,
            is_spin_free=f"tasks.{goal.name}.spin_deg" not in cell.origin.lines,
        )


def has_open_rests(cell: Cell, instance: Instance) -> bool:
    """Whether tasks rest for each other whose times only the solve of the program decides: no bound counts these."""
    return bool(instance.rules.lags) and cell.motion.timing is not Timing.AS_WRITTEN


def alternatives_to(best: SequencedBlocks, others: Iterable[SequencedBlocks]) -> tuple[SequencedBlocks, ...]:
    """Schedules with other robots or poses of the part, or other tasks together, that take little more time."""
    different = {best.schedule.identity: best}
    for other in sorted(others, key=lambda it: it.steps):
        if other.steps <= NEARLY * best.steps:
            different.setdefault(other.schedule.identity, other)
    return tuple(different.values())[1:]


def refuse_impossible_tasks(draft: AssignmentDraft, goals: list[TaskGoal], table: ModeTable, able: set[str]) -> None:
    """Refuse tasks that no robot can do at any pose of the part, each with the filter that dropped it.

    Raises:
        ImpossibleTasksError: One line for each of them.
    """
    lines = []
    for goal in goals:
        if goal.name not in able:
            counts: Mapping[str, int] = table.counts.get(goal.name, {})
            dropped = next((name for name in LOOKED_FOR if not counts.get(name)), LOOKED_FOR[-1])
            names = ", ".join(goal.robots)
            turns = draft.may_move_part and not draft.settings.groups and joint_angles(draft.cell, goal) is not None
            cure = "write assign.groups: true, so that the part turns meanwhile, or " if turns else ""
            lines.append(
                f"{draft.cell.task(goal.name).where()}: none of {names} can do it at any pose of the part: nothing is "
                f"left after the filter '{dropped}'; {cure}give more poses of the part, other robots or bases"
            )
    if lines:
        raise ImpossibleTasksError(lines, [goal.name for goal in goals if goal.name not in able])


def _solved(cell: Cell, progress: Progress) -> Solution | str:
    """The program, solved and verified; why there is none."""
    try:
        return solve(cell, progress=progress)
    except NoSolutionError as error:
        return str(error)


def without_failed(instance: Instance, sequenced: SequencedBlocks, solution: Solution | str) -> Instance:
    """The instance without the choices of blocks that failed; where the part cooled too shortly, with longer rests."""
    checks = () if isinstance(solution, str) else [check for run in solution.runs for check in run.report.checks]
    if (rules := instance.rules.with_longer_rests(checks, instance.step)) != instance.rules:
        return replace(instance, rules=rules)
    blocks = sequenced.schedule.blocks
    failed = set(range(len(blocks)))
    if isinstance(solution, str):
        words = set(re.findall(r"[\w-]+", solution))
        failed = {place for place, block in enumerate(blocks) if words.intersection(block)} or failed
    else:
        works = [run for run in solution.runs if run.schedule.tasks]
        failed = {place for place, run in enumerate(works) if not _passed(run)} or failed
    modes, conflicts = dict(instance.modes), set(instance.conflicts)
    for place in failed:
        chosen = {
            (end.mode.task, end.mode.robot, end.mode.station): end.mode
            for end in sequenced.stops[place][1]
            if end is not None
        }
        keys = list(chosen)
        if any(mode not in instance.modes[key] for key, mode in chosen.items()):
            continue  # a finer mode: the next round has none
        if len(keys) > 1:
            conflicts |= {frozenset(pair) for pair in pairwise(keys)}
        else:
            left = tuple(mode for mode in modes[keys[0]] if mode is not chosen[keys[0]])
            if left:
                modes[keys[0]] = left
            elif any(key[0] == keys[0][0] for key in modes if key != keys[0]):
                del modes[keys[0]]
    return replace(instance, conflicts=frozenset(conflicts)).with_modes(modes)


def _passed(run: Run) -> bool:
    return all(check.passed for check in run.report.checks)
