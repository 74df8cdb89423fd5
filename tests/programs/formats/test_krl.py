"""KUKA programs: what is written is read back as it was, keeps the rules of the language, and nothing else is read."""

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from builders.export_jobs import (
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
    two_arms,
    zero_of,
)
from builders.scene_builders import arm_model

from cellplan.errors import InputError
from cellplan.model.report.exported import ExportJob, Promise, RobotRows
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.controllers import HandshakeEntry
from cellplan.programs.elements.corners import row_shares
from cellplan.programs.formats.krl.writer import KRL

KUKA = "kuka"
QUANTUM = np.deg2rad(1e-5)


def checked(files: dict[str, str]) -> None:
    """The rules of the language, from the texts alone."""
    stems = {path.rpartition(".")[0] for path in files}
    assert {f"{stem}{ending}" for stem in stems for ending in (".src", ".dat")} == set(files)
    for path, text in files.items():
        name = path.rpartition("/")[2][:-4]
        lines = text.split("\r\n")
        assert lines.pop() == ""
        assert all(re.fullmatch(r"[ -~]*", line) and len(line) <= 471 for line in lines)
        assert re.fullmatch(r"[A-Za-z]\w{0,23}", name)
        code = [line for line in lines if not line.startswith((";", "&"))]
        is_source = path.endswith(".src")
        assert code[0] == (f"DEF {name}()" if is_source else f"DEFDAT {name}")
        assert code[-1] == ("END" if is_source else "ENDDAT")
        assert not re.search(r"\d[eE][-+]?\d|-0\.0+\b(?!\d)", " ".join(code))
        _check_source(files, path, code[1:-1]) if is_source else _check_data(code[1:-1])


def _check_source(files: dict[str, str], path: str, code: list[str]) -> None:
    declared = [line for line in code if line.startswith("EXT ")]
    assert code[: len(declared)] == declared
    assert not any("=" in line for line in declared)
    calls = [line for line in code if re.fullmatch(r"\w+\(\)", line)]
    assert [f"EXT {call}" for call in calls] == declared
    assert all(f"{path.rpartition('/')[0]}/{call[:-2]}.src".lstrip("/") in files for call in calls)
    points = re.findall(r"E6AXIS (\w+)=", files[f"{path[:-4]}.dat"])
    moves = [line.split()[1] for line in code if line.startswith("PTP ")]
    assert moves == points
    assert not any(word in " ".join(code) for word in ("SPTP", "SPLINE", "LIN", "CIRC"))
    speeds = [int(value) for line in code for value in re.findall(r"#VEL_PTP,(\d+)", line)]
    assert all(0 < speed <= 100 for speed in speeds)
    if moves:
        assert not [line for line in code if line.startswith("PTP")][-1].endswith("C_PTP")


def _check_data(code: list[str]) -> None:
    axes = [*(f"A{k}" for k in range(1, 7)), *(f"E{k}" for k in range(1, 7))]
    for line in code:
        components = re.fullmatch(r"DECL E6AXIS \w+=\{(.*)\}", line)
        assert components is not None
        assert [part.split()[0] for part in components[1].split(",")] == axes


@pytest.mark.parametrize("make", [one_arm, arm_on_a_rail, two_arms])
@pytest.mark.parametrize("changes", [{}, {"split": 6}, {"blend": 0.3}, {"blend": 0.5, "split": 7}], ids=str)
def test_rows_come_back_to_the_rounding_and_files_keep_the_rules(make, changes) -> None:
    job = make(KUKA, seed=3, **changes)

    files = KRL.render(job)
    (read,) = KRL.read(job.frame, files)

    checked(files)
    assert files == KRL.render(job)  # the same bytes again
    for robot, rows in job.programs[0].robots.items():
        assert read.robots[robot].marks == rows.marks
        assert largest_deviation(job, (read,), robot) <= 2.0 * QUANTUM  # the coupled axis adds that of the other one


def limit_jobs(count: int) -> list[ExportJob]:
    """Jobs of rows on the limits, half of them of robots whose third axis is counted with the second."""
    jobs = []
    for seed in range(count):
        model = drawn_limits(arm_model(), np.random.default_rng(seed))
        model = replace(model, controller=zero_of(6, coupling=(-1.0) ** seed)) if seed % 2 else model
        cell = cell_of(controlled("alpha", model), kind=KUKA)
        jobs.append(job_of(cell, random_program(cell, rows=25, seed=seed, at_limit=True)))
    return jobs


