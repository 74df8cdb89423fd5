"""Lines that bodies refuse: the task whose tube brings them too near is named, with the place on its seam."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.plain_dialect import dialect, job_of

from cellplan import VerifiedRun, open_gate
from cellplan.programs.judgement.judge import judge
from cellplan.programs.judgement.refused_lines import refused_lines
from cellplan.programs.rows.rows import full_rows
from cellplan.programs.shared import Shared

pytestmark = pytest.mark.usefixtures("stored_solutions")


@pytest.fixture(scope="module")
def run(sound: Path) -> VerifiedRun:
    return open_gate(sound / "run", cell=sound / "cell" / "small.yaml")


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
