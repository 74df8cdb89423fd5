"""Tasks that cover a face with a raster: the path that they become, its counts, and refusals by place."""

from pathlib import Path

import numpy as np
import pytest
from builders.step_files import Named, box, cut, cylinder, write_step

from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.model.cell.cell import Cell
from cellplan.model.task.task import ProgrammedPath

CELL = """\
cellplan: 1
name: plate
robots:
  arm:
    model: kuka_kr16_2
    tool: {xyz_mm: [0, 0, 200]}
part:
  step: {file: plate.step}
  at: {xyz_mm: [1100, 0, 700]}
tasks:
  coat:
    robot: arm
    path: {PATH}
    TASK
motion: {mode: part_at_rest}
"""
PATH = "face: TOP, raster: {step_mm: 20, transfer_mm_s: 400}, standoff_mm: 50"
PROCESS = "process: {feed_mm_s: 100}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("faces")
    plate = cut(box((0, 0, 0), (200, 100, 10)), cylinder(25, 30, (90, 50, -5)))
    write_step(place / "plate.step", [Named("PLATE", plate, {}, {2: "TOP"})])
    return place


def read(folder: Path, path: str = PATH, task: str = PROCESS, part: str = "step: {file: plate.step}") -> Cell:
    file = folder / "cell.yaml"
    file.write_text(CELL.replace("PATH", path).replace("TASK", task).replace("step: {file: plate.step}", part))
    return load_cell(file)


def refusal(folder: Path, path: str = PATH, task: str = PROCESS, part: str = "step: {file: plate.step}") -> str:
    with pytest.raises(InputError) as refused:
        read(folder, path, task, part)
    return str(refused.value).replace(f"{folder}/", "")


def path_of(cell: Cell) -> ProgrammedPath:
    path = cell.task("coat").path
    assert isinstance(path, ProgrammedPath)
    assert path.axes is not None
    return path


def test_raster_has_the_feed_of_the_process_and_transfers_between_lines(folder: Path) -> None:
    cell = read(folder)
    path = path_of(cell)

    assert {(bool(off), round(1e3 * float(v))) for off, v in zip(path.is_rapid, path.speeds, strict=True)} == {
        (False, 100),
        (True, 400),
    }
    np.testing.assert_allclose(path.points[:, 2], 0.06, atol=1e-12)
    np.testing.assert_allclose(path.axes, np.tile([0.0, 0.0, -1.0], (len(path.points), 1)), atol=1e-12)
    holes = 50.0 + 2.0 * 2.0 * np.sqrt(25.0**2 - 20.0**2)  # chords at 0 and twice at 20 mm from the middle
    remark = f"face TOP as 5 lines in 8 stretches, 16 points; {1000 - holes:.1f} mm with the process on"
    remark += f", {80 + holes:.1f} mm between"
    assert ("tasks.coat.path.raster", remark) in cell.remarks


def test_raster_of_a_mirrored_part_is_the_mirror_image(folder: Path) -> None:
    path = path_of(read(folder))
    mirrored = path_of(read(folder, part="step: {file: plate.step}\n  mirror: {plane: xz}"))

    np.testing.assert_allclose(mirrored.points, path.points * [1.0, -1.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(mirrored.axes, np.asarray(path.axes) * [1.0, -1.0, 1.0], atol=1e-12)


@pytest.mark.parametrize(
    ("path", "task", "part", "words"),
    [
        ("face: TOPP, raster: {step_mm: 20}", PROCESS, "", "path.face: expected a face of the STEP file, got 'TOPP'"),
        ("face: TOPP, raster: {step_mm: 20}", PROCESS, "", "did you mean 'TOP'"),
        ("face: TOP", PROCESS, "", "path.raster: missing, expected how the face is rastered"),
        ("circle: {radius_mm: 9, plane: xy}, raster: {step_mm: 2}", PROCESS, "", "path.raster: unexpected key"),
        ("face: TOP, raster: {step_mm: 120}", PROCESS, "", "path.raster.step_mm: expected a step of at most 100 mm"),
        ("face: TOP, raster: {step_mm: 20}", "feed_mm_s: 9", "", "expected a process with a stated feed"),
        ("face: TOP, raster: {step_mm: 20}", "process: {feed_mm_s: greatest}", "", "a process with a stated feed"),
        ("face: TOP, raster: {step_mm: 20}, push_deg: 9", PROCESS, "", "path.push_deg: unexpected key, a raster has"),
        ("face: TOP, raster: {step_mm: 20}, project: +z", PROCESS, "", "path.project: unexpected key, a face lies on"),
        (PATH, PROCESS, "geometry: {box: {size_mm: [9, 9, 9]}}", "path.face: expected a part from a STEP file"),
    ],
)
def test_what_does_not_suit_a_raster_is_refused_by_place(
    folder: Path, path: str, task: str, part: str, words: str
) -> None:
    text = refusal(folder, path, task, part or "step: {file: plate.step}")

    assert words in text
    assert text.startswith("cell.yaml:")
    assert len(text.splitlines()) == 1
