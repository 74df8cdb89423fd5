"""VAL3 projects: what is written is read back as it was, keeps the rules of the language, and nothing else is read."""

import re
from dataclasses import replace
from xml.etree import ElementTree as ET

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
from cellplan.geometry.transforms import pose_from, rotation_about, rotation_exp
from cellplan.model.cell.cell import Tool
from cellplan.model.report.exported import ExportJob, Promise, RobotRows
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.controllers import HandshakeEntry
from cellplan.programs.formats.val3.writer import VAL3
from cellplan.scene.kinematics.screw_chain import ScrewChain

STAUBLI = "staubli"
QUANTUM = np.deg2rad(1e-5)
DATA = "{http://www.staubli.com/robotics/VAL3/Data/2}"
PROJECT = "{http://www.staubli.com/robotics/VAL3/Project/3}"
PROGRAM = "{http://www.staubli.com/robotics/VAL3/Program/2}"
TYPE = "{http://www.w3.org/2001/XMLSchema-instance}type"


def parsed(text: str) -> ET.Element:
    return ET.fromstring(text)  # noqa: S314 (written by this test)


def checked(files: dict[str, str]) -> None:
    """The rules of the language, from the texts alone."""
    for path, text in files.items():
        assert text.endswith("\n")
        assert all(re.fullmatch(r"[ -~]*", line) for line in text.split("\n"))
        assert not re.search(r'"-0\.0*"|"-?[\d.]+[eE]', text)
        assert len(path.rpartition("/")[2].rpartition(".")[0]) < 16
    for path in [path for path in files if path.endswith(".pjx")]:
        folder, _, name = path.removesuffix(".pjx").rpartition("/")
        assert folder.rpartition("/")[2] == name
        project = parsed(files[path])
        assert project.tag == f"{PROJECT}Project"
        programs = [entry.get("file") for entry in project.iter(f"{PROJECT}Program")]
        listed = [*programs, *(entry.get("file") for entry in project.iter(f"{PROJECT}Data")), f"{name}.pjx"]
        assert sorted(f"{folder}/{file}" for file in listed) == sorted(p for p in files if p.startswith(f"{folder}/"))
        assert {"start.pgx", "stop.pgx"} <= set(programs)
        _check_project({file: files[f"{folder}/{file}"] for file in programs}, files[f"{folder}/{name}.dtx"])


def _check_project(programs: dict[str, str], data: str) -> None:
    arrays = {entry.get("name"): entry for entry in parsed(data).iter(f"{DATA}Data")}
    for name, entry in arrays.items():
        assert len(name) < (14 if entry.get("type") == "tool" else 16)
        assert entry.get(TYPE) == "array"
        assert [value.get("key") for value in entry] == [str(key) for key in range(int(entry.get("size")))]
        assert entry.get("type") != "tool" or entry[0].get("fatherId") == "flange[0]"
    moved: dict[str, list[int]] = {}
    for file, text in programs.items():
        program = parsed(text).find(f"{PROGRAM}Program")
        assert program.get("name") == file.removesuffix(".pgx")
        code = [line.strip() for line in program.find(f"{PROGRAM}Code").text.split("\n")]
        assert (code[0], code[-1]) == ("begin", "end")
        for line in code:
            for joints, key, tool, descriptor, place in re.findall(
                r"movej\((\w+)\[(\d+)\],(\w+)\[0\],(\w+)\[(\d+)\]\)", line
            ):
                moved.setdefault(joints, []).append(int(key))
                assert arrays[tool].get("type") == "tool"
                assert arrays[descriptor].get("type") == "mdesc"
                assert int(place) < len(arrays[descriptor])
            for name in re.findall(r"wait\((\w+)==|^(\w+)=(?:true|false)$", line):
                assert arrays["".join(name)].get("type") == "dio"
            for name in re.findall(r"call (\w+)\(\)", line):
                assert f"{name}.pgx" in programs
    assert moved == {name: list(range(len(a))) for name, a in arrays.items() if a.get("type") == "jointRx"}


