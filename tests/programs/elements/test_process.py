"""Process statements in programs: where they stand, with which data, and what the controller does by itself."""

from dataclasses import replace
from typing import Any

import pytest
from builders.paced_pairs import OTHER_TASK, pair_job
from builders.seam_jobs import CONTROLLER, TASK

from cellplan.model.settings.controllers import ControllerEntry
from cellplan.model.settings.process_statements import read_statement
from cellplan.programs.elements.process import ProcessForm, shared_outputs

ENDS = r"{point}, {speed}, seam1, {data} \Weave:=weave1, {zone}, {tool} \WObj:={frame}"
SLOTS = {
    "point": "seam_p2",
    "via": "seam_p1",
    "speed": "v8",
    "zone": "fine",
    "tool": "torch",
    "frame": "frame_1",
    "data": "weld1",
}
ARC: dict[str, Any] = {"on": f"ArcLStart {ENDS};", "inner": f"ArcL {ENDS}", "off": f"ArcLEnd {ENDS}"}


def form(kind: str, **process: Any) -> ProcessForm:
    """The form of a controller with some process."""
    values = {key: tuple(value) if isinstance(value, list) else value for key, value in process.items()}
    stated = ProcessForm.of(ControllerEntry.model_validate({"kind": kind, "process": values}))
    assert stated is not None
    return stated


def test_a_controller_without_statements_has_no_form() -> None:
    assert ProcessForm.of(ControllerEntry(kind="abb")) is None


def test_motions_have_their_slots_filled() -> None:
    arc = form("abb", **ARC, data={"seam": "weld1"})
    rest = r"v8, seam1, weld1 \Weave:=weave1, fine, torch \WObj:=frame_1;"

    assert arc.is_move
    assert (arc.data("seam"), arc.feed_in("seam")) == ("weld1", None)
    assert (arc.suffix(True, "seam"), arc.lines(True, "seam")) == ("", ())
    assert [arc.move(which, circular=False, slots=SLOTS) for which in ("on", "inner", "off")] == [
        f"ArcLStart seam_p2, {rest}",
        f"ArcL seam_p2, {rest}",
        f"ArcLEnd seam_p2, {rest}",
    ]
    assert [arc.move(which, circular=True, slots=SLOTS) for which in ("on", "inner", "off")] == [
        f"ArcCStart seam_p1, seam_p2, {rest}",
        f"ArcC seam_p1, seam_p2, {rest}",
        f"ArcCEnd seam_p1, seam_p2, {rest}",
    ]


@pytest.mark.parametrize("name", ["DispL", "displ", "DISPL"])  # RAPID has no case
def test_a_motion_of_dispensing_keeps_its_switch_on_a_circle(name: str) -> None:
    bead = r"{point}, {speed}, bead1, {zone}, {tool}\WObj:={frame}"
    disp = form("abb", on=rf"{name}\On, {bead}", inner=f"{name} {bead}", off=rf"{name}\Off, {bead}")

    assert disp.move("off", circular=True, slots=SLOTS) == (
        rf"{name[:-1]}C\Off, seam_p1, seam_p2, v8, bead1, fine, torch\WObj:=frame_1;"
    )


def test_a_suffix_stands_on_the_motion_and_lines_after_it() -> None:
    weld = form(
        "fanuc",
        on=["Weave Sine[1]", "Weld Start[1,{data}]"],
        off=["Weld End[1,{data}]", "Weave End"],
        data={"a": "1", "b": "2"},
        feed_in="{data}",
        weave_mm=2.0,
        shift_mm=3.0,
    )

    assert not weld.is_move
    assert [weld.suffix(True, task) for task in "ab"] == ["Weld Start[1,1]", "Weld Start[1,2]"]
    assert (weld.suffix(False, "b"), weld.lines(False, "b")) == ("Weld End[1,2]", ("Weave End",))
    assert weld.lines(True, "a") == ("Weave Sine[1]",)
    assert weld.tube == pytest.approx(0.005, abs=1e-15)
    assert [weld.feed_in(task) for task in "ab"] == ["1", "2"]


