"""Contact of a holder and of a support with a part that is picked up: near the place of the part, nowhere else."""

import re
from pathlib import Path

import pytest
from builders.grid_bodies import grid_body, obj_text
from builders.home_to_home import PICK_AND_PLACE

from cellplan import load_cell
from cellplan.checks.verify import run_clearance
from cellplan.errors import InputError
from cellplan.model.progress import silent
from cellplan.model.report.report import Check
from cellplan.planning.sequence.scenes import StageScenes
from cellplan.planning.sequence.stages import program_stages
from cellplan.runs.plan.program_faults import refuse_hanging_parts
from cellplan.runs.plan.sequence import WorkedStages

FLAT = "bodies: [{cylinder: {radius_mm: 50, length_mm: 120}, at: {xyz_mm: [0, 0, 60]}}]"
PIN = "{cylinder: {radius_mm: 8, length_mm: 120}, at: {xyz_mm: [0, 0, 60]}}"
DISC = "{cylinder: {radius_mm: 30, length_mm: 5}, at: {xyz_mm: [0, 0, 107.5]}}"
JAWS = (
    "{box: {size_mm: [20, 40, 60]}, at: {xyz_mm: [-60, 0, 120]}}, "
    "{box: {size_mm: [20, 40, 60]}, at: {xyz_mm: [60, 0, 120]}}, "
    "{box: {size_mm: [140, 40, 20]}, at: {xyz_mm: [0, 0, 60]}}"
)
NAMED = "grip_bodies: [holder/tool, holder/tool_2]}"
LIP = {(0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 0, 1), (1, 0, 2), (2, 0, 2)}


def with_lip(folder: Path, tool: str) -> str:
    """A block on which the holder grips below a lip that is 20 mm thick and 20 mm off the axis of its tool."""
    lip = grid_body([[-150, 20, 130, 150], [-150, 150], [-100, 60, 80, 100]], LIP)
    (folder / "lip.obj").write_text(obj_text(lip), encoding="utf-8")
    text = PICK_AND_PLACE.replace(FLAT, f"bodies: [{tool}]").replace("step_s: 0.02", "step_s: 0.05")
    text = text.replace("{box: {size_mm: [300, 300, 200]}}", "{mesh: lip.obj, unit: mm}")
    return text.replace("at: {xyz_mm: [0, 0, 100], rpy", "at: {xyz_mm: [0, 0, 60], rpy")


def checks_of(text: str, folder: Path, move: str) -> list[Check]:
    """The checks of clearance of a straight move, all others being left out."""
    file = folder / "cell.yaml"
    file.write_text(text, encoding="utf-8")
    cell = load_cell(file)
    search = WorkedStages(cell, StageScenes.of(cell), silent, None)
    for stage in program_stages(cell):
        if (run := search.run(stage) if stage.move is not None else None) is not None and stage.phase.name == move:
            assert run.scene is not None
            return list(run_clearance(run.scene, run.schedule, run.motion.q, with_curves=False)[1])
    raise AssertionError(move)


def failures(text: str, folder: Path, move: str = "grip") -> list[str]:
    """Messages of the checks that fail."""
    return [check.message for check in checks_of(text, folder, move) if not check.passed]


@pytest.mark.slow
def test_a_disc_on_the_holder_that_passes_through_a_lip_of_the_part_collides(tmp_path: Path) -> None:
    messages = failures(with_lip(tmp_path, f"{PIN}, {DISC}"), tmp_path)

    assert any(
        message.startswith(
            "collision: holder/tool_2 touches part more than 2 mm from the grip (program.attach.contact_mm) from"
        )
        for message in messages
    )


@pytest.mark.slow
def test_no_length_of_contact_excuses_what_lies_outside_the_zone_of_the_grip(tmp_path: Path) -> None:
    text = with_lip(tmp_path, f"{PIN}, {DISC}").replace("rests_on: table_in", "rests_on: table_in, contact_mm: 50")

    assert any(
        message.startswith("collision: holder/tool_2 touches part outside the contact zone of the grip")
        for message in failures(text, tmp_path)
    )


@pytest.mark.slow
def test_a_body_that_is_named_as_gripping_is_no_deeper_on_its_way_than_its_grip(tmp_path: Path) -> None:
    text = with_lip(tmp_path, f"{PIN}, {DISC}").replace("rests_on: table_in", "rests_on: table_in, contact_mm: 50")
    text = text.replace("rpy_deg: [180, 0, 0]}}", f"rpy_deg: [180, 0, 0]}}, {NAMED}", 1)

    (message,) = failures(text, tmp_path)

    assert message.startswith("holder/tool_2 is 9.9")
    assert "mm deep in part" in message


