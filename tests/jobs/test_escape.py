"""Escape programs of shipped cells: run from random stops, all distances by another engine; and what is refused."""

import copy
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.escape_players import Robot, play
from builders.stored_cells import solve_into
from recoveries import BruteForce

from cellplan.cli.main import run as run_command
from cellplan.errors import InputError, NotVerifiedError
from cellplan.jobs.recover.escape import WrittenEscape, escape_findings, escape_programs, homewards
from cellplan.jobs.recover.legs import recovery_rows
from cellplan.jobs.recover.state import RunPlaces
from cellplan.model.report.exported import Moves, Promise
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.programs.dialects import DIALECTS, ESCAPES
from cellplan.programs.elements.joints import exact_numbers, from_numbers
from cellplan.programs.export.choice import Choice
from cellplan.programs.shared import Shared
from cellplan.runs.gate.open_gate import open_gate

pytestmark = pytest.mark.slow
CELLS = Path(__file__).resolve().parents[2] / "cells"
ZERO = "sign: {C1: -1}\ncoupling: {C1: {B1: -1}}\nsource: test\n"
TOLERANCE = 1e-4  # [m] of distances of coal
STOPS = 20  # of each step
SIGNALS = "handshake: {output: %s, inputs: {holder: %s}}}\n"
ONE = """\
cellplan: 1
name: one
robots:
  left:
    model: kuka_kr6
    base: {xyz_mm: [0, -1100, 0], rpy_deg: [0, 0, 90]}
    tool: {xyz_mm: [0, 0, 150], geometry: {capsule: {radius_mm: 12, length_mm: 150}}}
    home_deg: [0, -20, 50, 0, -45, 0]
    controller: {id: krc, tool_number: 1, base: {}, tool_frame: {}}
controllers: {krc: {kind: kuka}}
part: {geometry: {box: {size_mm: [600, 300, 200]}}, at: {xyz_mm: [0, 0, 900]}}
tasks:
  ring:
    robot: left
    path: {circle: {radius_mm: 60, plane: xz}, project: -y}
    tool_axis: normal
    approach_mm: 80
    approach_s: 1
    retract_mm: 80
    retract_s: 1
    duration_s: 4
environment: {floor: {plane: {z_mm: 0}}}
motion: {mode: part_at_rest, duration_s: 6, step_s: 0.02}
program: {}
checks: {clearance_mm: 5}
"""
CHANGES = {
    "in_turn": {
        "kind: reis": "kind: kuka",
        "kind: staubli": "kind: abb, tasks: {T_ROB1: ROB_1}",
        "{id: cs,": "{id: cs, task: T_ROB1,",
    },
    "in_turn_elsewhere": {
        "kind: reis": "kind: fanuc",
        "model: reis_rv20_16": "model: reis_rv20_16\n    controller_zero: zero.yaml",
        "kind: abb, tasks: {T_ROB1: ROB_1}": "kind: fanuc",
        "task: T_ROB1, cycle_ms: 4, decimals: 5, handshake: {output: doThere, inputs: {reis: diGo}}": "cycle_ms: 4, "
        "decimals: 5, handshake: {output: 1, inputs: {reis: 1}}",
        "kind: kuka": "kind: staubli",
    },
    "in_turn_paced": {"kind: reis": "kind: kuka"},
    "three_tasks_each": {
        "    model: kuka_kr16_2\n": "    model: kuka_kr16_2\n"
        "    controller: {id: krc, handshake: {output: 1, inputs: {left: 1, right: 2}}}\n",
        "  left:\n": "  left:\n    controller: {id: one, " + SIGNALS % (1, 1),
        "  right:\n": "  right:\n    controller: {id: two, " + SIGNALS % (2, 2),
        "part:\n": "controllers: {krc: {kind: kuka}, one: {kind: ur}, two: {kind: ur}}\npart:\n",
        "mode: simultaneous": "mode: part_at_rest",
    },
}


@pytest.fixture(scope="module")
def in_turn(tmp_path_factory: pytest.TempPathFactory) -> VerifiedRun:
    """Four robots that work in turn."""
    return run_of("in_turn", tmp_path_factory.mktemp("in_turn"))


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory: pytest.TempPathFactory) -> VerifiedRun:
    """The same four robots on controllers of other makers."""
    return run_of("in_turn_elsewhere", tmp_path_factory.mktemp("elsewhere"))


