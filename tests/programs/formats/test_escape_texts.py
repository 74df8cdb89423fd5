"""Escape programs: what is written is read back, nothing else is read, and what a controller makes of the texts."""

import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import pairwise, product

import numpy as np
import pytest
from builders.escape_players import Robot, play
from builders.export_jobs import cell_of, controlled, one_arm, random_program, two_arms, zero_of
from builders.fanuc_jobs import counted, waiting_job
from builders.fanuc_jobs import seam_job as fanuc_seam_job
from builders.rapid_jobs import sequence_job
from builders.scene_builders import arm_model
from builders.seam_jobs import KUKA_ZERO, STAUBLI_VALVE, UR_VALVE, VALVE, seam_job

from cellplan.errors import InputError, refusals
from cellplan.model.report.exported import ExportFrame, ExportJob, Promise
from cellplan.model.settings.controllers import HandshakeEntry
from cellplan.programs.dialects import DIALECTS, ESCAPES
from cellplan.programs.elements.escapes import EscapeProgram, EscapeStep, read_escape, with_register
from cellplan.programs.elements.joints import from_numbers, to_numbers

KINDS = {"fanuc_ls": "fanuc", "krl": "kuka", "rapid": "abb", "urscript": "ur", "val3": "staubli"}
FORMS = tuple(KINDS)


def job_in(form: str) -> ExportJob:
    """A program of two robots that meet at three marks."""
    if form != "urscript":
        jobs = {"rapid": sequence_job, "fanuc_ls": waiting_job}
        return jobs.get(form, partial(two_arms, KINDS[form]))(seed=3)
    return with_few_signals(two_arms("ur", seed=3))


def with_few_signals(job: ExportJob) -> ExportJob:
    """The job of two robots whose signals are standard ones of UR."""
    wires = {"alpha": (1, {"beta": 2}), "beta": (3, {"alpha": 4})}
    signals = {name: HandshakeEntry(output=output, inputs=inputs) for name, (output, inputs) in wires.items()}
    robots = tuple(
        replace(robot, control=robot.control.model_copy(update={"handshake": signals[robot.name]}))
        for robot in job.frame.cell.robots
        if robot.control is not None
    )
    return replace(job, frame=replace(job.frame, cell=replace(job.frame.cell, robots=robots)))


def numbers_of(form: str, job: ExportJob, robot: str, q: np.ndarray) -> np.ndarray:
    """Positions as the controller shows them, with the decimals of the format."""
    angle, decimals = ESCAPES[form].angle, 9 if form == "urscript" else 4
    return to_numbers(job.frame.robot(robot), q, decimals=decimals, angle=angle)


def escape_of(form: str, job: ExportJob, robot: str) -> EscapeProgram:
    """Ways home that lead from each mark over three rows, in two legs, in the second of which it stands."""
    rows = job.programs[0].robots[robot]
    q = from_numbers(job.frame.robot(robot), numbers_of(form, job, robot, rows.q), angle=ESCAPES[form].angle)
    pairs = zip(rows.marks[:-1], rows.marks[1:], strict=True)
    steps = tuple(
        EscapeStep(number, first + 1, last + 1, "0.1000", ((3 * number - 1, 3 * number + 1), None))
        for number, (first, last) in enumerate(pairs, start=1)
    )
    homeward = q[np.arange(1 + 3 * len(steps)) % len(q)]
    return EscapeProgram(frame=job.frame, robot=robot, notes=("a note",), rows=q, homeward=homeward, steps=steps)


@pytest.mark.parametrize("form", FORMS)
def test_programs_set_their_register_at_each_mark_and_are_read_with_these_numbers_only(form: str) -> None:
    job, plain = job_in(form), DIALECTS[form]
    dialect = with_register(plain, ESCAPES[form])
    files = dialect.render(job)
    (read,) = dialect.read(job.frame, files)
    (expected,) = plain.read(job.frame, plain.render(job))

    begin = r"(?:cell_step ?:?= ?|write_output_integer_register\(24, | *\d+:  R\[81\]=)"
    setting = re.compile(rf"^ *{begin}(\d)(?: ?;|\))?\r?\n", re.MULTILINE)
    for name, rows in expected.robots.items():
        np.testing.assert_array_equal(read.robots[name].q, rows.q)
        assert read.robots[name].marks == rows.marks
    for path, text in files.items():
        numbers = [match[1] for match in setting.finditer(text)]
        assert numbers in ([], ["0", "1", "2", "3"])
        for match in setting.finditer(text):
            lines = match[0]
            other = re.sub(rf"{match[1]}(?=\D*$)", "7", lines)
            for changed in ("", other, lines + lines):
                with pytest.raises(InputError, match=rf"^{path}:\d+: expected '"):
                    dialect.read(job.frame, {**files, path: text[: match.start()] + changed + text[match.end() :]})


