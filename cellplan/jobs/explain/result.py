"""The structure of a cell as record and as text, in lines of at most a hundred columns."""

import textwrap
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Final

from cellplan.jobs.explain.explain import MatrixShape, Structure
from cellplan.model.cell.cell import Cell, Grasp, Robot
from cellplan.model.task.task import Task
from cellplan.report.record.common import Record, number
from cellplan.report.record.sections.joints import joint_record, limits_text
from cellplan.report.text.method import counted

COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")
TOOL_AXIS = ("across_tool_1", "across_tool_2")  # what free spin leaves of the three turns
WIDTH: Final = 100  # columns of a terminal
GAP: Final = 2  # spaces between two columns of a table
BLOCKS: Final = {-1: "- J", 1: "+ J", 0: "."}


# Record


def structure_record(structure: Structure) -> dict[str, Any]:
    """The structure in printed units."""
    cell, graph = structure.cell, structure.graph
    return {
        "cell": cell.name,
        "mode": str(cell.motion.mode),
        "part": {"held_by": list(cell.positioners), "closures": [_closure_record(grasp) for grasp in cell.closures]},
        "robots": [_robot_record(cell, robot) for robot in cell.robots],
        "tasks": [_task_record(task) for task in cell.tasks],
        "graph": {
            "chains": "PPPS" if structure.plane is None else "PPR",
            "plane": None if structure.plane is None else str(structure.plane),
            "vertices": len(graph.links),
            "edges": len(graph.joints),
            "independent_circuits": len(structure.circuits),
            "links": list(graph.links),
            "joints": [
                {"name": joint.name, "owner": joint.owner, "type": str(joint.kind), "virtual": joint.is_virtual}
                | {"from": joint.tail, "to": joint.head, "driven_by": joint.drive, "ratio": joint.ratio}
                for joint in graph.joints
            ],
        },
        "circuits": [
            {
                "chord": graph.joints[circuit.chord].name,
                "passed": [{"joint": graph.joints[index].name, "sign": sign} for index, sign in circuit.passed],
            }
            for circuit in structure.circuits
        ],
        "matrices": [_matrix_record(cell, matrix) for matrix in structure.matrices],
    }


def _robot_record(cell: Cell, robot: Robot) -> dict[str, Any]:
    model = robot.model
    return {
        "name": robot.name,
        "model": model.name,
        "holds_part": robot.name in cell.positioners,
        "works_on": [task.name for task in cell.tasks if task.robot == robot.name],
        "joints": [joint_record(joint) for joint in model.joints],
        "followers": [
            {
                "name": follower.name,
                "type": str(follower.kind),
                "leader": model.joints[follower.leader].name,
                "ratio": follower.ratio,
            }
            for follower in model.followers
        ],
    }


def _task_record(task: Task) -> dict[str, Any]:
    desired = [COMPONENTS[axis] for axis in task.axes if axis < 3 or not task.is_spin_free]
    return {
        "name": task.name,
        "robot": task.robot,
        "relative_to": str(task.relative_to),
        "constrained": [*desired, *(TOOL_AXIS if task.is_spin_free else ())],
    }


def _closure_record(grasp: Grasp) -> dict[str, Any]:
    """What the grasp of a further holder keeps."""
    return {"name": grasp.name, "robot": grasp.robot, "kept": [COMPONENTS[axis] for axis in grasp.axes]}


def _matrix_record(cell: Cell, matrix: MatrixShape) -> dict[str, Any]:
    """Blocks, rank and redundancy of one run."""
    values = matrix.singular_values
    robots = [robot.name for robot in cell.robots]
    return {
        "run": matrix.phase.label,
        "rows": sum(matrix.rows),
        "columns": sum(matrix.columns),
        "row_blocks": dict(zip(matrix.blocks, matrix.rows, strict=True)),
        "column_blocks": dict(zip(robots, matrix.columns, strict=True)),
        "signs": {
            task: {robot: int(sign) for robot, sign in zip(robots, row, strict=True)}
            for task, row in zip(matrix.blocks, matrix.signs.tolist(), strict=True)
        },
        "starts_to_find": list(matrix.missing),
        "rank": matrix.rank,
        "smallest_singular_value": None if values is None else number(values.min(initial=float("inf"))),
        "redundancy": matrix.redundancy,
    }


# Text


