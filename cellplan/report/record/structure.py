"""The structure of a cell as one record in printed units: what JSON and the lines for people are made from."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cellplan.report.record.joint_limits import joint_record

if TYPE_CHECKING:
    from cellplan.model.cell import Cell, Grasp, Robot
    from cellplan.model.task import Task
    from cellplan.pipeline.explain import MatrixShape, Structure

COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")
TOOL_AXIS = ("across_tool_1", "across_tool_2")  # what free spin leaves of the three turns


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
            {"name": each.name, "type": str(each.kind), "leader": model.joints[each.leader].name, "ratio": each.ratio}
            for each in model.followers
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
    from cellplan.report.record.common import number

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
