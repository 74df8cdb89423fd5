"""Keys that say how deep a grip and what stands may be."""

from pathlib import Path

from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import written_document


def test_depths_are_read_in_millimetres_and_written_out_with_their_defaults(cells: Path, tmp_path: Path) -> None:
    text = (cells / "dual_arm.yaml").read_text(encoding="utf-8")
    path = tmp_path / "cell.yaml"
    path.write_text(text.replace("clearance_mm:", "standing_depth_mm: 3, clearance_mm:"), encoding="utf-8")

    cell = load_cell(path)

    assert cell.part.held_by[0].depth == 0.002
    assert cell.checks.standing_depth_mm.si == 0.003
    written = written_document(cell)
    assert written["part"]["held_by"][0]["depth_mm"] == 2.0
    assert written["checks"]["standing_depth_mm"] == 3.0
