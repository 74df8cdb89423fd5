"""RAPID programs: what is written is read back, follows the rules of MultiMove, and is refused where it cannot be."""

import re
from dataclasses import replace

import numpy as np
import pytest
from builders.export_jobs import (
    NAMES,
    arm_on_a_rail,
    cell_of,
    controlled,
    drawn_limits,
    job_of,
    largest_deviation,
    one_arm,
    positioner_model,
    random_program,
    read_back,
)
from builders.rapid_jobs import ABB, CONTROLLER, multimove_cell, multimove_job, named_signals, sequence_job
from builders.rapid_rules import rules_broken, text_of
from builders.scene_builders import arm_model
from hypothesis import given, settings
from hypothesis import strategies as st

from cellplan.errors import InputError
from cellplan.model.report.exported import ExportJob, Moves, ProgramRows, Promise
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.formats.rapid.writer import RAPID

HALF_UNIT = 0.5e-4  # of a degree or a millimetre, four decimals
NUDGED = 3.0 * np.deg2rad(2.0 * HALF_UNIT)  # a joint near its limit, and one that is coupled to it, moves inwards


def with_decimals(job: ExportJob, decimals: int) -> ExportJob:
    """The job with other decimals of every robot."""
    cell = job.frame.cell
    robots = tuple(replace(robot, control=robot.control.changed(decimals=decimals)) for robot in cell.robots)
    return replace(job, frame=replace(job.frame, cell=replace(cell, robots=robots)))


