"""Lines of the reproduction page from the joint tables alone, by a kinematics written here from the papers' tables."""

import importlib
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from cellplan import load_cell, solve
from cellplan.runs.solution import Run, Solution

pytestmark = [pytest.mark.usefixtures("stored_solutions"), pytest.mark.slow]

Array = NDArray[np.float64]
ROOT = Path(__file__).resolve().parent.parent.parent
PAPERS = ROOT / "cells" / "papers"
LINES = ROOT / "docs" / "reproduction" / "lines.json"
ROOT_3 = 3.0**0.5
DIGIT = 0.02  # [-] the third digit, which is the last that is recorded

# Denavit-Hartenberg parameters (a, alpha, d) as printed: Nicolato 2007, tables 4.1 and 4.2.
THREE_LINKS = ((0.0, np.pi / 2, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0))
PUMA = (
    (0.0, -np.pi / 2, 0.0),
    (0.4318, 0.0, 0.0),
    (0.0203, -np.pi / 2, 0.1254),
    (0.0, np.pi / 2, 0.4318),
    (0.0, -np.pi / 2, 0.0),
    (0.0, 0.0, 0.0),
)
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
# Axes and points in [mm] as printed: Ribeiro 2010, tables 4 and 5.
REIS = ((Z, (0, 0, 400)), (Y, (280, 0, 400)), (Y, (920, 0, 400)), (X, (1011, 0, 400)), (Y, (1500, 0, 400)))
REIS_6 = (*REIS, (X, (1600, 0, 400)))
KUKA = ((Z, (0, 0, 422)), (Y, (260, 0, 675)), (Y, (260, 0, 1355)), (X, (662, 0, 1320)), (Y, (930, 0, 1320)))
KUKA_6 = (*KUKA, (X, (1045, 0, 1320)))


@pytest.fixture(scope="module")
def script() -> Iterator[ModuleType]:
    """The script that makes the page."""
    sys.path.insert(0, str(ROOT / "docs"))
    try:
        yield importlib.import_module("make_reproduction")
    finally:
        while str(ROOT / "docs") in sys.path:
            sys.path.remove(str(ROOT / "docs"))


def recorded(table: str, quantity: str) -> dict[str, Any]:
    """One line of the record."""
    lines = json.loads(LINES.read_text(encoding="utf-8"))
    (result,) = [line for line in lines if line["table"] == table and line["quantity"] == quantity]
    return dict(result)


def joint_table(solution: Solution, robot: str = "arm") -> tuple[Array, Array]:
    """Times and joint angles in [rad] of a written table."""
    header, *rows = [line for line in solution.program.tables[robot].splitlines() if not line.startswith("#")]
    assert header.split(",")[0].startswith("time"), header
    values = np.array([[float(word) for word in row.split(",")] for row in rows])
    return values[:, 0], np.deg2rad(values[:, 1:])


def dh_poses(table: tuple[tuple[float, float, float], ...], q: Array) -> Array:
    """Pose of the last frame by Denavit-Hartenberg parameters, shape (N, 4, 4)."""
    pose = np.tile(np.eye(4), (len(q), 1, 1))
    for (a, alpha, d), theta in zip(table, q.T, strict=True):
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        zero, one = np.zeros_like(theta), np.ones_like(theta)
        link = [c, -s * ca, s * sa, a * c, s, c * ca, -c * sa, a * s, zero, sa * one, ca * one, d * one]
        pose = pose @ np.concatenate([np.stack(link, axis=1), np.tile([0.0, 0.0, 0.0, 1.0], (len(q), 1))], 1).reshape(
            -1, 4, 4
        )
    return pose


def screw_poses(screws: tuple[tuple[Any, Any], ...], q: Array, reference: Array) -> Array:
    """Pose of a flange by successive screw displacements from its reference pose, shape (N, 4, 4)."""
    pose = np.tile(np.eye(4), (len(q), 1, 1))
    for (axis, point), angle in zip(screws, q.T, strict=True):
        s = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        turn = np.eye(3) + np.sin(angle)[:, None, None] * s + (1.0 - np.cos(angle))[:, None, None] * (s @ s)
        step = np.tile(np.eye(4), (len(q), 1, 1))
        step[:, :3, :3] = turn
        step[:, :3, 3] = 1e-3 * np.array(point) - turn @ (1e-3 * np.array(point))
        pose = pose @ step
    return pose @ reference


