"""Explaining a cell from the shell: its structure in words and as JSON."""

import json
from pathlib import Path

import pytest

from cellplan.cli.main import run
from cellplan.jobs.explain.result import WIDTH, structure_lines

SHIPPED = ["dual_arm", "four_robots", "four_robots_initial", "mesh_part_csv", "planar_pair", "rail", "turntable"]


def explained(path: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    assert run(["explain", str(path)]) == 0
    return capsys.readouterr().out.splitlines()


def record_of(path: Path, capsys: pytest.CaptureFixture[str]) -> dict:
    assert run(["explain", str(path), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def changed(cells: Path, name: str, folder: Path, old: str, new: str) -> Path:
    text = (cells / name).read_text(encoding="utf-8")
    assert old in text
    path = folder / name
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


def test_four_robots_are_reported_as_graph_circuits_and_arrow(cells: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = explained(cells / "four_robots.yaml", capsys)

    assert lines[:6] == [
        "four-robots: 4 robots, 24 joints, 3 tasks, mode simultaneous",
        "the part is held by reis",
        "",
        "robot reis  (reis_rv20_16) holds the part",
        "  A1  revolute   -180 … 180 deg            200 deg/s",
        "  B1  revolute   -135 … 70 deg             165 deg/s",
    ]
    reported = "\n".join(lines)
    assert "  l = e - v + 1 = 42 - 40 + 1 = 3 independent circuits\n" in reported
    assert "  kuka            world -A2- 1 -B2- 2 -C2- 3 -D2- 4 -E2- 5 -F2- kuka/tool\n" in reported
    assert (
        "  2  rhombus    +px +py +pz +rx +ry +rz\n"
        "     abb        -F3 -E3 -D3 -C3 -B3 -A3\n"
        "     reis       +A1 +B1 +C1 +D1 +E1 +F1\n"
    ) in reported
    assert lines[-8:] == [
        "cooperation Jacobian: 18 rows, 24 columns",
        "                  reis   kuka    abb  staubli",
        "                     6      6      6        6",
        "  circle     6     - J    + J      .        .",
        "  rhombus    6     - J      .    + J        .",
        "  rectangle  6     - J      .      .      + J",
        "  rank at the start: 18, smallest singular value 0.298",
        "  degree of redundancy: 24 - 18 = 6",
    ]


@pytest.mark.parametrize("name", SHIPPED)
def test_nothing_is_wider_than_a_terminal(cells: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    lines = explained(cells / f"{name}.yaml", capsys)
    assert max(map(len, lines)) <= WIDTH
    assert [line for line in lines if line != line.rstrip()] == []


@pytest.mark.parametrize("name", SHIPPED)
def test_json_counts_fit_each_other(cells: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    reported = record_of(cells / f"{name}.yaml", capsys)
    graph = reported["graph"]

    assert (reported["schema"], reported["status"], reported["exit"]) == ("cellplan.explain/1", "passed", 0)
    assert graph["vertices"] == len(graph["links"])
    assert graph["edges"] == len(graph["joints"])
    assert graph["independent_circuits"] == len(reported["circuits"]) == graph["edges"] - graph["vertices"] + 1
    for circuit in reported["circuits"]:
        ends = {joint["name"]: (joint["from"], joint["to"]) for joint in graph["joints"]}
        passed = [ends[step["joint"]][:: step["sign"]] for step in circuit["passed"]]
        assert [end for _, end in passed] == [
            begin for begin, _ in passed[1:] + passed[:1]
        ]  # each joint begins where one ended


def test_a_start_that_is_to_be_found_leaves_the_rank_open(cells: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = explained(cells / "planar_pair.yaml", capsys)

    assert "graph: 9 links (vertices), 9 joints (edges): 6 real, 3 virtual (PPR, in the plane xy)" in lines
    assert lines[-2:] == [
        "  rank: unknown until the start of right is found (by `cellplan check`)",
        "  degree of redundancy: 6 - 3 = 3 where the rows are independent",
    ]
    matrix = record_of(cells / "planar_pair.yaml", capsys)["matrices"][0]
    assert (matrix["rank"], matrix["redundancy"], matrix["starts_to_find"]) == (None, None, ["right"])


def test_a_stretched_arm_is_reported_to_be_singular(
    cells: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Reis at rest and the wrist of the circle's arm stretched: two of its axes coincide."""
    path = changed(cells, "four_robots.yaml", tmp_path, "16.711226006, 0, 85.704033176,", "16.711226006, 0, 0,")
    path.write_text(path.read_text(encoding="utf-8").replace("simultaneous", "part_at_rest"), encoding="utf-8")

    lines = explained(path, capsys)

    assert lines[-2:] == [
        "  degree of redundancy: 18 - 17 = 1",
        "  only 17 of 18 rows are independent there: 1 direction in which the tools cannot move as required",
    ]


def test_pairwise_has_one_matrix_per_run_and_bystanders_stand_still(
    cells: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = changed(cells, "four_robots.yaml", tmp_path, "mode: simultaneous", "mode: pairwise")

    lines = explained(path, capsys)

    assert lines[-6:] == [
        "cooperation Jacobian of the run rectangle: 6 rows, 12 columns",
        "                  reis   kuka    abb  staubli",
        "                     6  still  still        6",
        "  rectangle  6     - J      .      .      + J",
        lines[-2],
        "  degree of redundancy: 12 - 6 = 6",
    ]
    assert lines[-2].startswith("  rank at the start: 6, smallest singular value 0.6")


def test_the_part_at_rest_leaves_no_redundancy(cells: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = changed(cells, "four_robots.yaml", tmp_path, "mode: simultaneous", "mode: part_at_rest")
    assert explained(path, capsys)[-1] == "  degree of redundancy: 18 - 18 = 0"


def test_free_spin_and_too_few_joints_are_reported(
    cells: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = changed(cells, "planar_pair.yaml", tmp_path, "axes: [x, y, rz]", "free: [spin]")
    path.write_text(path.read_text(encoding="utf-8").replace("simultaneous", "part_at_rest"), encoding="utf-8")

    lines = explained(path, capsys)

    assert "  circle  right  x y z tool axis (spin is free)" in lines
    assert lines[-1] == "  overconstrained: 5 rows for 3 columns"


def test_many_robots_with_long_names_stay_within_the_screen() -> None:
    robots = [f"a_robot_with_a_rather_long_name_{i}" for i in range(9)]
    record = {
        "cell": "many",
        "mode": "simultaneous",
        "part": {"held_by": [], "closures": []},
        "robots": [
            {"name": r, "model": "m", "holds_part": False, "works_on": [], "joints": [], "followers": []}
            for r in robots
        ],
        "tasks": [{"name": "t", "robot": robots[0], "relative_to": "part", "constrained": ["x"]}],
        "graph": {"chains": "PPPS", "plane": None, "vertices": 1, "edges": 0, "independent_circuits": 0, "joints": []},
        "circuits": [],
        "matrices": [
            {
                "run": None,
                "rows": 1,
                "columns": 0,
                "row_blocks": {"t": 1},
                "column_blocks": dict.fromkeys(robots, 0),
                "signs": {"t": dict.fromkeys(robots, 0)},
                "starts_to_find": [],
                "rank": 0,
                "smallest_singular_value": None,
                "redundancy": 0,
            }
        ],
    }

    lines = structure_lines(record)

    assert max(map(len, lines)) <= WIDTH
    assert all(any(robot in line for line in lines[-20:]) for robot in robots)


def test_bad_input_is_refused_with_its_place(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status = run(["explain", str(tmp_path / "absent.yaml"), "--json"])

    reported = json.loads(capsys.readouterr().out)
    assert (status, reported["status"], reported["exit"]) == (2, "error", 2)
