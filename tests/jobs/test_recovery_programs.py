"""Recoveries as programs: the rows of the tables in every format, and what is refused."""

import contextlib
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.pen import PEN
from builders.stored_cells import solve_into

from cellplan.cli.main import run as run_command
from cellplan.errors import InputError
from cellplan.files.run.joint_tables import parse_table
from cellplan.jobs.recover.programs import WITHIN, RecoveryPrograms, recovery_programs
from cellplan.jobs.recover.recover import Recovery, recover
from cellplan.model.report.exported import Promise
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.rows.thin import bends
from cellplan.runs.gate.open_gate import open_gate

ROOT = Path(__file__).resolve().parents[2]
ON_UR = PEN.replace("    start_deg", "    controller: {id: ur, cycle_ms: 8}\n    start_deg").replace(
    "part:\n", "controllers:\n  ur: {kind: ur, latency_ms: 100}\npart:\n", 1
)


@pytest.fixture(scope="module")
def pen(tmp_path_factory: pytest.TempPathFactory) -> VerifiedRun:
    """A pen of six joints on a box that lies, on a controller."""
    folder = tmp_path_factory.mktemp("pen")
    (folder / "pen.yaml").write_text(ON_UR, encoding="utf-8")
    solve_into(folder / "pen.yaml", folder / "run")
    return open_gate(folder / "run")


@pytest.fixture(scope="module")
def stopped(pen: VerifiedRun) -> Recovery:
    """The recovery from one stop of it."""
    return recover(pen, at=0.73)


@pytest.mark.parametrize("form", ["csv", "json", "ros2", "stream", "urscript"])
def test_programs_hold_the_tables_and_a_pose_that_is_off_is_refused(
    pen: VerifiedRun, stopped: Recovery, form: str
) -> None:
    programs, dialect = recovery_programs(pen, stopped, form), DIALECTS[form]

    (read,) = dialect.read(programs.job.frame, programs.files)
    table, rows = parse_table(stopped.tables["pen"], "pen"), read.robots["pen"]
    np.testing.assert_allclose(rows.q[[0, -1]], table.q[[0, -1]], atol=1e-8)
    nearest = np.abs(table.q[:, None] - rows.q[None]).max(axis=2).min(axis=0)
    assert nearest.max() < (0.02 if form == "stream" else 1e-8)  # a stream has rows of its own cycle on the same curve
    assert "recovery from 0.73 s" in "".join(programs.files.values()) or form in {"csv", "ros2"}

    path, text = next((p, t) for p, t in programs.files.items() if re.search(r"-?1\.[0-9]{6}", t))
    where = list(re.finditer(r"(?<![0-9.])-?[0-9]+\.([0-9]{6,})", text))[-3]
    other = text[: where.start()] + f"{float(where[0]) + 0.01:.{len(where[1])}f}" + text[where.end() :]
    with contextlib.suppress(InputError):
        assert programs.findings(dialect, {**programs.files, path: other})


def test_rows_that_are_left_out_lie_on_the_chords_of_those_that_stay() -> None:
    t = np.linspace(0.0, 1.0, 101)[:, None]
    corner = np.where(t < 0.4, t * [1.0, 2.0], [0.4, 0.8] + (t - 0.4) * [-1.0, 0.5])
    assert bends(corner, WITHIN) == [0, 40, 100]  # the law of time on a straight line costs no row
    assert bends(corner[(0.5 * (1.0 - np.cos(np.pi * t[:, 0])) * 40).astype(int)], WITHIN) == [0, 100]
    t = np.linspace(0.0, 1.0, 1001)[:, None]
    arc = np.stack([np.cos(t[:, 0]), np.sin(t[:, 0])], axis=1)
    stays = bends(arc, WITHIN)
    chords = np.stack([np.interp(t[:, 0], t[stays, 0], column) for column in arc[stays].T], axis=1)
    sagitta = np.linalg.norm(arc - chords, axis=1).max()
    assert 70 < len(stays) < 150  # chords whose sagitta is the tolerance span 0.0126 rad: 80 of them
    assert sagitta < 2.0 * np.sqrt(2.0) * WITHIN + 1e-3 * WITHIN


def test_a_recovery_as_programs_is_written_beside_its_tables(
    pen: VerifiedRun, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "out"
    common = ["recover", str(pen.folder), "--at", "0.73", "--without-cell", "-o", str(folder), "-q"]

    assert run_command([*common, "--for", "urscript,csv"]) == 0
    out = capsys.readouterr().out
    assert "  urscript: pen: sequence only\n  csv: pen: timed\n" in out
    assert sorted(path.name for path in (folder / "programs").iterdir()) == ["csv", "urscript"]
    assert run_command(common) == 0  # a later recovery takes the place of one with programs
    assert not (folder / "programs").exists()


@pytest.mark.parametrize(
    ("form", "message"),
    [
        ("krl", "robots.pen.controller: expected a controller of kind kuka, which plays krl"),
        ("wide", "--for: expected a format of programs of single robots, got wide"),
        ("rapit", "--for: expected one of "),
    ],
)
def test_a_format_that_cannot_be_written_is_refused_before_anything_is_planned(
    pen: VerifiedRun, tmp_path: Path, form: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["recover", str(pen.folder), "--at", "0.73", "--without-cell", "-o", str(tmp_path / "out"), "-q"]

    assert run_command([*command, "--for", form]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
@pytest.mark.parametrize(("cell", "forms"), [("multimove", ("rapid",)), ("in_turn", ("krl", "rapid", "val3"))])
def test_robots_go_in_step_on_one_controller_and_wait_for_one_another_on_several(
    tmp_path: Path, cell: str, forms: tuple[str, ...]
) -> None:
    solve_into(ROOT / "cells" / f"{cell}.yaml", tmp_path / "run")
    run = open_gate(tmp_path / "run", cell=ROOT / "cells" / f"{cell}.yaml")
    recovery = recover(run, at=0.4 * float(run.motion.times[-1]))
    for form in forms:
        programs = recovery_programs(run, recovery, form)
        rows = programs.job.programs[0].robots
        if cell == "multimove":
            assert programs.job.frame.promise is Promise.SYNCHRONISED
            assert len({len(of_robot) for of_robot in rows.values()}) == 1
        else:
            assert {len(of_robot.marks) for of_robot in rows.values()} == {len(programs.legs) + 1}
        _require_noticed(programs, form)


def _require_noticed(programs: RecoveryPrograms, form: str) -> None:
    """Judge what lies elsewhere than the recovery: a robot that stands still, one that goes past a wait too early."""
    dialect, (program,) = DIALECTS[form], programs.job.programs
    for name, rows in program.robots.items():
        q = rows.q.copy()
        q[len(q) // 2] += 0.01
        others = {**program.robots, name: replace(rows, q=q)}
        files = dialect.render(replace(programs.job, programs=(replace(program, robots=others),)))
        assert programs.findings(dialect, files), f"{form}, {name}"
