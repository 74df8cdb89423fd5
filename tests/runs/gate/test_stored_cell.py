"""Names of controllers may change after a cell was solved, in its file or in one beside it; nothing else may."""

import copy
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from builders.two_phases import PAIR

from cellplan import load_cell, open_gate, solve, write_run
from cellplan.cli.main import run as run_command
from cellplan.errors import InputError
from cellplan.files.run.stored import StoredRun, read_stored_run
from cellplan.model.settings.controllers import ControllerEntry, RobotControlEntry
from cellplan.runs.gate.stored_cell import StoredCell, load_stored_cell

LEFT, RIGHT, ABB, FANUC = "robots.left.controller", "robots.right.controller", "controllers.irc", "controllers.r30"
GLUE = {"on": "SetDO doGlue,high", "off": "SetDO doGlue,low"}
STATED: dict[str, Any] = {
    "controllers": {
        "irc": {
            "kind": "abb",
            "tasks": {"T_ROB1": "ROB_1"},
            "process": GLUE,
            "latency_ms": 20,
            "reaction_ms": 100,
            "brake_s": 0.4,
        },
        "r30": {"kind": "fanuc", "latency_ms": 12, "skew_ms": 1},
    },
}
CONTROLS: dict[str, dict[str, Any]] = {
    "left": {
        "id": "irc",
        "task": "T_ROB1",
        "cycle_ms": 4,
        "decimals": 5,
        "handshake": {"output": "doThere", "inputs": {"right": "diGo"}},
    },
    "right": {"id": "r30", "group": 1, "tool_number": 1, "handshake": {"output": 7, "inputs": {"left": 8}}},
}
NAMES: dict[str, Any] = {
    f"{ABB}.tasks": {"T_ROB1": "ROB_7"},
    f"{ABB}.process.on": "SetDO doGlue,1",
    f"{LEFT}.decimals": 6,
    f"{LEFT}.tool_number": 3,
    f"{LEFT}.handshake.output": "doHere",
    f"{LEFT}.handshake.inputs.right": "diStay",
    f"{RIGHT}.group": 2,
    f"{RIGHT}.tool_number": 2,
    f"{RIGHT}.base_number": 4,
    f"{RIGHT}.frames": (1, 3),
    f"{RIGHT}.step_register": 9,
    f"{RIGHT}.handshake": {"output": 71, "inputs": {"left": 81}},
}
BOUND: dict[str, Any] = {
    f"{FANUC}.kind": "yaskawa",
    f"{ABB}.latency_ms": 25,
    f"{FANUC}.skew_ms": 2,
    f"{ABB}.reaction_ms": 90,
    f"{ABB}.brake_s": 0.5,
    f"{LEFT}.cycle_ms": 8,
    f"{RIGHT}.cycle_ms": 8,
    f"{RIGHT}.base": {"xyz_mm": [0, 0, 450]},
    f"{LEFT}.tool_frame": {"rpy_deg": [0, 0, 180]},
}
OTHERS: dict[str, Any] = {
    "robots.left.base": {"xyz_mm": [0, 0, 1]},
    "robots.left.tool.xyz_mm": [0, 0, 61],
    "robots.left.start_deg": [57.682, -53.90672769931, -51.879785265709],
    "tasks.first.path.circle.radius_mm": 101,
    "part.at.xyz_mm": [700, 300, -84],
    "motion.duration_s": 3,
    "checks.clearance_mm": 6,
}


def stated() -> dict[str, Any]:
    """The cell with controllers, as plain values."""
    document = yaml.safe_load(PAIR) | copy.deepcopy(STATED)
    for name, control in CONTROLS.items():
        document["robots"][name]["controller"] = copy.deepcopy(control)
    return document


def written(path: Path, document: dict[str, Any]) -> Path:
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path


def put(document: dict[str, Any], address: str, value: object) -> dict[str, Any]:
    """The document with another value, None for none."""
    *above, last = address.split(".")
    node = document
    for key in above:
        node = node.setdefault(key, {})
    node[last] = value
    if value is None:
        del node[last]
    return document


