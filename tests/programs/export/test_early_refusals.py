"""What the files of a run say against an export is said at once, all of it, before anything is verified."""

import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from builders.seam_jobs import seam_job

from cellplan import load_cell, open_gate
from cellplan.cli.main import run as run_command
from cellplan.errors import InputError, NotVerifiedError
from cellplan.jobs.recover.refusals import refuse_recovery, refuse_state
from cellplan.model.motion.motion import Motion
from cellplan.model.motion.plan import Hold
from cellplan.model.report.exported import Moves, Promise
from cellplan.model.report.verified_run import ReadRun
from cellplan.model.settings.controllers import ControllerEntry, HandshakeEntry, KindName, RobotControlEntry
from cellplan.model.settings.task import ProcessEntry
from cellplan.model.settings.units import MmPerS
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.export.choice import Choice
from cellplan.programs.export.refusals import refuse_unfit, refuse_unfit_run, settings_remarks, unmet_demands

NAMES = ("left", "right", "idle")


@pytest.fixture(scope="module")
def read(sound: Path) -> ReadRun:
    """The run as it was read; what is verified after that is of no account."""
    runs: list[ReadRun] = []
    open_gate(sound / "run", cell=sound / "cell" / "small.yaml", refuse=runs.append)
    return runs[0]


def on(read: ReadRun, kind: KindName, *, handshake: HandshakeEntry | None = None, **stated: float) -> ReadRun:
    """The run with all robots on one controller."""
    control = RobotControlEntry(id="c", handshake=handshake)
    robots = tuple(replace(robot, control=control) for robot in read.cell.robots)
    controllers = {"c": ControllerEntry(kind=kind, **stated)}
    return replace(read, cell=replace(read.cell, robots=robots, controllers=controllers))


def no_rows() -> Motion:
    raise InputError("the rows were read")


def refusing(form: str, choice: Choice) -> Callable[[ReadRun], None]:
    return partial(refuse_unfit_run, formats={form: True}, choice=choice, folder=Path("out"))


@pytest.mark.parametrize(
    ("refuse", "reason"),
    [
        (refusing("krl", Choice()), "robots.left.controller: expected the controller that plays krl, got none"),
        (refusing("csv", Choice(robots=("lefty",))), "--robot: expected one of left, right, idle, got 'lefty'"),
        (refusing("csv", Choice(promise=Promise.SYNCHRONISED)), "--promise: expected timed with csv"),
        (refusing("wide", Choice(robots=("left",))), "--format: expected no choice of robots"),
        (refusing("ros2", Choice(split=1)), "--split: expected 2 to 100000 rows with ros2, got 1"),
        (
            lambda read: refuse_state(read.cell, read.motion, at=99.0, frozen={}, keep=()),
            "--at: expected a time of the program, 0 to ",
        ),
        (
            lambda read: refuse_state(read.cell, read.motion, at=0.1, frozen={}, keep=("lefty",)),
            "--keep: expected the name of a robot",
        ),
    ],
)
def test_nothing_is_verified_before_a_refusal(sound: Path, refuse: Callable[[ReadRun], None], reason: str) -> None:
    stages: list[str] = []

    with pytest.raises(InputError) as refusal:
        open_gate(
            sound / "run",
            cell=sound / "cell" / "small.yaml",
            refuse=refuse,
            progress=lambda stage, _: stages.append(stage),
        )

    assert str(refusal.value).startswith(reason)
    assert stages == []


def test_every_robot_without_a_controller_is_named(read: ReadRun) -> None:
    with pytest.raises(InputError) as refusal:
        refuse_unfit(read, DIALECTS["val3"], Choice())

    assert str(refusal.value).splitlines() == [
        f"robots.{name}.controller: expected the controller that plays val3, got none" for name in NAMES
    ]