def jaws(grip: str, place: str) -> str:
    """Two jaws that clamp a bar over 30 mm, each half a millimetre deep in it."""
    text = PICK_AND_PLACE.replace(FLAT, f"bodies: [{JAWS}]").replace("step_s: 0.02", "step_s: 0.05")
    text = text.replace("size_mm: [300, 300, 200]", "size_mm: [101, 300, 200]")
    text = text.replace("rpy_deg: [180, 0, 0]}}", f"rpy_deg: [180, 0, 0]}}{grip}", 1)
    return text.replace("rests_on: table_in", f"rests_on: table_in{place}")


def test_jaws_slide_along_the_part_as_far_as_the_cell_says(tmp_path: Path) -> None:
    assert not failures(jaws(f", {NAMED}", ", contact_mm: 30"), tmp_path)

    messages = failures(jaws(f", {NAMED}", ""), tmp_path)
    assert any(
        message.startswith("collision: holder/tool touches part more than 2 mm from the grip") for message in messages
    )


def test_a_flat_holder_comes_down_on_a_flat_part(tmp_path: Path) -> None:
    text = PICK_AND_PLACE.replace("step_s: 0.02", "step_s: 0.05")

    checks = checks_of(text, tmp_path, "grip")

    assert all(check.passed for check in checks)
    assert {check.name for check in checks} >= {"grip_depth", "collision", "clearance"}


@pytest.mark.slow
def test_a_part_that_is_lifted_through_an_overhang_of_its_support_collides(tmp_path: Path) -> None:
    nest = grid_body([[-200, 130, 200, 220], [-200, 200], [-250, 250, 500, 530]], LIP)
    (tmp_path / "nest.obj").write_text(obj_text(nest), encoding="utf-8")
    text = PICK_AND_PLACE.replace("step_s: 0.02", "step_s: 0.05").replace(
        "table_in: {box: {size_mm: [400, 400, 500]}, at", "table_in: {mesh: nest.obj, unit: mm, at"
    )
    text = text.replace("rests_on: table_in", "rests_on: table_in, lift_mm: 100")

    messages = failures(text, tmp_path, "lift")

    assert any(
        message.startswith("collision: part touches table_in more than 5 mm from the place of the part")
        for message in messages
    )


@pytest.mark.parametrize(
    ("z_mm", "keys", "words"),
    [
        (
            750,
            "rests_on: table_in",
            "expected a part that touches 'table_in' where it lies, within rest_gap_mm = 1, got one 150 mm away, which "
            "would fall: move the place or the body, or state clamped: true for a nest, magnet or hook that holds it",
        ),
        (602, "rests_on: [table_in]", "within rest_gap_mm = 1, got one 2 mm away, which would fall"),
        (
            600,
            "rests_on: [table_in, floor]",
            "touches 'floor' where it lies, within rest_gap_mm = 1, got one 500 mm away",
        ),
        (750, "lift_mm: 40", "expected a body that the part rests on, got none ('table_in', the nearest, 150 mm away)"),
        (602, "rests_on: table_in, rest_gap_mm: 3", ""),
        (602, "rests_on: table_in, clamped: true", ""),
        (750, "clamped: true", ""),
        (600, "rests_on: table_in", ""),
    ],
)
def test_a_part_that_would_fall_is_refused(z_mm: float, keys: str, words: str, tmp_path: Path) -> None:
    for place, y_mm in (("attach", -1000), ("detach", 1000)):
        on = "table_in" if place == "attach" else "table_out"
        given = f"{place}: {{at: {{xyz_mm: [0, {y_mm}, 600]}}, rests_on: {on}}}"
        assert given in PICK_AND_PLACE
        other = f"{place}: {{at: {{xyz_mm: [0, {y_mm}, {z_mm}]}}, {keys}}}".replace("table_in", on)
        file = tmp_path / f"{place}.yaml"
        file.write_text(PICK_AND_PLACE.replace(given, other), encoding="utf-8")
        scenes = StageScenes.of(load_cell(file))
        if not words:
            refuse_hanging_parts(scenes)
            continue
        with pytest.raises(InputError, match=re.escape(words.replace("table_in", on))) as error:
            refuse_hanging_parts(scenes)
        assert f": program.{place}.rests_on: " in str(error.value)