def rolled(xyz_mm: tuple[float, float, float], rpy_deg: tuple[float, float, float]) -> Array:
    """Pose from roll, pitch and yaw about fixed axes."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(np.deg2rad(rpy_deg)), np.sin(np.deg2rad(rpy_deg))
    pose = np.eye(4)
    pose[:3, :3] = (
        np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
        @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    )
    pose[:3, 3] = 1e-3 * np.array(xyz_mm)
    return pose


def quintic(share: Array) -> Array:
    """From rest to rest, without acceleration at either end."""
    return 10 * share**3 - 15 * share**4 + 6 * share**5


def circle_through_the_origin(t: Array) -> Array:
    """Nicolato 2007, section 4.1: diameter 1.7320 m, through the origin, in 6 s; begun towards -z."""
    angle = 2 * np.pi * quintic(t / 6.0)
    return ROOT_3 / 2 * np.stack([1 + np.cos(angle), np.zeros_like(angle), -np.sin(angle)], axis=1)


def test_search_on_the_circle() -> None:
    t, q = joint_table(solve(load_cell(PAPERS / "nicolato_circle.yaml")))
    error = np.linalg.norm(dh_poses(THREE_LINKS, q)[:, :3, 3] - circle_through_the_origin(t), axis=1)

    assert error.max() == pytest.approx(recorded("nicolato_circle", "search: largest error")["ours"], rel=DIGIT)


def test_damped_least_squares_on_the_circle(script: ModuleType) -> None:
    runs = sys.modules["reproduction.runs"]
    t, q = joint_table(solve(runs.paper_cell("nicolato_circle", method="damped_least_squares")))
    error = np.linalg.norm(dh_poses(THREE_LINKS, q)[:, :3, 3] - circle_through_the_origin(t), axis=1)
    line = recorded("nicolato_circle", "DLS: error near the singular point")

    assert error.max() == pytest.approx(line["ours"], rel=DIGIT)
    assert t[error.argmax()] == pytest.approx(line["ours_at_s"], abs=0.011)  # one sample of 10 ms


def test_error_of_position_of_the_puma() -> None:
    t, q = joint_table(solve(load_cell(PAPERS / "nicolato_pose.yaml")))
    ends = np.deg2rad([[45.0, 45.0, 60.0, 60.0, 60.0, 36.0], [60.0, 60.0, 45.0, 135.0, 45.0, 120.0]])
    first, last = dh_poses(PUMA, ends)[:, :3, 3]
    places = dh_poses(PUMA, q)[:, :3, 3]
    error = np.linalg.norm(places - first - quintic(t / 2.0)[:, None] * (last - first), axis=1)

    assert error.max() == pytest.approx(recorded("nicolato_pose", "position error")["ours"], rel=DIGIT)
    assert last == pytest.approx([-0.2118, -0.1160, -0.2817], abs=1e-4)  # Eq. 4.2


@pytest.mark.parametrize(("name", "limit"), [("position", "of position"), ("velocity", "of speed")])
def test_error_of_four_links_with_a_limit(name: str, limit: str) -> None:
    t, q = joint_table(solve(load_cell(PAPERS / f"nicolato_4r_{name}.yaml")))
    angles, start = np.cumsum(q, axis=1), np.cumsum([np.pi / 4, np.pi / 6, np.pi / 2, np.pi / 4])
    places = 0.2 * np.stack([np.cos(angles).sum(axis=1), np.sin(angles).sum(axis=1)], axis=1)
    begin = 0.2 * np.array([np.cos(start).sum(), np.sin(start).sum()])  # the rightmost point of the circle
    goal = begin + 0.15 * np.stack([np.cos(2 * np.pi * t) - 1, np.sin(2 * np.pi * t)], axis=1)
    line = recorded("nicolato_limits", f"error with the limit {limit} (its tolerance)")

    assert np.linalg.norm(places - goal, axis=1).max() == pytest.approx(line["ours"], rel=DIGIT)


@pytest.mark.slow
def test_error_of_vargas_near_the_singular_point() -> None:
    solution = solve(load_cell(PAPERS / "vargas_case_2.yaml").with_values({"solver.method": "filtered_inverse_ii"}))
    t, q = joint_table(solution)
    angles, links = np.cumsum(q, axis=1), np.array([2.0, 1.0, 1.0])
    places = np.stack([np.cos(angles) @ links, np.sin(angles) @ links], axis=1)
    path = np.stack([1.1 + np.sin(0.2 * t), 0.35 * np.cos(0.2 * t)], axis=1)
    error = np.linalg.norm(places - path, axis=1)[t >= 5.0]
    line = recorded("vargas_2", "error near the singular point (Fig. 10)")

    assert 1e3 * error.max() == pytest.approx(line["ours"], rel=DIGIT)


@pytest.mark.slow
def test_error_of_the_circle_of_four_robots() -> None:
    solution = solve(load_cell(PAPERS / "ribeiro_mode_1.yaml"))
    (run,) = solution.runs
    _, reis = joint_table(solution, "reis")
    _, kuka = joint_table(solution, "kuka")
    facing = (0.0, 90.0, 0.0)  # both flanges face along the last axis, +x
    flange = rolled((0, 0, 400), (0, 0, 0)) @ screw_poses(REIS_6, reis, rolled((1600, 0, 400), facing))
    part = flange @ np.linalg.inv(rolled((-250, 0, 0), facing))
    base, tool = rolled((1175, 775, 500), (0, 0, -105)), rolled((0, 0, 100), (0, 0, -90))
    tip = base @ screw_poses(KUKA_6, kuka, rolled((1045, 0, 1320), facing)) @ tool
    error = np.linalg.norm((np.linalg.inv(part) @ tip)[:, :3, 3] - desired_circle(run), axis=1)

    assert 1e3 * error.max() == pytest.approx(recorded("ribeiro_errors", "mode 1: circle")["ours"], rel=DIGIT)


def desired_circle(run: Run) -> Array:
    """The path of the circle on the part at every row; it lies on the cylinder above a circle of 100 mm."""
    (task,) = [task for task in run.schedule.tasks if task.task.name == "circle"]
    places = task.X_PT[:, :3, 3]
    assert np.hypot(places[:, 0], places[:, 1]) == pytest.approx(np.full(len(places), 0.1), abs=1e-6)
    assert np.hypot(places[:, 1], places[:, 2]) == pytest.approx(np.full(len(places), 0.25), abs=1e-6)
    return np.asarray(places)


def test_the_record_of_lines_is_that_of_the_measurements(script: ModuleType) -> None:
    assert json.loads(LINES.read_text(encoding="utf-8")) == script.lines(script.recorded()), "run: make reproduce"


def test_simulations_by_the_equations_agree_with_the_program(script: ModuleType) -> None:
    numbers = script.recorded()
    alone, cells = numbers["vargas_filter"], numbers["vargas_2"]

    assert alone["gain"]["25"]["I"]["error_mm"] == pytest.approx(cells["filtered_inverse"]["error_mm"], rel=0.01)
    assert alone["gain"]["25"]["II"]["error_mm"] == pytest.approx(cells["filtered_inverse_ii"]["error_mm"], rel=0.01)
    assert alone["damping"]["printed"]["error_mm"] == pytest.approx(cells["damped_least_squares"]["error_mm"], rel=0.01)


def test_the_planar_equations_of_davies_are_a_jacobian(script: ModuleType) -> None:
    davies = sys.modules["reproduction.davies_planar"]
    q, size = np.array([0.3, -1.1, 0.6, 1.2, -0.9, 0.4]), 1e-6
    N_s, pose = davies.relative(q)
    differences = [
        (davies.relative(q + size * e)[1] - davies.relative(q - size * e)[1]) / (2 * size) for e in np.eye(6)
    ]

    assert np.linalg.solve(davies.virtual(pose), N_s) == pytest.approx(np.array(differences).T[[2, 1, 0]], abs=1e-8)


def test_singular_values_of_the_arm_on_the_circle(script: ModuleType) -> None:
    q, size = np.array([[0.4, -0.3, 1.9], [0.0, 1.0, -2.9], [-1.2, 0.7, 0.2], [2.0, 1.5, 2.4]]), 1e-6
    moved = [
        (dh_poses(THREE_LINKS, q + size * e) - dh_poses(THREE_LINKS, q - size * e))[:, :3, 3] / (2 * size)
        for e in np.eye(3)
    ]
    smallest = np.linalg.svd(np.stack(moved, axis=2), compute_uv=False)[:, -1]
    result = sys.modules["reproduction.choices"].smallest_singular(*dh_poses(THREE_LINKS, q)[:, :3, 3].T)

    assert result == pytest.approx(smallest, abs=1e-7)


def test_choices_that_were_made_agree_with_the_program(script: ModuleType) -> None:
    numbers = script.recorded()
    choices, ellipse = numbers["choices"], numbers["nicolato_ellipse"]["pseudo_inverse"]

    assert choices["plane"]["0"] == pytest.approx(numbers["nicolato_circle"]["dls"]["damped_from_s"], abs=0.011)
    assert choices["ellipse"]["by_reading"]["0+"] == pytest.approx(ellipse["drift_deg"], rel=DIGIT)


def test_a_picture_of_the_camera_is_undone_by_its_inverse(script: ModuleType) -> None:
    planar = sys.modules["reproduction.planar_search"]

    assert planar.seen_at(planar.pixels_of(np.array([0.31, -0.17]))) == pytest.approx([0.31, -0.17], abs=1e-12)
    assert planar.pixels_of(np.zeros(2)) == pytest.approx([320.0, 240.0])  # Eq. 4.3: the camera stands above the base


def test_every_published_value_names_its_place() -> None:
    lines = json.loads(LINES.read_text(encoding="utf-8"))
    places = re.compile(r"\b(Figs?\.|Eqs?\.|tables?|sections?) [A-E]?\.?\d")

    for line in lines:
        assert bool(places.search(line["where"])) is (line["verdict"] != "ours alone"), line
        assert line["published"] is None or line["verdict"] != "ours alone", line


def test_figures_and_tables_follow_each_other_from_page_to_page(script: ModuleType) -> None:
    """A slip in the list of pages would put an item before one with a smaller number, or have too few of them."""
    for paper, kinds in sys.modules["reproduction.pages"].PAGES.items():
        for kind in ITEMS[paper]:
            result = list(kinds[kind].values())
            assert set(kinds[kind]) == ITEMS[paper][kind]
            assert result == sorted(result), (paper, kind)


@pytest.mark.parametrize(
    ("paper", "where", "expected"),
    [
        ("Ribeiro 2010", "section 5.3.1, Fig. 33, table 7", [72, 75, 76]),
        ("Ribeiro 2010", "section 5.4, Figs. 37 to 39 and 51 to 53", [79, 80, 88, 89, 90]),
        ("Nicolato 2007", "section 5.4.2, Figs. 5.8 and 5.10", [53, 54]),
        ("Vargas, Leite and Costa 2012", "Eqs. 19 to 23, Fig. 2", [3544]),
        ("Ribeiro 2010", "Eqs. C.21, E.8 and E.11", []),
    ],
)
def test_pages_of_a_place(script: ModuleType, paper: str, where: str, expected: list[int]) -> None:
    assert sys.modules["reproduction.pages"].pages_of(paper, where) == expected


def test_every_named_place_belongs_to_a_line(script: ModuleType) -> None:
    lines = json.loads(LINES.read_text(encoding="utf-8"))
    places = sys.modules["reproduction.places_in_papers"].PLACES

    named = {(table, what) for table, place in places.items() for what in place}
    assert named <= {(line["table"], line["quantity"]) for line in lines}


def numbered(*parts: tuple[str, int]) -> set[str]:
    """Numbers as printed: a prefix, and how many there are with it."""
    return {f"{prefix}{number}" for prefix, count in parts for number in range(1, count + 1)}


ITEMS = {
    "Vargas, Leite and Costa 2012": {"Fig.": numbered(("", 15))},
    "Nicolato 2007": {
        "Fig.": numbered(("2.", 1), ("3.", 4), ("4.", 11), ("5.", 18), ("A.", 5)),
        "Tab.": numbered(("4.", 4), ("5.", 1), ("A.", 1)),
        "Alg.": {"1"},
    },
    "Ribeiro 2010": {"Fig.": numbered(("", 111)), "Tab.": numbered(("", 7))},
}


@pytest.mark.parametrize("paper", ITEMS)
def test_every_figure_and_table_is_listed_once(script: ModuleType, paper: str) -> None:
    entries = sys.modules["reproduction.listing"].LISTS[paper]
    result = [(entry.kind, number) for entry in entries for number in entry.numbers]

    assert len(result) == len(set(result))
    assert set(result) == {(kind, number) for kind, numbers in ITEMS[paper].items() for number in numbers}


def test_every_listed_item_has_a_verdict_and_a_reason(script: ModuleType) -> None:
    listing = sys.modules["reproduction.listing"]
    verdicts = {"reproduced", "differs", "chosen", "circular", "used", "not attempted"}

    for paper, entry in [(paper, entry) for paper, value in listing.LISTS.items() for entry in value]:
        assert entry.verdict in verdicts
        assert entry.where
        assert entry.text(paper) in script.PAGE.read_text(encoding="utf-8")
