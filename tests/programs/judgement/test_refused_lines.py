"""Lines that bodies refuse: the task whose tube brings them too near is named, with the place on its seam."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.plain_dialect import dialect, job_of

from cellplan import VerifiedRun, load_cell, open_gate, solve, write_run
from cellplan.programs.judgement.judge import judge
from cellplan.programs.judgement.refused_lines import refused_lines
from cellplan.programs.rows.rows import full_rows
from cellplan.programs.shared import Shared
from cellplan.scene.scene import Scene

pytestmark = pytest.mark.usefixtures("stored_solutions")


@pytest.fixture(scope="module")
def run(sound: Path) -> VerifiedRun:
    return open_gate(sound / "run", cell=sound / "cell" / "small.yaml")


@pytest.fixture(scope="module")
def two_arms(cells: Path, tmp_path_factory: pytest.TempPathFactory) -> VerifiedRun:
    folder = tmp_path_factory.mktemp("two_arms")
    write_run(solve(load_cell(cells / "multimove.yaml")), folder / "run")
    return open_gate(folder / "run", cell=cells / "multimove.yaml")


def refused_with(run: VerifiedRun, **joints_off: float) -> dict[str, str]:
    """What is refused where joints of robots may be off by something in [rad] all the time."""
    full, robots = full_rows(run), {}
    for name, off in joints_off.items():
        rows = full[0].robots[name]
        tube = np.zeros((len(rows) - 1, 4 + rows.q.shape[1]))
        tube[:, 2:4], tube[:, 4:] = np.inf, off
        robots[name] = replace(rows, tube=tube)
    executed = replace(full[0], robots={**full[0].robots, **robots})
    return refused_lines(Shared(run), dialect(decimals=9), job_of(run, full), [executed], orders=())


@pytest.mark.slow
def test_the_place_is_that_at_which_bodies_are_nearest(two_arms: VerifiedRun) -> None:
    """A second opinion: quick distances at the rows, which know of what lies between two of them nothing."""
    (reason,) = refused_with(two_arms, right=0.02).values()
    said = re.search(r"positioner/table and right/tool come as near as ([\d.]+) mm or nearer, at ([\d.]+) s", reason)
    scene, names = Scene.from_cell(two_arms.cell), {"right/tool", "positioner/table"}
    sides = ({scene.bodies[pair.first].name, scene.bodies[pair.second].name} for pair in scene.pairs)
    near = scene.near(two_arms.motion.q, 0.1)
    is_pair = near.rows == list(sides).index(names)
    distances = dict(zip(two_arms.motion.times[near.samples[is_pair]], near.distances[is_pair], strict=True))
    then = min(distances, key=lambda time: abs(time - float(said[2])))

    assert float(said[1]) == pytest.approx(1e3 * min(distances.values()), abs=0.2)  # [mm] the certificate's tolerance
    assert distances[then] == pytest.approx(min(distances.values()), abs=2e-4)


@pytest.mark.slow
def test_of_two_tools_on_lines_only_that_with_the_wider_ones_moves_by_joints(two_arms: VerifiedRun) -> None:
    assert list(refused_with(two_arms, left=0.001, right=0.2)) == ["right_ring"]


@pytest.mark.parametrize(("joint_off", "is_refused"), [(1e-6, False), (0.5, True)])
def test_the_task_is_named_whose_tube_brings_bodies_too_near(
    run: VerifiedRun, joint_off: float, *, is_refused: bool
) -> None:
    """Programs of lines alone are refused in the same words."""
    (task,) = run.cell.tasks
    full = full_rows(run)
    rows, job = full[0].robots[task.robot], job_of(run, full)
    tube = np.zeros((len(rows) - 1, 4 + rows.q.shape[1]))
    tube[:, 2:4], tube[:, 4:] = np.inf, joint_off
    executed = replace(full[0], robots={**full[0].robots, task.robot: replace(rows, tube=tube)})

    refused = refused_lines(Shared(run), dialect(decimals=9), job, [executed], orders=())

    assert list(refused) == ([task.name] if is_refused else [])
    for reason in refused.values():
        assert re.match(r"\d+\.\d mm along its seam: clearance: \S+ and \S+ ", reason)
        findings = judge(run, dialect(decimals=9), job, (executed,)).findings
        assert f"task '{task.name}', {reason}" in findings
