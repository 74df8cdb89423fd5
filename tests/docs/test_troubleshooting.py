"""The page of messages: each is what the program prints, or at least stands in its source."""

import ast
import re
import shutil
import subprocess
from functools import cache
from pathlib import Path

import pytest
from builders.commands import run_command

pytestmark = pytest.mark.usefixtures("stored_solutions")

ROOT = Path(__file__).resolve().parent.parent.parent
PAGE = (ROOT / "docs" / "troubleshooting.md").read_text(encoding="utf-8")
ENTRY = re.compile(r"^<!-- (?P<kind>from|source): (?P<how>.+) -->\n```text\n(?P<message>.+?)\n```$", re.MULTILINE)
ENTRIES = [match.groupdict() for match in ENTRY.finditer(PAGE)]
TRIGGERED = [
    pytest.param(entry["how"], entry["message"], id=entry["message"][:50])
    for entry in ENTRIES
    if entry["kind"] == "from"
]
NAMED = [
    pytest.param(entry["how"], entry["message"], id=entry["message"][:50])
    for entry in ENTRIES
    if entry["kind"] == "source"
]


@cache
def texts(folder: str) -> list[str]:
    """All texts of the modules in a folder, each as a whole; a zero byte stands for what is computed."""
    place = ROOT / folder
    lines: list[str] = []
    for path in [place] if place.is_file() else sorted(place.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.JoinedStr):
                parts = [part.value if isinstance(part, ast.Constant) else "\0" for part in node.values]
                lines.append("".join(map(str, parts)))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                lines.append(node.value)
    return lines


def test_every_block_of_the_page_is_an_entry_and_there_are_many() -> None:
    assert PAGE.count("```text") == len(ENTRIES)
    assert len(ENTRIES) >= 35
    assert len(TRIGGERED) >= 30


@pytest.mark.parametrize(("folder", "message"), NAMED)
def test_a_message_stands_in_the_source(folder: str, message: str) -> None:
    pattern = re.compile("[^\n]*".join(re.escape(piece.strip()) for piece in message.split("…")))

    assert any(pattern.search(text) for text in texts(folder))


@pytest.mark.slow
@pytest.mark.parametrize(("how", "message"), TRIGGERED)
def test_the_program_prints_the_message(how: str, message: str, tmp_path: Path) -> None:
    shutil.copytree(ROOT / "cells", tmp_path / "cells")

    for command in how.split(" && "):
        if command.startswith("cellplan "):
            _, out, err = run_command(command, tmp_path)
        else:
            subprocess.run(["bash", "-c", command], check=True, cwd=tmp_path, capture_output=True)

    assert re.search(".*".join(map(re.escape, message.split("…"))), out + err), out + err
