"""FANUC programs: what is written is read back as it was, keeps the rules of the language, and nothing else is read."""

import re
from dataclasses import replace

import numpy as np
import pytest
from builders.export_jobs import (
    arm_on_a_rail,
    cell_of,
    controlled,
    job_of,
    largest_deviation,
    one_arm,
    positioner_model,
    random_program,
    read_back,
)
from builders.fanuc_jobs import CONTROLLER, FANUC, counted, group_job, waiting_job
from builders.scene_builders import arm_model

from cellplan.errors import InputError
from cellplan.model.report.exported import ExportJob, Promise
from cellplan.model.robot.controller import ControllerZero
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.controllers import HandshakeEntry
from cellplan.programs.elements.corners import may_round, moves, row_shares, units_of
from cellplan.programs.formats.fanuc_ls.writer import FANUC_LS

QUANTUM = np.deg2rad(1e-4)
AXIS = re.compile(r"([JE]\d) = (-?\d+\.\d+) (deg|mm)(,?)$")


def checked(files: dict[str, str]) -> None:
    """The rules of the language, from the texts alone."""
    for path, text in files.items():
        lines = text.split("\r\n")
        assert lines.pop() == ""
        assert all(re.fullmatch(r"[ -~]*", line) for line in lines)
        name = path.removesuffix(".ls")
        assert re.fullmatch(r"[A-Z][A-Z0-9_]{0,35}", name)
        assert lines[0] == f"/PROG {name}"
        heads = [lines.index(head) for head in ("/ATTR", "/MN", "/POS", "/END")]
        assert heads == [1, *sorted(heads[1:])]
        assert heads[-1] == len(lines) - 1
        (mask,) = re.findall(r"(?m)^DEFAULT_GROUP = ([1*](?:,[1*]){4,7});$", text.replace("\r", ""))
        groups = [number for number, slot in enumerate(mask.split(","), start=1) if slot == "1"]
        numbered = [line.partition(":") for line in lines[heads[1] + 1 : heads[2]]]
        assert [int(number) for number, _, _ in numbered] == list(range(1, len(numbered) + 1))
        assert all(re.fullmatch(r"[^;]* ;", said) for _, _, said in numbered)
        assert all(len(said.removesuffix(" ;")) <= 35 for _, _, said in numbered if said.startswith("  !"))
        moved = [int(number) for _, _, said in numbered for number in re.findall(r"^J P\[(\d+)\]", said)]
        assert _points(lines[heads[2] + 1 : heads[3]], groups) == moved == list(range(1, len(moved) + 1))
        assert all(f"{called}.ls" in files for called in re.findall(r"CALL (\w+)", text))


def _points(lines: list[str], groups: list[int]) -> list[int]:
    """Numbers of the points, each of which has the axes of every group."""
    numbers, axes = [], set()
    for block in re.findall(r"(?s)P\[\d+\]\{.*?\};\n", "\n".join([*lines, ""])):
        begin, *rest, end = block.splitlines()
        assert end == "};"
        numbers.append(int(begin[2:-2]))
        assert [int(line.strip()[2:-1]) for line in rest if "GP" in line] == groups
        shape = []
        for group in "\n".join(rest).split("GP")[1:]:
            parts = re.split(r"(?<=,) |\n\s*", group.strip())[3:]
            assert parts == [part for part in parts if AXIS.fullmatch(part)]
            assert [part.endswith(",") for part in parts] == [True] * (len(parts) - 1) + [False]
            shape.append(tuple((match[1], match[3]) for part in parts if (match := AXIS.fullmatch(part))))
        axes.add(tuple(shape))
    assert len(axes) <= 1
    return numbers


def jobs(split: int | None = None, blend: float = 0.0) -> list[ExportJob]:
    changes = {"seed": 3, "split": split, "blend": blend}
    return [one_arm(FANUC, **changes), arm_on_a_rail(FANUC, **changes), waiting_job(**changes), group_job(**changes)]