@pytest.fixture(scope="module")
def paced(tmp_path_factory: pytest.TempPathFactory) -> VerifiedRun:
    """The four robots, tools moved on lines and arcs in three languages."""
    return run_of("in_turn_paced", tmp_path_factory.mktemp("paced"))


@pytest.fixture(scope="module")
def three(tmp_path_factory: pytest.TempPathFactory) -> VerifiedRun:
    """Two robots that work on a part which a third one takes from a table and puts on another one."""
    return run_of("three_tasks_each", tmp_path_factory.mktemp("three"))


@pytest.fixture(scope="module")
def shared(in_turn: VerifiedRun) -> Shared:
    """What the formats of the four robots have in common."""
    return Shared(in_turn)


@pytest.fixture(scope="module")
def escapes(in_turn: VerifiedRun, shared: Shared) -> dict[str, WrittenEscape]:
    """Programs and escape programs of the four robots in both formats."""
    return escapes_of(in_turn, shared)


def run_of(cell: str, folder: Path) -> VerifiedRun:
    """A shipped cell on controllers of kinds that have escape programs."""
    text = (CELLS / f"{re.sub('_(elsewhere|paced)$', '', cell)}.yaml").read_text(encoding="utf-8")
    (folder / "zero.yaml").write_text(ZERO, encoding="utf-8")
    for old, new in CHANGES[cell].items():
        assert old in text
        text = text.replace(old, new, 1)
    (folder / "cell.yaml").write_text(text, encoding="utf-8")
    solve_into(folder / "cell.yaml", folder / "run")
    return open_gate(folder / "run", cell=folder / "cell.yaml")


def escapes_of(run: VerifiedRun, shared: Shared, choice: Choice | None = None) -> dict[str, WrittenEscape]:
    """Programs and escape programs in all formats of a cell."""
    kinds = {entry.kind for entry in run.cell.controllers.values()}
    forms = [form for form in ESCAPES if DIALECTS[form].kinds & kinds]
    return {form: escape_programs(run, form, choice or Choice(), shared=shared) for form in forms}


@pytest.mark.parametrize("cell", ["in_turn", "elsewhere", "paced", "three"])
def test_all_robots_come_home_from_random_stops_and_keep_their_distance_by_brute_force(
    cell: str, request: pytest.FixtureRequest
) -> None:
    run: VerifiedRun = request.getfixturevalue(cell)
    shared = request.getfixturevalue("shared") if cell == "in_turn" else Shared(run)
    choice = Choice(moves=Moves.LINEAR, promise=Promise.PACED) if cell == "paced" else None
    escapes = request.getfixturevalue("escapes") if cell == "in_turn" else escapes_of(run, shared, choice)
    places, rng, smallest = RunPlaces.of(run), np.random.default_rng(11), np.inf
    stretches, routes = shared.orders()[0].stretches, next(iter(escapes.values())).routes
    programs = {name: (form, program) for form, one in escapes.items() for name, program in one.programs.items()}
    angles = {name: ESCAPES[form].angle for name, (form, _) in programs.items()}
    assert set(programs) == {robot.name for robot in run.cell.robots}
    for route, stretch in zip(routes, stretches, strict=True):
        back = BruteForce(places.scene_of_phase(places.at(0.5 * sum(_times(run, stretch)))))
        home = BruteForce(places.scene_while_stopped(route.recovery.state.lying))
        assert route.recovery.judgement is not None
        near = {pair.names: pair.begin - pair.slack for pair, _ in route.recovery.judgement.apart}
        for _ in range(STOPS):
            robots = {}
            for name, (form, _) in programs.items():
                rows = escapes[form].main.robots[name]
                row = int(rng.integers(*rows.marks[route.number - 1 : route.number + 1]))
                q = rows.q[row] + rng.uniform() * (rows.q[row + 1] - rows.q[row])
                q += 0.0 if rows.tube is None else rng.uniform(-1.0, 1.0, len(q)) * rows.tube[row, 4:]
                files = {p: t for p, t in escapes[form].escape_files.items() if p.lower().startswith(name)}
                here = exact_numbers(run.cell.robot(name), q[None], angle=angles[name])[0]
                robots[name] = Robot(files, route.number, here, float(rng.uniform(0.0, 2.0)))

            def seen(robots=robots, back=back, home=home, near=near, number=route.number) -> None:
                nonlocal smallest
                if rng.uniform() > 0.02:
                    return
                shown = ((robot, robots[robot.name].q[None], angles[robot.name]) for robot in run.cell.robots)
                q = np.concatenate([from_numbers(robot, it, angle=angle)[0] for robot, it, angle in shown])
                begun = any(robot.machine.step == 0 for robot in robots.values())
                for names, (distance, demand) in (home if begun else back).near(q, 0.02).items():
                    least = min(near.get(names, demand), demand) if begun else demand
                    assert distance > least - TOLERANCE, (number, names, distance)
                    smallest = min(smallest, distance - least)

            play(robots, _wires(run), rng, seen)
            assert all(robot.is_done for robot in robots.values())
            end = recovery_rows(route.recovery.phases)[-1]
            for name, robot in robots.items():
                q = from_numbers(run.cell.robot(name), robot.q[None], angle=angles[name])[0]
                np.testing.assert_allclose(q, end[run.cell.columns(name)], atol=2e-4)
    assert smallest < 0.02  # something was measured


