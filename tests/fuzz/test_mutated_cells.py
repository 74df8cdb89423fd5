"""Every shipped cell with one injury: read, or refused in lines of which one is that of the injury."""

import re
import shutil
import subprocess
import sys
import time
from pathlib import Path
from random import Random

import pytest
from fuzz import cell_mutations
from fuzz.cell_mutations import Injury, Place
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cellplan.cli.terminal.errors import error_lines
from cellplan.errors import InputError, OverrunError
from cellplan.files.cell.load import load_cell
from cellplan.files.cell_errors import load_errors

ROOT = Path(__file__).resolve().parents[2]
CELLS = sorted(path.relative_to(ROOT / "cells").as_posix() for path in (ROOT / "cells").rglob("*.yaml"))
CELLS = [name for name in CELLS if not name.startswith("robots/") and "/robots/" not in name]
MANY_KEYS = Path(__file__).with_name("many_keys.yaml")  # those of its keys that no shipped cell has
LONGEST_S = 10.0
RIGHT_SHARE = 0.95  # of the refusals that name the line of the injury; a forgotten bracket can hide it

# No key of a cell takes one of these, whatever it stands for.
NEVER = (
    *(".nan", "-.inf", "1e400", "null", "~", "0x10", "1:30", "010", "1_000", "!!int 3", "*a", "&a 1", "2026-01-01"),
    *(
        "no",
        "Yes",
        "ON",
        "[[[[]]]]",
        "{a: {b: {c: 1}}}",
        "'\x1b[31m'",
        "'a\u200eb'",
        '"\\0"',
        "<<",
        "- 1",
        "@x",
        "`x`",
        "%d",
    ),
    *("99999999999999999999999999", "-1e300", "'" + 5000 * "x" + "'", "[" * 40 + "]" * 40, "!!python/name:os.system"),
)
ODD_KEYS = ("extra", "__class__", "unit", "'k k'", "<<", "~", "1", "[1]", "Robots", "x\u0301", "'<b>'", "? x")


def needs_number(place: Place) -> bool:
    if "handshake" in place.path:  # a signal is a number or a name
        return False
    try:
        float(place.node.value)
    except (TypeError, ValueError):
        return False
    return True


def injury(text: str, random: Random) -> Injury | None:
    """One change that no cell may have."""
    place = random.choice(cell_mutations.places(text))
    kinds = ["never", "never", "key added", "key twice", "words for a number"]
    match random.choice(kinds):
        case "never":
            return cell_mutations.replaced(text, place, random.choice(NEVER), kind="never")
        case "key added":
            return cell_mutations.with_key(text, place, random.choice(ODD_KEYS), "1") if is_fixed(place) else None
        case "key twice":
            return cell_mutations.duplicated(text, place)
        case _:
            word = random.choice(["1,5", "5mm", "'5'", "one", "[1", "{", "true"])
            return cell_mutations.replaced(text, place, word, kind="word") if needs_number(place) else None


def is_fixed(place: Place) -> bool:
    """Whether the mapping of the place has fixed keys, not names of the user's choice."""
    free = {"robots", "tasks", "environment", "limits", "locked", "at", "start", "vary", "grasp", "axes"}
    return len(place.path) == 1 or (
        place.path[-2] not in free and not str(place.path[-2]).startswith(("joint_", "link_"))
    )


def refusal(folder: Path, name: str, text: str) -> list[str] | None:
    """Lines that a changed cell is refused with; None when it is read. All that must never happen is asserted."""
    file = folder / Path(name).parent / "changed.yaml"
    file.write_text(text, encoding="utf-8", newline="")
    began = time.monotonic()
    try:
        if text.find("cellplan_errors") >= 0:
            load_errors(file, load_cell(folder / "four_robots.yaml"))
        else:
            load_cell(file)
    except OverrunError:
        raise
    except InputError as error:
        lines = error_lines(error)
        assert all(line.isprintable() and len(line) < 1500 for line in lines)
        return lines
    finally:
        assert time.monotonic() - began < LONGEST_S
    return None