def structure_lines(record: Record) -> list[str]:
    """All lines about one cell."""
    joints = sum(len(robot["joints"]) for robot in record["robots"])
    counts = [(len(record["robots"]), "robot"), (joints, "joint"), (len(record["tasks"]), "task")]
    holders = ", ".join(record["part"]["held_by"])
    return [
        f"{record['cell']}: {', '.join(counted(*count) for count in counts)}, mode {record['mode']}",
        f"the part is held by {holders}" if holders else "the part is fixed in the world",
        *_robot_lines(record["robots"]),
        *_task_lines(record["tasks"]),
        *_closure_lines(record["part"]),
        *_graph_lines(record["graph"], [closure["name"] for closure in record["part"]["closures"]]),
        *_circuit_lines(record),
        *(line for matrix in record["matrices"] for line in _matrix_lines(matrix)),
    ]


def _robot_lines(robots: Iterable[Record]) -> Iterator[str]:
    for robot in robots:
        duties = ["holds the part"] if robot["holds_part"] else []
        duties += [f"works on {', '.join(robot['works_on'])}"] if robot["works_on"] else []
        yield ""
        yield from _wrapped(f"robot {robot['name']}  ({robot['model']}) ", " and ".join(duties) or "idle")
        name_width = max((len(axis["name"]) for axis in robot["joints"] + robot["followers"]), default=0)
        for joint in robot["joints"]:
            limits, speed = limits_text(joint)
            yield f"  {joint['name']:<{name_width}}  {joint['type']:<9}  {limits:<24}  {speed}"
        for axis in robot["followers"]:
            yield f"  {axis['name']:<{name_width}}  {axis['type']:<9}  {axis['ratio']:g} times {axis['leader']}"


def _task_lines(tasks: Sequence[Record]) -> Iterator[str]:
    yield ""
    yield "tasks and their constrained components"
    task_width, robot_width = _width(task["name"] for task in tasks), _width(task["robot"] for task in tasks)
    for task in tasks:
        desired = [name for name in task["constrained"] if not name.startswith("across")]
        desired += ["tool axis (spin is free)"] if len(desired) < len(task["constrained"]) else []
        place = "" if task["relative_to"] == "part" else "  in the world"
        yield f"  {task['name']:<{task_width}}  {task['robot']:<{robot_width}}  {' '.join(desired)}{place}"


def _closure_lines(part: Record) -> Iterator[str]:
    closures = part["closures"]
    if closures:
        width = _width(closure["name"] for closure in closures)
        yield ""
        yield f"grasps of co-holders, which close kinematic loops; {part['held_by'][0]} carries the part frame"
        for closure in closures:
            yield f"  {closure['name']:<{width}}  constrains {' '.join(closure['kept'])}"


def _graph_lines(graph: Record, closures: list[str]) -> Iterator[str]:
    """Counts, then the links and joints of every chain."""
    e, v, circuits = graph["edges"], graph["vertices"], graph["independent_circuits"]
    where = "PPPS, in space" if graph["plane"] is None else f"PPR, in the plane {graph['plane']}"
    virtual = sum(joint["virtual"] for joint in graph["joints"])
    yield ""
    yield f"graph: {v} links (vertices), {e} joints (edges): {e - virtual} real, {virtual} virtual ({where})"
    yield f"  l = e - v + 1 = {e} - {v} + 1 = {counted(circuits, 'independent circuit')}"
    chains: dict[str, list[Record]] = {}
    for joint in graph["joints"]:
        chains.setdefault(_owner(joint, closures), []).append(joint)
    width = _width(chains)
    for owner, joints in chains.items():
        steps = [f"-{_short(joint)}- {_link(joint['to'])}" for joint in joints]
        yield from _wrapped(f"  {owner:<{width}}  ", " ".join([joints[0]["from"], *steps]))


def _owner(joint: Record, closures: list[str]) -> str:
    """Name of the chain of a joint: of a robot, of a task, or of the free components of a co-holder's grasp."""
    if not joint["virtual"]:
        return str(joint["owner"])
    return f"{'grasp' if joint['owner'] in closures else 'task'} {joint['owner']}"


def _circuit_lines(record: Record) -> Iterator[str]:
    """The joints of each circuit, starting at the part, with the sign of traversal."""
    joints = {joint["name"]: joint for joint in record["graph"]["joints"]}
    width = _width(joint["owner"] for joint in joints.values())
    yield ""
    yield "circuits: + joint traversed from its base side, - joint traversed in the opposite direction"
    for count, circuit in enumerate(record["circuits"], start=1):
        by_owner: dict[str, list[str]] = {}
        for step in _from_first_virtual(circuit["passed"], joints):
            joint, sign = joints[step["joint"]], "+" if step["sign"] > 0 else "-"
            by_owner.setdefault(joint["owner"], []).append(f"{sign}{_short(joint)}")
        for place, (name, steps) in enumerate(by_owner.items()):
            yield from _wrapped(f"  {count if place == 0 else '':<2} {name:<{width}}  ", " ".join(steps))


