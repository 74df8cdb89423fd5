"""Search of an assignment: stations, modes and conflicts of a draft, and the best schedules of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

from cellplan.errors import ImpossibleTasksError, NoSolutionError
from cellplan.jobs.assign.columns import verified_columns
from cellplan.jobs.assign.draft import AssignmentDraft
from cellplan.jobs.assign.planned_ends import planned_ends
from cellplan.jobs.assign.written import goals_written_otherwise, written_points
from cellplan.model.answers import Answers, worked_out
from cellplan.model.cell.cell import Timing
from cellplan.model.progress import Progress
from cellplan.runs.plan.retiming import joint_bounds, transfer_retimer
from cellplan.scene.scene import Scene
from cellplan.search.assign.problem.clearance import AssignmentClearance
from cellplan.search.assign.problem.durations import with_stand_offs
from cellplan.search.assign.problem.goals import Stations, TaskGoal, task_goals
from cellplan.search.assign.problem.instance import Instance, find_conflicts, least_transfer, with_rules
from cellplan.search.assign.problem.moving_blocks import joint_angles, with_columns
from cellplan.search.assign.problem.rules import TaskRules, tasks_before
from cellplan.search.assign.problem.stations import choose_stations
from cellplan.search.assign.problem.table import Key, ModeSearch, ModeTable, TaskMode
from cellplan.search.assign.schedules.blocks import BlockAnswer
from cellplan.search.assign.schedules.cover import best_blocks, bound_of_blocks
from cellplan.search.assign.schedules.greedy import greedy_schedule, improved
from cellplan.search.assign.schedules.order import Refusal, SequencedBlocks, Sequencer
from cellplan.search.assign.schedules.refined import Refinement
from cellplan.search.assign.schedules.solver import is_installed
from cellplan.search.assign.schedules.transfers import TransferCertifier

EFFORT: Final = (2.0, 5.0, 15.0, 60.0, 240.0)  # of the block model, in units of deterministic time, by --effort
LITTLE: Final = 0.5  # likewise, of the figures beside the program
LOOKED_FOR: Final = (
    "torch and weld position",
    "reach",
    "joint limits",
    "path",
    "sums of joints",
    "tool by the part",
    "collisions",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedBlocks:
    """A schedule with its modes, and what is known of it."""

    sequenced: SequencedBlocks
    bound: int | None  # [steps]
    is_proved: bool
    greedy: int  # [steps]
    others: tuple[SequencedBlocks, ...]  # other schedules
    without: Mapping[str, SequencedBlocks | None]  # by robots that do no task; None where they have to
    examined: int
    refused: int


class AssignmentSearch:
    """The search of one draft."""

    def __init__(
        self,
        draft: AssignmentDraft,
        effort: int,
        *,
        most_stations: int | None = None,
        answers: Answers = worked_out,
    ) -> None:
        """Begin with nothing chosen; most_stations counts instead of that of the draft.

        Args:
            answers: What answers for what takes long, or records it.
        """
        self.draft, self.answers, self._effort = draft, answers, EFFORT[effort - 1]
        self._most_stations = most_stations or draft.settings.most_stations
        self._scene = Scene.from_cell(draft.cell)
        self._refusals: list[Refusal] = []  # of transfers, once for all schedules
        self.counts: dict[str, int] = {}

    def instance(self, progress: Progress) -> Instance:
        """Stations, modes and conflicts.

        Raises:
            NoSolutionError: A task can be done nowhere.
        """
        draft, settings = self.draft, self.draft.settings
        cell, stations = draft.cell, draft.stations()
        goals = [self._as_given(goal) for goal in task_goals(cell, draft.robots)]
        clearance = self._clearance_at(stations)
        directed, fits = [*goals, *goals_written_otherwise(draft, goals)], clearance.tool_fits
        search = ModeSearch(cell=cell, goals=directed, stations=stations, spins=draft.spins(), tool_fits=fits)
        table = search.table()
        self._refinement = self._refined_by(search, clearance)
        progress("stations", 0.0)
        rules = TaskRules.of(cell)
        used, modes = choose_stations(table, goals, clearance, most=self._most_stations, rules=rules)
        columns = verified_columns(draft, goals, self._scene, progress, self.answers) if settings.groups else []
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

    def _clearance_at(self, stations: Stations) -> AssignmentClearance:
        """What answers for collisions at some stations."""
        return AssignmentClearance(
            scene=self._scene,
            home=self.draft.home,
            stations=stations,
            conflict=self.draft.settings.conflict_mm.si,
            answers=self.answers,
        )

    def _refined_by(self, search: ModeSearch, clearance: AssignmentClearance) -> Refinement:
        """What refines the modes of a search: certified transfers, and where tools with a free spin end."""
        retimer = transfer_retimer(self._scene)
        certifier = TransferCertifier(scene=self._scene, home=self.draft.home, retimer=retimer, answers=self.answers)
        ends = partial(planned_ends, self.draft, self.answers)
        return Refinement(search=search, clearance=clearance, certifier=certifier, planned_ends=ends)

    def planned(self, instance: Instance, *, is_first: bool) -> PlannedBlocks:
        """The best schedule of an instance, with certified transfers; the first one with finer modes."""
        certifier, least = self._refinement.certifier, least_transfer(instance)
        sequencer = Sequencer(instance, refusals=self._refusals)
        greedy = greedy_schedule(instance)
        nearest = sequencer.sequenced(greedy).steps
        exchanged = sequencer.ordered(improved(instance, greedy)).schedule
        answer = BlockAnswer(schedule=None, bound=None, is_proved=False)
        if is_installed():
            answer = best_blocks(instance, least=least, effort=self._effort, hint=exchanged)
        without = {name: self.without(instance, name) for name in instance.robots} if is_first else {}
        schedules = [it.schedule for it in without.values() if it is not None]
        schedules += [it for it in (answer.schedule, *answer.others, exchanged) if it is not None]
        others = sorted(map(sequencer.ordered, schedules), key=lambda it: it.steps)
        best, refined = certifier.best(sequencer, others), instance
        if is_first:
            best, refined = self._refinement.shortened(best, sequencer)
        bound = answer.bound
        if bound is not None and refined is not instance:
            least, hint = least_transfer(refined), best.schedule
            bound = min(bound, bound_of_blocks(refined, least=least, effort=self._effort, hint=hint) or 0)
        return PlannedBlocks(
            sequenced=best,
            bound=bound,
            is_proved=answer.is_proved,
            greedy=nearest,
            others=tuple(others),
            without=without,
            examined=certifier.examined,
            refused=len(sequencer.refusals),
        )

    def blocks(self, instance: Instance) -> BlockAnswer:
        """What the block model comes to by itself."""
        schedule = improved(instance, greedy_schedule(instance))
        if not is_installed():
            return BlockAnswer(schedule=schedule, bound=None, is_proved=False)
        return best_blocks(instance, least=least_transfer(instance), effort=self._effort, hint=schedule)

    def without(self, instance: Instance, robot: str) -> SequencedBlocks | None:
        """The same if a robot did no task, as ``little``; None where a task is its alone."""
        others = instance.without(robot)
        return self.little(others) if others.tasks == instance.tasks else None

    def little(self, instance: Instance) -> SequencedBlocks | None:
        """Blocks by the model with little effort, transfers certified; None where no schedule keeps all rules."""
        try:
            schedule = improved(instance, greedy_schedule(instance))
        except NoSolutionError:
            return None
        if is_installed():
            least = least_transfer(instance)
            schedule = best_blocks(instance, least=least, effort=LITTLE, hint=schedule).schedule or schedule
        sequencer = Sequencer(instance, refusals=self._refusals)
        return self._refinement.certifier.settle(sequencer, sequencer.ordered(schedule).schedule)

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
