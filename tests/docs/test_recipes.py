"""The recipes of ``docs/developing.md``: their places exist and suffice, and three of them are carried out."""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
PACKAGE = ROOT / "cellplan"
PAGE = (ROOT / "docs" / "developing.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| `(?P<place>[^`]+)` \| (?P<names>(?:`[^`]+`(?:, )?)+) \| .+ \|$", re.MULTILINE)
RECIPES = dict(re.findall(r"^### A new ([^\n]+)\n(.*?)(?=^##)", PAGE, re.MULTILINE | re.DOTALL))
# Every module of the package that has to be changed for a further one names one of those that exist like this.
TRACES = {
    "resolution method": r"\bjacobian_transpose\b",
    "check": r"\bcheck_locked\b",
    "program format": r"\brender_csv\b|\bimport CSV\b",
    "command": r"\bcellplan\.cli\.verify\b",
    "bundled robot": r"\bplanar_3r\b",
    "template": r"\bown-urdf\b",
    "shape": r"\bcase [^:\n]*\bSphere\(",
    "kind of path": r"\bRhombusEntry\b|\bcase PolygonPath\(|\bPathSpec = ",
}

METHOD = '''"""Least norm: joint velocities by the Moore-Penrose inverse."""

import numpy as np

from cellplan.planning.tracking.problem import Advance


def least_norm(problem):
    """One Euler step with the Moore-Penrose inverse of the cooperation Jacobian."""

    def advance(k, q):
        tasks = problem.first_order(k, q)
        return Advance(q=q + np.linalg.pinv(tasks.J) @ (tasks.twist + problem.gain * tasks.error) * problem.step(k))

    return advance
'''
TRAITS = '"least_norm": MethodTraits(label="least norm", has_null_space=False, takes_euler_steps=True),'
CHECK = '''"""Check of the travel of all joints."""

import numpy as np

from cellplan.model.report import Check


def check_travel(q, *, limit):
    """Whether no joint travels farther than a limit in [rad] or [m]."""
    for robot, positions in q.items():
        value = float(np.abs(np.diff(positions, axis=0)).sum(axis=0).max())
        message = f"largest travel of '{robot}': {value:.3g}, allowed {limit:g}"
        yield Check(
            name="travel", subject=robot, passed=value <= limit, value=value, limit=limit, unit="rad", at_s=None,
            message=message,
        )
'''
FORMAT = '''"""CSV with semicolons."""

from dataclasses import replace

from cellplan.export.csv import CSV, read_csv, render_csv


def render_semicolons(job):
    """The text of the plain format with another separator."""
    return {name: text.replace(",", ";") for name, text in render_csv(job).items()}


def read_semicolons(frame, files):
    """The rows of such files."""
    return read_csv(frame, {name: text.replace(";", ",") for name, text in files.items()})


SEMICOLONS = replace(CSV, name="semicolons", title="with semicolons", render=render_semicolons, read=read_semicolons)
'''


def rows(recipe: str) -> dict[str, list[str]]:
    """Names by place, as the table of a recipe has them."""
    return {row["place"]: re.findall(r"`([^`]+)`", row["names"]) for row in ROW.finditer(RECIPES[recipe])}


def file_of(place: str) -> Path:
    return (
        ROOT / place if place.startswith(("benchmarks/", "cells/", "docs/", "pyproject", "tests/")) else PACKAGE / place
    )


def test_every_kind_of_addition_has_a_recipe() -> None:
    assert set(RECIPES) == set(TRACES)


@pytest.mark.parametrize("recipe", TRACES)
def test_the_places_of_a_recipe_exist_and_hold_the_names(recipe: str) -> None:
    table = rows(recipe)

    assert len(table) >= 4
    assert [place for place in table if not file_of(place).is_file()] == []
    missing = [
        f"{place}: {name}"
        for place, names in table.items()
        for name in names
        if not re.search(rf"\b{re.escape(name)}\b", file_of(place).read_text(encoding="utf-8"))
    ]
    assert missing == []


@pytest.mark.parametrize("recipe", TRACES)
def test_no_module_is_missing_from_a_recipe(recipe: str) -> None:
    touched = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        if re.search(TRACES[recipe], path.read_text(encoding="utf-8"))
    }

    assert touched <= set(rows(recipe))


