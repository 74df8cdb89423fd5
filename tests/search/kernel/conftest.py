"""The reference cell and random layouts of it."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from cellplan.files.cell.load import load_cell
from cellplan.geometry.transforms import rotation_about
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import schedule_tasks
from cellplan.search.kernel.job import Job, Layouts

CELL = Path(__file__).resolve().parents[3] / "cells" / "four_robots.yaml"
NODES = 97


@pytest.fixture(scope="session")
def reference() -> SimpleNamespace:
    """The reference cell, its job on 97 nodes, and some layouts with bases and the positioner's start changed."""
    cell = load_cell(CELL)
    schedule = schedule_tasks(cell, [build_toolpath(task, cell.part) for task in cell.tasks])
    moving, rng, count = [robot.name for robot in cell.robots], np.random.default_rng(3), 12
    start = np.concatenate([robot.start for robot in cell.robots if robot.start is not None])
    layouts = Layouts.of([cell] * count, np.tile(start, (count, 1)))
    for robot in range(1, 4):
        turned = rotation_about(np.array([0.0, 0.0, 1.0]), rng.uniform(-0.2, 0.2, count))
        layouts.X_WB[:, robot, :3, :3] = turned @ layouts.X_WB[:, robot, :3, :3]
        layouts.X_WB[:, robot, :3, 3] += rng.uniform(-0.15, 0.15, (count, 3))
    layouts.start[:, :6] += rng.uniform(-0.15, 0.15, (count, 6))
    job = Job.of(cell, schedule, moving=moving, nodes=NODES)
    return SimpleNamespace(cell=cell, schedule=schedule, moving=moving, job=job, layouts=layouts)