@pytest.mark.parametrize("changes", [{}, {"split": 6}, {"blend": 0.3}, {"blend": 0.5, "split": 7}], ids=str)
def test_rows_come_back_to_the_rounding_and_files_keep_the_rules(changes) -> None:
    for job in jobs(**changes):
        files = FANUC_LS.render(job)
        (read,) = FANUC_LS.read(job.frame, files)

        checked(files)
        assert files == FANUC_LS.render(job)  # the same bytes again
        assert list(read.robots) == list(job.programs[0].robots)
        for robot, rows in job.programs[0].robots.items():
            assert read.robots[robot].marks == rows.marks
            assert largest_deviation(job, (read,), robot) <= 2.0 * QUANTUM  # the coupled axis adds that of the other


def test_axis_3_is_counted_against_the_ground() -> None:
    coupling = np.zeros((6, 6))
    coupling[2, 1] = -1.0
    zero = ControllerZero(zero=np.zeros(6), sign=np.ones(6), coupling=coupling, source="test")
    job = counted(one_arm(FANUC), zero)

    written = re.findall(r"J2 = (-?[\d.]+) deg, J3 = (-?[\d.]+) deg", FANUC_LS.render(job)["ALPHA.ls"])

    q = np.rad2deg(job.programs[0].robots["alpha"].q)
    assert np.allclose(np.array(written, dtype=float), np.stack([q[:, 1], q[:, 2] - q[:, 1]], axis=1), atol=2e-4)


def test_groups_move_in_one_program_each_with_its_axes() -> None:
    job = group_job(groups=(1, 6, 2))

    files = FANUC_LS.render(job)

    checked(files)
    text = files[f"{CONTROLLER.upper()}.ls"]
    assert "DEFAULT_GROUP = 1,1,*,*,*,1,*,*;" in text
    rail = [float(value) for value in re.findall(r"E1 = (-?[\d.]+) mm", text)]
    assert np.allclose(rail, 1e3 * job.programs[0].robots["beta"].q[:, 0], atol=1e-4)
    table = re.findall(r"GP2:\s+UF : 0, UT : 1,\s+J1 = (-?[\d.]+) deg, J2 = (-?[\d.]+) deg\s", text)
    q = np.rad2deg(job.programs[0].robots["gamma"].q)
    assert np.allclose(np.array(table, dtype=float), q, atol=1e-4)
    assert list(read_back(FANUC_LS, job)[0].robots) == ["alpha", "beta", "gamma"]


def test_motions_in_step_state_their_durations_which_do_not_drift() -> None:
    job = group_job(rows=300)
    clock = job.programs[0].robots["alpha"].times

    text = FANUC_LS.render(job)["R30.ls"]
    read = read_back(FANUC_LS, job)[0].robots

    assert re.findall(r"J P\[\d+\] (\d+%)", text) == ["10%"]
    durations = [int(value) for value in re.findall(r"J P\[\d+\] (\d+)msec", text)]
    assert len(durations) == 299
    assert np.abs(1e3 * clock[1:] - np.cumsum(durations)).max() <= 0.5
    for rows in read.values():
        np.testing.assert_allclose(rows.times, np.cumsum([0, *durations]) / 1e3, atol=1e-12)


def test_a_robot_by_itself_has_no_durations_and_a_speed_of_its_plan() -> None:
    job = one_arm(FANUC)
    rows = job.programs[0].robots["alpha"]
    q = np.zeros((4, 6))
    q[1:, 0] = [0.5, 0.5, 0.75]  # 0.5 rad in 1 s, none, 0.25 rad in 1 s; the top speed is 5 rad/s
    program = replace(job.programs[0], robots={"alpha": replace(rows, q=q, times=np.arange(4.0), process=None)})

    job = replace(job, programs=(program,))

    assert re.findall(r"J P\[\d\] (\S+)", FANUC_LS.render(job)["ALPHA.ls"]) == ["10%", "10%", "10%", "5%"]
    assert read_back(FANUC_LS, job)[0].robots["alpha"].times is None


@pytest.mark.parametrize("make", [waiting_job, group_job])
def test_rows_are_passed_where_no_group_stops(make) -> None:
    job = make(blend=0.5, split=13)
    program = job.programs[0]

    read = read_back(FANUC_LS, job)[0].robots

    free = may_round(program, units_of(job.frame))
    for name, rows in read.items():
        expected = free[name].copy()
        expected[[12, 19]] = False
        np.testing.assert_array_equal(rows.rounding, 0.5 * expected)
        assert 0 < expected.sum() < 19


