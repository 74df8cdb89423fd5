"""Whatever the README and the docs show is run here, page by page, from top to bottom."""

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
import yaml
from builders.commands import is_plain, run_command, run_script

pytestmark = pytest.mark.usefixtures("stored_solutions")

ROOT = Path(__file__).resolve().parent.parent.parent
PAGES = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")] + sorted(
    (ROOT / "docs").rglob("*.md")
)
BLOCK = re.compile(r"^(?:<!-- (?P<mark>[^>]*?) -->\n)?```(?P<kind>\w*)\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\((?P<target>[^)#\s]+)(?:#[^)]*)?\)")
EXIT_STATUS = re.compile(r"#\s*exit status (\d+)\s*$")
PROGRAM = f"cellplan() {{ '{sys.executable}' -m cellplan \"$@\"; }}; "  # this tree, wherever it is installed
COMMAND_LIMIT_S = 120  # [s] a block that takes longer does not belong on a page for newcomers


@dataclass(frozen=True)
class Block:
    """One fenced block: its language, the remark above it and its text."""

    kind: str
    mark: str
    text: str


def blocks(page: Path) -> Iterator[Block]:
    for match in BLOCK.finditer(page.read_text(encoding="utf-8")):
        yield Block(match["kind"], match["mark"] or "", match["text"])


def page_name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def run_shell(text: str, folder: Path) -> str:
    """Run a block line by line; targets of make are only looked up, for they would run the tests again."""
    output = ""
    for line in text.replace("\\\n", " ").splitlines():
        if not line.strip() or line.startswith("#"):
            continue
        expected = int(match[1]) if (match := EXIT_STATUS.search(line)) else 0
        if is_plain(line):
            status, out, err = run_command(line, folder)
            assert status == expected, f"{line}\n{out}\n{err}"
            output += out + err
            continue
        command = PROGRAM + re.sub(r"^make\b", f"make --dry-run -C '{ROOT}'", line)
        run = subprocess.run(
            ["bash", "-c", command],
            check=False,
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=COMMAND_LIMIT_S,
        )
        assert run.returncode == expected, f"{line}\n{run.stdout}\n{run.stderr}"
        output += run.stdout + run.stderr
    return output


def assert_shown(expected: str, output: str) -> None:
    """Every expected line stands in the output, in order; an ellipsis stands for anything."""
    lines = [r"[^\n]*".join(map(re.escape, line.split("…"))) for line in expected.strip().splitlines()]
    assert re.search(r"\n(?:[^\n]*\n)*?".join(lines), output), f"expected:\n{expected}\ngot:\n{output}"


LONG = {  # their commands and functions have tests of their own, which are quicker
    "accurate-mode.md",
    "from-the-drawing.md",
    "paths-from-cam.md",
    "manifest.md",
    "repair-a-cell.md",
    "compare.md",
    "questions.md",
    "verify-and-export.md",
    "which-method.md",
    "find-a-layout.md",
    "rehearse-with-errors.md",
    "limits.md",
    "shortest-cycle.md",
    "secondary-goals.md",
    "sweep-values.md",
    "load-sharing.md",
    "report-json.md",
    "demanded-feeds.md",
    "place-a-robot.md",
    "tutorial.md",
    "own-part-and-path.md",
    "hand-over.md",
    "templates.md",
    "programs.md",
    "recover.md",
    "escape.md",
    "linear-programs.md",
    "programs-krl.md",
    "first-cell.md",
    "from-python.md",
    "use-the-numbers.md",
    "floor-plan.md",
    "watch-a-cell.md",
    "real-robots.md",
    "screen-layouts.md",
    "my-robot.md",
    "read-the-report.md",
    "see-the-cell.md",
    "skew.md",
    "stops.md",
    "README.md",
    "keep-the-branch.md",
    "assign-tasks.md",
    "seams.md",
}
RUNNABLE = [pytest.param(page, marks=pytest.mark.slow if page.name in LONG else ()) for page in PAGES]


@pytest.mark.parametrize("page", RUNNABLE, ids=page_name)
def test_every_block_of_a_page_runs(page: Path, tmp_path: Path) -> None:
    for folder in ("cells", "examples"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    output = ""
    for block in blocks(page):
        if block.mark.startswith("file: "):
            target = tmp_path / block.mark.removeprefix("file: ")
            target.write_text(block.text, encoding="utf-8")
        elif block.mark == "output":
            assert_shown(block.text, output)
        elif block.mark == "not run":
            continue
        elif block.kind == "sh":
            output = run_shell(block.text, tmp_path)
        elif block.kind == "python":
            output = run_script(block.text, tmp_path)
        elif block.kind == "yaml":
            yaml.safe_load(block.text)
        else:
            assert block.kind == "text", f"{page_name(page)}: say what the block is: {block.text[:60]}"


@pytest.mark.parametrize("page", PAGES, ids=page_name)
def test_every_link_of_a_page_leads_somewhere(page: Path) -> None:
    targets = [match["target"] for match in LINK.finditer(page.read_text(encoding="utf-8"))]

    broken = [target for target in targets if "://" not in target and not (page.parent / target).exists()]

    assert broken == []