def paced_job(form: str) -> ExportJob:
    """Two robots that meet at three marks: the first one works on a seam, which the second mark is in."""
    jobs: dict[str, Callable[[], ExportJob]] = {
        "fanuc_ls": fanuc_seam_job,
        "krl": partial(seam_job, "kuka", process=VALVE, controller=KUKA_ZERO),
        "urscript": partial(seam_job, "ur", process=UR_VALVE),
        "val3": partial(seam_job, "staubli", process=STAUBLI_VALVE),
    }
    job = jobs[form]()
    rows, cell = job.programs[0].robots["alpha"], job.frame.cell
    model = replace(arm_model(), controller=cell.robot("alpha").model.controller)
    robots = (cell.robot("alpha"), controlled("beta", model))
    both = cell_of(*robots, kind=KINDS[form])  # type: ignore[arg-type]
    both = replace(both, tasks=cell.tasks, controllers={**both.controllers, **cell.controllers})
    marks = (0, 6, len(rows) - 1)
    beta = random_program(both, rows=len(rows), marks=marks).robots["beta"]
    program = replace(
        job.programs[0], robots={"alpha": replace(rows, marks=marks), "beta": replace(beta, process=None)}
    )
    frame = replace(job.frame, cell=both, robots=("alpha", "beta"))
    job = replace(job, frame=frame, programs=(program,))
    return with_few_signals(job) if form == "urscript" else job


@pytest.mark.parametrize("form", ["fanuc_ls", "krl", "urscript", "val3"])
def test_paced_programs_count_their_register_up_at_each_mark_in_whichever_routine_it_is(form: str) -> None:
    job, plain = paced_job(form), DIALECTS[form]
    dialect = with_register(plain, ESCAPES[form])
    files = dialect.render(job)
    (read,), (expected,) = dialect.read(job.frame, files), plain.read(job.frame, plain.render(job))

    counting = re.compile(r"(?:cell_step=cell_step\+1|R\[81\]=R\[81\]\+1|24, read_output_integer_register\(24\) \+ 1)")
    beginning = re.compile(r"(?:cell_step=0|R\[81\]=0|register\(24, 0)")
    for name, rows in expected.robots.items():
        np.testing.assert_array_equal(read.robots[name].q, rows.q)
        assert read.robots[name].marks == rows.marks == (0, 6, len(rows) - 1)
        texts = [text for path, text in files.items() if path.lower().startswith(name)]
        assert (sum(len(counting.findall(text)) for text in texts), sum(map(len, map(beginning.findall, texts)))) == (
            3,
            1,
        )
    for path, text in files.items():
        for match in [*counting.finditer(text), *beginning.finditer(text)]:
            begin, end = text.rindex("\n", 0, match.start()), text.index("\n", match.end())
            for changed in ("", text[begin:end] * 2):
                with pytest.raises(InputError, match=rf"^{path}:\d+: expected"):
                    dialect.read(job.frame, {**files, path: text[:begin] + changed + text[end:]})


@pytest.mark.parametrize(
    ("form", "off"),
    [("krl", VALVE["off"]), ("urscript", [UR_VALVE["off"]]), ("val3", STAUBLI_VALVE["off"])],
)
def test_processes_go_off_before_anything_moves(form: str, off: list[str]) -> None:
    job, escape = paced_job(form), ESCAPES[form]
    rows = job.programs[0].robots["beta"].q
    program = EscapeProgram(frame=job.frame, robot="alpha", notes=(), rows=rows, homeward=rows[:1], steps=())

    assert escape.before(program)[: len(off)] == off
    moving = replace(program, robot="beta")
    assert not set(off) & set(escape.before(moving))


@pytest.mark.parametrize("form", FORMS)
def test_a_robot_by_itself_keeps_no_register_and_goes_back_along_all_of_its_rows(form: str) -> None:
    jobs = {"rapid": lambda: replace(sequence_job(seed=3)), "fanuc_ls": lambda: counted(one_arm("fanuc", seed=3))}
    job = jobs.get(form, partial(one_arm, KINDS[form], seed=3))()
    if len(job.frame.robots) > 1:
        cell = replace(job.frame.cell, robots=job.frame.cell.robots[:1])
        alone = replace(job.programs[0].robots[cell.robots[0].name], marks=())
        program_rows = replace(job.programs[0], robots={alone.robot: alone})
        job = replace(job, frame=replace(job.frame, cell=cell, robots=(alone.robot,)), programs=(program_rows,))
    escape, (name,) = ESCAPES[form], job.frame.robots
    assert with_register(DIALECTS[form], escape).render(job) == DIALECTS[form].render(job)
    q = job.programs[0].robots[name].q
    step = EscapeStep(1, 1, len(q), "0.1000", ((2, 4),))
    program = EscapeProgram(frame=job.frame, robot=name, notes=(), rows=q, homeward=q[:4], steps=(step,))
    files = escape.render(program)

    assert read_escape(escape, program, files).steps == (step,)
    numbers = numbers_of(form, job, name, q)
    here = 0.3 * numbers[5] + 0.7 * numbers[6]
    for register in (0, 5):  # whatever it holds
        moves = _moves(Robot(files, register, here))
        np.testing.assert_allclose(np.array(moves), np.array([*numbers[5::-1], *numbers[1:4]]), atol=1e-4)


