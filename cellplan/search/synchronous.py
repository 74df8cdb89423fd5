"""Jobs that a search can judge: motions by the weighted pseudo-inverse, and of these one synchronous motion alone."""

from collections.abc import Collection

from cellplan.errors import InputError
from cellplan.model.cell.cell import Cell, Mode, Timing


def refuse_other_jobs(cell: Cell, what: str, *, paths: Collection[str] = ()) -> None:
    """Refuse jobs for ``what`` but one synchronous pseudo-inverse motion; some robots may have a given joint path."""
    motion, at = cell.motion, cell.origin.at
    if cell.program.is_home_to_home:
        raise InputError(f"{at('program')}: expected a cell without a program from home to home for {what}")
    if motion.mode not in {Mode.SIMULTANEOUS, Mode.PART_AT_REST}:
        raise InputError(f"{at('motion.mode')}: expected simultaneous or part_at_rest for {what}, got '{motion.mode}'")
    refuse_other_methods(cell, what, paths=paths)


def refuse_other_methods(cell: Cell, what: str, *, paths: Collection[str] = ()) -> None:
    """Refuse motions for ``what`` that are none of the pseudo-inverse; see ``refuse_other_jobs``.

    They are timed as written; a program may be as fast as its limits allow.
    """
    motion, solver, at = cell.motion, cell.solver, cell.origin.at
    is_retimed = cell.program.is_home_to_home and motion.timing is Timing.FASTEST
    if motion.timing is not Timing.AS_WRITTEN and not is_retimed:
        raise InputError(
            f"{at('motion.timing')}: expected as_written for {what}, got '{motion.timing}': it states the shortest "
            "cycle by the time laws"
        )
    if motion.locked:
        raise InputError(f"{at('motion.locked_joints')}: expected no failed joints for {what}")
    if motion.cyclic:
        raise InputError(f"{at('motion.cyclic')}: expected false for {what}, got true")
    for robot in cell.robots:
        if robot.path is not None and robot.name not in paths:
            raise InputError(f"{at(f'robots.{robot.name}.path')}: expected no given joint path for {what}: remove it")
    for key in solver.nonminimal_keys:
        raise InputError(
            f"{at(f'solver.{key}')}: expected the weighted pseudo-inverse without goals, with constant weights, for "
            f"{what}"
        )


def is_searchable(cell: Cell) -> bool:
    """Whether the job is one that a search can judge, a program among them; see ``refuse_other_jobs``."""
    refuse = refuse_other_methods if cell.program.is_home_to_home else refuse_other_jobs
    try:
        refuse(cell, "a search")
    except InputError:
        return False
    return True
