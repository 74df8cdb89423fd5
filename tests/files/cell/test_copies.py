"""Copies of cells: the same cell, of which no URDF is read again."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from builders.stored_cells import write_cell

from cellplan.files.cell import referenced_files
from cellplan.files.cell.load import load_cell, load_copy
from cellplan.guard import Guard, in_child


def test_a_copy_of_a_cell_is_the_same_cell_and_reads_no_urdf_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, copy, workers = write_cell(tmp_path / "cell"), tmp_path / "copy.yaml", list[str]()
    copy.write_bytes(file.read_bytes())
    cell = load_cell(file)

    def counting(function: Callable[..., object], *arguments: object, guard: Guard) -> object:
        workers.append(guard.worker)
        return in_child(function, *arguments, guard=guard)

    monkeypatch.setattr(referenced_files, "in_child", counting)
    copied = load_copy(copy, cell)
    assert "the URDF reader" not in workers
    read = load_cell(copy, folder=file.parent)
    assert "the URDF reader" in workers
    assert copied.inputs == read.inputs
    np.testing.assert_array_equal(copied.robot("right").model.X_BF, read.robot("right").model.X_BF)