@pytest.mark.parametrize("form", FORMS)
def test_escape_programs_are_read_back_and_every_change_is_noticed(form: str) -> None:
    job, escape, rng = job_in(form), ESCAPES[form], np.random.default_rng(5)
    name = job.frame.robots[1]
    program = escape_of(form, job, name)
    files = escape.render(program)
    read = read_escape(escape, program, files)

    assert (read.steps, read.notes) == (program.steps, program.notes)
    np.testing.assert_array_equal(read.rows, program.rows)
    np.testing.assert_array_equal(read.homeward, program.homeward)
    for _ in range(80):
        path = sorted(files)[int(rng.integers(len(files)))]
        lines = files[path].split("\n")
        place = int(rng.integers(len(lines) - 1))
        line = lines[place]
        if line.strip().startswith(escape.sign):
            continue
        at = int(rng.integers(max(len(line), 1)))
        letter = "0123456789ABCDEFabcdef.+-,()"[int(rng.integers(28))]
        changed = [[line[:at] + letter + line[at + 1 :]], [], [line, line]][int(rng.integers(3))]
        if changed == [line]:
            continue
        text = "\n".join([*lines[:place], *changed, *lines[place + 1 :]])
        try:
            other = read_escape(escape, program, {**files, path: text})
        except InputError:
            continue
        same_rows = np.array_equal(other.rows, program.rows) and np.array_equal(other.homeward, program.homeward)
        assert not same_rows or other.steps != program.steps, (line, changed)


@pytest.mark.parametrize("form", FORMS)
def test_a_robot_goes_back_along_its_rows_from_wherever_it_stands_and_from_nowhere_else(form: str) -> None:
    job, escape, rng = job_in(form), ESCAPES[form], np.random.default_rng(7)
    name = job.frame.robots[1]
    program = escape_of(form, job, name)
    files = escape.render(program)
    numbers, home = (numbers_of(form, job, name, q) for q in (program.rows, program.homeward))
    for step in program.steps:
        for _ in range(10):
            row = int(rng.integers(step.first, step.last))  # from 1, so that its next one is row + 1
            here = numbers[row - 1] + rng.uniform() * (numbers[row] - numbers[row - 1])
            moves = _moves(Robot(files, step.number, here))
            begin, end = step.legs[0] or (1, 0)
            expected = [*numbers[step.first - 1 : row][::-1], *home[begin - 1 : end]]
            np.testing.assert_allclose(np.array(moves), np.array(expected), atol=1e-4)
            aside = np.linalg.norm(numbers[row] - numbers[row - 1])
            off = here + 0.1 * aside * np.where(
                np.abs(numbers[row] - numbers[row - 1]) > 1e-6, [1, -1, 1, -1, 1, -1], 1
            )
            if min(_distance(off, a, b) for a, b in pairwise(numbers)) > 0.11:
                assert _moves(Robot(files, step.number, off)) == ["halt"]
    assert _moves(Robot(files, 0, numbers[0])) == ["halt"]


def _moves(robot: Robot) -> list[object]:
    """Where a robot goes when all that it waits for comes."""
    moves: list[object] = []
    while robot.event is not None and not robot.is_halted:
        moves += [robot.event[1]] if robot.event[0] == "move" else []
        robot.take()
    return [*moves, "halt"] if robot.is_halted else moves