@pytest.mark.parametrize("make", [one_arm, two_arms])
@pytest.mark.parametrize("changes", [{}, {"split": 6}, {"blend": 0.3}, {"blend": 0.5, "split": 7}], ids=str)
def test_rows_come_back_to_the_rounding_and_files_keep_the_rules(make, changes) -> None:
    job = make(STAUBLI, seed=3, **changes)

    files = VAL3.render(job)
    (read,) = VAL3.read(job.frame, files)

    checked(files)
    assert files == VAL3.render(job)  # the same bytes again
    for robot, rows in job.programs[0].robots.items():
        assert read.robots[robot].marks == rows.marks
        assert largest_deviation(job, (read,), robot) <= 2.0 * QUANTUM  # the coupled axis adds that of the other one


def limit_jobs(count: int) -> list[ExportJob]:
    """Jobs of rows on the limits, half of them of robots whose third axis is counted with the second."""
    jobs = []
    for seed in range(count):
        model = drawn_limits(arm_model(), np.random.default_rng(seed))
        model = replace(model, controller=zero_of(6, coupling=(-1.0) ** seed)) if seed % 2 else model
        cell = cell_of(controlled("alpha", model), kind=STAUBLI)
        jobs.append(job_of(cell, random_program(cell, rows=25, seed=seed, at_limit=True)))
    return jobs


def assert_inside(job: ExportJob) -> None:
    (read,) = read_back(VAL3, job)
    model, q = job.frame.robot("alpha").model, read.robots["alpha"].q
    assert np.all((q >= model.lower) & (q <= model.upper))
    assert largest_deviation(job, (read,), "alpha") <= 4.0 * QUANTUM  # moved inwards, and the coupled axis with it


def test_rows_on_the_limits_stay_inside() -> None:
    for job in limit_jobs(8):
        assert_inside(job)


@pytest.mark.slow
def test_a_hundred_thousand_rows_on_the_limits_stay_inside() -> None:
    for seed, job in enumerate(limit_jobs(20)):
        program = random_program(job.frame.cell, rows=5000, seed=seed, at_limit=True)
        assert_inside(replace(job, programs=(program,)))


def test_decimals_of_the_robot_hold() -> None:
    cell = cell_of(controlled("alpha", arm_model(), decimals=3), kind=STAUBLI)
    job = job_of(cell, random_program(cell))

    assert re.search(r'j1="-?\d+\.\d{3}"', VAL3.render(job)["alpha/alpha.dtx"])


def test_rows_are_left_and_reached_within_their_share_and_stops_stay() -> None:
    """By other kinematics: no point of both segments beyond the share is nearer to the row than what is stated."""
    job = two_arms(STAUBLI, marks=(0, 7, 19), blend=0.3, split=13)  # process from row 5 to row 10
    rng = np.random.default_rng(3)
    robots = {
        name: replace(rows, q=0.5 * rows.q[:1] + np.cumsum(rng.uniform(-0.01, 0.01, rows.q.shape), axis=0))
        for name, rows in job.programs[0].robots.items()
    }
    job = replace(job, programs=(replace(job.programs[0], robots=robots),))
    files = VAL3.render(job)

    (read,) = VAL3.read(job.frame, files)

    shares, q = read.robots["alpha"].rounding, job.programs[0].robots["alpha"].q
    assert np.flatnonzero(shares == 0.0).tolist() == [0, 5, 7, 10, 12, 19]
    assert np.all(shares <= 0.3 + 1e-6)
    data = files["alpha/alpha.dtx"]
    moves = re.findall(r"mMove\[(\d+)\]", files["alpha/alpha_001.pgx"] + files["alpha/alpha_002.pgx"])
    sizes = re.findall(r'vel="\d+".*blend="(\w+)" leave="([\d.]+)" reach="([\d.]+)"', data)
    tips = ScrewChain(job.frame.robot("alpha")).tool_poses
    for row in np.flatnonzero(shares > 0.0):
        blend, leave, reach = sizes[int(moves[row])]
        assert (blend, leave) == ("joint", reach)
        for other in (row - 1, row + 1):
            beyond = q[row] + np.linspace(0.3, 1.0, 50)[:, None] * (q[other] - q[row])
            away = np.linalg.norm(tips(beyond)[:, :3, 3] - tips(q[None, row])[:, :3, 3], axis=1)
            assert 1e3 * away.min() >= float(leave) - 1e-3


