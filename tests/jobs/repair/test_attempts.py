"""What repairs try: subsets of what may change, what is left out, round numbers and words."""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cellplan import load_cell
from cellplan.errors import InputError
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.trials.searched import searched_cell
from cellplan.jobs.repair.attempts import (
    Attempt,
    RemedyKind,
    of_branches,
    of_layout,
    of_paths,
    of_tools,
    of_weights,
    owners,
)
from cellplan.jobs.repair.neat import changed_values, neat, written_at
from cellplan.jobs.repair.prepare import ready_cell, start_posture, with_attempt
from cellplan.jobs.repair.record import change_text
from cellplan.jobs.repair.repair import StartFault
from cellplan.jobs.repair.solved import required_step, required_time
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.layout import Mirrored
from cellplan.search.programs.objective import Objective


@pytest.fixture(scope="module")
def cell(cells: Path) -> Cell:
    return load_cell(cells / "four_robots_initial.yaml")


def of_kind(kind: RemedyKind, *robots: str) -> Attempt:
    return Attempt(kind=kind, robots=robots)


def test_subsets_come_by_size_in_the_order_of_the_cell(cell: Cell) -> None:
    assert cell.layout is not None
    pairs = [attempt.robots for attempt in of_layout(cell, cell.layout, 2)]
    assert pairs == [
        ("reis", "kuka"),
        ("reis", "abb"),
        ("reis", "staubli"),
        ("kuka", "abb"),
        ("kuka", "staubli"),
        ("abb", "staubli"),
    ]
    singles = {attempt.robots[0]: attempt.addresses for attempt in of_layout(cell, cell.layout, 1)}
    assert singles == owners(cell, cell.layout)
    assert singles["abb"] == tuple(f"robots.abb.base.{entry}" for entry in ("x_mm", "y_mm", "z_mm", "yaw_deg"))


def test_what_is_tied_changes_with_all_it_is_tied_to(cell: Cell) -> None:
    assert cell.layout is not None
    equal = ("robots.kuka.base.z_mm", "robots.abb.base.z_mm")
    tied = replace(cell.layout, equal=(equal,), mirrored=(Mirrored(robots=("kuka", "staubli"), axis=1),))
    singles = {attempt.robots: attempt.addresses for attempt in of_layout(cell, tied, 1)}
    assert ("kuka",) not in singles
    assert ("staubli",) not in singles
    assert singles["abb",] == tuple(f"robots.abb.base.{entry}" for entry in ("x_mm", "y_mm", "yaw_deg"))
    pairs = {attempt.robots: attempt.addresses for attempt in of_layout(cell, tied, 2)}
    assert pairs["kuka", "abb"] == singles["abb",]  # the heights are tied to that of staubli
    assert [address.rpartition(".")[2] for address in pairs["kuka", "staubli"]] == [*("x_mm", "y_mm", "yaw_deg")] * 2
    (three,) = (entry.addresses for entry in of_layout(cell, tied, 3) if entry.robots == ("kuka", "abb", "staubli"))
    assert len(three) == 12


def test_other_attempts_are_those_that_the_cell_has_room_for(cell: Cell) -> None:
    assert cell.layout is not None
    tools = [(attempt.kind, *attempt.robots) for attempt in of_tools(cell, cell.layout)]
    operators = ("kuka", "abb", "staubli")
    assert tools == [(kind, name) for name in operators for kind in (RemedyKind.SPIN, RemedyKind.FREE_SPIN)]
    assert [attempt.values for attempt in of_branches(cell)] == [
        {f"robots.{name}.start_deg": "auto"} for name in operators
    ]
    assert [attempt.robots for attempt in of_weights(cell, cell.layout)] == [
        ("reis",),
        *((name,) for name in operators),
    ]


def test_a_fault_of_the_start_excludes_what_does_not_change_it() -> None:
    fault = StartFault(robots=frozenset({"kuka", "reis"}), text="too near")
    assert fault.excludes(of_kind(RemedyKind.LAYOUT, "abb"))
    assert not fault.excludes(of_kind(RemedyKind.LAYOUT, "abb", "kuka"))
    assert not fault.excludes(of_kind(RemedyKind.BRANCH, "kuka"))
    assert fault.excludes(of_kind(RemedyKind.WEIGHTS, "kuka"))  # weights leave the start posture as it is
    assert fault.excludes(of_kind(RemedyKind.DURATION))