def _distance(p: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    share = np.clip((p - a) @ (b - a) / max((b - a) @ (b - a), 1e-12), 0.0, 1.0)
    return float(np.linalg.norm(p - a - share * (b - a)))


@pytest.mark.slow
@pytest.mark.parametrize(("form", "count", "seeds"), [("krl", 2, 8), ("krl", 3, 4), ("fanuc_ls", 2, 2), ("val3", 2, 2)])
def test_robots_go_only_where_all_registers_have_even_or_all_odd_numbers(form: str, count: int, seeds: int) -> None:
    model = replace(arm_model(), controller=zero_of(6)) if form == "fanuc_ls" else arm_model()
    cell = cell_of(*(controlled(name, model) for name in ("alpha", "beta", "gamma")[:count]), kind=KINDS[form])
    names = [robot.name for robot in cell.robots]
    frame = ExportFrame(cell=cell, robots=tuple(names), programs=(None,), promise=Promise.SEQUENCE_ONLY)
    here = np.zeros((2, 6))
    here[1] = 0.1
    steps = tuple(EscapeStep(number, 1, 2, "0.1000", ((2, 2),)) for number in (1, 2))
    files = {}
    for name in names:
        program = EscapeProgram(frame=frame, robot=name, notes=(), rows=here, homeward=here, steps=steps)
        files[name] = ESCAPES[form].render(program)
    wires: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for robot in cell.robots:
        assert robot.control is not None
        assert robot.control.handshake is not None
        wires[robot.name, str(robot.control.handshake.output)] = [
            (other.name, str(other.control.handshake.inputs[robot.name]))
            for other in cell.robots
            if other.control and other.control.handshake and robot.name in other.control.handshake.inputs
        ]
    stands = to_numbers(cell.robots[0], here, decimals=5)[1]
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        for numbers in product((1, 2), repeat=count):
            spread = (0.0, 0.02, 1.0, 3.0)[seed % 4]
            robots = {
                name: Robot(files[name], number, stands, float(rng.uniform(0.0, spread)))
                for name, number in zip(names, numbers, strict=True)
            }
            play(robots, wires, rng)
            if len(set(numbers)) == 1:
                assert all(robot.is_done and robot.moved for robot in robots.values()), (seed, numbers)
            else:
                assert not any(robot.moved for robot in robots.values()), (seed, numbers)


@pytest.mark.parametrize(
    ("form", "registers", "path", "expected", "refusal"),
    [
        ("krl", ("N_STEP", "SWITCH"), "alpha.src", "\nN_STEP=3\r", "expected a name of at most 24 characters"),
        ("fanuc_ls", (7, 99), "ALPHA.ls", ":  R[7]=3 ;\r", "expected the number of a register, 1 to 98"),
        ("val3", ("nAt", "diMark1"), "alpha/start.pgx", "\n  nAt=3\n", "expected a name of at most 15 characters"),
    ],
)
def test_a_register_may_have_another_name_and_none_that_the_language_has(
    form: str, registers: tuple[object, object], path: str, expected: str, refusal: str
) -> None:
    job = job_in(form)
    robots = tuple(
        replace(robot, control=robot.control.model_copy(update={"step_register": register}))
        for robot, register in zip(job.frame.cell.robots, registers, strict=True)
        if robot.control is not None
    )
    frame = replace(job.frame, cell=replace(job.frame.cell, robots=robots))
    dialect = with_register(DIALECTS[form], ESCAPES[form])

    assert expected in dialect.render(replace(job, frame=frame))[path]
    (finding,) = refusals(*dialect.demands(frame, int))
    assert f"beta.controller.step_register: {refusal}, got '{registers[1]}'" in str(finding)


@pytest.mark.parametrize(("register", "is_right"), [(None, False), (74, False), (73, True), (89, True)])
def test_registers_of_two_robots_of_a_fanuc_controller_do_not_overlap(register: int | None, is_right: bool) -> None:
    frame = job_in("fanuc_ls").frame
    alpha, beta = frame.cell.robots
    assert alpha.control is not None
    assert beta.control is not None
    stated = {"id": alpha.control.id, "group": 2, "step_register": register}
    robots = (
        replace(alpha, control=alpha.control.model_copy(update={"group": 1})),  # with register 81
        replace(beta, control=beta.control.model_copy(update=stated)),
    )
    frame = replace(frame, cell=replace(frame.cell, robots=robots))

    said = [
        str(error) for error in refusals(*with_register(DIALECTS["fanuc_ls"], ESCAPES["fanuc_ls"]).demands(frame, int))
    ]

    wanted = (
        "robots.beta.controller.step_register: expected one 8 or more from that of 'alpha' on the same controller, 81"
    )
    assert any(text.startswith(wanted) for text in said) is not is_right


def test_more_rows_than_a_program_of_a_controller_has_points_are_refused() -> None:
    job = job_in("fanuc_ls")
    program = escape_of("fanuc_ls", job, "beta")

    with pytest.raises(InputError, match=r"^--escape: expected at most 999 rows of 'beta' in fanuc_ls, got 1000: "):
        ESCAPES["fanuc_ls"].render(replace(program, rows=np.tile(program.rows[:1], (1000, 1))))
