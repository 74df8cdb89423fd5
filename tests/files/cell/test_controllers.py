"""Controllers in a cell file: what they become, how they are written back, and every finding about them."""

from collections.abc import Callable
from pathlib import Path

import pytest

from cellplan.errors import InvalidFileError
from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import render_cell
from cellplan.model.cell.cell import Cell
from cellplan.model.settings.checks import StopEntry
from cellplan.model.settings.controllers import ControllerEntry, HandshakeEntry, RobotControlEntry

KUKA = "    model: kuka_kr6\n"
ABB = "    weights: [1, 1, 1, 1, 1, 1]\n"
LEADS = "{id: c1, handshake: {output: 5, inputs: {worker: 7}}}"
FOLLOWS = (
    "{id: c2, task: T_ROB1, decimals: 3, cycle_ms: 8, tool_number: 1, base_number: 2, "
    "handshake: {output: do_there, inputs: {holder: di_go}}}"
)
FIRST = "  c1: {kind: kuka, latency_ms: 12, skew_ms: 4, reaction_ms: 100, brake_s: 0.5}\n"
SECOND = "  c2: {kind: abb, tasks: {T_ROB1: ROB_1}}\n"
STOP = "checks: {stop: {depth_mm: 2, clearance_mm: 1.5}}\n"

Load = Callable[..., Cell]


