"""Rules of a cell as a search takes them, in closed form: straight seams of 140 and 120 mm at 20 mm/s."""

from pathlib import Path

import pytest

from cellplan.files.cell.load import load_open_cell
from cellplan.search.assign.problem.rules import TaskRules, tasks_before

OPEN = Path(__file__).resolve().parents[4] / "examples" / "open_tasks" / "open_frame.yaml"


@pytest.fixture
def rules(tmp_path: Path, request: pytest.FixtureRequest) -> TaskRules:
    (tmp_path / "cell.yaml").write_text(OPEN.read_text().replace("program: {}", f"program: {request.param}"))
    return TaskRules.of(load_open_cell(tmp_path / "cell.yaml")[0])


@pytest.mark.parametrize("rules", ["{rest_s: 25, apart_mm: 180}"], indirect=True)
def test_a_block_begins_a_rest_after_the_end_of_the_path_of_another(rules: TaskRules) -> None:
    """Approach 0.6 s, delays 0.2 s, ramps 0.1 s: 0.6 + 0.2 + 7.1 + 0.2 + 25 - 0.6 s in steps of 0.02 s."""
    assert rules.lags["top_1", "top_3"] == 1625
    assert rules.lags["top_3", "top_1"] == 1575
    assert ("top_1", "top_2") not in rules.lags  # 439 mm apart
    assert ("side_2", "edge_2") in rules.lags


@pytest.mark.parametrize("rules", ["{arcs_apart_mm: 500}"], indirect=True)
def test_two_seams_keep_their_distance_where_both_run_the_same_way(rules: TaskRules) -> None:
    """Parallel, 460 and 300 mm apart: 549 mm in the same direction, else 439 mm where they are nearest."""
    assert rules.crowded["top_1", "top_2"] == {(False, True), (True, False)}
    assert rules.is_crowded(("top_2", "top_1"), (True, False))
    assert not rules.is_crowded(("top_2", "top_1"), (True, True))


@pytest.mark.parametrize("rules", ["{rest_s: 25, apart_mm: 180, together: [top_1, top_3]}"], indirect=True)
def test_what_begins_together_does_not_wait_for_itself(rules: TaskRules) -> None:
    assert ("top_1", "top_3") not in rules.lags
    assert rules.lags


def test_tacks_and_turns_come_before_what_follows_them(tmp_path: Path) -> None:
    text = OPEN.read_text().replace(
        "program: {}", "program: {tacks_first: true, order: {alternate: [[top_1], [top_2]]}}"
    )
    (tmp_path / "cell.yaml").write_text(text.replace("  side_1:\n", "  side_1:\n    tack: true\n"))

    before = tasks_before(load_open_cell(tmp_path / "cell.yaml")[0])

    assert before["side_1"] == ()
    assert before["side_2"] == ("side_1",)
    assert set(before["top_2"]) == {"top_1", "side_1"}