def test_rows_that_may_be_rounded_by_less_than_half_are_stops() -> None:
    job = one_arm(FANUC, blend=0.5)
    (program,) = job.programs
    free = row_shares(job, program)["alpha"] > 0.0
    shares = np.where(free, np.resize([0.5, 0.35, 0.49, 0.0], len(free)), 0.0)
    rows = replace(program.robots["alpha"], rounding=shares)
    job = replace(job, programs=(replace(program, robots={"alpha": rows}),))

    (read,) = read_back(FANUC_LS, job)

    np.testing.assert_array_equal(read.robots["alpha"].rounding, np.where(shares == 0.5, 0.5, 0.0))
    assert "CNT" not in FANUC_LS.render(one_arm(FANUC, blend=0.35))["ALPHA.ls"]


def test_a_group_that_stands_does_not_stop_the_others() -> None:
    job = group_job(blend=0.5)
    (program,) = job.programs
    table = program.robots["gamma"]
    stands = replace(program, robots={**program.robots, "gamma": replace(table, q=np.tile(table.q[:1], (20, 1)))})

    (read,) = read_back(FANUC_LS, replace(job, programs=(stands,)))

    assert not np.any(moves(stands.robots["gamma"]))
    assert np.count_nonzero(read.robots["alpha"].rounding) > 10


def test_decimals_frames_and_the_group_of_the_robot_hold() -> None:
    arm = controlled("alpha", arm_model(), decimals=3, tool_number=3, base_number=2, group=2)
    cell = cell_of(arm, kind=FANUC)
    job = counted(job_of(cell, random_program(cell)))

    text = FANUC_LS.render(job)["ALPHA.ls"]

    assert "DEFAULT_GROUP = *,1,*,*,*;" in text
    assert "UFRAME_NUM[GP2]=2 ;" in text
    assert "UTOOL_NUM[GP2]=3 ;" in text
    assert re.search(r"   GP2:\s+UF : 2, UT : 3,\s+J1 = -?\d+\.\d{3} deg,", text)
    checked(FANUC_LS.render(job))
    assert read_back(FANUC_LS, job)


NAMES = ("Schweißroboter_Süd", "a" * 40, "a" * 39 + "b", "con", "LPT1", "3rd", "weld_001", "weld", 'a;b]]>--"', "")


def test_names_of_any_kind_become_names_of_programs() -> None:
    cell = cell_of(controlled("alpha", arm_model()), kind=FANUC)
    programs = [random_program(cell, rows=9, seed=seed, name=name) for seed, name in enumerate(NAMES)]
    job = counted(job_of(cell, *programs, split=4, notes=NAMES))

    files = FANUC_LS.render(job)

    checked(files)
    assert len(files) == len(NAMES) * 4
    assert "ALPHA_SCHWEISSROBOTER_SUED.ls" in files
    assert [program.name for program in FANUC_LS.read(job.frame, files)] == list(NAMES)


def test_robots_with_names_of_any_kind_do_too() -> None:
    names = [name or "x" for name in NAMES]
    cell = cell_of(*(controlled(name, arm_model()) for name in names), kind=FANUC)
    job = counted(job_of(cell, random_program(cell, rows=5, marks=(2,))))

    files = FANUC_LS.render(job)

    checked(files)
    assert len(files) == len(names)
    assert set(FANUC_LS.read(job.frame, files)[0].robots) == set(names)


def test_robots_of_one_controller_that_are_not_in_step_have_programs_of_their_own() -> None:
    job = group_job(promise=Promise.SEQUENCE_ONLY)

    files = FANUC_LS.render(job)

    checked(files)
    masks = {path: re.findall(r"DEFAULT_GROUP = (\S+);", text) for path, text in files.items()}
    assert masks == {"ALPHA.ls": ["1,*,*,*,*"], "BETA.ls": ["*,*,1,*,*"], "GAMMA.ls": ["*,1,*,*,*"]}


