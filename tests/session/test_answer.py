"""What an answer says of the whole job at rest: no phase that fails is hidden by the block that is shown."""

from pathlib import Path

import numpy as np
import pytest
from builders.editor import coarse_pair

from cellplan.files.cell.load import load_cell
from cellplan.session.answer import Look, verdict_of
from cellplan.session.blocks import LiveCell
from cellplan.session.judge import JOB, Judgement, judged_job
from cellplan.session.motion import follow, standing


@pytest.fixture(scope="module")
def look(cells: Path, tmp_path_factory: pytest.TempPathFactory) -> Look:
    [live] = LiveCell.of(load_cell(coarse_pair(cells, tmp_path_factory.mktemp("pair")))).planned()
    return Look.at(live.blocks[0], follow(live.blocks[0], live.variables.layout.given))


def test_a_phase_that_fails_is_named_where_the_shown_block_passes(look: Look) -> None:
    known = {look.block.name: Judgement(is_done=True), "transfer-2": Judgement(lines=("too near", "too fast"))}

    assert verdict_of(look.judged(known[look.block.name]), known, "") == {
        "state": "fails",
        "verdict": "fails: transfer-2: too near (and 1 more)",
        "reasons": ["transfer-2: too near", "transfer-2: too fast"],
    }


def test_the_shown_block_comes_before_others_and_a_missing_program_before_both(look: Look) -> None:
    failing = look.judged(Judgement(lines=("beyond its limit",)))
    known = {"transfer-2": Judgement(lines=("too near",))}

    assert verdict_of(failing, known, "")["verdict"] == "fails: beyond its limit"
    lost = {**known, JOB: Judgement(lost="no way from home")}
    assert verdict_of(failing, lost, "")["verdict"] == "breaks off: no way from home"


def test_what_was_not_judged_is_said(look: Look) -> None:
    awaited = Look.at(look.block, standing(look.motion.x, look.motion.q[0]))

    assert verdict_of(look, {}, "it crashed")["verdict"].endswith("; not judged: it crashed")
    assert verdict_of(awaited, {}, "it crashed")["verdict"] == "unknown: it crashed"
    assert verdict_of(awaited, {}, "")["state"] == "working out"


def test_bodies_that_are_too_near_fail_at_once_and_are_named_later(cells: Path, tmp_path: Path) -> None:
    post = {"environment.post": {"box": {"size_mm": [200, 200, 4000]}, "at": {"xyz_mm": [950, 300, 0]}}}
    cell = load_cell(coarse_pair(cells, tmp_path)).with_values(post)
    known = [next(iter(some.values())) for some in judged_job(cell, [200])]

    first = next(it for it in known if it.is_clear is False)
    assert "clearance: bodies are nearer than demanded" in first.lines
    assert known[-1].is_done
    assert not known[-1].passed
    assert any("post" in line for line in known[-1].lines)
    assert np.isfinite(known[-1].q).all()