def tell_lines(lines: list[str]) -> set[int]:
    result = (re.match(r".*?changed\.yaml:(\d+): ", line) for line in lines)
    return {int(match[1]) for match in result if match}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The shipped cells with all that they name, to be changed."""
    copy = tmp_path_factory.mktemp("cells") / "cells"
    shutil.copytree(ROOT / "cells", copy)
    return copy


def original(name: str) -> str:
    """Text of a shipped cell, or of the one that has the other keys."""
    return (MANY_KEYS if name == MANY_KEYS.name else ROOT / "cells" / name).read_text(encoding="utf-8")


def share_of_right_lines(folder: Path, name: str, seeds: range) -> float:
    text = original(name)
    right = wrong = 0
    for seed in seeds:
        injured = injury(text, Random(f"{name}/{seed}"))
        if injured is None:
            continue
        lines = refusal(folder, name, injured.text)
        assert lines is not None, (
            f"{name}, seed {seed}: {injured.kind} at {injured.path}, line {injured.line}, was accepted"
        )
        is_right = injured.line in tell_lines(lines)
        right, wrong = right + is_right, wrong + (not is_right)
    return right / max(1, right + wrong)


@pytest.mark.parametrize(
    "name", ["four_robots.yaml", "load_sharing.yaml", "errors/four_robots_spread.yaml", MANY_KEYS.name]
)
def test_an_injury_is_refused_with_its_line(folder: Path, name: str) -> None:
    assert share_of_right_lines(folder, name, range(15)) >= 0.9


@pytest.mark.slow
@pytest.mark.parametrize("name", [*CELLS, MANY_KEYS.name])
def test_very_many_injuries_are_refused_with_their_lines(folder: Path, name: str) -> None:
    assert share_of_right_lines(folder, name, range(1000, 1100)) >= RIGHT_SHARE


HARMLESS = {
    "windows line ends": lambda text: text.replace("\n", "\r\n"),
    "byte order mark": lambda text: "\ufeff" + text,
    "comments": lambda text: "# before\n" + text.replace("\n", "  # after\n") + "# at the end",
    "blank lines": lambda text: text.replace("\n", "\n\n"),
    "trailing blanks": lambda text: text.replace("\n", "   \n"),
    "document marks": lambda text: f"---\n{text}...\n",
    "no end of line": lambda text: text.rstrip("\n"),
}


@pytest.mark.parametrize("kind", HARMLESS)
def test_the_same_cell_in_another_dress_is_read(folder: Path, kind: str) -> None:
    text = (ROOT / "cells/dual_arm.yaml").read_text(encoding="utf-8")

    assert refusal(folder, "dual_arm.yaml", HARMLESS[kind](text)) is None


@settings(max_examples=25, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_value_anywhere_is_read_or_refused(folder: Path, data: st.DataObject) -> None:
    some_values_anywhere(folder, data)


@pytest.mark.slow
@settings(max_examples=600, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_very_many_values_anywhere_are_read_or_refused(folder: Path, data: st.DataObject) -> None:
    some_values_anywhere(folder, data)


def some_values_anywhere(folder: Path, data: st.DataObject) -> None:
    name = data.draw(st.sampled_from([*CELLS, MANY_KEYS.name]))
    text = original(name)
    place = data.draw(st.sampled_from(cell_mutations.places(text)))
    number = st.floats() | st.integers() | st.sampled_from([1e-300, -0.0, 1e300, 2**63, 1000.0])
    value = data.draw(number.map(repr) | st.text(max_size=30) | st.sampled_from(NEVER) | st.just("[0, 0, 0]"))
    refusal(
        folder, name, cell_mutations.replaced(text, place, value.encode("utf-8", "replace").decode(), kind="any").text
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", [*CELLS, MANY_KEYS.name])
def test_units_that_slipped_are_read_or_refused(folder: Path, name: str) -> None:
    text = original(name)
    for place in filter(needs_number, cell_mutations.places(text)):
        for factor in (1000.0, 0.001, 57.29577951308232, -1.0, 0.0):
            value = repr(factor * float(place.node.value))
            refusal(folder, name, cell_mutations.replaced(text, place, value, kind="unit").text)


@pytest.mark.slow
def test_the_command_refuses_in_time_and_memory_and_leaves_nothing(folder: Path, tmp_path: Path) -> None:
    """What the tests above find in one process holds for the command too."""
    bombs = {
        "nodes.yaml": "a: [" + "1, " * 250_000 + "1]\n",
        "deep.yaml": "a: " + "[" * 100_000,
        "large.yaml": "# " + "x" * 3_000_000,
        "laughs.yaml": "a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]\n",
        "keys.yaml": "".join(f"k{n}: 1\n" for n in range(90_000)),
        "long.yaml": "cellplan: 1\nname: " + "x" * 1_900_000,
        "quote.yaml": "name: '" + "x\n" * 500_000,
        "utf16.yaml": "cellplan: 1\n".encode("utf-16"),
    }
    for file, content in bombs.items():
        data = content if isinstance(content, bytes) else content.encode()
        (tmp_path / file).write_bytes(data)
    before = sorted(tmp_path.iterdir())
    for file in bombs:
        code = (
            "import resource, sys; resource.setrlimit(resource.RLIMIT_AS, (1 << 30, 1 << 30)); "
            "from cellplan.cli.main import main; main()"
        )
        ended = subprocess.run(
            [sys.executable, "-c", code, "check", str(tmp_path / file)],
            capture_output=True,
            text=True,
            timeout=LONGEST_S * 3,  # a busy machine
            cwd=tmp_path,
            env={"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"},
            check=False,
        )
        assert ended.returncode == 2, (file, ended.stderr)
        assert "Traceback" not in ended.stderr
        assert ended.stderr.startswith(f"{tmp_path / file}:") or ended.stderr.startswith("error: "), file
    assert sorted(tmp_path.iterdir()) == before