def test_robots_of_other_makers_are_left_to_their_formats() -> None:
    job = waiting_job()
    controllers = dict(job.frame.cell.controllers)
    controllers["beta_controller"] = controllers["beta_controller"].changed(kind="abb")
    job = replace(job, frame=replace(job.frame, cell=replace(job.frame.cell, controllers=controllers)))

    assert set(FANUC_LS.render(job)) == {"ALPHA.ls"}
    assert set(read_back(FANUC_LS, job)[0].robots) == {"alpha"}


def refused(model: RobotModel, *, is_counted: bool = True, **control: object) -> str:
    """Why a robot cannot be written."""
    cell = cell_of(controlled("alpha", model, **control), controlled("beta", positioner_model()), kind=FANUC)
    job = job_of(cell, random_program(cell, marks=(3,)))
    with pytest.raises(InputError) as error:
        FANUC_LS.render(counted(job) if is_counted else job)
    return str(error.value)


@pytest.mark.parametrize("signal", ["doStart", "0", "-1", "1.5", "", "１"])
def test_signals_without_a_number_are_refused(signal: str) -> None:
    handshake = HandshakeEntry.model_construct(output="3", inputs={"beta": signal})

    assert refused(arm_model(), handshake=handshake).startswith(
        "robots.alpha.controller.handshake.inputs.beta: expected a whole number from 1"
    )


def test_what_a_cell_lacks_is_refused_at_its_key() -> None:
    key = "robots.alpha.controller"
    assert refused(arm_model(), is_counted=False).startswith(f"{key}_zero: expected how the controller counts axis 3")
    assert refused(arm_model(), tool_number=0) == f"{key}.tool_number: expected a number from 1 to 10, got 0"
    assert refused(arm_model(), base_number=10) == f"{key}.base_number: expected a number from 0 to 9, got 10"
    assert refused(arm_model(), id="beta_controller") == (
        f"{key}.group: expected the number of its motion group, as 'beta_controller' moves 2 robots, got none\n"
        "robots.beta.controller.group: expected the number of its motion group, as 'beta_controller' moves 2 robots, "
        "got none"
    )


def test_robots_in_step_on_two_controllers_are_refused() -> None:
    job = waiting_job(promise=Promise.SYNCHRONISED, marks=())

    with pytest.raises(InputError, match=r"expected at least two robots on one controller .* got 2 on 2"):
        FANUC_LS.render(job)


@pytest.mark.parametrize("late", [0.0, 40.0])
def test_rows_too_near_or_too_far_from_one_another_are_refused(late: float) -> None:
    job = group_job()
    (program,) = job.programs
    times = np.concatenate([program.robots["alpha"].times[:-1], [program.robots["alpha"].times[-2] + late + 1e-4]])
    robots = {name: replace(rows, times=times) for name, rows in program.robots.items()}

    with pytest.raises(InputError, match=r"expected rows 1 to 32000 ms apart, got "):
        FANUC_LS.render(replace(job, programs=(replace(program, robots=robots),)))


@pytest.mark.parametrize(
    "variant",
    [
        lambda text: text.replace("\r\n", "\n"),
        lambda text: text.replace("\r\n", "\r\n\r\n"),
        lambda text: text.replace(" ;\r\n", "    ;\r\n").replace("    UF", "\tUF").replace(", J", ",\t J"),
        lambda text: text.replace(" = ", "\t\t= ").replace("J P[", "J  P [ "),
        lambda text: re.sub(r" = (-?)0\.(\d+) deg", r" = \1.\2 deg", text).replace("CNT100", "CNT 50"),
        lambda text: text.replace("/MN\r\n", "/APPL\r\n/MN\r\n"),
        lambda text: text.replace(
            "OWNER = MNEDITOR;",
            "OWNER = MNEDITOR;\r\nPROG_SIZE = 735;\r\nCREATE = DATE 14-12-22  TIME 10:36:46;\r\nFILE_NAME = ;\r\n"
            "VERSION = 0;\r\nMEMORY_SIZE = 1087;",
        ),
        lambda text: re.sub(r"(?m)^ *(\d+):", lambda match: f"{10 * int(match[1])}:", text),
        lambda text: text.replace(" P[2]", " P[99]").replace("\nP[2]", "\nP[99]"),
        lambda text: re.sub(r"! promise[^;]*", "!", text),
        lambda text: re.sub(r"(?s)(P\[1\]\{.*?\};\r\n)(P\[2\]\{.*?\};\r\n)", r"\2\1", text),
    ],
)
def test_harmless_variants_are_read_to_the_same_rows(variant) -> None:
    for job in (waiting_job(blend=0.5), group_job(blend=0.5)):
        files = FANUC_LS.render(job)
        changed = {path: variant(text) for path, text in files.items()}

        assert changed != files
        for robot, rows in FANUC_LS.read(job.frame, files)[0].robots.items():
            again = FANUC_LS.read(job.frame, changed)[0].robots[robot]
            assert np.array_equal(again.q, rows.q)
            assert np.array_equal(again.rounding, rows.rounding)
            assert again.marks == rows.marks


