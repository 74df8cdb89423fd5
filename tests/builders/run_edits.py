"""Edits of run folders, plain and sealed: what the defects of ``run_defects`` are made of."""

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cellplan.files.input.files import digest
from cellplan.files.run.joint_tables import program_digest
from cellplan.files.run.manifest import MADE_LATER

ROBOTS = ("idle", "left", "right")


@dataclass(frozen=True)
class Copy:
    """A copy of a sound run with its cell, and another sound run of the same cell to take things from."""

    cell: Path
    run: Path
    other: Path

    def table(self, robot: str) -> Path:
        return self.run / "tables" / f"{robot}.csv"

    def any_table(self, rng: np.random.Generator) -> Path:
        return self.table(str(rng.choice(ROBOTS)))

    def any_file(self, rng: np.random.Generator) -> Path:
        """Any file of the run; every second time one that matters to the motion."""
        files = sorted(path for path in self.run.rglob("*") if path.is_file() and path.name not in MADE_LATER)
        return pick(rng, [path for path in files if path.parent.name != "plots"] if rng.random() < 0.5 else files)


def pick(rng: np.random.Generator, items: Any) -> Any:
    return items[int(rng.integers(len(items)))]


def replace_in(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text, f"{path.name} has no {old!r}"
    path.write_bytes(text.replace(old, new, 1).encode())


def first_row(lines: list[str]) -> int:
    return next(i for i, line in enumerate(lines) if line.startswith("time_s")) + 1


def edit_rows(path: Path, change: Callable[[int, list[str]], list[str]]) -> None:
    """Change the fields of every row of a table; ``change`` gets the number of the row and its fields."""
    lines = path.read_text(encoding="utf-8").splitlines()
    start = first_row(lines)
    rows = [",".join(change(i, line.split(","))) for i, line in enumerate(lines[start:])]
    path.write_bytes(("\n".join([*lines[:start], *rows]) + "\n").encode())


def edit_field(rng: np.random.Generator, path: Path, change: Callable[[str], str]) -> None:
    """Change one field of one row, not of the clock."""
    count = len(path.read_text(encoding="utf-8").splitlines()) - first_row(path.read_text().splitlines())
    row, column = int(rng.integers(count)), int(rng.integers(1, 4))
    edit_rows(path, lambda i, f: [*f[:column], change(f[column]), *f[column + 1 :]] if i == row else f)


def edit_json(path: Path, change: Callable[[dict[str, Any]], None]) -> None:
    record = json.loads(path.read_text(encoding="utf-8"))
    change(record)
    path.write_text(json.dumps(record, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def seal(copy: Copy) -> None:
    """Make the manifest say that all files are as they were written."""

    def change(record: dict[str, Any]) -> None:
        files = {path.relative_to(copy.run).as_posix(): path for path in copy.run.rglob("*") if path.is_file()}
        record["files"] = {
            name: {"bytes": path.stat().st_size, "sha256": digest(path.read_bytes())}
            for name, path in sorted(files.items())
            if name != "manifest.json"
        }
        record["inputs"] = json.loads((copy.run / "report.json").read_text())["inputs"]

    edit_json(copy.run / "manifest.json", change)


def sign(copy: Copy) -> None:
    """Make tables and report carry the digests of the cell and of the rows as they are now, then seal."""
    record = json.loads((copy.run / "report.json").read_text())
    texts = {name: copy.table(name).read_text(encoding="utf-8") for name in record["joints"]}
    now = {"cell": record["inputs"]["small.yaml"], "program": program_digest(texts)}
    for name, text in texts.items():
        signed = re.sub("# cell digest: sha256 .*", f"# cell digest: sha256 {now['cell']}", text)
        signed = re.sub("# program digest: sha256 .*", f"# program digest: sha256 {now['program']}", signed)
        copy.table(name).write_text(signed, encoding="utf-8")
    clock = copy.table("clock")
    text = re.sub("# program digest: sha256 .*", f"# program digest: sha256 {now['program']}", clock.read_text())
    clock.write_text(text, encoding="utf-8")
    edit_json(copy.run / "report.json", lambda record: record["digests"].update(program=now["program"]))
    seal(copy)