@pytest.fixture
def connected(base_cell: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Load:
    """Loads the small cell with both robots on controllers, after replacing pieces of its text."""
    monkeypatch.chdir(tmp_path)
    text = base_cell.replace(KUKA, f"{KUKA}    controller: {LEADS}\n").replace(ABB, f"{ABB}    controller: {FOLLOWS}\n")
    text = text.replace("part:\n", f"controllers:\n{FIRST}{SECOND}part:\n", 1) + STOP

    def load_changed(*changes: tuple[str, str]) -> Cell:
        changed = text
        for old, new in changes:
            assert changed.count(old) == 1, f"{old!r} must occur once"
            changed = changed.replace(old, new)
        Path("c").write_text(changed, encoding="utf-8")
        return load_cell("c")

    return load_changed


def test_controllers_are_read_with_their_units_and_signals(connected: Load) -> None:
    cell = connected()

    assert cell.controllers == {
        "c1": ControllerEntry(kind="kuka", latency_ms=12.0, skew_ms=4.0, reaction_ms=100.0, brake_s=0.5),
        "c2": ControllerEntry(kind="abb", tasks={"T_ROB1": "ROB_1"}),
    }
    assert cell.robot("holder").control == RobotControlEntry(
        id="c1", handshake=HandshakeEntry(output=5, inputs={"worker": 7})
    )
    assert cell.robot("worker").control == RobotControlEntry(
        id="c2",
        task="T_ROB1",
        decimals=3,
        cycle_ms=8.0,
        tool_number=1,
        base_number=2,
        handshake=HandshakeEntry(output="do_there", inputs={"holder": "di_go"}),
    )
    assert cell.checks.stop == StopEntry(depth_mm=2.0, clearance_mm=1.5)


def test_a_cell_without_controllers_knows_none(load: Load) -> None:
    cell = load()

    assert not cell.controllers
    assert [robot.control for robot in cell.robots] == [None, None]
    assert cell.checks.stop is None
    assert not {"controllers:", "controller:", "stop:"} & set(render_cell(cell).split())


def test_the_cycle_of_a_controller_is_that_over_which_jerk_is_taken(connected: Load) -> None:
    """Stated at one key or at both, or by the motion where the robot states none."""
    cycle = "cycle_ms: 8, "
    edit = ("    controller: {id: c2", "    controller_cycle_ms: 8\n    controller: {id: c2")

    assert connected().robot("worker").controller_cycle == 0.008
    assert connected(edit).robot("worker").controller_cycle == 0.008
    assert connected((cycle, ""), edit).robot("worker").controller_cycle == 0.008
    assert connected((cycle, "")).robot("worker").controller_cycle == 0.004
    assert connected().robot("holder").controller_cycle == 0.004


def test_the_written_cell_reads_back_with_its_controllers(connected: Load) -> None:
    cell = connected()
    written = render_cell(cell)
    Path("copy").write_text(written, encoding="utf-8")
    again = load_cell("copy")

    assert render_cell(again) == written
    assert again.controllers == cell.controllers
    assert [robot.control for robot in again.robots] == [robot.control for robot in cell.robots]
    assert again.checks.stop == cell.checks.stop


def test_values_of_controllers_are_changed_by_address(connected: Load) -> None:
    changed = connected().with_values(
        {
            "controllers.c1.skew_ms": 6,
            "robots.worker.controller.decimals": 5,
            "robots.holder.controller.handshake.inputs.worker": 9,
            "robots.worker.controller.task": None,
            "checks.stop.depth_mm": None,
        }
    )

    assert changed.controllers["c1"].skew_ms == 6.0
    worker, holder = changed.robot("worker").control, changed.robot("holder").control
    assert worker is not None
    assert (worker.decimals, worker.task) == (5, None)
    assert holder is not None
    assert holder.handshake == HandshakeEntry(output=5, inputs={"worker": 9})
    assert changed.checks.stop == StopEntry(clearance_mm=1.5)


def test_several_robots_share_a_controller_with_tasks_and_signals_of_their_own(connected: Load) -> None:
    cell = connected(
        (FIRST, ""),
        (STOP, ""),
        ("{T_ROB1: ROB_1}", "{T_ROB1: ROB_1, T_ROB2: ROB_2}"),
        (
            "{id: c1, handshake: {output: 5, inputs: {worker: 7}}}",
            "{id: c2, task: T_ROB2, handshake: {output: do_5, inputs: {worker: di_5}}}",
        ),
    )

    assert [robot.control.id for robot in cell.robots if robot.control] == ["c2", "c2"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "kind: kuka",
            "kind: kukka",
            "c:15: controllers.c1.kind: expected abb, fanuc, kuka, reis, ros, staubli, ur, "
            "yaskawa or other, got 'kukka', did you mean 'kuka'?",
        ),
        (
            "latency_ms: 12",
            "latency_ms: -1",
            "c:15: controllers.c1.latency_ms: expected a number of at least 0, got -1",
        ),
        (
            "brake_s: 0.5",
            "brake_s: 500",
            "c:15: controllers.c1.brake_s: expected a number of seconds of at most 60, got 500",
        ),
        (
            "kind: kuka",
            "kind: kuka, tasks: {T: R}",
            "c:15: controllers.c1.tasks: unexpected key, it applies to kind abb only, got kuka",
        ),
        (
            "{T_ROB1: ROB_1}",
            "{T-ROB1: ROB_1}",
            "c:16: controllers.c2.tasks.T-ROB1: expected a name of 1 to 32 ASCII "
            "letters, digits or '_' that begins with a letter, got 'T-ROB1'",
        ),
        (
            "{T_ROB1: ROB_1}",
            "{T_ROB1: RÖB_1}",
            "c:16: controllers.c2.tasks.T_ROB1: expected a name of 1 to 32 ASCII "
            "letters, digits or '_' that begins with a letter, got 'RÖB_1'",
        ),
        (
            "{T_ROB1: ROB_1}",
            "{T_ROB1: ROB_1, t_rob1: ROB_2}",
            "c:16: controllers.c2.tasks.t_rob1: expected each task once, got 't_rob1' twice",
        ),
        (
            "{T_ROB1: ROB_1}",
            "{T_ROB1: ROB_1, T_ROB2: rob_1}",
            "c:16: controllers.c2.tasks.T_ROB2: expected each mechanical unit once, got 'rob_1' twice",
        ),
        (
            SECOND,
            f"{SECOND}  spare: {{kind: ur}}\n",
            "c:17: controllers.spare: expected a robot with controller: {id: spare} (holder, worker), got none",
        ),
        (
            "{id: c2, task",
            "{id: c3, task",
            "c:13: robots.worker.controller.id: expected a controller of this cell (c1, c2), got 'c3'",
        ),
        (
            "task: T_ROB1",
            "task: T_ROB2",
            "c:13: robots.worker.controller.task: expected a task of controllers.c2.tasks "
            "(T_ROB1), got 'T_ROB2', did you mean 'T_ROB1'?",
        ),
        (
            "{id: c1",
            "{id: c1, task: T_ROB1",
            "c:6: robots.holder.controller.task: unexpected key, it applies to kind abb only, and 'c1' is of kind kuka",
        ),
        (
            "{id: c1",
            "{id: c1, group: 1",
            "c:6: robots.holder.controller.group: unexpected key, it applies to the kinds "
            "fanuc and yaskawa only, and 'c1' is of kind kuka",
        ),
        (
            "decimals: 3",
            "decimals: 10",
            "c:13: robots.worker.controller.decimals: expected a number of at most 9, got 10",
        ),
        ("decimals: 3", "decimals: 3.5", "c:13: robots.worker.controller.decimals: expected a whole number, got 3.5"),
        (
            "tool_number: 1",
            "tool_number: 1000",
            "c:13: robots.worker.controller.tool_number: expected a number of at most 999, got 1000",
        ),
        (
            "base_number: 2",
            "base_number: -2",
            "c:13: robots.worker.controller.base_number: expected a number of at least 0, got -2",
        ),
        (
            "    controller: {id: c2",
            "    controller_cycle_ms: 4\n    controller: {id: c2",
            "c:14: "
            "robots.worker.controller.cycle_ms: expected 4, as controller_cycle_ms says, got 8; remove one of them",
        ),
        (
            "output: 5",
            "output: -1",
            "c:6: robots.holder.controller.handshake.output: expected a number of at least 0, got -1",
        ),
        (
            "output: 5",
            "output: 5.5",
            "c:6: robots.holder.controller.handshake.output: expected a name or a whole number from 0, got 5.5",
        ),
        (
            "output: 5",
            "output: 5th",
            "c:6: robots.holder.controller.handshake.output: expected a name of 1 to 32 ASCII "
            "letters, digits or '_' that begins with a letter, got '5th'",
        ),
        (
            "{worker: 7}",
            "{worked: 7}",
            "c:6: robots.holder.controller.handshake.inputs.worked: expected another robot "
            "of this cell (worker), got 'worked', did you mean 'worker'?",
        ),
        (
            "{worker: 7}",
            "{holder: 7}",
            "c:6: robots.holder.controller.handshake.inputs.holder: expected another robot "
            "of this cell (worker), got 'holder'",
        ),
        ("{worker: 7}", "{}", "c:6: robots.holder.controller.handshake.inputs: expected at least 1 entry, got 0"),
        (
            "{depth_mm: 2, clearance_mm: 1.5}",
            "{}",
            "c:29: checks.stop: expected depth_mm, clearance_mm or both, got neither",
        ),
        (
            "depth_mm: 2",
            "depth_mm: -2",
            "c:29: checks.stop.depth_mm: expected a number of millimetres of at least 0, got -2",
        ),
        ("kind: kuka", "kind: abb, tasks: {A: 1}", "c:15: controllers.c1.tasks.A: expected a text, got 1"),
        (
            "  c2: {kind: abb",
            "  C1: {kind: ur}\n  c2: {kind: abb",
            "c:16: controllers.C1: expected a name that differs from 'c1' by more than upper and lower case",
        ),
    ],
)
def test_a_controller_that_cannot_be_is_refused(connected: Load, old: str, new: str, message: str) -> None:
    with pytest.raises(InvalidFileError) as caught:
        connected((old, new))

    assert message in str(caught.value).splitlines()