def test_what_needs_no_rows_is_refused_without_them_and_without_engines(
    sound: Path, read: ReadRun, tmp_path: Path
) -> None:
    with pytest.raises(InputError) as refusal:
        refusing("csv", Choice(robots=("lefty",)))(replace(read, rows=no_rows))
    words = ["export", str(sound / "run"), "--format", "csv", "--robot", "lefty", "-o", str(tmp_path / "csv"), "-q"]
    words += ["--cell", str(sound / "cell" / "small.yaml")]
    command = [sys.executable, "-X", "importtime", "-m", "cellplan", *words]
    refused = subprocess.run(command, capture_output=True, text=True, check=False)
    loaded = set(re.findall(r"^import time:.*\| +([\w.]+)$", refused.stderr, flags=re.MULTILINE))

    assert refused.returncode == 2
    assert refused.stderr.endswith(f"{refusal.value}\n")
    assert "cellplan.programs.formats.csv" in loaded
    assert loaded.isdisjoint({"pinocchio", "fcl", "coal", "jinja2", "cellplan.programs.formats.rapid.writer"})


def test_all_that_a_stream_needs_is_said_at_once(read: ReadRun) -> None:
    lagging = on(read, "ur")

    with pytest.raises(InputError) as refusal:
        refuse_unfit(lagging, DIALECTS["stream"], Choice(thin_mm=None))

    assert str(refusal.value).count("controllers.c.latency_ms: expected the time by which its robots follow") >= 1


def test_signals_of_all_robots_and_their_names_are_said_at_once(read: ReadRun) -> None:
    """The motion allows no other order: what else is missing is said beside that, with a cure."""
    urs = on(read, "kuka", handshake=HandshakeEntry(output="x", inputs={"left": "y"}))

    with pytest.raises(NotVerifiedError) as refusal:
        refuse_unfit(urs, DIALECTS["krl"], Choice())

    first, cure, *needed = refusal.value.findings
    assert first.startswith("krl: not sequence only: ")
    assert "left, right, idle share controller 'c', but krl as cellplan writes it moves each robot by" in cure
    said = "\n".join(needed)
    for name in ("right", "idle"):  # the leader reads all others
        assert f"robots.left.controller.handshake.inputs: expected the input that '{name}' sets, got none" in said
    for name in NAMES:
        assert f"robots.{name}.controller.handshake.output: expected a whole number from 1 to 4096" in said
        assert f"robots.{name}.controller.handshake.inputs.left: expected a whole number from 1 to 4096" in said


def test_what_programs_of_a_recovery_need_in_several_formats_is_said_at_once(read: ReadRun) -> None:
    with pytest.raises(InputError) as refusal:
        refuse_recovery(read, at=0.1, frozen={}, keep=(), formats=("krl", "rapid"))

    for form in ("krl", "rapid"):
        assert f"which plays {form}" in str(refusal.value) or f"that plays {form}" in str(refusal.value)


@pytest.mark.parametrize("promise", [None, Promise.SEQUENCE_ONLY])
def test_what_a_cell_with_the_part_at_rest_does_not_state_is_refused_without_rows(
    read: ReadRun, promise: Promise | None
) -> None:
    """The rows of a part that moves decide the promise first: they are read."""
    kukas = replace(on(read, "kuka", handshake=HandshakeEntry(output="x", inputs={"left": "y"})), rows=no_rows)
    held = {name: Hold() for name in read.cell.positioners}
    at_rest = tuple(replace(phase, roles={**phase.roles, **held}) for phase in read.phases)

    with pytest.raises(InputError) as refusal:
        refuse_unfit(replace(kukas, phases=at_rest), DIALECTS["krl"], Choice(promise=promise))
    with pytest.raises(InputError, match=r"^the rows were read$"):
        refuse_unfit(kukas, DIALECTS["krl"], Choice(promise=promise))

    assert "robots.left.controller.handshake.inputs: expected the input that 'right' sets" in str(refusal.value)