def _from_first_virtual(passed: list[Record], joints: dict[str, Record]) -> list[Record]:
    """A circuit from its first virtual joint: along the virtual chain, then back over the robots.

    A circuit without a virtual chain begins at the world: up one robot that holds the part and down another.
    """
    virtual = [joints[step["joint"]]["virtual"] for step in passed]
    upward = [step["sign"] > 0 and joints[step["joint"]]["from"] == "world" for step in passed]
    marks = virtual if any(virtual) else upward
    first = next((place for place, is_in in enumerate(marks) if is_in and not marks[place - 1]), 0)
    return passed[first:] + passed[:first]


def _matrix_lines(matrix: Record) -> Iterator[str]:
    """The blocks as an arrow, then rank and redundancy."""
    rows, columns = matrix["rows"], matrix["columns"]
    of = "cooperation Jacobian" + (f" of the run {matrix['run']}" if matrix["run"] else "")
    yield ""
    yield f"{of}: {counted(rows, 'row')}, {counted(columns, 'column')}"
    task_width = _width(matrix["row_blocks"])
    for robots in _groups(matrix["column_blocks"], left=task_width + 6):
        widths = [max(len(robot), 5) + GAP for robot in robots]
        sizes = [str(matrix["column_blocks"][robot] or "still") for robot in robots]
        yield f"  {'':<{task_width}}    " + "".join(f"{robot:>{w}}" for robot, w in zip(robots, widths, strict=True))
        yield f"  {'':<{task_width}}    " + "".join(f"{size:>{w}}" for size, w in zip(sizes, widths, strict=True))
        for task, size in matrix["row_blocks"].items():
            signs = [BLOCKS[matrix["signs"][task][robot]] for robot in robots]
            yield f"  {task:<{task_width}} {size:>2} " + "".join(
                f"{sign:>{w}}" for sign, w in zip(signs, widths, strict=True)
            )
    yield from _rank_lines(matrix)


def _rank_lines(matrix: Record) -> Iterator[str]:
    rows, columns, rank = matrix["rows"], matrix["columns"], matrix["rank"]
    if rank is None:
        missing = ", ".join(matrix["starts_to_find"])
        yield from _wrapped("  ", f"rank: unknown until the start of {missing} is found (by `cellplan check`)")
        if columns >= rows:
            yield f"  degree of redundancy: {columns} - {rows} = {columns - rows} where the rows are independent"
    else:
        smallest = matrix["smallest_singular_value"]
        yield f"  rank at the start: {rank}" + ("" if smallest is None else f", smallest singular value {smallest:.3g}")
        yield f"  degree of redundancy: {columns} - {rank} = {matrix['redundancy']}"
        if rank < rows:
            yield (
                f"  only {rank} of {rows} rows are independent there: "
                f"{counted(rows - rank, 'direction')} in which the tools cannot move as required"
            )
    if rank is None and columns < rows:
        yield f"  overconstrained: {counted(rows, 'row')} for {counted(columns, 'column')}"


def _groups(column_blocks: Record, *, left: int) -> Iterator[list[str]]:
    """Robots in groups whose columns fit side by side."""
    group: list[str] = []
    used = left
    for robot in column_blocks:
        need = max(len(robot), 5) + GAP
        if group and used + need > WIDTH:
            yield group
            group, used = [], left
        group.append(robot)
        used += need
    yield group


def _wrapped(head: str, text: str) -> list[str]:
    """A line with a hanging indent; words are never broken."""
    return textwrap.wrap(
        text,
        WIDTH,
        initial_indent=head,
        subsequent_indent=" " * min(len(head), WIDTH // 2),
        break_long_words=False,
        break_on_hyphens=False,
        drop_whitespace=True,
    )


def _width(names: Iterable[str]) -> int:
    return max(map(len, names), default=0)


def _short(joint: Record) -> str:
    """A joint's own name, without that of its robot or task."""
    name: str = joint["name"]
    return name[len(joint["owner"]) + 1 :]


def _link(link: str) -> str:
    """A link's own name where it is only a number."""
    last = link.replace(":", "/").rpartition("/")[2]
    return last if last.isdigit() else link
