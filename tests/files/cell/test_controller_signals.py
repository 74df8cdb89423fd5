"""Signals, tools and bases of a cell file: those that controllers of a kind have, and no others."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from cellplan.errors import InvalidFileError
from cellplan.files.cell.load import load_cell
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Cell
from cellplan.model.settings.controllers import HandshakeEntry

KUKA = "    model: kuka_kr6\n"
WEIGHTS = "    weights: [1, 1, 1, 1, 1, 1]\n"  # of the worker
LEADS = "{id: c1, handshake: {output: 5, inputs: {worker: 7}}}"

Load = Callable[..., Cell]


@pytest.fixture
def connected(base_cell: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Load:
    """Loads the small cell with the holder on a controller, after replacing pieces of its text."""
    monkeypatch.chdir(tmp_path)
    text = base_cell.replace(KUKA, f"{KUKA}    controller: {LEADS}\n")
    text = text.replace("part:\n", "controllers:\n  c1: {kind: kuka}\npart:\n", 1)

    def load_changed(*changes: tuple[str, str]) -> Cell:
        changed = text
        for old, new in changes:
            assert changed.count(old) == 1, f"{old!r} must occur once"
            changed = changed.replace(old, new)
        Path("c").write_text(changed, encoding="utf-8")
        return load_cell("c")

    return load_changed


@pytest.mark.parametrize(("kind", "numbers"), [("ur", (0, 7)), ("kuka", (1, 4096)), ("staubli", (0, 65535))])
def test_the_first_and_the_last_signal_of_a_kind_can_be_stated(
    connected: Load, kind: str, numbers: tuple[int, int]
) -> None:
    first, last = numbers
    signals = ("output: 5, inputs: {worker: 7}", f"output: {first}, inputs: {{worker: {last}}}")

    holder = connected(("kind: kuka", f"kind: {kind}"), signals).robot("holder").control

    assert holder is not None
    assert holder.handshake == HandshakeEntry(output=first, inputs={"worker": last})


@pytest.mark.parametrize(
    ("kind", "expected", "signals"),
    [
        ("kuka", "a whole number from 1 to 4096", ["0", "4097", "go"]),
        ("ur", "a whole number from 0 to 7", ["8", "go"]),
        ("abb, tasks: {T_1: ROB_1}", "a name", ["0", "17"]),
    ],
)
@pytest.mark.parametrize("place", ["output", "inputs.worker"])
def test_signals_that_a_kind_does_not_have_are_refused(
    connected: Load, kind: str, expected: str, signals: list[str], place: str
) -> None:
    """At the line of the signal, and nothing else is said."""
    sound = (
        {"output": "doThere", "inputs.worker": "diGo"} if kind.startswith("abb") else {"output": 5, "inputs.worker": 7}
    )
    verb = "name" if kind.startswith("abb") else "number"
    for signal in signals:
        used = sound | {place: signal}
        text = f"output: {used['output']}, inputs: {{worker: {used['inputs.worker']}}}"
        got = signal if signal.isdecimal() else f"{signal!r}"

        with pytest.raises(InvalidFileError) as caught:
            connected(("kind: kuka", f"kind: {kind}"), ("output: 5, inputs: {worker: 7}", text))

        assert str(caught.value).splitlines() == [
            f"c:6: robots.holder.controller.handshake.{place}: expected {expected}, as controllers of kind "
            f"{kind.partition(',')[0]} {verb} their signals, got {got}"
        ]


@pytest.mark.parametrize("key", ["tool_number", "base_number"])
def test_kuka_controllers_have_as_many_tools_and_bases_as_they_have(connected: Load, key: str) -> None:
    leads = "{id: c1, handshake: "
    control = connected((leads, f"{{id: c1, {key}: 128, handshake: ")).robot("holder").control

    assert getattr(control, key) == 128
    with pytest.raises(InvalidFileError) as caught:
        connected((leads, f"{{id: c1, {key}: 129, handshake: "))
    assert str(caught.value).splitlines() == [
        f"c:6: robots.holder.controller.{key}: expected at most 128, as many as controllers of kind kuka have, got 129"
    ]


def test_a_controller_may_count_from_a_base_and_a_flange_of_its_own(connected: Load) -> None:
    stated = "{id: c1, base: {xyz_mm: [0, 0, 450]}, tool_frame: {}, frames: [3, 1], handshake: "

    control = connected(("{id: c1, handshake: ", stated)).robot("holder").control

    assert control.base.matrix[:3, 3].tolist() == [0.0, 0.0, 0.45]
    assert control.tool_frame.matrix.tolist() == pose().tolist()
    assert control.frames == (3, 1)
    without = connected().robot("holder").control
    assert (without.base, without.tool_frame, without.frames) == (None, None, ())


@pytest.mark.parametrize(
    ("kind", "frames", "text"),
    [
        ("fanuc", "[1, 10]", "[1]: expected at most 9, as many as controllers of kind fanuc have, got 10"),
        ("kuka", "[129]", "[0]: expected at most 128, as many as controllers of kind kuka have, got 129"),
        ("yaskawa", "[2, 3, 2]", "[2]: expected each number once, got 2 twice"),
    ],
)
def test_frames_of_the_part_have_numbers_of_their_kind(connected: Load, kind: str, frames: str, text: str) -> None:
    changes = ("kind: kuka", f"kind: {kind}"), ("{id: c1, handshake: ", f"{{id: c1, frames: {frames}, handshake: ")

    with pytest.raises(InvalidFileError) as caught:
        connected(*changes)

    assert str(caught.value).splitlines() == [f"c:6: robots.holder.controller.frames{text}"]


@pytest.mark.parametrize(("key", "value"), [("frames", "[0]"), ("frames", "3"), ("base", "{x: 1}"), ("base", "[1]")])
def test_what_is_no_frame_is_refused_by_its_key(connected: Load, key: str, value: str) -> None:
    with pytest.raises(InvalidFileError, match=rf"^c:6: robots\.holder\.controller\.{key}"):
        connected(("{id: c1, handshake: ", f"{{id: c1, {key}: {value}, handshake: "))


@pytest.mark.parametrize(
    ("kind", "number", "words"),
    [
        ("kuka", 1, "expected a number of at least 2, got 1"),
        ("ur", 2, "unexpected key, it applies to kind kuka only, and 'c1' is of kind ur"),
    ],
)
def test_only_kuka_numbers_its_machines_and_from_two(connected: Load, kind: str, number: int, words: str) -> None:
    machine = ("{id: c1,", f"{{id: c1, machine: {number},")
    assert connected(("{id: c1,", "{id: c1, machine: 2,")).robot("holder").control.machine == 2

    with pytest.raises(InvalidFileError) as caught:
        connected(("kind: kuka", f"kind: {kind}"), machine)

    assert f"robots.holder.controller.machine: {words}" in str(caught.value)


@pytest.mark.parametrize(
    ("kind", "on", "off", "output", "finding"),
    [
        ("kuka", "$OUT[5]=TRUE", "$OUT[5]=FALSE", "5", "an output that nothing else on 'c1' uses, got '5'"),
        ("kuka", "$OUT[0]=TRUE", "$OUT[0]=FALSE", "5", "an output from 1 to 4096"),
        ("kuka", "$OUT[4097]=TRUE", "$OUT[4097]=FALSE", "5", "an output from 1 to 4096"),
        ("kuka", "$OUT[6]=TRUE", "$OUT[6]=FALSE", "5", None),
        ("fanuc", "DO[05]=ON", "DO[05]=OFF", "5", "an output that nothing else on 'c1' uses, got '5'"),
        ("fanuc", "RO[5]=ON", "RO[5]=OFF", "5", None),
        ("ur", "set_digital_out(5,True)", "set_digital_out(5,False)", "5", "an output that nothing else on 'c1' uses"),
        ("ur", "set_tool_digital_out(5,True)", "set_tool_digital_out(5,False)", "5", None),
        ("staubli", "doGo=true", "doGo=false", "doGo", "an output that nothing else on 'c1' uses, got 'doGo'"),
        ("yaskawa", "DOUT OT#(5) ON", "DOUT OT#(5) OFF", "5", "an output that nothing else on 'c1' uses, got '5'"),
    ],
)
def test_no_handshake_uses_the_output_of_a_process(
    connected: Load, kind: str, on: str, off: str, output: str, finding: str | None
) -> None:
    changes = (
        ("kind: kuka}", f"kind: {kind}, process: {{on: '{on}', off: '{off}'}}}}"),
        ("output: 5", f"output: {output}"),
    )
    if finding is None:
        assert connected(*changes).controllers["c1"].process is not None
        return
    with pytest.raises(InvalidFileError) as caught:
        connected(*changes)

    assert finding in str(caught.value)


@pytest.mark.parametrize(
    ("kind", "number", "is_right"), [("yaskawa", 3, False), ("yaskawa", 4, True), ("fanuc", 3, True)]
)
def test_robots_of_a_yaskawa_controller_share_its_tools_by_number(
    connected: Load, kind: str, number: int, *, is_right: bool
) -> None:
    changes = (
        ("kind: kuka}", f"kind: {kind}}}"),
        (LEADS, "{id: c1, group: 1, tool_number: 3}"),
        (WEIGHTS, f"{WEIGHTS}    controller: {{id: c1, group: 2, tool_number: {number}}}\n"),
    )
    if is_right:
        assert connected(*changes).robot("worker").control.tool_number == number
        return
    with pytest.raises(InvalidFileError) as caught:
        connected(*changes)

    (finding,) = str(caught.value).splitlines()
    assert finding.endswith(
        "robots.worker.controller.tool_number: expected another number than robots.holder.controller.tool_number, "
        "whose tool differs and which 'c1' has once, got 3"
    )
    assert re.match(r"c:\d+: ", finding)


@pytest.mark.parametrize(("kind", "is_right"), [("yaskawa", False), ("fanuc", True)])
def test_robots_of_a_yaskawa_controller_have_user_frames_of_their_own(
    connected: Load, kind: str, is_right: bool
) -> None:
    changes = (
        ("kind: kuka}", f"kind: {kind}}}"),
        (LEADS, "{id: c1, group: 1, frames: [3, 4]}"),
        (WEIGHTS, f"{WEIGHTS}    controller: {{id: c1, group: 2, frames: [5, 4]}}\n"),
    )
    if is_right:
        assert len(connected(*changes).robots) == 2
        return
    with pytest.raises(InvalidFileError) as caught:
        connected(*changes)

    (finding,) = str(caught.value).splitlines()
    assert finding.endswith(
        "robots.worker.controller.frames[1]: expected a user frame that nothing else on 'c1' uses, got '4', as "
        "robots.holder.controller.frames[1] does"
    )
