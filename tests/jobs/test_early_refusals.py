"""What can be known from the files is refused before anything is planned or drawn, and before a process begins."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from cellplan.cli.main import run as run_command
from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.jobs.base_map.base_map import map_study
from cellplan.jobs.base_map.grid import BaseGrid
from cellplan.jobs.base_map.prepared import MapRequest
from cellplan.jobs.floor_plan.floor_plan_file import FloorPlanRequest, PlanFormat, requested_floor_plan
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.search import search_layout
from cellplan.jobs.view.write import ViewRequest, view
from cellplan.runs.solve import solve

Stages = list[str]


@pytest.fixture
def cell(sound: Path) -> Path:
    return sound / "cell" / "small.yaml"


@pytest.fixture
def stages() -> Iterator[Stages]:
    """Stages of work that were begun before a refusal: none."""
    result: Stages = []
    yield result
    assert result == []


def noting(stages: Stages) -> Callable[[str, float], None]:
    return lambda stage, _share: stages.append(stage)


def refusal(work: Callable[[], object]) -> str:
    with pytest.raises(InputError) as refused:
        work()
    return str(refused.value)


def taken(folder: Path) -> Path:
    """A file that cellplan did not write."""
    path = folder / "mine.html"
    path.write_text("mine")
    return path


def test_a_page_is_refused_its_place_before_it_is_made(cell: Path, sound: Path, tmp_path: Path, stages: Stages) -> None:
    for path in (cell, sound / "run"):
        request = ViewRequest(path=path, output=taken(tmp_path), cell=None)

        said = refusal(lambda wanted=request: view(wanted, progress=noting(stages)))

        assert said == f"{tmp_path / 'mine.html'}: holds something that is no 3-D page; choose another file with -o"


def test_a_floor_plan_is_refused_its_place_before_it_is_drawn(cell: Path, tmp_path: Path, stages: Stages) -> None:
    request = FloorPlanRequest(path=cell, output=taken(tmp_path))

    said = refusal(lambda: requested_floor_plan(request, progress=noting(stages)))

    assert said == f"{tmp_path / 'mine.html'}: holds something that is no floor plan; choose another file with -o"


def test_a_place_below_a_file_is_refused_too(cell: Path, tmp_path: Path, stages: Stages) -> None:
    request = ViewRequest(path=cell, output=taken(tmp_path) / "page.html")

    said = refusal(lambda: view(request, progress=noting(stages)))

    assert said.endswith(f"cannot write the output: '{tmp_path / 'mine.html'}' is not a folder")


def test_a_missing_package_is_named_before_anything_is_drawn(
    cell: Path, tmp_path: Path, stages: Stages, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    request = FloorPlanRequest(path=cell, output=tmp_path / "plan.dxf", form=PlanFormat.DXF)

    assert "pip install 'cellplan[dxf]'" in refusal(lambda: requested_floor_plan(request, progress=noting(stages)))


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"robot": "idle"}, "--robot: expected a robot with a task that does not hold the part"),
        ({"grid": BaseGrid(step=0.0)}, "--grid: expected millimetres above 0, got 0"),
        ({"grid": BaseGrid(x=(900.0, 100.0))}, "--x: expected FROM:TO in mm with FROM not above TO, got 900:100"),
        ({"grid": BaseGrid(step=0.5)}, "--grid: expected at most 40000 places"),
        ({}, "holds 'mine.html', which no study wrote"),
    ],
)
def test_a_map_is_refused_before_a_start_is_searched(
    cell: Path, tmp_path: Path, stages: Stages, changes: dict[str, object], reason: str
) -> None:
    request = MapRequest(**{"cell": cell, "robot": "right", **changes})  # type: ignore[arg-type]
    folder = taken(tmp_path).parent

    assert reason in refusal(lambda: map_study(request, folder, progress=noting(stages)))


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"vary": ("righty.base",)}, "righty"),
        ({"duration": 2.0}, "--duration: expected no duration where the shortest cycle is sought"),
        ({}, "holds 'mine.html', which no study wrote"),
    ],
)
def test_a_search_is_refused_before_a_process_begins(
    cell: Path, tmp_path: Path, stages: Stages, changes: dict[str, object], reason: str
) -> None:
    request = LayoutRequest(**{"cell": cell, **changes})  # type: ignore[arg-type]
    folder = taken(tmp_path).parent

    assert reason in refusal(lambda: search_layout(request, folder, workers=1, progress=noting(stages)))


def test_another_study_is_not_continued_and_nothing_is_searched(
    cell: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "study.jsonl").write_text('{"schema": "cellplan.study/1", "kind": "sweep"}\n')

    assert run_command(["layout", str(cell), "--resume", "-o", str(tmp_path), "-v"]) == 2

    assert "searching" not in capsys.readouterr().err


def test_the_last_task_of_a_program_is_read_before_the_first_is_planned(cells: Path, stages: Stages) -> None:
    given = load_cell(cells / "in_turn.yaml")
    last = given.tasks[-1].name
    wide = given.with_values({f"tasks.{last}.path.rectangle.sides_mm": [1400, 100]})

    assert f"tasks.{last}.path" in refusal(lambda: solve(wide, progress=noting(stages)))
