"""Paced programs of a solved cell: what is written is read by other means, and what is changed is noticed."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.commands import run_command

from cellplan import load_cell, open_gate
from cellplan.errors import InputError, NotVerifiedError
from cellplan.geometry.transforms import Array, inverse, pose_from, quaternion_to_rotation
from cellplan.model.report.exported import ExportFrame, ExportJob, Moves, ProgramRows, Promise, RobotRows, Seam, Station
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.elements.frames import controller_base
from cellplan.programs.export.choice import Choice
from cellplan.programs.export.prepare import PreparedExport, prepare
from cellplan.programs.export.written import judged, write
from cellplan.programs.formats.rapid.writer import RAPID
from cellplan.programs.judgement.compare_rows import other_rows
from cellplan.programs.rows.rows import full_rows
from cellplan.programs.seams.executed import executed_programs
from cellplan.scene.kinematics.screw_chain import ScrewChain

BEAD = Path(__file__).resolve().parents[3] / "examples" / "seams" / "bead.yaml"
NUMBERS = r"\[([^\[\]]*)\]"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> VerifiedRun:
    folder = tmp_path_factory.mktemp("paced")
    off_grid = BEAD.read_text(encoding="utf-8").replace("[200, ", "[201.03, ")  # no row falls on the corner
    (folder / "cell.yaml").write_text(off_grid, encoding="utf-8")
    status, _, error = run_command("cellplan solve cell.yaml -o run --quiet", folder)
    assert (status, error) == (0, "")
    return open_gate(Path(folder / "run"), cell=Path(folder / "cell.yaml"))


@pytest.fixture(scope="module")
def frame() -> ExportFrame:
    """What a reader knows of a paced export of the cell, which is not solved."""
    cell = load_cell(BEAD)
    X = inverse(controller_base(cell.robot("arm"))) @ cell.part.X_CP
    station = Station(tasks=("ring", "corner"), X=X, X_W=cell.part.X_CP)
    return ExportFrame(
        cell=cell,
        robots=("arm",),
        programs=(None,),
        promise=Promise.PACED,
        moves=Moves.LINEAR,
        stations={"arm": (station,)},
    )


@pytest.fixture(scope="module")
def prepared(run: VerifiedRun) -> PreparedExport:
    return prepare(run, DIALECTS["rapid"], Choice(moves=Moves.LINEAR))


@pytest.fixture(scope="module")
def text(prepared: PreparedExport) -> str:
    return DIALECTS["rapid"].render(prepared.job)["arm.mod"]


def frame_of(words: str) -> Array:
    """A frame ``[x,y,z],[w,x,y,z]`` in [mm], as the manual of the language has it."""
    place, turn = (np.array([float(number) for number in part.split(",")]) for part in re.findall(NUMBERS, words)[:2])
    return pose_from(quaternion_to_rotation(turn), place / 1000.0)


def routine(text: str, name: str) -> list[str]:
    body = re.search(rf"PROC {name}\(\)(.*?)ENDPROC", text, re.S)
    assert body is not None
    return [line.strip() for line in body[1].strip().splitlines()]


def points(text: str, name: str) -> list[Array]:
    """Poses of the tool in the world that a routine passes in process, from declarations and frames in the text."""
    datum = re.search(r"wobjdata w_part_1 := \[FALSE,TRUE,\"\",(\[.*?\],\[.*?\])\],", text)
    assert datum is not None
    X_WC = pose_from(np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.array([0.0, 0.0, 0.1]))
    X_WP = X_WC @ frame_of(datum[1])
    names = [re.findall(rf"{name}_\d+", line) for line in routine(text, name) if line.startswith("Disp")]
    targets = {word: re.search(rf"robtarget {word} := (.*);", text) for line in names for word in line}
    return [X_WP @ frame_of(match[1]) for match in targets.values() if match is not None]


@pytest.mark.slow
def test_points_lie_on_the_path_and_the_process_goes_on_and_off_at_its_ends(text: str) -> None:
    ring, corner = routine(text, "ring"), routine(text, "corner")

    assert [line.partition(" ")[0] for line in corner] == [
        "MoveAbsJ",
        "DispLStart",
        "DispL",
        "DispLEnd",
        "MoveL",
    ]
    assert ring[1].startswith("DispLStart ring_1,")
    assert ",fine," in ring[1]
    assert ",bead1," in ring[1]
    assert all(line.startswith(("DispC ", "DispL ")) and ",fine," not in line for line in ring[2:-2])
    assert ring[-2].startswith("DispCEnd ")
    assert ",fine," in ring[-2]
    assert sum(line.startswith("DispC") for line in ring) == 3  # a third of the ring each, and nothing is left over
    assert len(ring) <= 12
    assert "speeddata s_40 := [40,500,100,20];" in text
    assert all(",s_40," in line for line in (*ring[2:-1], *corner[2:-1]))
    centre = np.array([1.0, 0.0, 0.33])
    for X in points(text, "ring"):
        assert np.linalg.norm(X[:3, 3] - centre) == pytest.approx(0.08, abs=1e-6)
        np.testing.assert_allclose(X[:3, 2], [0.0, 0.0, -1.0], atol=1e-5)
    first, inner, last = (X[:3, 3] for X in points(text, "corner"))
    desired = [[0.8, -0.15, 0.33], [1.20103, -0.15, 0.33], [1.20103, 0.15, 0.33]]
    np.testing.assert_allclose([first, inner, last], desired, atol=1e-6)  # half a step of 4 ms beside rest: 0.8 um


@pytest.mark.slow
def test_the_head_says_how_many_rows_are_rounded(prepared: PreparedExport, run: VerifiedRun) -> None:
    module = write(run, prepared).files["arm.mod"]
    head = re.search(r"! (\d+) of \d+ rows rounded", module)

    assert head is not None
    assert int(head[1]) == len(re.findall(r"^    \w+ .*\bz_\d+\b", module, re.M))


@pytest.mark.slow
def test_joints_of_the_entry_bring_the_stated_tool_to_the_approach(text: str, run: VerifiedRun) -> None:
    """The tool in the turned flange of the controller is where the model has it."""
    robot = run.cell.robot("arm")
    tool = re.search(r"tooldata t_arm := \[TRUE,(\[.*?\],\[.*?\])\],", text)
    assert tool is not None
    X_FG = np.diag([-1.0, -1.0, 1.0, 1.0])
    np.testing.assert_allclose(X_FG @ frame_of(tool[1]), robot.tool.X_FT, atol=2e-7)


def noticed(prepared: PreparedExport, run: VerifiedRun, text: str) -> str:
    """What is said of a changed program; empty where nothing is."""
    dialect, job = prepared.dialect, prepared.job
    try:
        read = dialect.read(job.frame, {**dialect.render(job), "arm.mod": text})
        finding = next(other_rows(dialect, job, read), "")
        if not finding:
            executed_programs(job, dialect, full_rows(run), read)
    except (InputError, NotVerifiedError) as error:
        return str(error)
    return finding


CHANGES = {
    "feed": (r"speeddata s_40 := \[40,", "speeddata s_40 := [41,"),
    "feed of a move": (r"(DispL corner_2),s_40", r"\1,s_60"),
    "data": (r"(DispL corner_2,s_40),bead2", r"\1,bead1"),
    "work object": (r"(wobjdata w_part_1 := .FALSE,TRUE,\"\",\[\[)(-?\d+)", r"\g<1>45"),
    "frame of a move": (r"(MoveL corner_4.*)w_part_1", r"\1wobj0"),
    "tool frame": (r"(tooldata t_arm := \[TRUE,\[\[.*?\],\[)(-?\d\.\d+)", r"\g<1>1.0000000"),
    "tool": (r"(MoveL corner_4.*),t_arm", r"\1,tool0"),
    "configuration": (r"(robtarget corner_2 := .*\[)(-?\d)(,-?\d,-?\d,\d\])", r"\g<1>3\3"),
    "point": (r"(robtarget corner_2 := \[\[)201\.0300", r"\g<1>201.2300"),
    "on and off": (r"DispLStart corner_1(.*)DispLEnd", r"DispLEnd corner_1\1DispLStart"),
    "fine at the end": (r"(DispLEnd corner_3,s_40,bead2),fine", r"\1,z_158"),
    "a zone for another": (r"(DispL corner_2,s_40,bead2),z_\d+", r"\1,z_9999"),
    "a stop within": (r"(DispL corner_2,s_40,bead2),z_\d+", r"\1,fine"),
    "no process": (r"DispL corner_2,s_40,bead2", "MoveL corner_2,s_40"),
    "bent orientation": (r"(DispL corner_2)", r"SingArea\\Wrist; \1"),
    "a point used twice": (r"DispL corner_2", "DispL corner_3"),
    "a line for an arc": (r"DispC ring_2, ?ring_3", "DispL ring_3"),
    "another order": (r"(    ring;)\s*(    corner;)", r"\2\n\1"),
    "joints of the entry": (r"(jointtarget j_2 := \[\[)-?\d+", r"\g<1>12"),
}


@pytest.mark.slow
@pytest.mark.parametrize("change", CHANGES)
def test_a_change_is_noticed(change: str, prepared: PreparedExport, run: VerifiedRun, text: str) -> None:
    pattern, repl = CHANGES[change]
    changed, count = re.subn(pattern, repl, text, count=1, flags=re.S if change == "on and off" else 0)
    assert count == 1
    assert changed != text
    assert noticed(prepared, run, changed)


@pytest.mark.slow
def test_what_is_written_is_what_is_read(prepared: PreparedExport, run: VerifiedRun, text: str) -> None:
    dialect = prepared.dialect
    assert prepared.promised.promise is Promise.PACED
    assert noticed(prepared, run, text) == ""
    judgement = judged(run, prepared, dialect.read(prepared.job.frame, dialect.render(prepared.job)))
    assert judgement.passed
    tube = judgement.executed[0].robots["arm"].tube
    assert tube is not None
    assert 0.0 < tube[:, 0].max() <= 0.25 * 0.5e-3 + 1e-5  # the corner in process takes a quarter of its tolerance


def job_of_line(frame: ExportFrame, q: Array, *, configuration: Array | None = None) -> ExportJob:
    """A seam of one line between the first and the last of some joints, shape (N, 6), which the run has between."""
    robot = frame.robot("arm")
    X_WP = robot.X_WB @ inverse(robot.X_WB)
    X_WP[:3, 3] = [1.0, 0.0, 0.3]
    X_PT = np.full((2, 4, 4), np.nan)
    X_PT[1] = inverse(X_WP) @ ScrewChain(robot).tool_poses(q[-1:])[0]
    rows = RobotRows(
        robot="arm",
        q=q[[0, -1]],
        times=np.array([0.0, 1.0]),
        process=np.zeros(2, dtype=bool),
        rounding=np.zeros(2),
        X_PT=X_PT,
        configuration=configuration,
        seams=(Seam(task="corner", first=0, last=1),),
        feeds=np.array([np.nan, 0.04]),
        middles=np.zeros(2, dtype=bool),
    )
    return ExportJob(frame=frame, programs=(ProgramRows(name=None, robots={"arm": rows}),))


def test_a_seam_is_read_back(frame: ExportFrame) -> None:
    q = np.deg2rad([[-10.0, 25.0, 10.0, 5.0, 50.0, 10.0], [-5.0, 25.0, 10.0, 5.0, 50.0, 10.0]])
    job = job_of_line(frame, q)

    read = RAPID.read(frame, RAPID.render(job))

    assert list(other_rows(RAPID, job, read)) == []
    assert read[0].robots["arm"].seams == (Seam(task="corner", first=0, last=1),)


def refusal(frame: ExportFrame, job: ExportJob, q: Array) -> str:
    every = RobotRows(robot="arm", q=q, times=np.linspace(0.0, 1.0, len(q)))
    with pytest.raises(NotVerifiedError) as error:
        executed_programs(job, RAPID, [ProgramRows(name=None, robots={"arm": every})], job.programs)
    return str(error.value)


def test_a_line_that_flips_the_wrist_is_refused_with_task_length_and_joint(frame: ExportFrame) -> None:
    """Only axis 5 turns, from one side to the other: a straight tool passes its zero beside the singular direction."""
    q = np.deg2rad([[0.0, 20.0, 10.0, 30.0, 25.0, 10.0]]) + np.linspace(0.0, 1.0, 201)[:, None] * np.deg2rad(
        [[8.0, 0.0, 0.0, 0.0, -50.0, 0.0]]
    )

    message = refusal(frame, job_of_line(frame, q), q)

    assert re.search(r"task 'corner', \d+\.\d mm along its seam: .* joint J\d of 'arm' passes near", message)


def test_a_line_that_leaves_a_limit_between_its_ends_is_refused(frame: ExportFrame) -> None:
    q = np.deg2rad([[-25.0, 25.0, 10.0, 5.0, 50.0, 10.0]]) + np.linspace(0.0, 1.0, 201)[:, None] * np.deg2rad(
        [[50.0, 0.0, 0.0, 0.0, 0.0, 0.0]]
    )
    job = job_of_line(frame, q)
    every = [ProgramRows(name=None, robots={"arm": RobotRows(robot="arm", q=q, times=np.linspace(0.0, 1.0, len(q)))})]
    executed = executed_programs(job, RAPID, every, job.programs)[0].robots["arm"].q
    inside, ends = executed.max(axis=0), executed[[0, -1]].max(axis=0)
    joint = int(np.argmax(inside - ends))
    assert inside[joint] - ends[joint] > 0.01
    robot = frame.robot("arm")
    upper = 0.5 * (inside[joint] + ends[joint])
    joints = list(robot.model.joints)
    joints[joint] = replace(joints[joint], upper=upper)
    model = replace(robot.model, joints=tuple(joints))
    cell = replace(frame.cell, robots=(replace(robot, model=model),))

    message = refusal(frame, replace(job, frame=replace(frame, cell=cell)), q)

    assert re.search(
        rf"task 'corner', .* mm along its seam: joint {joints[joint].name} of 'arm' leaves its limits", message
    )


def test_a_line_in_another_configuration_than_stated_is_refused(frame: ExportFrame) -> None:
    q = np.deg2rad([[-10.0, 25.0, 10.0, 5.0, 50.0, 10.0]]) + np.linspace(0.0, 1.0, 201)[:, None] * np.deg2rad(
        [[5.0, 0.0, 0.0, 0.0, 0.0, 0.0]]
    )
    function = RAPID.configuration
    assert function is not None
    stated = function(frame.robot("arm"), q[[0, -1]])
    stated[1, 3] = 1 - stated[1, 3]

    message = refusal(frame, job_of_line(frame, q, configuration=stated), q)

    assert "task 'corner'" in message
    assert "expected configuration" in message


def test_a_line_at_a_speed_that_a_joint_cannot_follow_is_refused(frame: ExportFrame) -> None:
    q = np.deg2rad([[-10.0, 25.0, 10.0, 5.0, 50.0, 10.0]]) + np.linspace(0.0, 1.0, 201)[:, None] * np.deg2rad(
        [[5.0, 0.0, 0.0, 0.0, 0.0, 0.0]]
    )
    job = job_of_line(frame, q)
    rows = replace(job.programs[0].robots["arm"], feeds=np.array([np.nan, 40.0]))

    message = refusal(frame, replace(job, programs=(ProgramRows(name=None, robots={"arm": rows}),)), q)

    assert re.search(r"joint J\d of 'arm' would move at \d.* deg/s at 4e\+04 mm/s, allowed", message)


@pytest.mark.slow
def test_corners_that_tp_cannot_state_have_a_point_more(tmp_path: Path) -> None:
    """A right angle with 0.5 mm of tolerance is rounded within 0.18 mm, arcs of one circle within 2 mm."""
    statements = "process: {on: 'DO[7]=ON', off: 'DO[7]=OFF'}"
    text = re.sub(r"process:\n +on:.*\n +inner:.*\n +off:.*\n +data:.*", statements, BEAD.read_text("utf-8"), count=1)
    text = text.replace("kind: abb", "kind: fanuc").replace("{id: irc5,", "{id: irc5, tool_number: 1, frames: [1],")
    (tmp_path / "cell.yaml").write_text(text, encoding="utf-8")
    export = "cellplan export run --cell cell.yaml --format fanuc_ls --moves linear -o tp"
    for command in ("cellplan solve cell.yaml -o run --quiet", export, "cellplan verify tp --run run --cell cell.yaml"):
        assert run_command(command, tmp_path)[0] == 0

    corner, ring = ((tmp_path / "tp" / f"ARM_{name}.ls").read_text(encoding="utf-8") for name in ("CORNER", "RING"))
    endings = r" 40mm/sec (\w+)"
    assert re.findall(endings, corner) == ["CR1", "CR1", "FINE"]
    assert re.findall(endings, ring) == ["CR2", "CR1", "CR2", "CR1", "FINE"]
    places = re.findall(r"X = (\S+) mm, Y = (\S+) mm, Z = (\S+) mm", corner)
    before, at, _, _ = np.diff(np.array(places, dtype=float), axis=0)
    assert 0.2 < np.linalg.norm(at) <= 2.0 * 0.25 * 0.5 * np.sqrt(2.0)
    np.testing.assert_allclose(at / np.linalg.norm(at), before / np.linalg.norm(before), atol=1e-3)


@pytest.fixture(scope="module")
def yaskawa(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the solved cell with an arm of Yaskawa, and of what states other position levels."""
    folder, text = tmp_path_factory.mktemp("yaskawa"), BEAD.read_text(encoding="utf-8")
    statements = 'process: {on: "ARCON ASF#(1)", off: "ARCOF AEF#(1)"}\n    position_levels_mm: [0.15, 0.5, 1, 2]'
    text = re.sub(r"process:\n +on:.*\n +inner:.*\n +off:.*\n +data:.*", statements, text, count=1)
    text = text.replace("kind: abb", "kind: yaskawa").replace("{id: irc5,", "{id: irc5, tool_number: 1, frames: [1],")
    (folder / "cell.yaml").write_text(text, encoding="utf-8")
    for name, levels in (("coarse", "0.5"), ("coarsest", "5")):
        stated = f"controllers: {{irc5: {{position_levels_mm: [{levels}]}}}}"
        (folder / f"{name}.yaml").write_text(stated, encoding="utf-8")
    assert run_command("cellplan solve cell.yaml -o run --quiet", folder)[0] == 0
    return folder