def test_a_row_that_is_not_rounded_ends_in_a_stop() -> None:
    files = VAL3.render(one_arm(STAUBLI, blend=0.0))

    assert set(re.findall(r'blend="(\w+)"', files["alpha/alpha.dtx"])) == {"off"}


@pytest.mark.parametrize("wide", ["leave", "reach"])
def test_a_larger_distance_is_read_as_a_larger_share(wide: str) -> None:
    job = one_arm(STAUBLI, blend=0.1)
    files = VAL3.render(job)
    data = re.sub(rf'(blend="joint".*{wide}=")[\d.]+', r"\g<1>9000", files["alpha/alpha.dtx"])

    before, after = (
        VAL3.read(job.frame, entry)[0].robots["alpha"].rounding for entry in (files, {**files, "alpha/alpha.dtx": data})
    )

    assert np.any(before > 0.0)
    np.testing.assert_allclose(after[before > 0.0], 0.5)


def test_signals_come_after_the_robot_stands() -> None:
    code = VAL3.render(two_arms(STAUBLI))["beta/start.pgx"].split("\n")

    for place, line in enumerate(code):
        if line.strip() == "doMark=true":
            assert code[place - 1].strip() == "waitEndMove()"
            assert code[place - 2].strip().startswith("movej(jRow[")


def test_signals_are_links_and_numbers_are_those_of_the_first_board() -> None:
    handshake = HandshakeEntry.model_construct(output=r"ModbusSrv-0\%Q3", inputs={"beta": "7"})
    cell = cell_of(controlled("alpha", arm_model(), handshake=handshake), controlled("beta", arm_model()), kind=STAUBLI)
    job = job_of(cell, random_program(cell, marks=(4,)))

    files = VAL3.render(job)

    links = re.findall(r'link="([^"]*)"', files["alpha/alpha.dtx"])
    assert links == [r"BasicIO-1\%I7", r"ModbusSrv-0\%Q3"]
    assert VAL3.read(job.frame, files)[0].robots["alpha"].marks == (4,)


@pytest.mark.parametrize(
    ("output", "entry", "names"),
    [
        ("doThere", "diGo", ["diGo", "doThere"]),
        ("start", "tTool", ["diMark1", "doMark"]),  # a program, and the data of the tool
        ("usr", "USR", ["USR", "doMark"]),
        ("jRow_001", "a" * 16, ["diMark1", "doMark"]),
    ],
)
def test_signals_with_names_keep_them_where_these_are_free(output: str, entry: str, names: list[str]) -> None:
    handshake = HandshakeEntry.model_construct(output=output, inputs={"beta": entry})
    cell = cell_of(controlled("alpha", arm_model(), handshake=handshake), controlled("beta", arm_model()), kind=STAUBLI)
    job = job_of(cell, random_program(cell, marks=(4,)))

    files = VAL3.render(job)

    checked(files)
    assert re.findall(r'name="(\w+)"[^>]*type="dio"', files["alpha/alpha.dtx"]) == names
    assert re.findall(r'link="([^"]*)"', files["alpha/alpha.dtx"]) == [entry, output]
    assert VAL3.read(job.frame, files)[0].robots["alpha"].marks == (4,)