def assert_inside(job: ExportJob, *, quanta: float) -> None:
    (read,) = read_back(KRL, job)
    model, q = job.frame.robot("alpha").model, read.robots["alpha"].q
    assert np.all((q >= model.lower) & (q <= model.upper))
    assert largest_deviation(job, (read,), "alpha") <= quanta * QUANTUM


def test_rows_on_the_limits_stay_inside() -> None:
    for job in limit_jobs(8):
        assert_inside(job, quanta=4.0)  # moved inwards, and the coupled axis with it


@pytest.mark.slow
def test_a_hundred_thousand_rows_on_the_limits_stay_inside() -> None:
    for seed, job in enumerate(limit_jobs(20)):
        program = random_program(job.frame.cell, rows=5000, seed=seed, at_limit=True)
        assert_inside(replace(job, programs=(program,)), quanta=4.0)


def test_a_rail_is_the_first_external_axis_in_millimetres() -> None:
    job = arm_on_a_rail(KUKA)

    data = KRL.render(job)["alpha.dat"]

    written = [float(value) for value in re.findall(r"E1 (-?[\d.]+)", data)]
    assert np.allclose(written, 1e3 * job.programs[0].robots["alpha"].q[:, 0], atol=1e-5)


def test_decimals_of_the_robot_hold() -> None:
    cell = cell_of(controlled("alpha", arm_model(), decimals=3), kind=KUKA)
    job = job_of(cell, random_program(cell))

    assert re.search(r"\{A1 -?\d+\.\d{3},", KRL.render(job)["alpha.dat"])


def test_rows_are_rounded_in_process_too_but_not_where_something_happens() -> None:
    job = two_arms(KUKA, marks=(0, 7, 19), blend=0.3, split=13)  # process from row 5 to row 10

    files = KRL.render(job)

    text = files["alpha_001.src"] + files["alpha_002.src"]
    rounded = [int(number) - 1 for number in re.findall(r"PTP XP(\d+) C_PTP", text)]
    assert rounded == sorted({*range(20)} - {0, 5, 7, 10, 12, 19})
    (read,) = KRL.read(job.frame, files)
    np.testing.assert_allclose(read.robots["alpha"].rounding, 0.3 * np.isin(np.arange(20), rounded))
    assert [re.findall(r"APO.CPTP=(\d+)", files[f"alpha{page}.src"]) for page in ("", "_001", "_002")] == [
        [],
        ["60"],
        ["60"],
    ]


def test_each_row_may_have_a_share_of_its_own() -> None:
    job = one_arm(KUKA, blend=0.5)
    (program,) = job.programs
    free = row_shares(job, program)["alpha"] > 0.0
    shares = np.where(free, np.resize([0.5, 0.5, 0.1, 0.0, 0.052], len(free)), 0.0)
    rows = replace(program.robots["alpha"], rounding=shares)
    job = replace(job, programs=(replace(program, robots={"alpha": rows}),))

    files = KRL.render(job)

    (read,) = KRL.read(job.frame, files)
    np.testing.assert_allclose(read.robots["alpha"].rounding, np.floor(200.0 * shares + 1e-9) / 200.0)
    stated = re.findall(r"APO.CPTP=(\d+)", files["alpha.src"])
    assert set(stated) == {"100", "20", "10"}
    assert all(one != other for one, other in pairwise(stated))


@pytest.mark.parametrize(("blend", "percent"), [(0.0, None), (0.004, None), (0.005, 1), (0.05, 10), (0.5, 100)])
def test_a_share_of_the_segment_is_half_as_many_percent(blend: float, percent: int | None) -> None:
    text = KRL.render(one_arm(KUKA, blend=blend))["alpha.src"]

    assert ("C_PTP" in text) == (percent is not None)
    assert re.findall(r"\$APO.CPTP=(\d+)", text) == ([] if percent is None else [str(percent)])


def test_tool_and_base_are_those_of_the_cell() -> None:
    cell = cell_of(controlled("alpha", arm_model(), tool_number=3, base_number=2), kind=KUKA)
    job = job_of(cell, random_program(cell))

    text = KRL.render(job)["alpha.src"]

    assert "$TOOL=TOOL_DATA[3]" in text
    assert "$BASE=BASE_DATA[2]" in text
    assert KRL.read(job.frame, KRL.render(job))


def test_speeds_are_those_of_the_plan() -> None:
    job = one_arm(KUKA)
    rows = job.programs[0].robots["alpha"]
    q = np.zeros((4, 6))
    q[1:, 0] = [0.5, 0.5, 0.75]  # 0.5 rad in 1 s, none, 0.25 rad in 1 s; the top speed is 5 rad/s
    rows = replace(rows, q=q, times=np.arange(4.0), process=None)
    program = replace(job.programs[0], robots={"alpha": rows})

    text = KRL.render(replace(job, programs=(program,)))["alpha.src"]

    assert re.findall(r"(?:#VEL_PTP,\d+|PTP XP\d)", text) == [
        "#VEL_PTP,10",
        "PTP XP1",
        "PTP XP2",
        "PTP XP3",
        "#VEL_PTP,5",
        "PTP XP4",
    ]


