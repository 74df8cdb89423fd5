"""Homes: found near the start, free for the whole of every run at every instant, or refused with what is in the way."""

import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from builders.run_edits import Copy, seal
from builders.scene_builders import body, fixed_part, make_cell, placed, schedule, slide_model, thing, work
from builders.two_phases import PAIR

from cellplan import Solution, load_cell, open_gate, solve, write_run
from cellplan.errors import HomeNotFoundError, HomeOutsideLimitsError, NoSolutionError, NotVerifiedError
from cellplan.geometry.shapes import Box
from cellplan.geometry.transforms import Array, pose
from cellplan.model.cell.cell import Cell, Mode, Robot
from cellplan.model.motion.motion import Motion
from cellplan.planning.modes import plan_phases
from cellplan.runs.plan.homes import find_homes
from cellplan.runs.plan.run import PlannedRun
from cellplan.scene.scene import Scene

pytestmark = pytest.mark.usefixtures("stored_solutions")

BLOCK = Box((0.1, 0.1, 0.1))
SPARE = 0.055  # [m] the demanded clearance, and what a home keeps beyond it where it can


def slider(name: str, *, axis=(1.0, 0.0, 0.0), limit: float = 3.0, height: float = 0.0) -> Robot:
    """A block on a rail through the middle of the cell, which starts there."""
    model = slide_model(BLOCK, axis=axis)
    model = replace(model, joints=(replace(model.joints[0], lower=-limit, upper=limit),))
    return replace(placed(name, model, base=pose((0.0, 0.0, height))), start=np.zeros(1))


def in_turns(*robots: Robot, things=()) -> Cell:
    """A cell in which each robot has a task and works alone."""
    cell = make_cell(*robots, tasks=tuple(work(robot.name) for robot in robots), things=things)
    return replace(cell, motion=replace(cell.motion, mode=Mode.PAIRWISE))


def homes(cell: Cell, worker: str, motions: Mapping[str, Array], *, only: bool = True) -> Mapping[str, Array]:
    """Homes of the robots that are idle while one moves along rows of positions of its own."""
    runs = []
    for phase in plan_phases(cell, only=f"work_of_{worker}" if only else None).program:
        (name,) = phase.moving
        q = np.zeros((len(motions[name]), cell.joint_count))
        q[:, cell.columns(name)] = motions[name][:, None]
        clock = schedule(len(q), cell.task(phase.tasks[0]))
        runs.append(PlannedRun(phase=phase, schedule=clock, motion=Motion(times=clock.times, q=q)))
    return find_homes(Scene.from_cell(cell), runs)


def test_a_robot_that_is_out_of_the_way_stays_at_its_start() -> None:
    cell = in_turns(slider("saw", axis=(0.0, 1.0, 0.0)), slider("pen", height=0.5))

    assert homes(cell, "saw", {"saw": np.linspace(-1.0, 1.0, 50)})["pen"] == pytest.approx([0.0])


@pytest.mark.parametrize("samples", [201, 2])
def test_a_robot_in_the_way_stands_aside_even_when_no_sample_shows_it(samples: int) -> None:
    """With two samples the saw passes the pen between them."""
    cell = in_turns(slider("saw", axis=(0.0, 1.0, 0.0)), slider("pen"))

    home = homes(cell, "saw", {"saw": np.linspace(-1.0, 1.0, samples)})

    assert list(home) == ["pen"]
    assert 0.1 + SPARE <= abs(home["pen"][0]) <= 0.24  # 0.24 m is the nearest move of a single joint that is enough


def test_without_room_to_spare_the_demanded_clearance_is_enough() -> None:
    cell = in_turns(slider("saw", axis=(0.0, 1.0, 0.0)), slider("pen", limit=0.108))

    home = homes(cell, "saw", {"saw": np.linspace(-1.0, 1.0, 50)})

    assert 0.105 <= abs(home["pen"][0]) <= 0.108


def test_a_robot_that_cannot_leave_is_named_with_what_is_in_its_way() -> None:
    cell = in_turns(slider("saw", axis=(0.0, 1.0, 0.0)), slider("pen", limit=0.1))

    with pytest.raises(HomeNotFoundError) as refusal:
        homes(cell, "saw", {"saw": np.linspace(-1.0, 1.0, 50)})

    assert isinstance(refusal.value, NoSolutionError)
    assert "robots.pen.home: no home found near the start for 'pen', which is idle while 'work_of_saw'" in str(
        refusal.value
    )
    assert "'pen/block' comes too close to 'saw/block'" in str(refusal.value)


def test_robots_that_are_idle_together_keep_apart_in_any_order_of_the_file() -> None:
    robots = [slider("saw", axis=(0.0, 1.0, 0.0)), slider("one"), slider("two")]
    fence = thing("fence", Box((0.1, 1.0, 0.1)), pose((-0.4, 0.0, 0.0)))
    result = [
        homes(in_turns(*order, things=(fence,)), "saw", {"saw": np.linspace(-1.0, 1.0, 30)})
        for order in (robots, robots[::-1])
    ]

    assert all(dict(entry) == result[0] for entry in result)
    places = sorted(float(result[0][name][0]) for name in ("one", "two"))
    assert all(abs(place) >= 0.1 + SPARE for place in places)
    assert places[1] - places[0] >= 0.1 + SPARE
    assert all(abs(place + 0.4) >= 0.105 for place in places)


