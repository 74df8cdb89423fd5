"""Arrangement of tasks into blocks: every constraint holds, and circles of waiting robots are found and named."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from graphlib import CycleError, TopologicalSorter

import numpy as np
import pytest
from builders.random_cells import make_task, random_cell
from hypothesis import given, settings
from hypothesis import strategies as st

from cellplan.errors import InputError
from cellplan.model.cell.cell import Cell, Mode
from cellplan.model.motion.plan import Hold
from cellplan.model.settings.program import MarkEntry, NoTransfers, ProgramEntry
from cellplan.planning.sequence.arrangement import Block, arrange
from cellplan.planning.sequence.stages import program_stages

ROBOTS = ("op0", "op1", "op2")
CELL = random_cell(0, operators=3, joints=3)
ORDER = "expected an order that can be worked off, got a circle: "
CURE = ": change order, after or marks"


def cell_of(
    orders: Mapping[str, str],
    after: Mapping[str, Sequence[str]] | None = None,
    marks: Mapping[str, float] | None = None,
    *,
    mode: Mode = Mode.SIMULTANEOUS,
) -> Cell:
    """A cell with the orders of its robots as words; tasks have lower-case names, in the order of the alphabet."""
    names = {name: robot for robot, words in orders.items() for name in words.split() if name.islower()}
    tasks = tuple(make_task(names[name], name=name, after=tuple((after or {}).get(name, ()))) for name in sorted(names))
    return replace(
        CELL,
        robots=tuple(replace(robot, order=tuple(orders.get(robot.name, "").split())) for robot in CELL.robots),
        tasks=tasks,
        motion=replace(CELL.motion, mode=mode),
        program=ProgramEntry(marks=tuple(MarkEntry(name=name, dwell_s=dwell) for name, dwell in (marks or {}).items())),
    )


def at_postures(cell: Cell, postures: Mapping[str, float]) -> Cell:
    """The cell with postures of the holder for some tasks."""
    tasks = [
        replace(task, holder_posture=np.full(3, postures[task.name])) if task.name in postures else task
        for task in cell.tasks
    ]
    return replace(cell, tasks=tuple(tasks))


@st.composite
def sequences(draw: st.DrawFn) -> Cell:
    """Random tasks, marks and constraints, about as often with a circle as without."""
    tasks = "abcdefg"[: draw(st.integers(1, 7))]
    robots = {task: draw(st.sampled_from(ROBOTS)) for task in tasks}
    marks = {
        name: float(dwell) for name, dwell in zip("MN", draw(st.lists(st.integers(0, 2), max_size=2)), strict=False)
    }
    orders = {}
    for robot in ROBOTS:
        items = [task for task in tasks if robots[task] == robot] + [name for name in marks if draw(st.booleans())]
        orders[robot] = " ".join(draw(st.permutations(items)))
    edges = draw(st.lists(st.tuples(st.sampled_from(tasks), st.sampled_from(tasks)), max_size=4))
    after = {task: sorted({before for later, before in edges if later == task} - {task}) for task in tasks}
    return cell_of(orders, after, marks, mode=draw(st.sampled_from(Mode)))


def predecessors(cell: Cell) -> dict[str, set[str]]:
    """What comes directly before every task and mark: the constraints as a graph."""
    graph: dict[str, set[str]] = {task.name: set(task.after) for task in cell.tasks}
    for robot in cell.robots:
        for index, name in enumerate(robot.order):
            graph.setdefault(name, set()).update(robot.order[:index])
    return graph


@given(sequences())
def test_every_arrangement_keeps_every_constraint_and_a_deadlock_is_a_circle_of_constraints(cell: Cell) -> None:
    graph = predecessors(cell)
    try:
        ordered = list(TopologicalSorter(graph).static_order())
    except CycleError:
        with pytest.raises(InputError, match=ORDER):
            arrange(cell)
        return
    blocks = arrange(cell)
    tasks = [task.name for task in cell.tasks]
    above: dict[str, set[str]] = {}
    earliest: dict[str, int] = {}
    for name in ordered:
        above[name] = set().union(*({before} | above[before] for before in graph[name]))
        earliest[name] = max((earliest[before] + before.islower() for before in graph[name]), default=0)

    at_work = [block.tasks for block in blocks if block.tasks]
    place = {name: index for index, names in enumerate(at_work) for name in names}

    assert sorted(name for block in blocks for name in block.tasks) == tasks
    assert all(place[before] < place[name] for name in tasks for before in above[name] if before.islower())
    assert all(len({cell.task(name).robot for name in block.tasks}) == len(block.tasks) for block in blocks)
    assert sum(block.dwell for block in blocks) == sum(
        mark.dwell_s for mark in cell.program.all_marks if any(mark.name in robot.order for robot in cell.robots)
    )
    if cell.motion.mode is Mode.PAIRWISE:
        assert all(len(block.tasks) <= 1 for block in blocks)
    else:
        assert place == {name: earliest[name] for name in tasks}


@settings(max_examples=12)
@given(sequences(), st.lists(st.integers(0, 1), min_size=7, max_size=7))
def test_semi_coordinated_blocks_have_one_posture_of_the_holder(cell: Cell, turns: list[int]) -> None:
    try:
        TopologicalSorter(predecessors(cell)).prepare()
    except CycleError:
        return
    postures = {task.name: float(turn) for task, turn in zip(cell.tasks, turns, strict=False)}
    cell = at_postures(replace(cell, motion=replace(cell.motion, mode=Mode.SEMI_COORDINATED)), postures)

    blocks = arrange(cell)

    assert sorted(name for block in blocks for name in block.tasks) == [task.name for task in cell.tasks]
    assert all(len({postures[name] for name in block.tasks}) <= 1 for block in blocks)


def test_a_posture_of_the_holder_is_kept_as_long_as_there_are_tasks_for_it():
    orders = {"op0": "a d", "op1": "b e", "op2": "c"}
    cell = at_postures(cell_of(orders, mode=Mode.SEMI_COORDINATED), {"a": 0, "b": 1, "c": 0, "d": 0, "e": 1})

    assert [block.tasks for block in arrange(cell)] == [("a", "c"), ("d",), ("b",), ("e",)]


def test_tasks_during_which_the_holder_moves_have_blocks_of_their_own_and_it_leads_in_them() -> None:
    cell = cell_of({"op0": "a d", "op1": "b", "op2": "c"}, mode=Mode.SEMI_COORDINATED)
    tasks = tuple(replace(task, holder_moves=task.name in "bd") for task in cell.tasks)
    cell = replace(cell, tasks=tasks)

    blocks = [block.tasks for block in arrange(cell)]
    stages = [stage for stage in program_stages(cell) if stage.phase.tasks]

    assert blocks == [("a", "c"), ("b", "d")]
    assert [stage.cell.motion.mode for stage in stages] == [Mode.PART_AT_REST, Mode.SIMULTANEOUS]
    holder = cell.positioners[0]
    assert [holder in stage.phase.moving for stage in stages] == [False, True]
    for robot in cell.robots:
        ratio = stages[1].cell.robot(robot.name).weights / stages[0].cell.robot(robot.name).weights
        np.testing.assert_allclose(ratio, 1.0 if robot.name in cell.positioners else 1000.0, rtol=1e-12)


def test_marks_hold_those_that_take_part_and_their_dwells_are_rests_of_all():
    cell = cell_of({"op0": "M a N b O", "op1": "M c d N", "op2": "e f g"}, marks={"M": 0.5, "N": 0.25, "O": 2.0})

    assert arrange(cell) == (
        Block(("a", "c", "e"), 0.5),
        Block(("d", "f")),
        Block(("b", "g"), 0.25),
        Block((), 2.0),
    )


@pytest.mark.parametrize(
    ("orders", "after", "message"),
    [
        (
            {"op0": "c", "op1": "b a"},
            {"c": ["a"], "b": ["c"]},
            f"<cell>: tasks.c.after: {ORDER}'c' of op0 waits for 'a' of op1, which comes after 'b', which waits for "
            f"'c' of op0{CURE}",
        ),
        (
            {"op0": "a b"},
            {"a": ["b"]},
            f"<cell>: tasks.a.after: {ORDER}'a' of op0 waits for 'b' of op0, which comes after 'a'{CURE}",
        ),
        (
            {"op0": "M N", "op1": "N M a"},
            {},
            f"<cell>: robots.op0.order[0]: {ORDER}'M' of op0 waits for 'M' of op1, which comes after 'N', which waits "
            f"for 'N' of op0, which comes after 'M'{CURE}",
        ),
        (
            {"op0": "M a", "op1": "b M", "op2": "c M"},
            {"b": ["a"]},
            f"<cell>: robots.op0.order[0]: {ORDER}'M' of op0 waits for 'M' of op1, which comes after 'b', which waits "
            f"for 'a' of op0, which comes after 'M'{CURE}",
        ),
        (
            {"op0": "a", "op1": "b", "op2": "c"},
            {"a": ["b"], "b": ["c"], "c": ["b"]},
            f"<cell>: tasks.b.after: {ORDER}'b' of op1 waits for 'c' of op2, which waits for 'b' of op1{CURE}",
        ),
    ],
)
def test_a_deadlock_names_the_circle_of_robots_and_tasks(
    orders: dict[str, str], after: dict[str, list[str]], message: str
) -> None:
    with pytest.raises(InputError) as caught:
        arrange(cell_of(orders, after, {"M": 0.0, "N": 0.0}))

    assert str(caught.value) == message


def _with_order(*names: str) -> Cell:
    cell = cell_of({"op0": "a", "op1": "b"}, marks={"M": 0.0})
    return replace(cell, robots=tuple(replace(it, order=names) if it.name == "op0" else it for it in cell.robots))


@pytest.mark.parametrize(
    ("cell", "message"),
    [
        (_with_order("x"), "robots.op0.order[0]: expected a task of 'op0' or a mark (a, M), got 'x'"),
        (_with_order("b"), "robots.op0.order[0]: expected a task of 'op0' or a mark (a, M), got 'b', a task of 'op1'"),
        (_with_order("a", "M", "a"), "robots.op0.order[2]: expected each name once, got 'a' twice"),
        (_with_order("M"), "robots.op0.order: expected every task of 'op0', got none of the name 'a': add it"),
        (cell_of({"op0": "a"}, {"a": ["x"]}), "tasks.a.after: expected a task of this cell, got 'x'"),
        (
            at_postures(cell_of({"op0": "a", "op1": "b"}), {"a": 0, "b": 1}),
            "tasks.b.holder_deg: expected the configuration of the holder for 'a' in the mode simultaneous, got "
            "another: choose semi_coordinated, or let one come after the other",
        ),
        (
            at_postures(cell_of({"op0": "a b"}, mode=Mode.PART_AT_REST), {"b": 1}),
            "tasks.b.holder_deg: expected the configuration of the holder for 'a' in the mode part_at_rest, got "
            "another: choose semi_coordinated",
        ),
    ],
)
def test_a_cell_that_cannot_be_arranged_is_refused(cell: Cell, message: str) -> None:
    with pytest.raises(InputError) as caught:
        arrange(cell)

    assert str(caught.value) == f"<cell>: {message}"


def test_tasks_without_orders_come_in_the_order_of_the_cell():
    cell = cell_of({"op0": "a b", "op1": "c"})
    plain = replace(cell, robots=CELL.robots, program=NoTransfers())

    assert arrange(plain) == (Block(("a", "c")), Block(("b",)))
    assert arrange(replace(plain, motion=replace(plain.motion, mode=Mode.PAIRWISE))) == tuple(
        Block((name,)) for name in "abc"
    )


def test_a_task_of_the_holder_sets_the_posture_at_which_others_begin_with_it():
    cell = cell_of({"op0": "a", "holder": "b"}, {})
    cell = replace(cell, tasks=(cell.tasks[0], replace(cell.tasks[1], start_posture=np.ones(3))))

    assert arrange(cell) == (Block(("a", "b")),)
    with pytest.raises(InputError, match=r"tasks\.a\.holder_deg: expected the configuration of the holder for 'b'"):
        arrange(at_postures(cell, {"a": 0.5}))


def test_a_mark_after_all_tasks_is_a_rest_at_home():
    cell = cell_of({"op0": "a M b N", "op1": "c N"}, marks={"M": 0.5, "N": 2.0})

    stages = program_stages(cell)

    assert [(stage.phase.name, stage.dwell) for stage in stages] == [
        ("transfer-1", None),
        ("work-1", None),
        ("transfer-2", None),
        ("dwell-2", 0.5),
        ("work-2", None),
        ("transfer-3", None),
        ("dwell-3", 2.0),
    ]
    assert (stages[3].phase.idle, stages[3].phase.moving) == (("op1", "op2"), ())
    assert stages[-1].phase.roles == {"holder": Hold()} | dict.fromkeys(ROBOTS, Hold(at_home=True))


def test_the_holder_begins_a_block_where_its_own_task_or_that_of_others_says():
    cell = at_postures(cell_of({"op0": "a", "op1": "b", "holder": "c"}, {"b": ["a"], "c": ["b"]}), {"b": 0.5})
    cell = replace(cell, tasks=(*cell.tasks[:2], replace(cell.tasks[2], start_posture=np.ones(3))))

    starts = [stage.cell.robot("holder").start for stage in program_stages(cell) if stage.phase.tasks]

    assert starts[0] is None
    np.testing.assert_array_equal(starts[1:], [np.full(3, 0.5), np.ones(3)])
