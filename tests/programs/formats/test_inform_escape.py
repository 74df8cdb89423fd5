"""Escape programs of Yaskawa: what is written is read back, nothing else is read, and what a controller makes of it."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
import pytest
from builders.elbow_arm import tip
from builders.export_jobs import signals
from builders.scene_builders import make_cell
from builders.seam_jobs import ROBOT, inform_job

from cellplan.errors import InputError, refusals
from cellplan.model.report.exported import ExportFrame, ExportJob, ProgramRows, Promise, RobotRows
from cellplan.model.settings.controllers import ControllerEntry
from cellplan.programs.elements.escapes import EscapeProgram, EscapeStep, read_escape, with_register
from cellplan.programs.formats.inform.escape import INFORM_ESCAPE
from cellplan.programs.formats.inform.writer import INFORM

COUNT, MARKS = 8, (0, 3, 7)


@pytest.fixture(scope="module")
def job() -> ExportJob:
    """Two arms of two controllers that meet at three marks; some rows between are rounded."""
    one = inform_job()
    robots = []
    for name, wires in signals((ROBOT, "beta")).items():
        robot = one.frame.robot(ROBOT)
        assert robot.control is not None
        control = robot.control.model_copy(update={"handshake": wires, "id": f"box_{name}"})
        robots.append(replace(robot, name=name, control=control))
    kinds = {f"box_{robot.name}": ControllerEntry(kind="yaskawa") for robot in robots}
    cell = replace(make_cell(*robots), controllers=kinds)
    rng, home = np.random.default_rng(2), one.programs[0].robots[ROBOT].q[0]
    rows = {
        robot.name: RobotRows(
            robot=robot.name,
            q=home + rng.uniform(-0.15, 0.15, (COUNT, 6)),
            times=np.arange(float(COUNT)),
            marks=MARKS,
            rounding=np.isin(np.arange(COUNT), (1, 4, 5)) * 0.5,
        )
        for robot in robots
    }
    frame = ExportFrame(cell=cell, robots=(ROBOT, "beta"), programs=(None,), promise=Promise.SEQUENCE_ONLY)
    return ExportJob(frame=frame, programs=(ProgramRows(name=None, robots=rows),))


@pytest.fixture(scope="module")
def escape(job: ExportJob) -> EscapeProgram:
    """Ways home of the second robot, in two legs, in the second of which it stands; rows as its main job has them."""
    rows = INFORM.read(job.frame, INFORM.render(job))[0].robots["beta"].q
    steps = (EscapeStep(1, 1, 4, "", ((1, 2), None)), EscapeStep(2, 4, 8, "", (None, (3, 3))))
    return EscapeProgram(frame=job.frame, robot="beta", notes=("a note",), rows=rows, homeward=rows[:3], steps=steps)


def test_the_main_job_counts_steps_and_motions_and_is_read_with_these_numbers_only(job: ExportJob) -> None:
    dialect = with_register(INFORM, INFORM_ESCAPE)
    files = dialect.render(job)
    (read,), (plain,) = dialect.read(job.frame, files), INFORM.read(job.frame, INFORM.render(job))

    for name, rows in plain.robots.items():
        np.testing.assert_array_equal(read.robots[name].q, rows.q)
        assert read.robots[name].marks == rows.marks == MARKS
    for path, text in files.items():
        statements = text.partition("NOP\r\n")[2].split("\r\n")
        register = 0
        seen = []
        for statement in statements:
            if match := re.fullmatch(r"SET D081 (\d+)", statement):
                register = int(match[1])
            register += statement == "INC D081"
            seen += [register] if statement.startswith("MOVJ") else []
        assert seen == [0, 1001, 1002, 1003, 2001, 2002, 2003, 2004]
        assert register == 3000
        for match in re.finditer(r"(?:SET|INC) D081.*\r\n", text):
            other = "SET D081 7\r\n" if match[0].startswith("SET") else "INC D082\r\n"
            for changed in ("", match[0] * 2, other):
                with pytest.raises(InputError, match=rf"^{path}:\d+: "):
                    dialect.read(job.frame, {**files, path: text[: match.start()] + changed + text[match.end() :]})


@pytest.mark.slow
def test_an_escape_is_read_back_and_every_change_is_noticed(escape: EscapeProgram) -> None:
    files, rng = INFORM_ESCAPE.render(escape), np.random.default_rng(4)
    read = read_escape(INFORM_ESCAPE, escape, files)

    assert sorted(files) == [f"BETA_{name}.JBI" for name in ("ESC", "EVEN", "MEET", "ODD")]
    assert (read.steps, read.notes) == (escape.steps, escape.notes)
    np.testing.assert_array_equal(read.rows, escape.rows)
    np.testing.assert_array_equal(read.homeward, escape.homeward)
    for _ in range(40):
        path = sorted(files)[int(rng.integers(len(files)))]
        lines = files[path].split("\n")
        place = int(rng.integers(len(lines) - 1))
        changed = [[], [lines[place]] * 2, [re.sub(r"\d(?=\D*$)", "7", lines[place])]][int(rng.integers(3))]
        if changed == [lines[place]] or lines[place].startswith("'"):
            continue
        text = "\n".join([*lines[:place], *changed, *lines[place + 1 :]])
        try:
            other = read_escape(INFORM_ESCAPE, escape, {**files, path: text})
        except InputError:
            continue
        same = np.array_equal(other.rows, escape.rows) and np.array_equal(other.homeward, escape.homeward)
        assert not same or other.steps != escape.steps, (lines[place], changed)


def motions(files: Mapping[str, str], name: str, register: int, tool: np.ndarray) -> Iterator[str]:
    """Positions to which a robot goes, whose tool is at a place in [mm], once all that it waits for comes."""
    text = files[f"{name}.JBI"].replace("\r", "").partition("NOP\n")[2]
    lines, variables = text.split("\n"), {"D081": register}
    positions = dict(re.findall(r"(C\d{5})=(\S+)", files[f"{name}.JBI"]))
    place = 0
    while lines[place] != "END":
        word, *rest = lines[place].split(" ")
        place += 1
        if word == "JUMP":
            match = re.fullmatch(r"(\*\w+)(?: IF (D\d{3})(<|>|>=|=)(-?\d+))?", " ".join(rest))
            assert match is not None
            value, bound = (variables[match[2]], int(match[4])) if match[2] else (0, 0)
            if (
                not match[2]
                or {"<": value < bound, ">": value > bound, ">=": value >= bound, "=": value == bound}[match[3]]
            ):
                place = lines.index(match[1])
        elif word == "GETE":
            variables[rest[0]] = round(1000.0 * tool[int(rest[2].strip("()")) - 1])
        elif word == "MOVJ":
            yield positions[rest[0]]
        elif word == "SET":
            variables[rest[0]] = int(rest[1])
        elif word == "PAUSE":
            yield "halt"
            return
        elif word == "CALL":
            assert f"{rest[0].removeprefix('JOB:')}.JBI" in files
        else:
            assert word in {"DOUT", "GETS"} or word[0] in "*'", word
    assert variables["D081"] == 0


def test_a_robot_goes_back_from_the_row_that_is_counted_and_from_nowhere_else(escape: EscapeProgram) -> None:
    files, robot, rng = INFORM_ESCAPE.render(escape), escape.frame.robot("beta"), np.random.default_rng(6)

    def place(q: np.ndarray) -> np.ndarray:
        return 1000.0 * tip(robot, q)[:3, 3]

    for step in escape.steps:
        for begun in range(step.last - step.first + 1):
            before = max(begun - 1, 0)  # motions that have ended, but for what is rounded
            rows = escape.rows[step.first - 1 + before : step.first + begun]
            q = rows[0] + rng.uniform() * (rows[-1] - rows[0])
            went = [*motions(files, "BETA_ESC", 1000 * step.number + begun, place(q))]
            legs = [row for leg in step.legs if leg for row in range(leg[0], leg[1] + 1)]
            back = escape.rows[step.first - 1 : step.first + before][::-1]
            expected = [*back, *(escape.homeward[row - 1] for row in legs)]
            assert len(went) == len(expected)
            for text, meant in zip(went, expected, strict=True):
                np.testing.assert_allclose([float(it) for it in text.split(",")][:3], place(meant), atol=2e-3)
            aside = place(q) + np.array([0.0, 0.0, 400.0])
            assert [*motions(files, "BETA_ESC", 1000 * step.number + begun, aside)] == ["halt"]
    for register in (0, 999, 1004, 2005, 3000):
        assert [*motions(files, "BETA_ESC", register, place(escape.rows[0]))] == ["halt"]


def test_the_job_of_one_robot_counts_from_its_first_row(job: ExportJob) -> None:
    robot = job.frame.cell.robots[0]
    cell = replace(job.frame.cell, robots=(robot,), controllers={"box_alpha": ControllerEntry(kind="yaskawa")})
    frame = replace(job.frame, cell=cell, robots=(ROBOT,))
    rows = replace(job.programs[0].robots[ROBOT], marks=())
    alone = ExportJob(frame=frame, programs=(ProgramRows(name=None, robots={ROBOT: rows}),))
    dialect = with_register(INFORM, INFORM_ESCAPE)
    files = dialect.render(alone)
    (read,) = dialect.read(frame, files)
    statements = next(iter(files.values())).partition("NOP\r\n")[2].split("\r\n")
    counted = [
        re.sub("(MOVJ|SET D081 .*|INC D081).*", r"\1", line) for line in statements if line[0:1] not in ("'", "")
    ]
    program = EscapeProgram(
        frame=frame,
        robot=ROBOT,
        notes=(),
        rows=read.robots[ROBOT].q,
        homeward=read.robots[ROBOT].q[:1],
        steps=(EscapeStep(1, 1, COUNT, "", ((1, 1),)),),
    )
    jobs, tool = INFORM_ESCAPE.render(program), 1000.0 * tip(robot, program.rows[4])[:3, 3]

    assert counted == ["SET D081 0", "MOVJ", "SET D081 1000", *["INC D081", "MOVJ"] * (COUNT - 1), "END"]
    assert read_escape(INFORM_ESCAPE, program, jobs).steps == program.steps
    back = [*motions(jobs, "ALPHA_ESC", 1004, tool)]  # it comes to the fifth row, where the motion to it ends
    assert len(back) == 5
    np.testing.assert_allclose(
        [[float(it) for it in text.split(",")][:3] for text in back],
        [1000.0 * tip(robot, program.rows[row])[:3, 3] for row in (3, 2, 1, 0, 0)],
        atol=2e-3,
    )
    for register in (0, 999, 1000 + COUNT, 2000):
        assert [*motions(jobs, "ALPHA_ESC", register, tool)] == ["halt"]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"promise": Promise.PACED}, "expected motions of joints with inform, got lines: write joints"),
        ({"step_register": "97"}, "expected the number of a variable D, 0 to 96, got '097'"),
        ({"step_register": "N_STEP"}, "expected the number of a variable D, 0 to 96, got 'N_STEP'"),
        ({"name": "a" * 28}, "expected a name of at most 27 characters for --escape"),
    ],
)
def test_what_no_job_counts_is_refused(job: ExportJob, changes: dict[str, object], words: str) -> None:
    frame, (robot, other) = job.frame, job.frame.cell.robots
    assert robot.control is not None
    if "step_register" in changes:
        robot = replace(robot, control=robot.control.model_copy(update=changes))
    name = str(changes.get("name", robot.name))
    cell = replace(frame.cell, robots=(replace(robot, name=name), other))
    changed = replace(frame, cell=cell, robots=(name,), promise=changes.get("promise", frame.promise))  # type: ignore[arg-type]

    findings = refusals(*with_register(INFORM, INFORM_ESCAPE).demands(changed, int))

    assert any(words in str(finding) for finding in findings)


@pytest.mark.parametrize(("register", "is_right"), [(None, False), (84, False), (85, True), (77, True)])
def test_variables_of_two_robots_of_a_controller_do_not_overlap(
    job: ExportJob, register: int | None, is_right: bool
) -> None:
    one, other = job.frame.cell.robots
    assert one.control is not None
    assert other.control is not None
    stated = {"id": one.control.id, "step_register": register}
    robots = (one, replace(other, control=other.control.model_copy(update=stated)))  # the first with D081 to D084
    frame = replace(job.frame, cell=replace(job.frame.cell, robots=robots))

    said = [str(finding) for finding in refusals(*with_register(INFORM, INFORM_ESCAPE).demands(frame, int))]

    wanted = (
        f"robots.beta.controller.step_register: expected one 4 or more from that of '{ROBOT}' on the same controller"
    )
    assert any(text.startswith(wanted) for text in said) is not is_right
