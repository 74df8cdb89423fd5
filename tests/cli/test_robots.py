"""The list of bundled robots."""

import io
import json
from contextlib import redirect_stdout
from typing import Any

import pytest

from cellplan.cli.main import run


@pytest.fixture(scope="module")
def listed() -> dict[str, Any]:
    """What a machine gets."""
    with redirect_stdout(io.StringIO()) as out:
        assert run(["robots", "--json"]) == 0
    return json.loads(out.getvalue())


def test_every_bundled_robot_is_listed_with_reach_limits_and_source(capsys: pytest.CaptureFixture[str]) -> None:
    status = run(["robots"])

    reported = capsys.readouterr().out
    assert status == 0
    for name in ("abb_irb1600", "kuka_kr6", "reis_rv20_16", "staubli_rx90l", "staubli_rx90l_as_printed"):
        assert f"{name}\n  reach " in reported
    assert "  B2         -155 … 35 deg          156 deg/s\n" in reported
    assert "Ribeiro 2010, table 5" in reported


def test_a_machine_gets_the_figures_of_the_data_sheet(listed: dict[str, Any]) -> None:
    assert listed["schema"] == "cellplan.robots/1"
    kuka = next(robot for robot in listed["robots"] if robot["name"] == "kuka_kr6")
    assert kuka["joints"][1] == {
        "name": "B2",
        "type": "revolute",
        "lower_deg": -155.0,
        "upper_deg": 35.0,
        "velocity_deg_s": 156.0,
    }


def test_a_robot_named_for_its_reach_has_it(listed: dict[str, Any]) -> None:
    reis = next(robot for robot in listed["robots"] if robot["name"] == "reis_rv20_16")
    assert reis["reach_mm"] == 1600.0  # RV20-16: 20 kg, 1.6 m


def test_a_machine_gets_the_zero_that_positions_count_from(listed: dict[str, Any]) -> None:
    zeros = {robot["name"]: robot["zero"] for robot in listed["robots"]}

    assert zeros["kuka_kr6"]["is_stated"]
    assert zeros["kuka_kr6"]["controller"] == {
        "A2": "-model",
        "B2": "model - 90 deg",
        "C2": "model + 90 deg",
        "D2": "-model",
        "F2": "-model",
    }
    assert zeros["abb_irb1600"]["line"] == "joint positions count from the model's zero, which is the controller's"
    assert zeros["reis_rv20_16"] == {
        "line": "joint positions count from the model's zero, taken as the controller's; not confirmed",
        "is_stated": False,
        "controller": {},
        "source": "not stated",
    }
