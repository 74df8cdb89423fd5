"""Searches see of a path what ``solve`` sees: nodes follow from its knots, and the given layout is solved."""

from pathlib import Path

import numpy as np
import pytest
from builders.layout_search import CELL
from builders.study_trials import InThisProcess

from cellplan import LayoutRequest, Stop, load_cell, search_layout, solve
from cellplan.errors import InputError
from cellplan.jobs.layout.given_layout import given_record
from cellplan.jobs.layout.result import layout_lines
from cellplan.jobs.layout.trials.prepared import NODES, prepared
from cellplan.search.kernel.job import MOST, enough_nodes

CELLS = CELL.parent
DENSE = """\
cellplan: 1
name: dense
robots:
  arm:
    model: planar_3r
    tool: {xyz_mm: [0, 0, 60]}
    start_deg: auto
part:
  geometry: {sphere: {radius_mm: 1}}
  at: {xyz_mm: [3000, 0, 0]}
tasks:
  path:
    robot: arm
    path: {csv: {file: path.csv, smooth: true}}
    axes: [x, y, rz]
    tolerance: {position_mm: 1, orientation_deg: 0.5}
motion: {duration_s: 16, step_s: 0.02, jerk_build_up_s: unlimited}
checks: {clearance_mm: 0}
layout:
  vary: {arm.base: {x_mm: [-50, 50]}}
"""


def request_of(folder: Path, *, points: int, wave: float, **more: object) -> LayoutRequest:
    """A straight path on which the tool swings by ``wave`` in [deg] either way, from each given point to the next."""
    at = np.arange(points)
    x, y = np.full(points, 650.0 - 3000.0), -200.0 + 400.0 * at / (points - 1)
    turn = np.radians(wave * (-1.0) ** at)
    rows = [
        f"{a:.6f},{b:.6f},-80,0,{np.cos(t / 2):.9f},{np.sin(t / 2):.9f},0" for a, b, t in zip(x, y, turn, strict=True)
    ]
    (folder / "path.csv").write_text("\n".join(["x_mm,y_mm,z_mm,qw,qx,qy,qz", *rows]) + "\n")
    (folder / "cell.yaml").write_text(DENSE)
    return LayoutRequest(cell=folder / "cell.yaml", objective="conforming", **more)


def test_a_path_that_bends_between_its_knots_gets_more_nodes_and_a_smooth_one_none(tmp_path: Path) -> None:
    wavy, straight = tmp_path / "wavy", tmp_path / "straight"
    wavy.mkdir()
    straight.mkdir()

    counts = [
        enough_nodes(prepared(request_of(folder, points=points, wave=wave)).schedule, NODES)
        for folder, points, wave in ((wavy, 40, 40.0), (straight, 40, 0.0))
    ]

    assert counts[0] > 4 * 39  # four from each knot to the next
    assert counts[1] == NODES
    assert enough_nodes(prepared(LayoutRequest(cell=CELLS / "four_robots.yaml")).schedule, NODES) == NODES
    assert enough_nodes(prepared(request_of(wavy, points=400, wave=40.0)).schedule, NODES) <= 2 * MOST


@pytest.mark.slow
@pytest.mark.parametrize(("points", "wave"), [(25, 20.0), pytest.param(30, 30.0, marks=pytest.mark.slow)])
def test_a_layout_that_solve_passes_is_followed_and_certified(tmp_path: Path, points: int, wave: float) -> None:
    slow = ("motion.duration_s=60", "motion.step_s=0.02")
    request = request_of(tmp_path, points=points, wave=wave, settings=slow)
    given = load_cell(request.cell).with_values({"motion.duration_s": 60, "motion.step_s": 0.02})
    assert solve(given).passed

    searched = search_layout(request, tmp_path / "study", stop=Stop(trials=1), workers=InThisProcess())

    assert searched.record["status"] == "certified"
    assert searched.record["given"]["status"] == "conforming"
    assert searched.record["given"]["cycle_s"] is None  # another objective is sought
    assert layout_lines(searched.record, tmp_path / "study")[1] == "  as given: conforms"


@pytest.mark.slow
def test_the_shortest_cycle_of_the_given_motion_is_one_that_solve_passes(tmp_path: Path) -> None:
    request = request_of(tmp_path, points=25, wave=4.0)
    record = given_record(prepared(LayoutRequest(cell=request.cell)))

    cycle = record["cycle_s"]
    assert cycle is not None
    passes = [
        solve(load_cell(request.cell).with_values({"motion.duration_s": round(seconds, 2)})).passed
        for seconds in (cycle, cycle - 0.02)
    ]
    assert passes == [True, False]


def test_a_given_layout_without_motion_says_why_as_solve_does(tmp_path: Path) -> None:
    request = request_of(tmp_path, points=12, wave=0.0)
    request.cell.write_text(DENSE.replace("robots:\n  arm:\n", "robots:\n  arm:\n    base: {xyz_mm: [900, 900, 0]}\n"))

    record = given_record(prepared(request))

    assert (record["status"], record["cycle_s"]) == ("violating", None)
    assert record["reason"]
    with pytest.raises(Exception, match=r".") as caught:
        solve(load_cell(request.cell))
    assert record["reason"] == str(caught.value).splitlines()[0]


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        (
            "free",
            ["spin"],
            r"cell\.yaml:\d+: tasks\.ring\.free: expected no free spin for a joint path: .*got \[spin\]",
        ),
        (
            "axes",
            ["x", "y", "z", "rx", "ry"],
            r"cell\.yaml:\d+: tasks\.ring\.axes: expected all six components .*got 5;",
        ),
    ],
)
def test_a_joint_path_beside_open_components_is_refused_before_the_search(
    tmp_path: Path, key: str, value: list[str], message: str
) -> None:
    text = (CELLS / "two_robots.yaml").read_text()
    cell = load_cell(CELLS / "two_robots.yaml")
    name = next(task.name for task in cell.tasks)
    (tmp_path / "cell.yaml").write_text(text.replace(f"  {name}:\n", f"  ring:\n    {key}: [{', '.join(value)}]\n", 1))

    with pytest.raises(InputError, match=message):
        prepared(LayoutRequest(cell=tmp_path / "cell.yaml", vary=(f"{cell.positioners[0]}.path",)))
