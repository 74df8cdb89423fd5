"""Modes: which tasks are worked on together, and which robots move meanwhile (MODO 1, 2, 3 of [Ribeiro2010]_ ch. 5)."""

from collections.abc import Sequence
from itertools import pairwise

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Mode
from cellplan.model.cell.idle import idle_robots
from cellplan.model.motion.plan import ALL_TASKS, Carry, Hold, Phase, Plan, Role, Transfer, Work
from cellplan.model.task.task import Task


def plan_phases(cell: Cell, *, only: str | None = None) -> Plan:
    """The phases of the cell's program, of one task unless ``only`` is None, not yet on a clock: what its mode decides.

    Simultaneous: one phase. Part at rest: one phase in which the holders stand still. Pairwise: a phase for each task;
    what leads from one to the next is not part of the program.
    """
    chosen = [task for task in cell.tasks if only in (None, task.name)]
    if not chosen:
        raise InputError(f"task: expected one of {', '.join(task.name for task in cell.tasks)}, got '{only}'")
    _refuse_carrying_at_rest(cell, chosen)
    match cell.motion.mode:
        case Mode.SIMULTANEOUS:
            return Plan(phases=(_phase(cell, ALL_TASKS, chosen),))
        case Mode.PART_AT_REST:
            return Plan(phases=(_phase(cell, ALL_TASKS, chosen, is_carried=False),))
        case Mode.PAIRWISE:
            return Plan(phases=_with_transfers([_phase(cell, task.name, [task]) for task in chosen]))
        case Mode.SEMI_COORDINATED:
            raise InputError(
                f"{cell.origin.at('motion.mode')}: expected simultaneous, pairwise or part_at_rest without program, "
                "got 'semi_coordinated': add program: {} for a program from home to home"
            )


def standing(cell: Cell, phase: Phase, q: Array) -> Array:
    """Stacked configurations of a phase with its idle robots at those of their homes that are known.

    Args:
        q: Stacked joint positions in [rad] or [m], shape (..., nq).
    """
    placed = q.copy()
    for name in phase.idle:
        home = cell.robot(name).home
        if home is not None:
            placed[..., cell.columns(name)] = home
    return placed


def homeless(cell: Cell, phase: Phase) -> frozenset[str]:
    """Names of the idle robots of a phase whose homes are still to be found."""
    return frozenset(name for name in phase.idle if cell.robot(name).home is None)


def _phase(cell: Cell, name: str, tasks: Sequence[Task], *, is_carried: bool = True) -> Phase:
    """A phase in which some tasks are worked on and the holders carry the part, or hold it still."""
    roles: dict[str, Role] = {}
    for task in tasks:
        if (other := roles.get(task.robot)) is not None:
            raise InputError(
                f"{task.where('robot')}: expected a robot without another task in the phase '{name}', got "
                f"'{task.robot}' ({other}): add program: {{}} for a sequence of tasks"
            )
        roles[task.robot] = Work(task.name)
    for holder in cell.positioners:
        roles.setdefault(holder, Carry() if is_carried else Hold())
    idle = idle_robots(cell, [task.name for task in tasks])
    return Phase(name=name, roles=roles | dict.fromkeys(idle, Hold(at_home=True)))


def _with_transfers(phases: Sequence[Phase]) -> tuple[Phase, ...]:
    """Phases with what leads from each to the next one: motion that no program has yet."""
    extended = list(phases[:1])
    for one, other in pairwise(phases):
        roles: dict[str, Role] = {robot: Transfer(other.name) for robot in one.roles}
        extended += [Phase(name=f"{one.name} to {other.name}", roles=roles, in_program=False), other]
    return tuple(extended)


def _refuse_carrying_at_rest(cell: Cell, tasks: Sequence[Task]) -> None:
    """Refuse a task that carries the part where the part is to stand still."""
    for task in tasks:
        if cell.motion.mode is Mode.PART_AT_REST and task.robot in cell.positioners:
            raise InputError(
                f"{task.where('robot')}: expected a robot that does not hold the part in the "
                f"mode part_at_rest, got the positioner '{task.robot}'; choose another mode or leave the task out"
            )