NAMES = (
    "Schweißroboter_Süd",
    "a" * 40,
    "a" * 39 + "b",
    "DEF",
    "if",
    "3rd",
    "XP7",
    "weld_001",
    "weld",
    "a;b]]>--\"'",
    "",
)


def test_names_of_any_kind_become_names_of_modules() -> None:
    cell = cell_of(controlled("alpha", arm_model()), kind=KUKA)
    programs = [random_program(cell, rows=9, seed=seed, name=name) for seed, name in enumerate(NAMES)]
    job = job_of(cell, *programs, split=4, notes=NAMES)

    files = KRL.render(job)

    checked(files)
    assert len(files) == len(NAMES) * 8
    assert len({path.lower() for path in files}) == len(files)
    assert "alpha/Schweissroboter_Sued.src" in files
    assert [program.name for program in KRL.read(job.frame, files)] == list(NAMES)


def test_robots_with_names_of_any_kind_do_too() -> None:
    names = [name or "x" for name in NAMES]
    cell = cell_of(*(controlled(name, arm_model()) for name in names), kind=KUKA)
    job = job_of(cell, random_program(cell, rows=5, marks=(2,)))

    files = KRL.render(job)

    checked(files)
    assert len(files) == 2 * len(names)
    assert set(KRL.read(job.frame, files)[0].robots) == set(names)


def test_robots_of_other_makers_are_left_to_their_formats() -> None:
    job = two_arms(KUKA)
    controllers = dict(job.frame.cell.controllers)
    controllers["beta_controller"] = controllers["beta_controller"].changed(kind="abb")
    cell = replace(job.frame.cell, controllers=controllers)
    job = replace(job, frame=replace(job.frame, cell=cell))

    assert set(KRL.render(job)) == {"alpha.src", "alpha.dat"}
    assert set(read_back(KRL, job)[0].robots) == {"alpha"}


def refused(model: RobotModel, **control: object) -> str:
    """Why a robot cannot be written."""
    cell = cell_of(controlled("alpha", model, **control), controlled("beta", arm_model()), kind=KUKA)
    with pytest.raises(InputError) as error:
        KRL.render(job_of(cell, random_program(cell, marks=(3,))))
    return str(error.value)


@pytest.mark.parametrize("signal", ["doStart", "0", "-1", "1.5", "8193", "", "１"])
def test_signals_without_a_number_are_refused(signal: str) -> None:
    wrong_output = refused(arm_model(), handshake=HandshakeEntry.model_construct(output=signal, inputs={"beta": "3"}))
    wrong_input = refused(arm_model(), handshake=HandshakeEntry.model_construct(output="3", inputs={"beta": signal}))

    assert wrong_output.startswith("robots.alpha.controller.handshake.output: expected a whole number")
    assert wrong_input.startswith("robots.alpha.controller.handshake.inputs.beta: expected a whole number")


def test_robots_that_are_no_arm_are_refused() -> None:
    assert refused(positioner_model()).startswith("robots.alpha: expected an arm of six axes, got 2 axes")


def test_a_robot_without_a_controller_or_with_that_of_another_maker_is_refused() -> None:
    job = one_arm(KUKA)
    robot = job.frame.cell.robots[0]
    without = replace(job.frame, cell=replace(job.frame.cell, robots=(replace(robot, control=None),)))
    other = one_arm("abb")

    with pytest.raises(InputError, match=r"robots.alpha.controller: expected the controller that plays krl, got none"):
        KRL.render(replace(job, frame=without))
    with pytest.raises(InputError, match=r"robots.alpha.controller: expected a controller that plays krl .* got 'abb'"):
        KRL.render(other)


def test_too_many_pages_are_refused() -> None:
    with pytest.raises(InputError, match="--split: expected at most 999 pages, got 1001 of 1 of 1001 rows"):
        KRL.render(one_arm(KUKA, rows=1001, split=1))


