"""Parts from STEP files in a cell: what is read, what the deviation of the mesh counts for, and refusals."""

from pathlib import Path

import pytest
from builders.step_files import Named, box, cylinder, write_step

from cellplan.checks.clearance.tool_depth import check_depths
from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.model.report.report import ToolDepth
from cellplan.report.record.sections.rests_on import bodies_record
from cellplan.scene.bodies import Kind, scene_bodies
from cellplan.scene.pairs import sort_pairs

CELL = """\
cellplan: 1
name: step-part
robots:
  arm:
    model: kuka_kr6
    start_deg: [0, -90, 90, 0, 30, 0]
    tool: {xyz_mm: [0, 0, 100], geometry: {sphere: {radius_mm: 10}}}
part:
  step: {file: part.step, deviation_mm: 0.2}
  at: {xyz_mm: [900, 0, 400]}
tasks:
  line:
    robot: arm
    path: {polyline: {points_mm: [[10, 10], [40, 10]], plane: xy}, project: +z}
motion: {mode: simultaneous, duration_s: 4}
checks: {clearance_mm: 5, body_accuracy: report}
"""


@pytest.fixture
def cell_file(tmp_path: Path) -> Path:
    write_step(tmp_path / "part.step", [Named("PLATE", box((0, 0, 0), (50, 20, 10))), Named("PIN", cylinder(5, 30))])
    path = tmp_path / "cell.yaml"
    path.write_text(CELL)
    return path


def edited(path: Path, old: str, new: str) -> Path:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    return path


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as refused:
        load_cell(path)
    return str(refused.value).replace(str(path.parent), "").replace("/cell.yaml", "cell.yaml")


def test_the_file_is_an_input_and_what_was_made_of_it_is_remarked(cell_file: Path) -> None:
    cell = load_cell(cell_file)

    assert "part.step" in cell.inputs
    assert cell.part.accuracy == pytest.approx(2e-4)
    (key, remark), *others = cell.remarks
    assert key == "part.step"
    assert remark.startswith("2 solids as a mesh of ")
    assert remark.endswith(" triangles within 0.2 mm")
    assert others == []


def test_the_deviation_is_added_to_the_demanded_clearance_where_accuracies_are(cell_file: Path) -> None:
    demands = {}
    for word in ("report", "add"):
        cell = load_cell(cell_file).with_values({"checks.body_accuracy": word})
        bodies = scene_bodies(cell)
        pairs, _ = sort_pairs(cell, bodies)
        part = next(index for index, body in enumerate(bodies) if body.kind is Kind.PART)
        tool = next(index for index, body in enumerate(bodies) if body.kind is Kind.TOOL)
        demands[word] = next(pair.demand for pair in pairs if {pair.first, pair.second} == {part, tool})

    assert demands["report"] == pytest.approx(5e-3, abs=1e-12)
    assert demands["add"] == pytest.approx(5.2e-3, abs=1e-12)  # the tool is exact
    assert bodies_record(cell)["part"]["accuracy_mm"] == pytest.approx(0.2)


def test_the_deviation_is_added_to_the_depth_of_a_tool_where_accuracies_are(cell_file: Path) -> None:
    depths = [
        ToolDepth(task="line", robot="arm", depth=depth, at_s=None, limit=1e-3, body="axis")
        for depth in (0.0, 0.7e-3, 0.9e-3)
    ]
    verdicts = {}
    for word in ("report", "add"):
        cell = load_cell(cell_file).with_values({"checks.body_accuracy": word})
        verdicts[word] = [(check.passed, check.value) for check in check_depths(cell, depths)]

    assert verdicts["report"] == [(True, 0.0), (True, pytest.approx(0.7)), (True, pytest.approx(0.9))]
    assert verdicts["add"] == [(True, 0.0), (True, pytest.approx(0.9)), (False, pytest.approx(1.1))]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("part.step, ", "none.step, ", "cell.yaml:9: part.step.file: expected an existing file, got 'none.step'"),
        (
            "deviation_mm: 0.2",
            "shape: WEB",
            "cell.yaml:9: part.step.shape: expected the name of a shape in part.step, got 'WEB'; it has",
        ),
        (
            "deviation_mm: 0.2",
            "deviation_mm: 0",
            "cell.yaml:9: part.step.deviation_mm: expected a positive number of millimetres, got 0",
        ),
        (
            "  at: {xyz_mm: [900",
            "  geometry: {sphere: {radius_mm: 9}}\n  at: {xyz_mm: [900",
            "cell.yaml:9: part.step: unexpected key, geometry gives the shape already",
        ),
        (
            "  step: {file: part.step, deviation_mm: 0.2}\n",
            "",
            "cell.yaml:8: part.geometry: missing, expected the shape of the part, or step: with a STEP file",
        ),
    ],
)
def test_what_is_wrong_is_said_at_its_line(cell_file: Path, old: str, new: str, words: str) -> None:
    assert words in refusal(edited(cell_file, old, new))


def test_damage_of_the_file_is_said_with_its_place_in_both_files(cell_file: Path) -> None:
    step = cell_file.parent / "part.step"
    step.write_text(step.read_text().replace("(0.,0.,1.)", "(0.,0.,1..)", 1))

    text = refusal(cell_file)

    assert text.startswith("cell.yaml:9: part.step.file: part.step:")
    assert text.endswith("expected a number, got '1..'")


def test_without_the_extra_one_line_says_how_to_install_it(cell_file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cellplan.geometry.step.kernel.find_spec", lambda _: None)

    text = refusal(cell_file)

    cure = "expected the package cadquery-ocp-novtk, got none: pip install 'cellplan[step]'"
    assert text == f"cell.yaml:9: part.step.file: part.step: {cure}"
