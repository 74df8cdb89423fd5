"""Export: programs appear whole, in their own place, and only when their rounded numbers pass."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cellplan import export_program, load_cell, open_gate, solve, write_run
from cellplan.errors import InputError, NotVerifiedError
from cellplan.files.input.files import digest
from cellplan.programs.dialects import DIALECTS
from cellplan.runs.overrides import with_overrides

pytestmark = pytest.mark.usefixtures("stored_solutions")


@pytest.fixture
def copy(sound: Path, tmp_path: Path) -> Path:
    shutil.copytree(sound, tmp_path / "copy")
    return tmp_path / "copy"


def test_the_record_names_every_file_and_the_run(copy: Path) -> None:
    run = open_gate(copy / "run", cell=copy / "cell" / "small.yaml")

    files = export_program(run, copy / "programs")

    record = json.loads((copy / "programs" / "export.json").read_text())
    assert record["run"] == digest((copy / "run" / "manifest.json").read_bytes())
    unknown = "joint positions count from the model's zero, taken as the controller's; not confirmed"
    assert record["zero"] == dict.fromkeys(("left", "right", "idle"), unknown)
    assert record["files"] == {name: digest((copy / "programs" / name).read_bytes()) for name in files}


def test_exporting_again_replaces_the_programs_and_leaves_the_run_sound(copy: Path) -> None:
    cell = copy / "cell" / "small.yaml"
    place = copy / "run" / "programs" / "csv"
    export_program(open_gate(copy / "run", cell=cell), place)
    first = {path.name: path.read_bytes() for path in place.iterdir()}

    export_program(open_gate(copy / "run", cell=cell), place)

    assert {path.name: path.read_bytes() for path in place.iterdir()} == first


def test_runs_of_single_tasks_have_a_folder_each(sound: Path, tmp_path: Path) -> None:
    cell = sound / "cell" / "small.yaml"
    write_run(solve(with_overrides(load_cell(cell), mode="pairwise")), tmp_path / "run")

    for _ in range(2):
        files = export_program(open_gate(tmp_path / "run", cell=cell), tmp_path / "run" / "programs" / "csv")

    assert sorted(files) == ["path/idle.csv", "path/left.csv", "path/right.csv"]


@pytest.mark.parametrize("place", ["run", "run/tables", "run/new", "run/programs", ".", "cell", "run/../run"])
def test_programs_are_not_written_into_a_run_or_over_other_things(copy: Path, place: str) -> None:
    run = open_gate(copy / "run", cell=copy / "cell" / "small.yaml")
    before = sorted(copy.rglob("*"))

    with pytest.raises(InputError, match=r"expected a folder outside the run|contains files other than exported"):
        export_program(run, copy / place)

    assert sorted(copy.rglob("*")) == before


def test_an_unknown_format_is_refused_with_the_list(copy: Path) -> None:
    run = open_gate(copy / "run", cell=copy / "cell" / "small.yaml")

    with pytest.raises(InputError, match=r"--format: expected one of csv, .*wide, got 'apt'"):
        export_program(run, copy / "programs", form="apt")


def test_a_program_that_fails_after_rounding_is_not_written(copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A format with too few decimals: half a degree of rounding takes the tool off its path."""
    run = open_gate(copy / "run", cell=copy / "cell" / "small.yaml")
    sound = DIALECTS["csv"]

    def coarse(frame, files):
        read = sound.read(frame, files)
        for rows in read[0].robots.values():
            rows.q[:] = np.deg2rad(np.round(np.rad2deg(rows.q)))
        return read

    monkeypatch.setitem(DIALECTS, "csv", replace(sound, read=coarse, decimals=0))
    with pytest.raises(NotVerifiedError, match="position error of task 'path'"):
        export_program(run, copy / "programs")

    assert not (copy / "programs").exists()


def test_a_foreign_file_beside_the_programs_is_never_lost(copy: Path) -> None:
    run = open_gate(copy / "run", cell=copy / "cell" / "small.yaml")
    export_program(run, copy / "programs")
    (copy / "programs" / "notes.txt").write_text("mine")

    with pytest.raises(InputError, match=r"holds 'notes.txt', which cellplan did not write"):
        export_program(run, copy / "programs")
