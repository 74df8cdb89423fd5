"""Nothing unproved is exported: hundreds of spoilt runs are shown to the gate, and not one program comes out."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from builders.run_defects import DEFECTS
from builders.run_edits import Copy
from builders.stored_cells import solve_into, write_cell

from cellplan import export_program, open_gate
from cellplan.errors import InputError, NotVerifiedError

pytestmark = pytest.mark.usefixtures("stored_solutions")

QUICK_ROUNDS, ALL_ROUNDS = 1, 7  # of every kind: 52 and 364 defects


@pytest.fixture(scope="module")
def original(sound: Path, tmp_path_factory: pytest.TempPathFactory) -> Copy:
    """A sound run, and one of the same cell with other start postures."""
    folder = tmp_path_factory.mktemp("other")
    other = write_cell(folder / "cell")
    other.write_text(other.read_text().replace("[50, -85, 35]", "[51, -86, 36]"), encoding="utf-8")
    solve_into(other, folder / "run")
    return Copy(cell=sound / "cell" / "small.yaml", run=sound / "run", other=folder / "run")


def export_of_a_spoilt_copy(kind: str, seed: int, original: Copy, folder: Path) -> str:
    """What is said when a copy is spoilt and shown to the gate; fails when a program comes out."""
    rng = np.random.default_rng([seed, *kind.encode()])
    shutil.copytree(original.cell.parent, folder / "cell")
    shutil.copytree(original.run, folder / "run")
    copy = Copy(cell=folder / "cell" / original.cell.name, run=folder / "run", other=original.other)
    DEFECTS[kind](rng, copy)

    with pytest.raises((InputError, NotVerifiedError)) as refusal:
        export_program(open_gate(copy.run, cell=copy.cell), folder / "programs")

    assert not (folder / "programs").exists()
    return str(refusal.value)


def spoilt_copies(original: Copy, folder: Path, rounds: range, kind: str) -> list[str]:
    messages = []
    for seed in rounds:
        place = folder / str(seed)
        messages.append(export_of_a_spoilt_copy(kind, seed, original, place))
        shutil.rmtree(place)
    return messages


def test_the_untouched_run_is_exported(original: Copy, tmp_path: Path) -> None:
    files = export_program(open_gate(original.run, cell=original.cell), tmp_path / "programs")

    assert sorted(files) == ["idle.csv", "left.csv", "right.csv"]
    assert all((tmp_path / "programs" / name).is_file() for name in files)


@pytest.mark.parametrize("kind", DEFECTS)
def test_nothing_is_exported_from_a_run_with(kind: str, original: Copy, tmp_path: Path) -> None:
    for message in spoilt_copies(original, tmp_path, range(QUICK_ROUNDS), kind):
        assert message
        assert str(tmp_path) in message  # says which file


@pytest.mark.slow
@pytest.mark.parametrize("kind", DEFECTS)
def test_nothing_is_ever_exported_from_a_run_with(kind: str, original: Copy, tmp_path: Path) -> None:
    assert len(DEFECTS) * ALL_ROUNDS >= 200
    assert all(spoilt_copies(original, tmp_path, range(QUICK_ROUNDS, QUICK_ROUNDS + ALL_ROUNDS), kind))