def test_a_program_written_by_hand_is_read() -> None:
    cell = cell_of(
        controlled("weld", arm_model(), id="r30", group=1, tool_number=2),
        controlled("table", positioner_model(), id="r30", group=2),
        kind=FANUC,
    )
    program = random_program(cell)
    frame = job_of(cell, program, promise=Promise.SYNCHRONISED).frame
    text = """/PROG  R30
/ATTR
OWNER\t\t= MNEDITOR;
COMMENT\t\t= "by hand";
CREATE\t\t= DATE 26-06-12  TIME 05:43:56;
TCD:  STACK_SIZE\t= 0,
      TASK_PRIORITY\t= 50,
      PAUSE_REQUEST\t= 0;
DEFAULT_GROUP\t= 1,1,*,*,*;
/MN
   1:  !two groups ;
   2:   ;
   3:  UTOOL_NUM[GP1]=2 ;
   4:  UFRAME_NUM=0 ;
   5:  UFRAME_NUM[GP2]=0 ;
   6:  UTOOL_NUM[GP2]=1 ;
   8:J P[1] 25% FINE    ;
   9:J P[7] 1.5sec CNT100    ;
  10:J P[2] 250msec FINE    ;
/POS
P[1]{
   GP1:
\tUF : 0, UT : 2,\t
\tJ1=    10.000 deg,\tJ2=   -90.000 deg,\tJ3=    90.000 deg,
\tJ4=      .000 deg,\tJ5=      .000 deg,\tJ6=      .000 deg
   GP2:
\tUF : 0, UT : 1,\t
\tJ1=   -30.000 deg,\tJ2=     5.000 deg
};
P[2]{
   GP1:
\tUF : 0, UT : 2,\t
\tJ1=    12.000 deg,\tJ2=   -70.000 deg,\tJ3=    80.000 deg,
\tJ4=     0.000 deg,\tJ5=     0.000 deg,\tJ6=     3.000 deg
   GP2:
\tUF : 0, UT : 1,\t
\tJ1=   -25.000 deg,\tJ2=     6.000 deg
};
P[7]{
   GP1:
\tUF : 0, UT : 2,\t
\tJ1=    11.250 deg,\tJ2=   -80.000 deg,\tJ3=    85.000 deg,
\tJ4=     0.000 deg,\tJ5=     0.000 deg,\tJ6=     1.500 deg
   GP2:
\tUF : 0, UT : 1,\t
\tJ1=   -27.000 deg,\tJ2=     5.500 deg
};
/END
"""

    (read,) = FANUC_LS.read(frame, {"R30.ls": text})

    arm = [[10, -90, 90, 0, 0, 0], [11.25, -80, 85, 0, 0, 1.5], [12, -70, 80, 0, 0, 3]]
    assert np.allclose(np.rad2deg(read.robots["weld"].q), arm, atol=1e-12)
    assert np.allclose(np.rad2deg(read.robots["table"].q), [[-30, 5], [-27, 5.5], [-25, 6]], atol=1e-12)
    assert np.allclose(read.robots["weld"].times, [0.0, 1.5, 1.75])
    assert read.robots["table"].rounding.tolist() == [0.0, 0.5, 0.0]