@pytest.mark.parametrize(
    ("mine", "message"),
    [
        (
            "task: T_ROB1",
            "task: expected a task that nothing else on 'c2' uses, got 'T_ROB1', as robots.holder.controller.task does",
        ),
        (
            "handshake: {output: DO_THERE, inputs: {worker: di_5}}",
            "handshake.output: expected an output that nothing else on 'c2' uses, got 'do_there', as "
            "robots.holder.controller.handshake.output does",
        ),
        (
            "handshake: {output: do_5, inputs: {worker: DI_GO}}",
            "handshake.inputs.holder: expected an input that nothing else on 'c2' uses, got 'di_go', as "
            "robots.holder.controller.handshake.inputs.worker does",
        ),
    ],
)
def test_what_one_robot_uses_on_a_controller_no_other_one_does(connected: Load, mine: str, message: str) -> None:
    with pytest.raises(InvalidFileError) as caught:
        connected((FIRST, ""), (STOP, ""), (LEADS, f"{{id: c2, {mine}}}"))

    assert str(caught.value).splitlines() == [f"c:13: robots.worker.controller.{message}"]


def test_the_same_number_may_be_an_output_and_an_input(connected: Load) -> None:
    holder = connected(("inputs: {worker: 7}", "inputs: {worker: 5}")).robot("holder").control

    assert holder is not None
    assert holder.handshake == HandshakeEntry(output=5, inputs={"worker": 5})


