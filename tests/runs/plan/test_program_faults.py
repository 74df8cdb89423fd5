"""Faults of programs from home to home are refused at their place in the cell file, before moves are searched for."""

from dataclasses import replace
from pathlib import Path

import pytest
from builders.home_to_home import PICK_AND_PLACE

from cellplan import load_cell
from cellplan.errors import (
    CellplanError,
    HomeNotFoundError,
    InputError,
    InvalidFileError,
    StartNotFoundError,
    TransferNotFoundError,
)
from cellplan.model.cell.cell import Cell
from cellplan.planning.sequence.stages import Stage, program_stages
from cellplan.planning.transfer.best_try import BlockedTransferError
from cellplan.runs.plan.program_faults import located, named_transfer
from cellplan.runs.plan.sequence import plan_program

ATTACH = "attach: {at: {xyz_mm: [0, -1000, 600]}, rests_on: table_in}"
ONE_TASK = (
    PICK_AND_PLACE.partition("  ring:\n")[0]
    + "environment: {floor: {plane: {z_mm: 0}}}\nmotion: {duration_s: 2, step_s: 0.02}\nprogram: {}\n"
)


def refused(text: str, folder: Path) -> CellplanError:
    """How a cell is refused."""
    file = folder / "cell.yaml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(CellplanError) as error:
        plan_program(load_cell(file))
    return error.value


@pytest.mark.parametrize(
    ("attach", "kind", "words"),
    [
        (
            "attach: {at: {xyz_mm: [0, -1000, 520]}, rests_on: table_in}",
            InputError,
            ": program.attach.at: part is 80 mm deep in table_in, allowed 5 mm",
        ),
        (
            "attach: {at: {xyz_mm: [0, -1000, 600]}}",
            InputError,
            ": program.attach.rests_on: 'part' touches 'table_in', 5 mm are demanded where the part lies: name the "
            "body that it rests on, or move the place",
        ),
        (
            "attach: {at: {xyz_mm: [0, -1000, 600]}, lift_mm: 0}",
            InvalidFileError,
            ": program.attach.lift_mm: expected a positive number of millimetres, got 0",
        ),
    ],
)
def test_places_of_the_part_are_refused_where_they_stand(
    attach: str, kind: type[CellplanError], words: str, tmp_path: Path
) -> None:
    error = refused(PICK_AND_PLACE.replace(ATTACH, attach), tmp_path)

    assert type(error) is kind
    assert words in str(error)


def test_a_home_that_collides_is_refused_by_its_key(tmp_path: Path) -> None:
    text = ONE_TASK.replace("home_deg: [7.426416495712, -80,", "home_deg: [7.426416495712, 90,")
    error = refused(text, tmp_path)

    assert type(error) is HomeNotFoundError
    assert ": robots.pen.home_deg: the homes come too close: 'pen/" in str(error)
    assert str(error).endswith(": give another home_deg")


@pytest.mark.parametrize("key", ["via: {before: [home, POSTURE]}", "via: {after: [service]}"])
def test_postures_in_which_a_robot_touches_its_pedestal_are_refused_by_their_keys(key: str, tmp_path: Path) -> None:
    posture = "[7.426416495712, 90, 0, 26.231452660417, 82.573583504285, 90]"
    text = ONE_TASK.replace("    path:", f"    {key}\n    path:".replace("POSTURE", posture))
    place = "tasks.seam.via.before[1]"
    if "service" in key:
        place, home = "robots.pen.service.at", "    home_deg: [7.4"
        text = text.replace(home, f"    service: {{at: {posture}, takes_s: 2, every: {{seams: 1}}}}\n{home}")

    error = refused(text, tmp_path)

    assert type(error) is InputError
    assert f": {place}: 'pen' comes too close there: 'pen/" in str(error)
    assert "touches 'pen/pedestal'" in str(error)


def test_a_robot_without_tasks_stands_at_a_home_near_a_start_that_is_found(tmp_path: Path) -> None:
    file = tmp_path / "cell.yaml"
    idle = "  idle:\n    model: ur5e\n    base: {xyz_mm: [-1500, 0, 0]}\npart:\n"
    file.write_text(ONE_TASK.replace("part:\n", idle, 1), encoding="utf-8")

    cell = plan_program(load_cell(file)).cell

    home = cell.robot("idle").home
    assert home is not None
    assert cell.robot("idle").start is home


@pytest.fixture(name="moves")
def _moves(tmp_path: Path) -> tuple[Cell, dict[str, Stage]]:
    file = tmp_path / "cell.yaml"
    file.write_text(PICK_AND_PLACE, encoding="utf-8")
    cell = load_cell(file)
    return cell, {stage.phase.name: stage for stage in program_stages(cell)}


def test_errors_of_straight_moves_stand_where_the_part_lies(moves: tuple[Cell, dict[str, Stage]]) -> None:
    cell, stages = moves

    with (
        pytest.raises(StartNotFoundError, match=r"yaml:\d+: program.attach.at: the move 'grip' fails: out of reach"),
        located(stages["grip"], cell, cell),
    ):
        raise StartNotFoundError("out of reach")
    with (
        pytest.raises(TransferNotFoundError, match=r"program.detach.at: the move 'lower' fails: too close"),
        located(stages["lower"], cell, cell),
    ):
        raise TransferNotFoundError("too close")


def test_errors_of_later_tasks_say_that_the_holder_begins_as_found(moves: tuple[Cell, dict[str, Stage]]) -> None:
    cell, stages = moves
    open_start = replace(cell, robots=(replace(cell.robots[0], start=None), *cell.robots[1:]))

    with (
        pytest.raises(StartNotFoundError, match="beyond; 'holder' has the start posture that was found for earlier"),
        located(stages["work-2"], cell, open_start),
    ):
        raise StartNotFoundError("beyond")
    with pytest.raises(StartNotFoundError, match=r"^beyond$"), located(stages["work-2"], cell, cell):
        raise StartNotFoundError("beyond")


def test_only_tasks_of_the_cell_are_to_close_their_cycle(moves: tuple[Cell, dict[str, Stage]]) -> None:
    cell = moves[0]
    cyclic = replace(cell, motion=replace(cell.motion, cyclic=True))

    closing = [stage.phase.name for stage in program_stages(cyclic) if stage.cell.motion.cyclic]

    assert closing == ["work-1", "work-2"]


def test_a_transfer_move_that_fails_is_named_with_the_tasks_at_its_ends(tmp_path: Path) -> None:
    file = tmp_path / "cell.yaml"
    file.write_text(PICK_AND_PLACE, encoding="utf-8")
    stages = program_stages(load_cell(file))
    said = {}
    for number, stage in enumerate(stages):
        if stage.dwell is None and not stage.phase.tasks:
            with pytest.raises(BlockedTransferError) as error, named_transfer(stages, number):
                raise BlockedTransferError("cell.yaml:3: robots", "found none")
            said[error.value.name] = str(error.value)

    assert said["transfer-3"] == "cell.yaml:3: robots: transfer-3, from work-1 (seam) to work-2 (ring): found none"
    assert said["transfer-1"] == "cell.yaml:3: robots: transfer-1, from home to grip: found none"
    assert said["transfer-5"] == "cell.yaml:3: robots: transfer-5, from release to home: found none"