@pytest.mark.parametrize("angle", [0.3, -2.0, np.pi / 2, -np.pi / 2, np.pi])
@pytest.mark.parametrize("axis", [(0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.3, -0.5, 0.8)])
def test_the_tool_turns_about_x_then_the_new_y_then_the_new_z(angle: float, axis: tuple[float, ...]) -> None:
    X_FT = pose_from(rotation_exp(np.array(axis) / np.linalg.norm(axis) * angle), np.array([0.1, -0.02, 0.3]))
    robot = replace(controlled("alpha", arm_model()), tool=Tool(X_FT=X_FT, bodies=()))
    cell = cell_of(robot, kind=STAUBLI)

    data = VAL3.render(job_of(cell, random_program(cell)))["alpha/alpha.dtx"]

    x, y, z, *angles = [
        float(re.search(rf' {name}="([-\d.]+)"', data)[1]) for name in ("x", "y", "z", "rx", "ry", "rz")
    ]
    Rx, Ry, Rz = (rotation_about(np.eye(3)[k], np.deg2rad(value)) for k, value in enumerate(angles))
    assert np.allclose([x, y, z], 1e3 * X_FT[:3, 3], atol=1e-3)
    assert np.allclose(Rx @ Ry @ Rz, X_FT[:3, :3], atol=1e-4)  # three decimals of a degree, twice near the pole


NAMES = (
    "Schweißroboter_Süd",
    "a" * 40,
    "a" * 39 + "b",
    "start",
    "MOVEJ",
    "3rd",
    "jRow",
    "weld_001",
    "weld",
    "a;b]]>--\"'",
    "",
)


def test_names_of_any_kind_become_names_of_projects() -> None:
    cell = cell_of(controlled("alpha", arm_model()), kind=STAUBLI)
    programs = [random_program(cell, rows=9, seed=seed, name=name) for seed, name in enumerate(NAMES)]
    job = job_of(cell, *programs, split=4, notes=(*NAMES, "--", "a -- b --- c-", "]]>", "-->", "<&>"))

    files = VAL3.render(job)

    checked(files)
    assert len({path.lower() for path in files}) == len(files) == len(NAMES) * 7
    assert "alpha/Schweissrob/Schweissrob_002.pgx" in files
    assert [program.name for program in VAL3.read(job.frame, files)] == list(NAMES)


def test_robots_with_names_of_any_kind_do_too() -> None:
    names = [name or "x" for name in NAMES]
    cell = cell_of(*(controlled(name, arm_model()) for name in names), kind=STAUBLI)
    job = job_of(cell, random_program(cell, rows=5, marks=(2,)))

    files = VAL3.render(job)

    checked(files)
    assert set(VAL3.read(job.frame, files)[0].robots) == set(names)


def refused(model: RobotModel, **control: object) -> str:
    """Why a robot cannot be written."""
    cell = cell_of(controlled("alpha", model, **control), controlled("beta", arm_model()), kind=STAUBLI)
    with pytest.raises(InputError) as error:
        VAL3.render(job_of(cell, random_program(cell, marks=(3,))))
    return str(error.value)


@pytest.mark.parametrize("signal", ["", "do 1", 'a"b', "Tür", "a&b", "a\nb"])
def test_signals_that_are_no_link_are_refused(signal: str) -> None:
    wrong_output = refused(arm_model(), handshake=HandshakeEntry.model_construct(output=signal, inputs={"beta": "3"}))
    wrong_input = refused(arm_model(), handshake=HandshakeEntry.model_construct(output="3", inputs={"beta": signal}))

    assert wrong_output.startswith("robots.alpha.controller.handshake.output: expected a number, or the link")
    assert wrong_input.startswith("robots.alpha.controller.handshake.inputs.beta: expected a number, or the link")


def test_robots_that_are_no_arm_of_six_axes_are_refused() -> None:
    assert refused(positioner_model()).startswith("robots.alpha: expected an arm of six axes, got 2 axes")
    with pytest.raises(InputError, match=r"robots.alpha: expected an arm of six axes, got a rail before it"):
        VAL3.render(arm_on_a_rail(STAUBLI))