@pytest.mark.slow
def test_a_ring_and_a_corner_are_jobs_of_a_yaskawa_arm(yaskawa: Path) -> None:
    """Its position levels round what may be rounded, and the jobs that are written are verified as they lie there."""
    export = "cellplan export run --cell cell.yaml --format inform --moves linear -o jobs"
    for command in (export, "cellplan verify jobs --run run --cell cell.yaml"):
        assert run_command(command, yaskawa)[0] == 0

    ring, corner = ((yaskawa / "jobs" / f"{name}.JBI").read_text(encoding="utf-8") for name in ("RING", "CORNER"))
    assert re.findall(r"MOV(.) C\d+ V=40\.0 PL=(\d)", ring) == [
        *[("C", "0"), ("C", "1"), ("C", "2")],  # the first arc begins where the tool is; the others share its points
        *[("C", "1"), ("C", "2"), ("C", "1"), ("C", "0")],
    ]
    assert re.findall(r"MOV(.) C\d+ V=40\.0 PL=(\d)", corner) == [("L", "1"), ("L", "0")]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("levels", "jobs", "said"),
    [
        ("coarse", ["ARM.JBI", "RING.JBI"], "promise: paced"),
        ("coarsest", ["ARM.JBI"], "not paced: task 'ring': row "),
    ],
)
def test_tasks_whose_lines_are_refused_move_by_joints(yaskawa: Path, levels: str, jobs: list[str], said: str) -> None:
    """The first level alone rounds the corner by more than it may be, the second one the ring too."""
    options = f"--cell cell.yaml --controllers {levels}.yaml"
    export = f"cellplan export run {options} --format inform -o {levels} --moves"

    status, _, error = run_command(f"{export} linear", yaskawa)
    assert status == 1
    assert "a corner in process" in error
    status, output, _ = run_command(f"{export} auto", yaskawa)

    assert status == 0
    assert said in output
    assert "task 'corner'" in output
    assert sorted(path.name for path in (yaskawa / levels).glob("*.JBI")) == jobs
    assert "?corner?" in (yaskawa / levels / "ARM.JBI").read_text(encoding="utf-8")
    assert run_command(f"cellplan verify {levels} --run run {options}", yaskawa)[0] == 0