def value_at(document: Any, address: str) -> object:
    for key in address.split("."):
        document = document[key]
    return document


def control_of(source: StoredCell, address: str) -> object:
    """The value of a key of a controller in a cell, as a cell file has it."""
    section, name, *keys = address.split(".")
    of_robot = section == "robots"
    entry = source.cell.robot(name).control if of_robot else source.cell.controllers[name]
    assert entry is not None
    return value_at(entry.model_dump(exclude_none=True), ".".join(keys[1:] if of_robot else keys))


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the cell in ``cell.yaml`` and its run in ``run``; not to be changed."""
    folder = tmp_path_factory.mktemp("named")
    write_run(solve(load_cell(written(folder / "cell.yaml", stated()))), folder / "run")
    return folder


@pytest.fixture(scope="module")
def stored(solved: Path) -> StoredRun:
    return read_stored_run(solved / "run")


def test_every_key_is_a_name_or_bound() -> None:
    """A key that nobody thought of binds."""
    of_controller, of_robot = set(ControllerEntry.model_fields), set(RobotControlEntry.model_fields)
    last = {address.split(".")[2 if address.startswith("controllers") else 3] for address in [*NAMES, *BOUND]}

    elsewhere = {"task", "id"}  # a task is renamed together with those of its controller
    other_kinds = {"machine", "position_levels_mm"}  # names, as the last two lines say
    assert last | elsewhere | other_kinds == of_controller | of_robot
    assert {"tasks", "process", "position_levels_mm"} == ControllerEntry.NAMES
    assert of_robot - RobotControlEntry.NAMES == {"id", "cycle_ms", "base", "tool_frame"}


@pytest.mark.parametrize("address", NAMES)
def test_a_name_may_change_in_the_cell_file(solved: Path, stored: StoredRun, tmp_path: Path, address: str) -> None:
    cell = written(tmp_path / "cell.yaml", put(stated(), address, NAMES[address]))

    source = load_stored_cell(stored, cell=cell, allow_dirs=())

    assert control_of(source, address) == NAMES[address]
    assert address in " ".join(source.remarks)
    assert list(source.names) == ["cell.yaml"]
    assert "cell.yaml" not in source.compared


@pytest.mark.parametrize("address", NAMES)
@pytest.mark.parametrize("has_cell", [True, False])
def test_a_name_may_stand_in_a_file_of_names(
    solved: Path, stored: StoredRun, tmp_path: Path, address: str, has_cell: bool
) -> None:
    key = ".".join(address.split(".")[: 3 if address.startswith("controllers") else 4])
    value = value_at(put(stated(), address, NAMES[address]), key)  # a key takes the place of the same key, whole
    file = written(tmp_path / "names.yaml", put({}, key, value))
    cell = solved / "cell.yaml" if has_cell else None

    source = load_stored_cell(stored, cell=cell, allow_dirs=(), controllers=file)

    assert control_of(source, address) == NAMES[address]
    assert any(remark.startswith(address) and "as in names.yaml" in remark for remark in source.remarks)
    assert list(source.names) == ["names.yaml"]
    assert ("cell.yaml" in source.compared) is has_cell


def test_a_task_may_be_renamed_with_those_of_its_controller(stored: StoredRun, tmp_path: Path) -> None:
    names = put(put({}, f"{ABB}.tasks", {"T_L": "ROB_1"}), f"{LEFT}.task", "T_L")

    source = load_stored_cell(stored, cell=None, allow_dirs=(), controllers=written(tmp_path / "names.yaml", names))

    assert (control_of(source, f"{LEFT}.task"), control_of(source, f"{ABB}.tasks")) == ("T_L", {"T_L": "ROB_1"})


@pytest.mark.parametrize("address", [*BOUND, *OTHERS])
def test_nothing_else_may_change_with_a_name(stored: StoredRun, tmp_path: Path, address: str) -> None:
    document = put(put(stated(), f"{LEFT}.tool_number", 9), address, (BOUND | OTHERS)[address])
    cell = written(tmp_path / "cell.yaml", document)

    with pytest.raises(InputError) as refusal:
        load_stored_cell(stored, cell=cell, allow_dirs=())

    first, *located = str(refusal.value).splitlines()
    assert first == f"{stored.folder}: 'cell.yaml' has changed since the run was made; solve the cell again"
    assert any(f": {address}" in line for line in located)
    assert all(line.startswith(f"{cell}:") and line.endswith("; solve the cell again") for line in located)


def test_the_lines_of_a_change_are_those_of_the_file(stored: StoredRun, tmp_path: Path) -> None:
    cell = written(tmp_path / "cell.yaml", put(stated(), f"{ABB}.latency_ms", 25))
    line = 1 + cell.read_text().splitlines().index("    latency_ms: 25")

    with pytest.raises(InputError) as refusal:
        load_stored_cell(stored, cell=cell, allow_dirs=())

    assert str(refusal.value).splitlines()[1] == (
        f"{cell}:{line}: {ABB}.latency_ms: expected 20, with which the run was made, got 25; solve the cell again"
    )


def _another_controller(document: dict[str, Any]) -> None:
    document["controllers"]["other"] = document["controllers"].pop("r30")
    document["robots"]["right"]["controller"]["id"] = "other"


def _another_leader(document: dict[str, Any]) -> None:
    document["robots"] = dict(reversed(document["robots"].items()))


def _no_controller(document: dict[str, Any]) -> None:
    del document["robots"]["right"]["controller"], document["controllers"]["r30"]
    document["robots"]["left"]["controller"]["handshake"]["inputs"] = {"right": "diX"}


@pytest.mark.parametrize("change", [_another_controller, _another_leader, _no_controller])
def test_who_leads_and_who_shares_a_clock_binds(
    stored: StoredRun, tmp_path: Path, change: Callable[[dict[str, Any]], None]
) -> None:
    document = put(stated(), f"{LEFT}.tool_number", 9)
    change(document)

    with pytest.raises(InputError, match="solve the cell again"):
        load_stored_cell(stored, cell=written(tmp_path / "cell.yaml", document), allow_dirs=())


@pytest.mark.parametrize("address", BOUND)
def test_a_file_of_names_says_of_what_binds_what_the_cell_says(
    stored: StoredRun, solved: Path, tmp_path: Path, address: str
) -> None:
    file, cell = tmp_path / "names.yaml", solved / "cell.yaml"
    written(file, put({}, address, BOUND[address]))

    with pytest.raises(InputError) as refusal:
        load_stored_cell(stored, cell=cell, allow_dirs=(), controllers=file)

    text = str(refusal.value)
    assert re.match(rf"{re.escape(str(file))}:[3-5]: {address}(\.xyz_mm|\.rpy_deg)?: expected ", text)
    assert f"as in '{cell}', got " in text
    assert "; without solving again only names of controllers may change (base_number, " in text
    if has_value(address):
        written(file, put({}, address, value_at(stated(), address)))
        load_stored_cell(stored, cell=cell, allow_dirs=(), controllers=file)


def has_value(address: str) -> bool:
    """Whether the cell states a value."""
    try:
        value_at(stated(), address)
    except KeyError:
        return False
    return True


@pytest.mark.parametrize(
    ("text", "finding"),
    [
        (
            "name: other",
            ":1: name: expected 'in-turns' as in '{cell}', got 'other'; without solving again only names of",
        ),
        ("robots: 3", ":1: robots: expected a mapping as in '{cell}', got 3; "),
        ("robots: {lefty: {controller: {group: 1}}}", ":1: robots.lefty.controller.group: expected nothing as in "),
        ("robots: {left: {base: {x: 1}}}", ":1: robots.left.base.x: expected nothing as in '{cell}', got 1; "),
        (
            "robots:\n  left: {controller: {tools: 3}}",
            ":2: robots.left.controller.tools: expected nothing as in '{cell}', got 3; ",
        ),
        (
            "robots: {left: {controller: {taskk: T}}}",
            ":1: robots.left.controller.taskk: expected nothing as in '{cell}', got 'T', did you mean 'task'?; ",
        ),
        (
            "robots: {left: {base: {xyz_mm: [1, 2]}}}",
            ":1: robots.left.base.xyz_mm: expected nothing as in '{cell}', got [1, 2]; ",
        ),
        (
            "robots:\n  left: {controller: {task: T_9}}",
            " with {file}:2: robots.left.controller.task: expected a task",
        ),
        (
            "robots:\n  right: {controller: {handshake: {output: 7, inputs: {left: 7, lefty: 9}}}}",
            " with {file}:2: robots.right.controller.handshake.inputs.lefty: expected another robot",
        ),
    ],
)
def test_what_is_wrong_with_a_file_of_names_is_located(
    stored: StoredRun, solved: Path, tmp_path: Path, text: str, finding: str
) -> None:
    (file := tmp_path / "names.yaml").write_text(text, encoding="utf-8")
    cell = solved / "cell.yaml"

    with pytest.raises(InputError) as refusal:
        load_stored_cell(stored, cell=cell, allow_dirs=(), controllers=file)

    where = str(cell) if finding.startswith(" with") else str(file)
    assert str(refusal.value).startswith(where + finding.format(file=file, cell=cell))


def test_the_wiring_of_other_names_is_checked_before_anything_is_verified(
    solved: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """An input that no robot of the cell needs, and not the one that is needed."""
    run, cell = solved / "run", put(stated(), f"{RIGHT}.handshake", None)
    words = ["--format", "rapid", "-o", str(tmp_path / "rapid"), "-v"]

    assert run_command(["export", str(run), "--cell", str(written(tmp_path / "cell.yaml", cell)), *words]) == 2

    err = capsys.readouterr().err
    assert f"{RIGHT}.handshake: expected its signals, {{output: …, inputs: {{left: …}}}}, as its program waits" in err
    assert "certifying" not in err
    assert not (tmp_path / "rapid").exists()


@pytest.mark.slow
def test_programs_with_other_names_are_written_and_verified(
    solved: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The same texts but for the names; each folder is verified with the names that it was made with only."""
    run, cell = str(solved / "run"), str(solved / "cell.yaml")
    names = {f"{LEFT}.handshake": {"output": "doHere", "inputs": {"right": "diGo"}}}
    file = str(written(tmp_path / "names.yaml", put({}, *next(iter(names.items())))))
    changed = str(written(tmp_path / "cell.yaml", put(stated(), *next(iter(names.items())))))
    sources = {
        "plain": ["--cell", cell],
        "named": ["--cell", cell, "--controllers", file],
        "changed": ["--cell", changed],
    }
    texts: dict[str, str] = {}
    for name, source in sources.items():
        folder = tmp_path / name
        assert run_command(["export", run, *source, "--format", "rapid", "-o", str(folder), "-q"]) == 0
        texts[name] = (folder / "first" / "left.mod").read_bytes().decode()
        digests = json.loads((folder / "export.json").read_text()).get("names", {})
        assert [line for line in texts[name].split("\r\n") if "! names " in line] == [
            f"  ! names {digest}" for digest in digests.values()
        ]
        assert list(digests) == {"plain": [], "named": ["names.yaml"], "changed": ["cell.yaml"]}[name]
        for other, its_source in sources.items():
            capsys.readouterr()
            status = run_command(["verify", str(folder), "--run", run, *its_source, "-q"])
            assert status == (0 if other == name else 2)
            assert other == name or "names: expected those of" in capsys.readouterr().err
    plain = texts["plain"].replace("doThere", "doHere").split("\r\n")
    for name in ("named", "changed"):
        assert "doHere" in texts[name]
        assert [line for line in texts[name].split("\r\n") if "! names " not in line] == plain
    assert open_gate(run, cell=cell, controllers=file).digest == open_gate(run, cell=cell).digest
