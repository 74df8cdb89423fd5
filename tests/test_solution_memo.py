"""The memo of solved cells: it gives what solving gives, and steps back where it could hide something."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.solution_memo import solved_anew, stored
from builders.stored_cells import write_cell

from cellplan import load_cell, solve, write_run
from cellplan.planning import modes

Events = list[tuple[str, float]]


@pytest.fixture
def memo(tmp_path: Path) -> Iterator[Path]:
    """Folder of a memo of this test's own."""
    with stored(tmp_path / "memo"):
        yield tmp_path / "memo"


def files(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_known_solution_is_written_and_reported_as_a_new_one(memo: Path, tmp_path: Path) -> None:
    said: list[Events] = [[], [], []]
    for place, events in zip(("first", "second"), said, strict=False):
        solution = solve(load_cell(write_cell(tmp_path / place)), progress=lambda *event, to=events: to.append(event))
        assert str(tmp_path / place) in solution.cell.origin.file
        write_run(solution, tmp_path / place / "run")
    with solved_anew():
        anew = solve(load_cell(tmp_path / "first" / "small.yaml"), progress=lambda *event: said[2].append(event))
    write_run(anew, tmp_path / "third" / "run")

    assert len(list(memo.iterdir())) == 1
    assert said[0] == said[1] == said[2]
    assert files(tmp_path / "first" / "run") == files(tmp_path / "second" / "run") == files(tmp_path / "third" / "run")


def test_nothing_is_taken_for_a_cell_with_another_value_and_nothing_can_be_spoiled(memo: Path, tmp_path: Path) -> None:
    cell = load_cell(write_cell(tmp_path / "cell"))
    first = solve(cell)
    expected = first.motion.q.copy()
    first.motion.q[:] = 0.0

    np.testing.assert_array_equal(solve(cell).motion.q, expected)
    other = solve(replace(cell, solver=cell.solver.changed(seed=cell.solver.seed + 1)))

    assert len(list(memo.iterdir())) == 2
    assert other.cell.solver.seed == cell.solver.seed + 1


def test_a_package_in_which_a_name_is_replaced_solves_anew(
    memo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cell = load_cell(write_cell(tmp_path / "cell"))
    solve(cell)
    (known,) = memo.iterdir()
    known.unlink()

    with monkeypatch.context() as patch:
        patch.setattr(modes, "standing", lambda *arguments: arguments[-1])
        solve(cell)
    assert list(memo.iterdir()) == []

    solve(cell)
    assert list(memo.iterdir()) == [known]


def test_a_name_that_stays_replaced_is_reported_where_solutions_are_to_be_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with stored(tmp_path / "memo"):
        monkeypatch.setattr(modes, "standing", lambda *arguments: arguments[-1])
    with pytest.raises(RuntimeError, match=r"replaced for longer than one test.*cellplan\.planning\.modes\.standing"):
        stored(tmp_path / "memo").__enter__()