RIGHT, RAIL = "    base: {xyz_mm: [2000, 0, 0], rpy_deg: [0, 0, 180]}\n", "axis: +y, lower_mm: 0, upper_mm: 9"


@pytest.mark.parametrize(
    ("kind", "joints", "is_right"),
    [("ur", 6, True), ("ur", 7, False), ("abb", 7, True), ("other", 7, True)],
)
def test_a_controller_moves_the_joints_that_its_kind_can(
    connected: Load, kind: str, joints: int, is_right: bool
) -> None:
    rail = [(RIGHT, f"{RIGHT}    mount: {{rail: {{{RAIL}, velocity_mm_s: 900}}}}\n"), (ABB, "")] if joints == 7 else []
    signals = ("output: do_there, inputs: {holder: di_go}", "output: 1, inputs: {holder: 1}")
    changes = [(SECOND, f"  c2: {{kind: {kind}}}\n"), ("task: T_ROB1, ", ""), *rail]
    changes += [signals] if kind == "ur" else []

    if is_right:
        assert len(connected(*changes).robot("worker").model.joints) == joints
        return
    with pytest.raises(InvalidFileError) as caught:
        connected(*changes)
    assert str(caught.value).splitlines() == [
        "c:13: robots.worker.controller.id: expected a controller for 7 joints, 6 of them revolute, got one of kind "
        "ur, which moves exactly 6 revolute joints"
    ]


def test_an_arm_with_more_external_axes_than_a_row_holds_is_refused(connected: Load) -> None:
    joint = "{type: revolute, axis: [0, 0, 1], point_mm: [0, 0, 0], lower_deg: -90, upper_deg: 90, velocity_deg_s: 90}"
    joints = "".join(f"  J{number}: {joint}\n" for number in range(1, 14))
    Path("long.yaml").write_text(f"robot: long\nsource: test\njoints:\n{joints}flange: {{xyz_mm: [500, 0, 0]}}\n")

    with pytest.raises(InvalidFileError) as caught:
        connected(("model: abb_irb1600", "model: long.yaml"), (ABB, ""))
    assert (
        "c:12: robots.worker.controller.id: expected a controller for 13 joints, got one of kind abb, which moves at "
        "most 6 axes of an arm and 6 external axes"
    ) in str(caught.value).splitlines()


def test_a_demand_on_stops_needs_to_know_how_others_go_on(connected: Load) -> None:
    with pytest.raises(InvalidFileError) as caught:
        connected((", reaction_ms: 100, brake_s: 0.5", ", reaction_ms: 0"))

    assert str(caught.value) == (
        "c:29: checks.stop: expected controllers of robots that state reaction_ms or brake_s above 0, of which it is "
        "worked out, got none"
    )


def test_a_demand_on_stops_needs_a_controller(load: Load) -> None:
    with pytest.raises(InvalidFileError, match=r"checks\.stop: expected controllers of robots that state reaction_ms"):
        load(("part:\n", f"{STOP}part:\n"))


def test_data_of_a_process_are_those_of_the_tasks_of_the_controller(connected: Load) -> None:
    """A task that does not exist, and one without data."""
    feed = ("    tool_axis: normal\n", "    tool_axis: normal\n    process: {feed_mm_s: 50}\n")
    statements = 'on: "SetDO {data},1", off: "SetDO {data},0", data'

    def load_with(data: str) -> Cell:
        clock = ("motion: {duration_s: 4}\n", "motion: {step_s: 0.01}\n")
        return connected(
            feed, clock, (SECOND, SECOND.replace("ROB_1}}", f"ROB_1}}, process: {{{statements}: {data}}}}}"))
        )

    for data, finding in (
        ("{rim: doA, ring: doB}", "controllers.c2.process.data.rim: expected a task of this cell (ring), got 'rim'"),
        ("{}", "controllers.c2.process.data: missing, expected by task what stands in the slot {data}"),
        ("{rim: doA}", "controllers.c2.process.data: expected data of the task 'ring' too, got none"),
        ("{ring: 'doA,1; EXIT'}", "controllers.c2.process.data.ring: expected "),
    ):
        with pytest.raises(InvalidFileError) as refusal:
            load_with(data)
        assert f": {finding}" in str(refusal.value)
    cell = load_with("{ring: doB}")
    entry = cell.controllers["c2"].process
    assert entry is not None
    assert entry.data == {"ring": "doB"}
    Path("written").write_text(render_cell(cell), encoding="utf-8")
    assert load_cell("written").controllers == cell.controllers