def test_every_package_has_its_line_and_every_line_its_package() -> None:
    table = PAGE.partition("## Packages")[2].partition("Three rules")[0]
    listed = re.findall(r"^\| `([^`]+)` \|", table, re.MULTILINE)
    packages = {path.parent.relative_to(PACKAGE).as_posix() for path in PACKAGE.rglob("__init__.py")}

    assert sorted("." if name == "cellplan" else name for name in listed) == sorted(packages)


def test_the_layers_are_those_of_the_import_contracts() -> None:
    block = PAGE.partition("## Packages")[2].partition("```text\n")[2].partition("```")[0]
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    layers = next(contract["layers"] for contract in contracts if contract["name"] == "imports point down")

    assert block.splitlines() == layers


def insert(path: Path, after: str, text: str) -> None:
    """Write text behind the one place where another text stands."""
    content = path.read_text(encoding="utf-8")
    assert content.count(after) == 1, f"{path.name}: '{after}' stands there {content.count(after)} times"
    path.write_text(content.replace(after, after + text), encoding="utf-8")


@pytest.fixture(scope="module")
def extended(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with a copy of the package to which the recipes added a method, a check and a format, and with a run."""
    folder = tmp_path_factory.mktemp("extended")
    copy = folder / "cellplan"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    (copy / "planning" / "methods" / "least_norm.py").write_text(METHOD, encoding="utf-8")
    insert(copy / "model" / "solver.py", "MethodName = Literal[", '"least_norm",')
    insert(
        copy / "model" / "solver.py",
        "METHODS: Final[Mapping[MethodName, MethodTraits]] = MappingProxyType(\n    {",
        TRAITS,
    )
    (copy / "checks" / "joints" / "travel.py").write_text(CHECK, encoding="utf-8")
    insert(
        copy / "checks" / "verify.py",
        "import numpy as np\n",
        "from cellplan.checks.joints.travel import check_travel\n",
    )
    insert(copy / "checks" / "verify.py", "        checks=tuple(checks", ") + tuple(check_travel(q, limit=10.0)")
    insert(
        copy / "model" / "check_kinds.py",
        "# the gravest first\n",
        '    CheckKind("travel", "travel small", "Too far"),\n',
    )
    (copy / "export" / "semicolons.py").write_text(FORMAT, encoding="utf-8")
    dialects = copy / "pipeline" / "export" / "dialects.py"
    insert(dialects, "from typing import Final\n", "\nfrom cellplan.export.semicolons import SEMICOLONS\n")
    insert(dialects, "dialect.name: dialect for dialect in (", "SEMICOLONS, ")
    cell = (ROOT / "examples" / "plate.yaml").read_text(encoding="utf-8")
    loose = re.sub(r"tolerance: \{.*\}", "tolerance: {position_mm: 1, orientation_deg: 1}", cell)
    (folder / "plate.yaml").write_text(loose, encoding="utf-8")

    run(folder, "solve", "plate.yaml", "--method", "least_norm", "-o", "run")
    return folder


def run(folder: Path, *arguments: str) -> None:
    """Run a command of the copy of the package that lies in a folder."""
    command = [sys.executable, "-m", "cellplan", *arguments]
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    environment |= {"PYTHONPATH": str(folder)}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_a_method_and_a_check_that_follow_their_recipes_are_in_the_report(extended: Path) -> None:
    report = json.loads((extended / "run" / "report.json").read_text(encoding="utf-8"))

    assert report["solver"]["method"] == "least_norm"
    travel = [check for check in report["checks"] if check["name"] == "travel"]
    assert [check["passed"] for check in travel] == [True, True]
    assert 0.5 < travel[0]["value"] < 10.0


def test_a_format_that_follows_its_recipe_is_written_after_all_checks(extended: Path) -> None:
    run(extended, "export", "run", "--cell", "plate.yaml", "--format", "semicolons", "-o", "programs")

    lines = (extended / "programs" / "left.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "time_s;A_deg;B_deg;C_deg"
    assert len(lines) == 1 + 151
