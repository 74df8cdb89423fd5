"""Files of a study on workers that have them nowhere else."""

from functools import partial
from pathlib import Path

import pytest

from cellplan.files.cell.load import load_cell
from cellplan.jobs.sweep.sweep import SweepJob, evaluate_variant, files_of
from cellplan.study.bundle import Bundle, Unpacked, packed_with_paths
from cellplan.study.trial import TrialStatus, Variant
from cellplan.study.variants import read_axis
from cellplan.study.workers import evaluated, packed

CELLS = Path(__file__).resolve().parents[2] / "cells"


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """A cell whose part and path are files of its own folder, and whose robot is one of the folder beside it."""
    (tmp_path / "job").mkdir()
    for name in ("meshes/dome.stl", "paths/dome_rosette.csv"):
        (tmp_path / "job" / name).parent.mkdir()
        (tmp_path / "job" / name).write_bytes((CELLS / name).read_bytes())
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots" / "own_arm.urdf").write_bytes((CELLS / "robots" / "own_arm.urdf").read_bytes())
    text = (CELLS / "mesh_part_csv.yaml").read_text()
    third = "  other:\n    model: ../robots/own_arm.urdf\n    flange: tool0\n    base: {xyz_mm: [0, 4000, 0]}\n"
    (tmp_path / "job" / "cell.yaml").write_text(text.replace("part:\n", f"{third}part:\n", 1))
    return tmp_path / "job" / "cell.yaml"


def test_the_cell_is_read_below_the_folder_of_the_bundle(study: Path) -> None:
    allowed = (study.parent.parent / "robots",)
    cell = load_cell(study, allow_dirs=allowed)
    bundle = Bundle.of([(study, cell)], allow_dirs=allowed)

    root = bundle.root()
    there = load_cell(Path(root + str(study)), allow_dirs=[Path(root + str(allowed[0]))])

    assert root != "/"
    assert there.inputs == cell.inputs
    assert len(bundle.files) == 4
    assert bundle.root() == root
    assert Bundle.of([(study, cell)], allow_dirs=allowed).digest == bundle.digest
    study.write_text(study.read_text() + "# changed\n")
    assert Bundle.of([(study, cell)], allow_dirs=allowed).digest != bundle.digest


def test_paths_lead_into_the_bundle_and_texts_name_them_as_they_were_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "job").mkdir()
    sent = packed_with_paths({"cell": Path("job/../job/cell.yaml"), "number": 3})

    here, there = Unpacked(sent, ""), Unpacked(sent, "/bundle")

    assert here.value == {"cell": Path("job/../job/cell.yaml"), "number": 3}
    assert there.value == {"cell": Path(f"/bundle{tmp_path}/job/cell.yaml"), "number": 3}
    assert there.as_written(f"/bundle{tmp_path}/job/cell.yaml:3: wrong") == "job/../job/cell.yaml:3: wrong"
    assert there.as_written("/bundle/elsewhere/robot.urdf: wrong") == "/elsewhere/robot.urdf: wrong"
    assert here.as_written("/bundle: as it is") == "/bundle: as it is"


def test_trials_say_the_same_with_a_bundle(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a variant that is wrong in the file, and of one that names a file that is missing."""
    monkeypatch.setenv("CELLPLAN_ALLOW_DIRS", str(study.parent.parent / "robots"))
    job = SweepJob(cell=study)
    axes = [read_axis("part.geometry.mesh=meshes/dome.stl,meshes/missing.stl"), read_axis("motion.duration_s=8,-1")]
    bundle = files_of(job, axes)
    sent = packed(partial(evaluate_variant, job))
    values = [{axes[0].address: "meshes/missing.stl"}, {axes[1].address: -1}]

    for number, changed in enumerate(values):
        text = evaluated(sent, Variant(number, changed))
        assert evaluated(sent, Variant(number, changed), bundle.root()) == text
        assert f'"{TrialStatus.BAD_INPUT}"' in text
        assert "cell.yaml" in text
