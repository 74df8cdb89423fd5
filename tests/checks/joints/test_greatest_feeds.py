"""Rounding of programs beside greatest feeds: a tool on a part that is carried, moved by every joint of both robots."""

from pathlib import Path

import numpy as np

from cellplan import load_cell
from cellplan.checks.joints.greatest_feeds import FEWEST_DECIMALS, rounding_of_programs
from cellplan.measures.tool_errors import error_lengths, part_poses, relative_to_task_frame
from cellplan.programs.dialects import DIALECTS
from cellplan.scene.scene import Scene


def test_no_rounding_puts_a_tool_farther_off_on_a_carried_part_and_some_nearly_as_far(cells: Path) -> None:
    cell = load_cell(cells / "multimove.yaml").with_values({f"tasks.{it}_ring.free": [] for it in ("left", "right")})
    scene, task, rng = Scene.from_cell(cell), cell.tasks[0], np.random.default_rng(1)
    at = {robot.name: rng.uniform(-1.0, 1.0, len(robot.model.joints)) for robot in cell.robots}
    half = np.deg2rad(0.5e-4)
    near = {name: q + half * rng.choice([-1.0, 1.0], (4000, len(q))) for name, q in at.items()}

    off = rounding_of_programs(scene, task, {name: q[None] for name, q in at.items()})

    places = [
        relative_to_task_frame(
            task, scene.chains[task.robot].tool_poses(q[task.robot]), part_poses(cell, scene.chains, q)
        )
        for q in (near, {name: q[None] for name, q in at.items()})
    ]
    farthest = error_lengths(*places, task).max(axis=0)
    assert np.all(farthest <= np.multiply(off, 1.0 + 1e-5))
    assert np.all(farthest > np.multiply(off, 0.4))


def test_no_language_has_fewer_decimals_where_none_are_stated() -> None:
    fewest = min(dialect.decimals for dialect in DIALECTS.values())

    assert fewest == FEWEST_DECIMALS[1]  # Of a millimetre; that language has one more of a degree
    assert min(dialect.decimals for name, dialect in DIALECTS.items() if name != "inform") == FEWEST_DECIMALS[0]