def _times(run: VerifiedRun, stretch) -> tuple[float, float]:
    return float(run.motion.times[stretch.first]), float(run.motion.times[stretch.last])


def _wires(run: VerifiedRun) -> dict[tuple[str, str], list[tuple[str, str]]]:
    """Inputs that lead from the output of each robot."""
    handshakes = {robot.name: robot.control.handshake for robot in run.cell.robots if robot.control}
    return {
        (name, str(one.output)): [
            (other, str(entry.inputs[name])) for other, entry in handshakes.items() if entry and name in entry.inputs
        ]
        for name, one in handshakes.items()
        if one
    }


@pytest.mark.parametrize("form", ["krl", "rapid"])
def test_rows_elsewhere_and_steps_of_other_rows_are_findings(
    in_turn: VerifiedRun, escapes: dict[str, WrittenEscape], form: str
) -> None:
    escape, written = ESCAPES[form], escapes[form]
    name, program = next(iter(written.programs.items()))
    files = {n: escape.render(one) for n, one in written.programs.items()}

    def findings(**changes: object) -> list[str]:
        changed = {**files, name: escape.render(replace(program, **changes))}
        return list(escape_findings(in_turn, escape, written.programs, written.routes, written.main, changed))

    assert findings() == []
    rows = program.rows.copy()
    rows[len(rows) // 2] += 0.001
    assert findings(rows=rows)[0] == f"'{name}': expected the rows of its main program, read others"
    other = program.steps[1]._replace(first=program.steps[1].first - 1)
    expected = f"'{name}': expected the steps of its main program, read others"
    assert findings(steps=(program.steps[0], other, *program.steps[2:]))[0] == expected
    moved = program.homeward.copy()
    moved[1:] *= 0.99
    assert findings(homeward=moved) == [f"'{name}': expected the planned rows of the ways home, read others"]


def test_rows_on_the_ways_home_that_bring_robots_together_are_findings(
    in_turn: VerifiedRun, escapes: dict[str, WrittenEscape]
) -> None:
    escape, written = ESCAPES["krl"], escapes["krl"]
    part = in_turn.motion.q[np.argmin(np.abs(in_turn.motion.times - 4.0))]  # a tool is at the part
    programs = {
        name: replace(program, homeward=np.tile(part[in_turn.cell.columns(name)], (len(program.homeward), 1)))
        for name, program in written.programs.items()
    }
    files = {name: escape.render(program) for name, program in programs.items()}

    findings = list(escape_findings(in_turn, escape, programs, written.routes, written.main, files))

    assert any(finding.startswith("step ") and "kuka" in finding and "part" in finding for finding in findings)


def test_programs_are_written_with_their_escapes_and_verified_again(
    in_turn: VerifiedRun, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["export", str(in_turn.folder), "--without-cell", "-q", "--format", "krl"]

    assert run_command([*command, "--escape", "-o", str(tmp_path / "out")]) == 0
    assert "\n    1. transfer-1, 0 to 1.16 s: " in capsys.readouterr().out
    assert (tmp_path / "out-escape" / "export.json").is_file()
    cell = str(in_turn.folder.parent / "cell.yaml")
    verify = ["verify", str(tmp_path / "out"), "--run", str(in_turn.folder), "--cell", cell, "-q"]
    assert run_command(verify) == 0
    of_escape = [verify[0], str(tmp_path / "out-escape"), *verify[2:]]
    assert run_command(of_escape) == 0
    limit = tmp_path / "out-escape" / "kuka_esc.src"
    limit.write_bytes(re.sub(rb"(BACK\(1,\d+),0", rb"\1,9", limit.read_bytes()))
    assert run_command(of_escape) == 2
    assert re.search(r"kuka_esc\.src:\d+: expected 'BACK\(1,\d+,0\.\d+\)', got 'BACK\(", capsys.readouterr().err)
    source = tmp_path / "out" / "kuka.src"
    source.write_text(source.read_text(encoding="utf-8").replace("cell_step=2", "cell_step=3"), encoding="utf-8")
    assert run_command(verify) == 2
    assert re.search(r"kuka\.src:\d+: expected 'cell_step=2', got 'cell_step=3'\n", capsys.readouterr().err)
    assert run_command([*command, "--escape", "-o", str(tmp_path / "out"), "--promise", "timed"]) == 2


def test_a_mark_without_a_way_home_is_named_with_its_phase_and_pair(in_turn: VerifiedRun, shared: Shared) -> None:
    farther = copy.copy(in_turn)
    checks = in_turn.cell.checks.model_validate({**in_turn.cell.checks.model_dump(), "clearance_mm": 200.0})
    object.__setattr__(farther, "cell", replace(in_turn.cell, checks=checks))

    with pytest.raises(NotVerifiedError, match=r"^no way home from step 1, 'transfer-1' from 0 s: .*(abb|kuka|reis)"):
        homewards(farther, shared.orders()[0])


@pytest.mark.parametrize("moves", [Moves.JOINTS, Moves.LINEAR])
def test_one_robot_goes_home_from_any_place_of_its_program(moves: Moves, tmp_path: Path) -> None:
    (tmp_path / "cell.yaml").write_text(ONE, encoding="utf-8")
    solve_into(tmp_path / "cell.yaml", tmp_path / "run")
    run, rng = open_gate(tmp_path / "run"), np.random.default_rng(13)
    promise = Promise.PACED if moves is Moves.LINEAR else None
    written = escape_programs(run, "krl", Choice(moves=moves, promise=promise))
    robot, rows = run.cell.robots[0], written.main.robots["left"]
    off = 1e-4 + np.radians(float(written.programs["left"].steps[0].off))
    along = np.diff(rows.q, axis=0)

    assert all("cell_step" not in text for text in written.files.values())
    for _ in range(STOPS):
        row = int(rng.integers(len(rows) - 1))
        q = rows.q[row] + rng.uniform() * (rows.q[row + 1] - rows.q[row])
        q += 0.0 if rows.tube is None else rng.uniform(-1.0, 1.0, len(q)) * rows.tube[row, 4:]
        player = Robot(written.escape_files, 0, exact_numbers(robot, q[None])[0])

        def seen(player: Robot = player) -> None:
            gaps = from_numbers(robot, player.q[None])[0] - rows.q[:-1]
            shares = np.clip(np.sum(gaps * along, axis=1) / np.maximum(np.sum(along**2, axis=1), 1e-12), 0.0, 1.0)
            assert np.linalg.norm(gaps - shares[:, None] * along, axis=1).min() < off  # it stays on its path

        play({"left": player}, {}, rng, seen)
        assert player.is_done
        np.testing.assert_allclose(from_numbers(robot, player.q[None])[0], run.motion.q[0], atol=2e-4)


def test_formats_without_escape_programs_are_refused(in_turn: VerifiedRun) -> None:
    with pytest.raises(
        InputError,
        match=r"^--escape: expected one of the formats fanuc_ls, inform, krl, rapid, urscript, val3, got csv",
    ):
        escape_programs(in_turn, "csv", Choice())