def test_attempts_survive_the_journey_to_another_process(cell: Cell) -> None:
    assert cell.layout is not None
    attempts = [*of_layout(cell, cell.layout, 2), *of_tools(cell, cell.layout), *of_branches(cell)]
    assert pickle.loads(pickle.dumps(attempts)) == attempts  # noqa: S301 - made here


@pytest.mark.parametrize(
    ("name", "share", "factor"),
    [
        ("joint_velocity", 1.3, 1.3),
        ("joint_acceleration", 1.44, 1.2),
        ("joint_jerk", 1.331, 1.1),
        ("position_error", 4.0, 1.0),  # slower motions are no more accurate in themselves
    ],
)
def test_the_time_that_a_check_asks_for(name: str, share: float, factor: float) -> None:
    assert required_time([{"name": name, "value": 5.0 * share, "limit": 5.0}]) == pytest.approx(factor)


def test_rows_are_halved_until_their_errors_fit() -> None:
    errors = [{"name": "position_error_between_rows", "value": value, "limit": 0.01} for value in (0.02, 0.1)]
    assert required_step(errors, 0.02) == 0.005  # a quarter of the step, a sixteenth of the error: 0.00625


def test_changes_are_round_and_only_what_differs_is_written(cells: Path) -> None:
    request = LayoutRequest(cell=cells / "four_robots_initial.yaml", objective=Objective.CHANGE)
    ready = ready_cell(request)
    (attempt,) = [entry for entry in of_layout(ready.cell, ready.variables.settings, 1) if entry.robots == ("staubli",)]
    only, start = with_attempt(ready, attempt), start_posture(ready)[0]
    assert only.variables.names == attempt.addresses
    x = only.variables.given + np.array([0.0123456, 0.00004, -0.1, np.radians(1.23456)])
    x, start = neat(only, x, start)
    values = changed_values(only, x, start)
    assert values["robots.staubli.base.x_mm"] == 1450.0 + 12.3
    assert values["robots.staubli.base.z_mm"] == 450.0 - 100.0
    assert values["robots.staubli.base.yaw_deg"] == pytest.approx(91.23)
    assert values.keys() == {
        *(f"robots.staubli.base.{entry}" for entry in ("x_mm", "z_mm", "yaw_deg")),
        "robots.staubli.start_deg",
    }
    text = change_text(ready.cell, attempt, values)
    assert text == "move staubli 100 mm down, 12.3 mm +x; turn staubli +1.23 deg yaw"


@pytest.mark.parametrize(
    ("address", "value"),
    [
        ("robots.kuka.base.y_mm", 1250.0),
        ("robots.kuka.base.yaw_deg", -115.0),
        ("robots.reis.start_deg[1]", -62.0),
        ("part.held_by[0].at.x_mm", -250.0),
        ("motion.duration_s", 6.0),
        ("robots.kuka.nothing", None),
    ],
)
def test_what_the_file_has_at_an_address(cell: Cell, address: str, value: float | None) -> None:
    assert written_at(cell.origin.document, address) == value


def test_a_joint_path_is_an_attempt_of_its_own() -> None:
    cells = Path(__file__).resolve().parents[3] / "cells"
    request = LayoutRequest(
        cell=cells / "four_robots.yaml",
        objective=Objective.CHANGE,
        vary=("reis.path={coefficients: 10}",),
        settings=("motion.step_s=0.004", "solver.gain_per_s=200"),
    )
    ready = ready_cell(request)
    (attempt,) = of_paths(searched_cell(request))

    opened = with_attempt(ready, attempt)
    values = changed_values(opened, *neat(opened, opened.coarse.given, start_posture(ready)[0]))

    assert ready.unled is None
    assert not any("path" in name for name in ready.coarse.names)
    assert attempt.text == "joint path of reis"
    assert change_text(ready.cell, attempt, values) == "joint path of reis: 10 coefficients a joint"
    assert ready.cell.with_values(values).robot("reis").path is not None


def test_a_cell_with_a_joint_path_is_not_repaired() -> None:
    cells = Path(__file__).resolve().parents[3] / "cells"
    path = "robots.reis.path={degree: 3, coefficients_deg: [[0, -93, 108, 0, -15, 0], [0, -93, 108, 0, -15, 0]]}"
    request = LayoutRequest(
        cell=cells / "four_robots.yaml", objective=Objective.CHANGE, vary=("reis.path",), settings=(path,)
    )

    with pytest.raises(InputError, match=r"robots\.reis\.path: expected no joint path for --repair"):
        ready_cell(request)
