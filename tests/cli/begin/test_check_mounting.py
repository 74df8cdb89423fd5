"""What a mounting that is wrong looks like from the shell."""

from pathlib import Path

import pytest

from cellplan.cli.main import run

CELL = """cellplan: 1
name: thick
robots:
  holder:
    model: abb_irb1600
    start_deg: [0, 20, -20, 0, 20, 0]
  pen:
    model: abb_irb1600
    base: {{xyz_mm: [4000, 0, 0]}}
    tool: {{xyz_mm: [0, 0, 150], geometry: {{cylinder: {{radius_mm: 10, length_mm: {rod}}}}}}}
part:
  geometry: {{box: {{size_mm: [300, 300, {thick}]}}}}
  held_by:
    - {{robot: holder, at: {{xyz_mm: [0, 0, {at}]}}}}
tasks:
  hold:
    robot: holder
    relative_to: world
    axes: [x]
    path: {{polyline: {{points_mm: [[0, 0, 0], [1, 0, 0]]}}}}
motion: {{duration_s: 1, step_s: 0.1}}
"""


def checked(tmp_path: Path, *, thick: int = 240, at: int = -120, rod: int = 150) -> tuple[int, str]:
    path = tmp_path / "cell.yaml"
    path.write_text(CELL.format(thick=thick, at=at, rod=rod), encoding="utf-8")
    return run(["check", "-q", str(path)]), str(path)


def test_a_thick_part_the_wrong_way_round_is_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, path = checked(tmp_path, at=120)

    out, err = capsys.readouterr()
    assert (status, out) == (2, "")
    assert err.startswith(f"{path}:14: part.held_by[0].at: expected a part clear of the links of 'holder'")
    assert "is the grasp the right way round?" in err


def test_a_rod_through_the_wrist_is_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, path = checked(tmp_path, rod=400)

    assert status == 2
    assert capsys.readouterr().err.startswith(f"{path}:10: robots.pen.tool.geometry: expected a body of the tool clear")