def test_a_robot_without_a_controller_is_refused() -> None:
    job = one_arm(STAUBLI)
    robot = replace(job.frame.cell.robots[0], control=None)
    without = replace(job.frame, cell=replace(job.frame.cell, robots=(robot,)))

    with pytest.raises(InputError, match=r"robots.alpha.controller: expected the controller that plays val3, got none"):
        VAL3.render(replace(job, frame=without))


def test_robots_may_keep_other_rows_but_meet_equally_often() -> None:
    job = two_arms(STAUBLI, marks=(0, 7, 19), split=8)
    both = job.programs[0].robots
    few = RobotRows(robot="beta", q=both["beta"].q[:3], times=both["beta"].times[:3], marks=(0, 1, 2))
    job = replace(job, programs=(replace(job.programs[0], robots={**both, "beta": few}),))
    never = replace(job, programs=(replace(job.programs[0], robots={**both, "beta": replace(few, marks=())}),))

    files = VAL3.render(job)
    (read,) = VAL3.read(job.frame, files)

    checked(files)
    assert [(len(rows), rows.marks) for rows in read.robots.values()] == [(20, (0, 7, 19)), (3, (0, 1, 2))]
    with pytest.raises(InputError, match="expected rows, and equal marks, got 20 and 3 of 'alpha', 3 and 0 of 'beta'"):
        VAL3.render(never)


def test_the_format_promises_no_times() -> None:
    assert VAL3.promises == (Promise.PACED, Promise.SEQUENCE_ONLY)
    assert VAL3.is_thinned


def turned_round(text: str) -> str:
    """The attributes of every element in the opposite order."""
    pattern = r"<(\w+)((?: [\w:]+=\"[^\"]*\")+)(\s*/?)>"
    one = re.compile(r"[\w:]+=\"[^\"]*\"")
    return re.sub(pattern, lambda m: f"<{m[1]} {' '.join(one.findall(m[2])[::-1])}{m[3]}>", text)


@pytest.mark.parametrize(
    "variant",
    [
        turned_round,
        lambda text: "\ufeff" + text,
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace('utf-8"?>', 'UTF-8" ?>'),
        lambda text: text.replace("/>", "  />").replace("<Data ", "<Data\n   ").replace("> <", "><"),
        lambda text: text.replace("<Programs>", "<!-- Übersicht -->\n<Programs>").replace(
            "<Datas>", "<Datas>\n<!-- a -->"
        ),
        lambda text: text.replace("(", " ( ").replace(")", " ) ").replace(",", " , ").replace("doMark=", "doMark = "),
        lambda text: text.replace("\n  movej", "\n\n// eine Bewegung\n      movej").replace("[0],mM", " [ 0 ],mM"),
        lambda text: text.replace("[0],mMove", ",mMove").replace("mMove[0]", "mMove"),
        lambda text: text.replace(' access="public"', ""),
        lambda text: text.replace("<Code>", "<Locals></Locals>\n<Code>").replace("begin\n", "\n  begin\n\n"),
        lambda text: text.replace("tTool", "tGun").replace("jRow", "jPath").replace("diMark1", "diGo"),
        lambda text: text.replace('"flange[0]"', '"flange[0]" ioLink="valve1"').replace('leave="0" reach="0"', ""),
        lambda text: text.replace("<Types/>", "").replace("<Libraries/>", "<Libraries>\n  </Libraries>"),
        lambda text: text.replace("resetMotion()", ""),
    ],
)
def test_harmless_variants_are_read_to_the_same_rows(variant) -> None:
    job = two_arms(STAUBLI)
    files = VAL3.render(job)
    changed = {path: variant(text) for path, text in files.items()}

    assert changed != files
    for robot, rows in VAL3.read(job.frame, files)[0].robots.items():
        again = VAL3.read(job.frame, changed)[0].robots[robot]
        assert np.array_equal(again.q, rows.q)
        assert again.marks == rows.marks
