"""Tools with a free spin: the model has the ends of their tasks as the solved program has them."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from cellplan.jobs.assign.assign import assign
from cellplan.jobs.assign.draft import AssignmentDraft

OPEN = Path(__file__).resolve().parents[3] / "examples" / "open_tasks" / "open_frame.yaml"
ACCURACY = 1e-6  # [rad] `solve` keeps tools within a micrometre: two plans of one task differ by as much at a metre


@pytest.mark.slow
def test_tools_with_a_free_spin_leave_their_tasks_where_the_model_has_them(tmp_path: Path) -> None:
    values = yaml.safe_load(OPEN.read_text())
    values["tasks"] = {name: it | {"free": ["spin"]} for name, it in list(values["tasks"].items())[:5]}
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(values, sort_keys=False))

    result = assign(AssignmentDraft.load(tmp_path / "cell.yaml"), effort=1)

    works = [run for run in result.solution.runs if run.schedule.tasks]
    turned = []
    for run, (_, stop) in zip(works, result.sequenced.stops, strict=True):
        for end in (it for it in stop if it is not None):
            left = run.motion.q[-1, result.cell.columns(end.mode.robot)]
            assert np.abs(left - end.end).max() < ACCURACY
            turned.append(np.abs(left - end.mode.q[0 if end.is_reversed else -1]).max())
    assert max(turned) > 0.01
    assert result.passed
    assert result.bound is not None
    assert result.bound <= result.cycle <= result.model_cycle + len(works) * result.instance.step