def test_a_time_after_the_end_of_a_program_is_refused_by_the_last_row_of_its_clock(read: ReadRun) -> None:
    with pytest.raises(InputError) as refusal:
        refuse_recovery(replace(read, rows=no_rows, clock=no_rows), at=99.0, frozen={}, keep=(), formats=())

    assert str(refusal.value) == f"--at: expected a time of the program, 0 to {read.motion.times[-1]:g} s, got 99"


def test_the_cure_is_no_controller_that_all_robots_have_already(read: ReadRun) -> None:
    for kind, form in (("staubli", "val3"), ("kuka", "krl")):
        with pytest.raises(NotVerifiedError) as refusal:
            refuse_unfit(on(read, kind), DIALECTS[form], Choice())

        assert "state one controller" not in str(refusal.value)
        assert "--format stream, csv" in str(refusal.value)


def test_of_several_formats_that_all_are_refused_each_says_why(read: ReadRun) -> None:
    formats = {"krl": True, "val3": False}

    with pytest.raises(NotVerifiedError) as refusal:
        refuse_unfit_run(read, formats, Choice(robots=("left",)), folder=Path("out"))

    assert str(refusal.value).splitlines() == [
        f"{form}: robots.left.controller: expected the controller that plays {form}, got none"
        for form in ("krl", "val3")
    ]


def test_a_format_that_can_be_written_keeps_several_from_being_refused(read: ReadRun) -> None:
    stages: list[str] = []

    refuse_unfit_run(read, {"krl": True, "csv": True}, Choice(), folder=Path("out"))
    stages.append("verified")

    assert stages == ["verified"]


def test_no_folder_is_announced_that_is_not_there(
    sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [
        "--format",
        "krl",
        "--format",
        "val3",
        "-o",
        str(tmp_path / "programs"),
        "--cell",
        str(sound / "cell" / "small.yaml"),
        "-q",
    ]

    assert run_command(["export", str(sound / "run"), *words]) == 2

    out, err = capsys.readouterr()
    assert "programs:" not in out + err
    assert not (tmp_path / "programs").exists()


def test_programs_of_another_run_are_refused_before_that_is_verified(
    sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, cell = tmp_path / "csv", str(sound / "cell" / "small.yaml")
    words = ["--format", "csv", "-o", str(folder), "--cell", cell, "-q"]
    assert run_command(["export", str(sound / "run"), *words]) == 0
    record = folder / "export.json"
    record.write_text(record.read_text().replace('"run": "', '"run": "0'))
    capsys.readouterr()

    assert run_command(["verify", str(folder), "--run", str(sound / "run"), "--cell", cell, "-v"]) == 2

    err = capsys.readouterr().err
    assert "the programs were made from another run" in err
    assert "certifying" not in err


@pytest.mark.parametrize("form", ["rapid", "krl", "fanuc_ls", "inform", "val3", "urscript"])
def test_programs_of_lines_pass_each_seam_once(form: str, read: ReadRun) -> None:
    job = seam_job("kuka")
    cell = job.frame.cell
    frame = replace(job.frame, cell=replace(cell, program=cell.program.model_copy(update={"cycles": 2})))

    said = [str(error) for error in unmet_demands(read, DIALECTS[form], frame, Choice(moves=Moves.LINEAR))]

    assert any(text.startswith("program.cycles: expected 1,") for text in said) is (form != "fanuc_ls")


def test_processes_of_which_no_statement_is_written_are_remarks(cells: Path) -> None:
    cell = load_cell(cells / "in_turn.yaml")
    with_process = replace(
        cell, tasks=tuple(replace(task, process=ProcessEntry(feed_mm_s=MmPerS(8.0))) for task in cell.tasks)
    )
    control = cell.robot("abb").control
    assert control is not None

    (remark,) = settings_remarks(with_process, ["rapid", "csv"])

    assert remark[0] == f"controllers.{control.id}.process"
    assert "no statement of a process is written for 'abb'" in remark[1]
    assert settings_remarks(with_process, ["csv"]) == settings_remarks(cell, ["rapid"]) == []