@pytest.mark.parametrize(
    ("kind", "on", "off", "holds"),
    [
        ("abb", "SetDO doArc,1", "SetDO doArc,0;", False),
        ("kuka", "$OUT[1]=TRUE", "$OUT[1]=FALSE", False),
        ("yaskawa", ["DOUT OT#(1) ON", "DOUT OT#(2) ON"], ["DOUT OT#(2) OFF", "DOUT OT#(1) OFF"], False),
        ("yaskawa", ["DOUT OT#(1) ON", "ARCON"], ["ARCOF", "DOUT OT#(1) OFF"], True),
        ("ur", "arc_on()", "arc_off()", True),
        ("fanuc", "Arc Start[1]", "Arc End[1]", True),
    ],
)
def test_plain_outputs_alone_hold_no_delay(kind: str, on: Any, off: Any, holds: bool) -> None:
    assert form(kind, on=on, off=off).holds_delay is holds


@pytest.mark.parametrize(
    ("kind", "on", "off", "routines"),
    [
        ("kuka", "ARC_ON(1)", "ARC_OFF()", {"arc_on", "arc_off"}),
        ("staubli", "call glue:open()", "call shut()", {"open", "shut"}),
        ("yaskawa", "CALL JOB:GUN-ON", "CALL JOB:GUN-OFF", {"gun-on", "gun-off"}),
        ("ur", "set_digital_out(1,True)", "set_digital_out(1,False)", set()),
    ],
)
def test_routines_that_are_called_are_known(kind: str, on: str, off: str, routines: set[str]) -> None:
    """No routine of a program may have their names: it would call itself."""
    assert form(kind, on=on, off=off).routines == routines


@pytest.mark.parametrize(
    ("kind", "on", "off"),
    [
        ("abb", ["SetDO doGas,{data}", "SetDO doArc,1"], ["SetDO doArc,0", "SetDO doGas,0"]),
        ("yaskawa", ["ARCON ASF#({data})", "WVON WEV#({data})"], ["WVOF", "ARCOF AEF#({data})"]),
        ("ur", ["arc_on({data})"], ["arc_off()"]),
    ],
)
def test_lines_are_read_back_as_what_they_switch(kind: str, on: list[str], off: list[str]) -> None:
    written = form(kind, on=on, off=off, data={"seam": "1"})

    for is_on, given in ((True, on), (False, off)):
        lines = written.lines(is_on, "seam")
        assert [line.removesuffix(";") for line in lines] == [text.replace("{data}", "1") for text in given]
        assert all(line.endswith(";") is (kind == "abb") for line in lines)
        assert all(read_statement(kind, line, on=is_on) for line in lines)
    for line, last in zip(written.lines(True, "seam"), reversed(written.lines(False, "seam")), strict=True):
        begun, ended = read_statement(kind, line, on=True), read_statement(kind, last, on=False)
        assert begun is not None
        assert ended is not None
        assert begun.is_ended_by(ended)


@pytest.mark.parametrize(
    ("process", "said"),
    [
        ({"on": "$OUT[6]=TRUE", "off": "$OUT[6]=FALSE"}, ["$out[6] for both"]),
        ({"on": "$OUT[{data}]=TRUE", "off": "$OUT[{data}]=FALSE", "data": {TASK: "6", OTHER_TASK: "7"}}, []),
        ({"on": "ARC_ON()", "off": "ARC_OFF()"}, []),
    ],
)
def test_tools_of_a_controller_that_work_at_once_have_outputs_of_their_own(
    process: dict[str, Any], said: list[str]
) -> None:
    _, job, _ = pair_job("krl")
    cell = job.frame.cell
    alpha, beta = cell.robots
    entry = ControllerEntry.model_validate({"kind": "kuka", "process": process})
    cell = replace(cell, robots=(alpha, replace(beta, control=alpha.control)), controllers={CONTROLLER: entry})

    errors = [str(error) for error in shared_outputs(cell, (TASK, OTHER_TASK))]

    assert [error.rpartition("got ")[2] for error in errors] == said
    assert not list(shared_outputs(cell, (TASK,)))