TASK_OF = {NAMES[0]: "T_ROB1", NAMES[1]: "T_ROB2", NAMES[2]: "T_ROB3"}


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("split", [None, 7, 19, 20])
def test_synchronised_programs_are_read_back_and_follow_the_rules(seed: int, split: int | None) -> None:
    job = multimove_job(seed=seed, split=split, blend=0.25)

    files = RAPID.render(job)
    read = RAPID.read(job.frame, files)

    assert rules_broken(files, TASK_OF) == []
    for name in NAMES[:3]:
        assert largest_deviation(job, read, name) <= 2.0 * np.deg2rad(HALF_UNIT) + 1e-12
        np.testing.assert_allclose(read[0].robots[name].times, job.programs[0].robots[name].times, atol=0.5e-6 + 1e-9)
    assert len(files) == (6 if split in {None, 20} else 6 + 3 * -(-19 // split))


@pytest.mark.parametrize("seed", range(3))
def test_no_position_is_beyond_a_limit_when_it_is_read(seed: int) -> None:
    job = multimove_job(rows=200, seed=seed, at_limit=True)

    read = read_back(RAPID, job)

    for robot in job.frame.cell.robots:
        q = read[0].robots[robot.name].q
        assert np.all((q >= robot.model.lower) & (q <= robot.model.upper))
        assert largest_deviation(job, read, robot.name) <= NUDGED


@pytest.mark.slow
def test_many_positions_are_read_back() -> None:
    job = multimove_job(rows=100_000, seed=5, at_limit=True)

    read = read_back(RAPID, job)

    for robot in job.frame.cell.robots:
        q = read[0].robots[robot.name].q
        assert np.all((q >= robot.model.lower) & (q <= robot.model.upper))
        assert largest_deviation(job, read, robot.name) <= NUDGED


@pytest.mark.parametrize("make", [one_arm, arm_on_a_rail])
def test_a_robot_alone_is_read_back(make) -> None:
    job = make(ABB, rows=30)

    read = read_back(RAPID, job)

    assert largest_deviation(job, read, NAMES[0]) <= 3.0 * np.deg2rad(HALF_UNIT)  # axis 3 counts with axis 2
    assert read[0].robots[NAMES[0]].marks == ()


@pytest.mark.parametrize("split", [None, 6])
def test_robots_meet_at_signals_where_they_stand_still(split: int | None) -> None:
    job = sequence_job(split=split, blend=0.5)

    files = RAPID.render(job)
    read = RAPID.read(job.frame, files)

    assert {rows.marks for rows in read[0].robots.values()} == {(0, 7, 19)}
    assert not any(word in text for text in files.values() for word in ("\\ID", "SyncMove", "PERS tasks"))
    lines = [line for line in text_of(files, NAMES[1]) if line.startswith("    ")]
    places = [k for k, line in enumerate(lines) if line == f"    SetDO do_{NAMES[1]},1;"]
    assert len(places) == 3
    assert all(lines[k - 1].split(",")[-2] == "fine" for k in places)


def test_an_external_axis_is_in_millimetres_and_missing_ones_are_marked() -> None:
    job = arm_on_a_rail(ABB, rows=3)
    rail = job.programs[0].robots[NAMES[0]].q[:, 0] * 1000.0

    text = RAPID.render(job)[f"{NAMES[0]}.mod"]

    matches = re.findall(r"\],\[([^\]]*)\]\]", "".join(line for line in text.splitlines() if "Move" in line))
    assert [entry.split(",")[1:] for entry in matches] == [["9E9"] * 5] * 3
    np.testing.assert_allclose([float(entry.split(",")[0]) for entry in matches], rail, atol=0.6e-4)


def test_a_positioner_moves_its_external_axes_only() -> None:
    job = multimove_job(rows=4)

    lines = [
        line for line in RAPID.render(job)[f"{NAMES[2]}.mod"].splitlines() if "Move" in line and "Sync" not in line
    ]

    assert all(line.startswith("    MoveExtJ [[9E9,9E9,9E9,9E9,9E9,9E9],[") for line in lines)
    assert not any("t_gamma" in line for line in lines)


def test_corner_paths_leave_out_ends_marks_and_switches_of_the_process() -> None:
    job = sequence_job(blend=0.25)  # the process is on from row 5 to row 10

    lines = [line for line in RAPID.render(job)[f"{NAMES[0]}.mod"].splitlines() if line.startswith("    Move")]

    assert [k for k, line in enumerate(lines) if ",fine," in line] == [0, 5, 7, 10, 19]
    assert all(re.search(r",z_\d+,", line) for k, line in enumerate(lines) if k not in {0, 5, 7, 10, 19})


def test_robots_in_step_stop_at_the_same_rows() -> None:
    job = multimove_job(rows=20, blend=0.25)
    rows = job.programs[0].robots
    other = replace(rows[NAMES[1]], process=np.arange(20) >= 13)
    job = replace(job, programs=(ProgramRows(name=None, robots={**rows, NAMES[1]: other}),))

    files = RAPID.render(job)

    stops = [
        [
            k
            for k, line in enumerate(x for x in files[f"{name}.mod"].splitlines() if x.startswith("    Move"))
            if "fine" in line
        ]
        for name in NAMES[:3]
    ]
    assert stops == [[0, 5, 10, 13, 19]] * 3


def test_durations_add_up_to_the_times_of_the_rows() -> None:
    """Each is rounded from the time, not from the step: 10,000 steps of a third of a millisecond end at 3.333333 s."""
    job = one_arm(ABB, rows=2)
    rows = job.programs[0].robots[NAMES[0]]
    times = np.arange(10_000) / 3000.0
    many = replace(rows, q=np.repeat(rows.q[:1], 10_000, axis=0), times=times, process=None)
    job = replace(job, programs=(ProgramRows(name=None, robots={NAMES[0]: many}),))

    text = "".join(RAPID.render(job).values())

    total = sum(float(match) for match in re.findall(r"\\T:=([\d.]+)", text))
    assert abs(total - times[-1]) < 1e-6


def test_several_programs_are_folders() -> None:
    cell = multimove_cell({NAMES[0]: arm_model(), NAMES[2]: positioner_model()})
    programs = [random_program(cell, rows=5, name=name, seed=k) for k, name in enumerate(("first", "second"))]
    job = job_of(cell, *programs, promise=Promise.SYNCHRONISED)

    files = RAPID.render(job)

    assert {path.split("/")[0] for path in files} == {"first", "second"}
    read = RAPID.read(job.frame, files)
    assert [program.name for program in read] == ["first", "second"]
    assert largest_deviation(job, read, NAMES[0]) <= 2.0 * np.deg2rad(HALF_UNIT)


@pytest.mark.parametrize(
    "names",
    [
        ("R1", "r1"),
        ("Prüfling", "Pruefling"),
        ("a" * 60, "a" * 61),
        ("MoveL", "tooldata"),
        ("1st", "x!y;z"),
        ('"]]>', "main"),
        ("b", "b_001"),
        ("part", "sync_on"),
        ("page_001", "v100"),
    ],
)
def test_names_of_any_robots_are_names_of_modules(names: tuple[str, str]) -> None:
    cell = multimove_cell({name: arm_model() for name in names})
    job = job_of(cell, random_program(cell, rows=9), promise=Promise.SYNCHRONISED, split=3, notes=("ü ]]> ! \n PROC",))

    files = RAPID.render(job)
    read = RAPID.read(job.frame, files)

    stems = [path.lower() for path in files]
    assert len(set(stems)) == len(stems) == 2 * (2 + 3)
    assert all(re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,31}\.(mod|pgf)", path) for path in files)
    assert largest_deviation(job, read, names[1]) <= 2.0 * np.deg2rad(HALF_UNIT)


def test_the_same_job_gives_the_same_bytes() -> None:
    assert RAPID.render(multimove_job(seed=3)) == RAPID.render(multimove_job(seed=3))


@given(decimals=st.integers(min_value=1, max_value=8), seed=st.integers(min_value=0, max_value=99))
@settings(max_examples=6, deadline=None)
def test_decimals_of_a_robot_hold(decimals: int, seed: int) -> None:
    job = with_decimals(multimove_job(rows=4, seed=seed), decimals)

    read = read_back(RAPID, job)

    assert largest_deviation(job, read, NAMES[2]) <= np.deg2rad(10.0**-decimals)


# Variants that mean the same


VARIANTS = {
    "line feeds": lambda text: text.replace("\r\n", "\n"),
    "lower case": lambda text: (
        "\n".join(line if "PERS tasks" in line else line.lower() for line in text.splitlines()) + "\n"
    ),
    "spaces": lambda text: re.sub(r"([,\[\]])", r" \1 ", text).replace("\\", " \\ ").replace("! ", "!  "),
    "no indentation": lambda text: re.sub(r"^ +", "", text, flags=re.MULTILINE),
    "tabs": lambda text: re.sub(r"^ +", "\t\t", text, flags=re.MULTILINE),
    "blank lines": lambda text: text.replace("\r\n", "\r\n\r\n\t\r\n"),
    "comments": lambda text: text.replace(";\r\n", '; ! done; "really" MoveAbsJ\r\n! 9E9 %%%\r\n'),
    "version": lambda text: "%%%\r\n  VERSION:1\r\n  LANGUAGE:ENGLISH\r\n%%%\r\n\r\n" + text,
    "lines inside a statement": lambda text: text.replace("]\\ID", "]\r\n      \\ID").replace(",t_", "\r\n,\r\n  t_"),
    "one line": lambda text: re.sub(r"\s*\r\n\s*", " ", re.sub(r" *!.*", "", text)) + "\r\n",
    "other decimals": lambda text: re.sub(r"(\d\.\d{4})(?=[,\]])", r"\g<1>00", text),
    "other exponent": lambda text: text.replace("9E9", "9E+09"),
    "predefined speeds and zones": lambda text: re.sub(r",z_\d+,", ",z1,", text.replace("v_rows\\", "v1000\\")),
    "task of its own": lambda text: text.replace("PERS tooldata", "TASK PERS tooldata"),
    "declared target": lambda text: re.sub(
        r"(  PROC main.*?)MoveAbsJ (\[\[.*?\]\])(,v_start)",
        r"  CONST jointtarget p_first := \2;\r\n\1MoveAbsJ p_first\3",
        text,
        flags=re.S,
    ),
}


@pytest.fixture(scope="module")
def multimove() -> tuple[ExportJob, dict[str, str], ProgramRows]:
    """A job, its files and what is read from them; not to be changed."""
    job = multimove_job(rows=5, blend=0.25)
    files = RAPID.render(job)
    return job, files, RAPID.read(job.frame, files)[0]


@pytest.mark.parametrize("variant", VARIANTS)
def test_harmless_variants_are_read(variant: str, multimove: tuple[ExportJob, dict[str, str], ProgramRows]) -> None:
    job, files, expected = multimove

    changed = {path: VARIANTS[variant](text) if path.endswith("mod") else text for path, text in files.items()}
    read = RAPID.read(job.frame, changed)

    assert changed != files
    for name in NAMES[:3]:
        np.testing.assert_allclose(read[0].robots[name].q, expected.robots[name].q, rtol=0.0, atol=1e-12)


# What cannot be written


def refusal(job: ExportJob) -> str:
    with pytest.raises(InputError) as caught:
        RAPID.render(job)
    return str(caught.value)


def changed_cell(job: ExportJob, **controls: dict[str, object]) -> ExportJob:
    """The job with other settings of the controls of robots."""
    robots = tuple(
        replace(robot, control=robot.control.changed(**controls.get(robot.name, {}))) for robot in job.frame.cell.robots
    )
    return replace(job, frame=replace(job.frame, cell=replace(job.frame.cell, robots=robots)))


def changed_rows(job: ExportJob, name: str, **changes: object) -> ExportJob:
    """The job with other rows of one robot."""
    robots = job.programs[0].robots
    program = replace(job.programs[0], robots={**robots, name: replace(robots[name], **changes)})
    return replace(job, programs=(program,))


def test_a_robot_without_a_controller_is_refused() -> None:
    job = one_arm(ABB)
    robot = replace(job.frame.cell.robots[0], control=None)
    cell = replace(job.frame.cell, robots=(robot,))

    text = refusal(replace(job, frame=replace(job.frame, cell=cell)))

    assert text == "robots.alpha.controller: expected the controller that plays rapid, got none"


def test_another_kind_of_controller_is_refused() -> None:
    assert refusal(one_arm("kuka")) == (
        "robots.alpha.controller: expected a controller of kind abb for rapid, got kuka"
    )


def test_robots_of_two_controllers_are_not_synchronised() -> None:
    assert refusal(sequence_job(promise=Promise.SYNCHRONISED)) == (
        "rapid: expected at least two robots on one controller for synchronised programs, got controllers "
        "alpha_controller, beta_controller"
    )


@pytest.mark.parametrize(
    ("control", "text"),
    [
        ({"task": None}, "expected one of the tasks of controller 'irc5' (T_ROB1, T_ROB2, T_ROB3), got none"),
        ({"task": "T_ROB9"}, "expected one of the tasks of controller 'irc5' (T_ROB1, T_ROB2, T_ROB3), got T_ROB9"),
        ({"task": "T_ROB1"}, "expected a task of its own, got T_ROB1, the task of 'alpha'"),
    ],
)
def test_tasks_must_be_those_of_the_controller(control: dict[str, object], text: str) -> None:
    assert refusal(changed_cell(multimove_job(), beta=control)) == f"robots.beta.controller.task: {text}"


def test_robots_with_other_rows_are_not_in_step() -> None:
    job = multimove_job(rows=6)
    rows = job.programs[0].robots[NAMES[1]]

    fewer = changed_rows(job, NAMES[1], q=rows.q[:4], times=rows.times[:4], process=None)
    later = changed_rows(job, NAMES[1], times=rows.times * 1.01)

    assert refusal(fewer) == (
        "rapid: expected the same rows of all robots, as their moves run together, got 6 of 'alpha' and 4 of 'beta'"
    )
    assert refusal(later) == "rapid: expected rows of 'beta' at the same times as those of 'alpha'"


def test_rows_need_times_that_rise() -> None:
    job = one_arm(ABB, rows=4)

    assert "expected at least two rows with times" in refusal(changed_rows(job, NAMES[0], times=None))
    assert "expected rows at least 1e-06 s apart" in refusal(
        changed_rows(job, NAMES[0], times=np.array([0, 0.1, 0.1, 1]))
    )


@pytest.mark.parametrize("signal", ["12", "do 1", "a" * 33, "1do", "MoveL", "do;"])
def test_signals_must_be_names(signal: str) -> None:
    named = named_signals(NAMES[:2])[NAMES[0]]

    text = refusal(changed_cell(sequence_job(), alpha={"handshake": named.model_copy(update={"output": signal})}))

    assert text == (
        "robots.alpha.controller.handshake.output: expected the name of a signal of at most 32 letters, digits and _, "
        f"got {signal!r}"
    )


def test_an_input_that_is_no_name_is_refused_by_its_key() -> None:
    signal = named_signals(NAMES[:2])[NAMES[0]]

    other = signal.model_copy(update={"inputs": {NAMES[1]: "3"}})
    text = refusal(changed_cell(sequence_job(), alpha={"handshake": other}))

    assert text.startswith(f"robots.alpha.controller.handshake.inputs.{NAMES[1]}: expected the name of a signal ")


def test_a_robot_of_many_axes_is_refused() -> None:
    model = arm_model()
    table = replace(model, joints=tuple(replace(joint, name=f"x{k}") for k in range(3) for joint in model.joints))
    cell = cell_of(controlled(NAMES[0], drawn_limits(table, np.random.default_rng(0))), kind=ABB)

    text = refusal(job_of(cell, random_program(cell)))

    assert text == "robots.alpha: expected at most 6 axes beside an arm, got 12"


def test_the_format_is_one_of_the_dialects() -> None:
    assert isinstance(DIALECTS["rapid"], Dialect)
    assert DIALECTS["rapid"].promises == (Promise.SYNCHRONISED, Promise.PACED, Promise.SEQUENCE_ONLY)
    assert Moves.LINEAR in DIALECTS["rapid"].moves
    assert CONTROLLER in multimove_job().frame.cell.controllers
