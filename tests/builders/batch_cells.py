"""Random cells for tests of the accurate mode: every shape of chain, task and hold that a cell may have."""

from dataclasses import replace

import numpy as np

from builders.jacobian_cells import model_of
from builders.random_cells import carried, random_cell, random_model, random_pose, sharing
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.cell import Cell, Relation
from cellplan.model.robot.robot import RobotModel
from cellplan.model.task.task import Frame
from cellplan.planning.collocation.batch_tasks import Desired
from cellplan.scene.kinematics.screw_chain import ScrewChain


def side_arm(model: RobotModel) -> RobotModel:
    """The model with its flange one joint earlier: the last joint does not lead to it."""
    return replace(model, flange_link=model.flange_link - 1)


def with_models(cell: Cell, models: dict[str, RobotModel]) -> Cell:
    """The cell with other models under some of its robots."""
    robots = [
        replace(robot, model=models[robot.name], weights=np.linspace(0.6, 1.9, len(models[robot.name].joints)))
        if robot.name in models
        else robot
        for robot in cell.robots
    ]
    return replace(cell, robots=tuple(robots))


def mixed_cell(seed: int) -> Cell:
    """Different numbers of joints, followers, a joint beside the way, and a robot without joints."""
    rng = np.random.default_rng(seed)
    cell = random_cell(seed, operators=4)
    models = {
        "holder": random_model(rng, 8, with_follower=True),
        "op0": side_arm(random_model(rng, 7)),
        "op1": random_model(rng, 8),
        "op2": model_of([], random_pose(rng)),
        "op3": random_model(rng, 7),
    }
    return with_models(cell, models)


def turning_cell(seed: int, *, operators: int = 2) -> Cell:
    """Six or seven joints each that all turn: the plain case of industrial arms."""
    rng, cell = np.random.default_rng(seed), random_cell(seed, operators=operators)
    models = {}
    for index, robot in enumerate(cell.robots):
        axes = [("R", tuple(rng.normal(size=3)), tuple(rng.normal(size=3))) for _ in range(6 + index % 2)]
        models[robot.name] = model_of(axes, random_pose(rng))
    return with_models(cell, models)


def with_tasks(cell: Cell, *changes: dict[str, object]) -> Cell:
    """The cell with changed tasks, in order."""
    tasks = [replace(task, **change) for task, change in zip(cell.tasks, changes, strict=True)]
    return replace(cell, tasks=tuple(tasks))


CELLS: dict[str, Cell] = {
    "plain": turning_cell(1),
    "plain of equal arms": random_cell(2, operators=2, joints=6),
    "sliding": random_cell(3, operators=3),
    "followers": random_cell(4, operators=2, with_follower=True),
    "mixed": mixed_cell(5),
    "fixture": random_cell(6, operators=2, held=False, joints=7),
    "single": random_cell(7, operators=1, joints=7),
    "partial": with_tasks(random_cell(8, operators=2, joints=7), {"axes": (0, 2, 5)}, {"axes": (1, 3)}),
    "spin": with_tasks(random_cell(9, operators=2), {"is_spin_free": True}, {}),
    "spin and partial": with_tasks(
        turning_cell(10, operators=3), {"axes": (0, 2, 3, 4, 5), "is_spin_free": True}, {}, {"axes": (0, 1, 2)}
    ),
    "closures": sharing(random_cell(11, operators=3), 2, axes=(0, 1, 2, 4)),
    "closed": sharing(turning_cell(12, operators=3), 1),
    "carried": carried(random_cell(13, operators=2)),
    "world": with_tasks(
        carried(turning_cell(14)), {"relative_to": Frame.WORLD, "is_spin_free": True}, {}, {"axes": (0, 1, 2)}
    ),
}


def relations(cell: Cell) -> list[Relation]:
    """The tasks, then the grasps of further holders."""
    return [*cell.tasks, *cell.closures]


def everyone(cell: Cell) -> list[str]:
    return [robot.name for robot in cell.robots]


def configurations(cell: Cell, lanes: int, *, seed: int = 0) -> Array:
    """Random stacked joint vectors, shape (nq, lanes)."""
    return np.random.default_rng(seed).uniform(-1.5, 1.5, size=(cell.joint_count, lanes))


def random_desired(count: int, lanes: int, *, seed: int = 0) -> tuple[Desired, Array]:
    """Random poses and twists, and the poses as matrices, shape (lanes, tasks, 4, 4)."""
    rng = np.random.default_rng(seed)
    X = np.array([[random_pose(rng) for _ in range(count)] for _ in range(lanes)])
    twists = rng.normal(size=(6, count, lanes))
    return (np.moveaxis(X, (0, 1), (3, 2)), twists), X


def seen_poses(cell: Cell, q: Array) -> Array:
    """Tool poses in the frame of each relation at stacked joint vectors, shape (N, nq), by successive screws.

    Returns:
        Poses, shape (N, relations, 4, 4).
    """
    tools = {r.name: ScrewChain(r).tool_poses(q[:, cell.columns(r.name)]) for r in cell.robots}
    if cell.part.held_by:
        X_WP = tools[cell.part.held_by[0].robot] @ inverse(cell.part.held_by[0].X_PT)
    else:
        X_WP = np.broadcast_to(cell.part.X_WP, (len(q), 4, 4))
    seen = []
    for relation in relations(cell):
        X_WR = X_WP if relation.relative_to is Frame.PART else np.broadcast_to(np.eye(4), (len(q), 4, 4))
        seen.append(inverse(X_WR) @ tools[relation.robot])
    return np.stack(seen, axis=1)