def test_one_home_serves_all_runs_of_a_robot() -> None:
    cell = in_turns(slider("saw", axis=(0.0, 1.0, 0.0)), slider("pen"), slider("axe", axis=(0.6, 0.8, 0.0)))
    path = np.linspace(-1.0, 1.0, 50)

    home = homes(cell, "", dict.fromkeys(("saw", "pen", "axe"), path), only=False)

    assert sorted(home) == ["axe", "pen", "saw"]
    assert abs(home["pen"][0]) >= 0.1 + SPARE


def test_an_idle_tool_keeps_away_from_the_part_that_it_works_on() -> None:
    """While it works it may touch the part near its tip; idle it may not, so it cannot stay at its start."""
    pen = slider("pen", axis=(0.0, 0.0, 1.0))
    tool = replace(pen.tool, X_FT=pose((0.0, 0.0, -0.1)), bodies=(body("tool", 0, shape=BLOCK, at=(0.0, 0.0, -0.05)),))
    pen = replace(pen, tool=tool, model=replace(pen.model, bodies=()))
    part = fixed_part(Box((0.4, 0.4, 0.1)), pose((0.0, 0.0, -0.15)))
    cell = replace(in_turns(slider("saw", height=5.0), pen), part=part)

    home = homes(cell, "saw", {"saw": np.linspace(-1.0, 1.0, 20)})

    assert home["pen"][0] >= SPARE


def test_a_home_that_is_given_is_not_searched() -> None:
    pen = replace(slider("pen"), home=np.array([0.01]))

    assert homes(in_turns(slider("saw", axis=(0.0, 1.0, 0.0)), pen), "saw", {"saw": np.linspace(-1, 1, 9)}) == {}


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Solution]:
    """Two arms that work on one plate in turns, the turn of the first one solved; its run is written beside it."""
    file = tmp_path_factory.mktemp("homes") / "pair.yaml"
    file.write_text(PAIR, encoding="utf-8")
    solution = solve(load_cell(file), task="first")
    write_run(solution, file.parent / "run")
    return file, solution


def test_rows_of_idle_robots_are_constant_and_the_resolved_cell_says_where(pair: tuple[Path, Solution]) -> None:
    file, solution = pair
    folder = file.parent / "run"

    assert solution.passed
    written = yaml.safe_load((folder / "cell.yaml").read_text(encoding="utf-8"))["robots"]
    rows = np.degrees(solution.runs[0].report.q["right"])
    assert np.all(rows == rows[0])
    assert rows[0] == pytest.approx(written["right"]["home_deg"], abs=1e-10)
    assert np.abs(rows[0] - written["right"]["start_deg"]).max() > 1.0  # at its start its tool is at the part
    assert written["left"]["home_deg"] == "auto"  # it is never idle in this run
    assert "before_you_run" not in (folder / "first" / "report.json").read_text(encoding="utf-8")

    verified = open_gate(folder, cell=file)

    assert [remark for remark in verified.remarks if "idle" in remark] == [
        "first: idle in this run: right stands at its home; moves to and from home are not part of the program",
    ]
    table = (folder / "tables" / "right.csv").read_text(encoding="utf-8")
    assert "# remark: idle in this run: right stands at its home; moves to and from home are not" in table


def test_a_home_that_is_given_in_the_way_is_respected_and_fails(pair: tuple[Path, Solution]) -> None:
    cell, run = pair[1].cell, pair[1].runs[0]
    at_start = replace(cell.robot("right"), home=cell.robot("right").start)
    cell = replace(cell, robots=(cell.robot("left"), at_start))

    report = solve(cell, task="first").runs[0].report

    assert run.report.passed
    assert any("right/tool touches part" in check.message for check in report.checks if not check.passed)


def test_a_home_outside_the_limits_is_refused(pair: tuple[Path, Solution]) -> None:
    cell = pair[1].cell
    beyond = replace(cell.robot("right"), home=np.radians([0.0, 151.0, 0.0]))

    with pytest.raises(HomeOutsideLimitsError, match=r"home_deg: joint 'B' stands at 151 deg, outside its limits"):
        solve(replace(cell, robots=(cell.robot("left"), beyond)))


def test_the_home_of_the_copy_has_to_be_that_of_the_tables(pair: tuple[Path, Solution], tmp_path: Path) -> None:
    """Another home in the resolved cells, with a manifest that fits, is found by the check of the rows."""
    file, solution = pair
    shutil.copytree(file.parent / "run", tmp_path / "run")
    home = np.degrees(solution.cell.robot("right").home)
    copy = tmp_path / "run" / "cell.yaml"
    text = copy.read_text(encoding="utf-8")
    assert f"{home[2]:.9f}"[:8] in text
    copy.write_text(text.replace(f"{home[0]:.6f}"[:7], f"{home[0] + 1.0:.6f}"[:7], 1), encoding="utf-8")
    seal(Copy(cell=file, run=tmp_path / "run", other=tmp_path))

    with pytest.raises(NotVerifiedError, match=r"idle robot right: joint A is .* from its home at 0.000 s"):
        open_gate(tmp_path / "run", cell=file)