def test_robots_may_keep_other_rows_but_meet_equally_often() -> None:
    job = two_arms(KUKA, marks=(0, 7, 19), split=8)
    both = job.programs[0].robots
    few = RobotRows(robot="beta", q=both["beta"].q[:3], times=both["beta"].times[:3], marks=(0, 1, 2))
    job = replace(job, programs=(replace(job.programs[0], robots={**both, "beta": few}),))
    never = replace(job, programs=(replace(job.programs[0], robots={**both, "beta": replace(few, marks=())}),))

    files = KRL.render(job)
    (read,) = KRL.read(job.frame, files)

    checked(files)
    assert [(len(rows), rows.marks) for rows in read.robots.values()] == [(20, (0, 7, 19)), (3, (0, 1, 2))]
    with pytest.raises(InputError, match="expected rows, and equal marks, got 20 and 3 of 'alpha', 3 and 0 of 'beta'"):
        KRL.render(never)


def test_the_format_promises_one_arm_in_step_and_else_the_sequence_only() -> None:
    assert KRL.promises == (Promise.SYNCHRONISED, Promise.PACED, Promise.SEQUENCE_ONLY)
    assert KRL.most_arms == 1
    assert KRL.is_thinned


@pytest.mark.parametrize(
    "variant",
    [
        lambda text: text.lower(),
        lambda text: text.replace("\r\n", "\n"),
        lambda text: text.replace("\r\n", "\r\n\r\n; a remark {A1 9}\r\n"),
        lambda text: text.replace("(", " ( ").replace(")", " ) ").replace("=", " = ").replace(",", " , "),
        lambda text: re.sub(r"(?m)^(?=[A-Z$])", "\t  ", text).replace("{", "{ ").replace("}", " } ; point"),
        lambda text: text.replace("DECL E6AXIS", "E6AXIS").replace("={", "={E6AXIS: "),
        lambda text: text.replace("&REL 1", "&REL 12\r\n&PARAM EDITMASK = *\r\n&PARAM TEMPLATE = C:\\KRC\\vorgabe"),
        lambda text: text.replace("BAS(#INITMOV,0)", ";FOLD INI;%{PE}\r\n  BAS (#INITMOV,0 )\r\n;ENDFOLD (INI)"),
        lambda text: text.replace("BAS(#INITMOV", "EXT BAS (BAS_COMMAND :IN,REAL :IN )\r\nBAS(#INITMOV"),
        lambda text: text.replace("WAIT FOR $IN[101]", "WAIT FOR $IN[101]==TRUE").replace(
            "WAIT FOR NOT $IN[101]", "WAIT FOR $IN[101] == FALSE"
        ),
        lambda text: re.sub(r"XP(\d+)", r"P_\1", text),
        lambda text: re.sub(r",E1.*?(?=\})", "", text),
        lambda text: re.sub(r"(A1 [-\d.]+),(A2 [-\d.]+)", r"\2,\1", text),
        lambda text: text.replace("DEFDAT alpha", "DEFDAT alpha PUBLIC"),
    ],
)
def test_harmless_variants_are_read_to_the_same_rows(variant) -> None:
    job = two_arms(KUKA, blend=0.3)
    files = KRL.render(job)
    changed = {path: variant(text) for path, text in files.items()}

    assert changed != files
    for robot, rows in KRL.read(job.frame, files)[0].robots.items():
        again = KRL.read(job.frame, changed)[0].robots[robot]
        assert np.array_equal(again.q, rows.q)
        assert again.marks == rows.marks


def test_a_program_written_by_hand_is_read() -> None:
    cell = cell_of(controlled("weld", arm_model()), kind=KUKA)
    frame = job_of(cell, random_program(cell)).frame
    source = """&ACCESS RVP
&COMMENT by hand
def weld ( )
;FOLD INI
  bas (#initmov,0)
;ENDFOLD
  $advance = 5   ; look ahead
  $base=$nullframe
  $tool = $NullFrame
  $apo.cptp = 50

  bas(#vel_ptp, 12.5)
  ptp start
  PTP Middle c_ptp
  ptp XP9
end
"""
    data = """defdat weld
decl e6axis START={a1 10,a2 -90.0,a3 +90,a4 0.0,a5 0.0,a6 0.0,e1 0.0}
DECL E6AXIS middle={A6 1.5,A1 11.25,A2 -80.0,A3 85,A4 0.0,A5 0.0,E1 0}
E6AXIS xp9={A1 12,A2 -70,A3 80,A4 0,A5 0,A6 3,E1 0.000}
enddat
"""

    (read,) = KRL.read(frame, {"weld.src": source, "weld.dat": data})

    expected = [[10, -90, 90, 0, 0, 0], [11.25, -80, 85, 0, 0, 1.5], [12, -70, 80, 0, 0, 3]]
    assert np.allclose(np.rad2deg(read.robots["weld"].q), expected, atol=1e-12)
    assert read.robots["weld"].times is None
