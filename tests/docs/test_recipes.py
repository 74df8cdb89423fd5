"""The recipes of ``docs/developing.md``: their places exist and suffice, and five of them are carried out."""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from cellplan.cli.main import COMMANDS
from cellplan.model.solver import METHODS

ROOT = Path(__file__).resolve().parent.parent.parent
PACKAGE = ROOT / "cellplan"
PAGE = (ROOT / "docs" / "developing.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| `(?P<place>[^`]+)` \| (?P<names>(?:`[^`]+`(?:, )?)+) \| .+ \|$", re.MULTILINE)
RECIPES = dict(re.findall(r"^### A new ([^\n]+)\n(.*?)(?=^##)", PAGE, re.MULTILINE | re.DOTALL))
# Every module of the package that has to be changed for a further one names one of those that exist like this.
TRACES = {
    "resolution method": r"\bjacobian_transpose\b",
    "check": r"\bcheck_locked\b",
    "figure": r"\benergy_proxy_s\b",
    "kind of result": r"\bcellplan\.jobs\.sweep\.result\b",
    "program format": r"\brender_csv\b|\bimport CSV\b",
    "command": r"\bcellplan\.cli\.verify\b",
    "bundled robot": r"\bplanar_3r\b",
    "template": r"\bown-urdf\b",
    "shape": r"\bcase [^:\n]*\bSphere\(",
    "kind of path": r"\bRhombusEntry\b|\bcase PolygonPath\(|\bPathSpec = ",
}

METHOD = '''"""Least norm: joint velocities by the Moore-Penrose inverse."""

import numpy as np

from cellplan.planning.tracking.problem import StepResult


def least_norm(problem):
    """One Euler step with the Moore-Penrose inverse of the cooperation Jacobian."""

    def advance(k, q):
        tasks = problem.first_order(k, q)
        return StepResult(q=q + np.linalg.pinv(tasks.J) @ (tasks.twist + problem.gain * tasks.error) * problem.step(k))

    return advance
'''
TRAITS = '"least_norm": MethodTraits(label="least norm", has_null_space=False, takes_euler_steps=True),'
CHECK = '''"""Check of the travel of all joints."""

import numpy as np

from cellplan.model.report.report import Check


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

from cellplan.programs.formats.csv import CSV, read_csv, render_csv


def render_semicolons(job):
    """The text of the plain format with another separator."""
    return {name: text.replace(",", ";") for name, text in render_csv(job).items()}


def read_semicolons(frame, files):
    """The rows of such files."""
    return read_csv(frame, {name: text.replace(";", ",") for name, text in files.items()})


SEMICOLONS = replace(CSV, name="semicolons", title="with semicolons", render=render_semicolons, read=read_semicolons)
'''
FIGURE = {
    "_LISTED: Final = (\n": 'FigureQuantity("travel_s", max, max, 1.0, "", None, "longest travel at top speed"),',
    "MappingProxyType({\n": '"travel_s": Shown("travel<br>s", small, "travel s", 1.0, "t"),',
    "KEY: Final = (\n": '"travel_s",',
    "velocity_ratio(use)\n": '        yield "travel_s", use.joint, use.travel / use.velocity_limit\n',
}  # what is written into the table of figures, by what it stands behind
KIND = '''"""How far each joint of a cell travels: the work, and its record, text, page and tables."""

from cellplan.model.report.report import CAUTION
from cellplan.runs.solve import solve
from cellplan.runs.write_run import versions
from cellplan.report.page.kind import ResultKind
from cellplan.report.page.render import template
from cellplan.report.record.common import as_json, number
from cellplan.report.record.rows import listed_table


def travels(cell):
    """The record of the travel of all joints."""
    uses = [use for run in solve(cell).runs for use in run.report.joints]
    joints = [{"joint": f"{use.robot}/{use.joint}", "travel": number(use.travel)} for use in uses]
    return {"schema": "cellplan.travels/1", "cell": cell.name, "status": "passed", "joints": joints} | {
        "inputs": dict(cell.inputs), "versions": versions()
    }


def write_travels(record, folder):
    """Write record and page."""
    folder.mkdir()
    (folder / "travels.json").write_text(as_json(record))
    (folder / "travels.html").write_text(template("jobs/travels.html").render(r=record, caution=CAUTION))


TRAVELS = ResultKind(
    name="travels",
    title="Travels",
    file="travels.json",
    tables=lambda record: {"joints": listed_table(record, "joints")},
    shown={"joints": ("joint", "travel")},
)
'''
KIND_PAGE = """{% extends "frame.html" %}
{% block content %}
{% for each in r.joints %}<p>{{ each.joint }}: {{ each.travel }}</p>{% endfor %}
{% endblock %}
"""
KIND_COMMAND = '''"""``cellplan travels``: how far each joint travels."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cellplan.cli.options.request import Options, option
from cellplan.cli.options.shared import AsJson, CellFile
from cellplan.cli.terminal.output import Result, result_of_folder
from cellplan.errors import ExitStatus


@dataclass(frozen=True, slots=True, kw_only=True)
class TravelsOptions(Options):
    """What is solved."""

    SCHEMA = "cellplan.travels/1"

    cell: CellFile
    output: Annotated[Path, option("-o, --output DIR", "Folder.")]
    as_json: AsJson = False


def travels(options: TravelsOptions) -> Result:
    """How far each joint travels."""
    from cellplan.files.cell.load import load_cell
    from cellplan.jobs.travels import travels as made
    from cellplan.jobs.travels import write_travels

    record = made(load_cell(options.cell))
    write_travels(record, options.output)
    return result_of_folder(options.schema, ExitStatus.PASSED, [], options.output / "travels.html", travels=record)
'''
SHOW = """import pathlib, cellplan
place = pathlib.Path("travels")
assert cellplan.tables(place) == ("joints",)
assert ">Travels<" in cellplan.to_html(place)
"""


def rows(recipe: str) -> dict[str, list[str]]:
    """Names by place, as the table of a recipe has them."""
    return {row["place"]: re.findall(r"`([^`]+)`", row["names"]) for row in ROW.finditer(RECIPES[recipe])}


@cache
def texts() -> dict[str, str]:
    """The modules of the package by their places."""
    return {path.relative_to(PACKAGE).as_posix(): path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py")}


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
    touched = {name for name, text in texts().items() if re.search(TRACES[recipe], text)}

    assert touched <= set(rows(recipe))


def test_every_package_has_its_line_and_every_line_its_package() -> None:
    table = PAGE.partition("## Packages")[2].partition("Three rules")[0]
    listed = re.findall(r"^\| `([^`]+)` \|", table, re.MULTILINE)
    packages = {path.parent.relative_to(PACKAGE).as_posix() for path in PACKAGE.rglob("__init__.py")}

    assert sorted("." if name == "cellplan" else name for name in listed) == sorted(packages)


def test_what_the_lines_of_packages_say_holds() -> None:
    said = dict(re.findall(r"^\| `([^`]+)` \| ([^|]+) \|$", PAGE, re.MULTILINE))
    commands = {f"cli/{group.lower().replace(' ', '_')}": list(named) for group, named in COMMANDS.items()}
    classes = [node for path in (PACKAGE / "model").rglob("*.py") for node in ast.walk(ast.parse(path.read_text()))]
    made = [ast.unparse(word) for node in classes if isinstance(node, ast.ClassDef) for word in node.decorator_list]

    assert {package: re.findall(r"`(\w+)`", said[package]) for package in commands} == commands
    assert all("frozen=True" in words for words in made if words.startswith("dataclass"))  # model: frozen data
    assert {path.stem for path in (PACKAGE / "planning" / "methods").glob("[a-z]*.py")} == set(METHODS)  # one file each


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


def add_method(copy: Path) -> None:
    (copy / "planning" / "methods" / "least_norm.py").write_text(METHOD, encoding="utf-8")
    insert(copy / "model" / "solver.py", "MethodName = Literal[", '"least_norm",')
    insert(
        copy / "model" / "solver.py",
        "METHODS: Final[Mapping[MethodName, MethodTraits]] = MappingProxyType(\n    {",
        TRAITS,
    )


def add_check(copy: Path) -> None:
    (copy / "checks" / "joints" / "travel.py").write_text(CHECK, encoding="utf-8")
    verify = copy / "checks" / "verify.py"
    insert(verify, "import numpy as np\n", "from cellplan.checks.joints.travel import check_travel\n")
    insert(verify, "        checks=tuple(checks", ") + tuple(check_travel(q, limit=10.0)")
    insert(
        copy / "model" / "report" / "check_kinds.py",
        "# the gravest first\n",
        '    CheckKind("travel", "travel small", "Too far"),\n',
    )


def add_format(copy: Path) -> None:
    (copy / "programs" / "formats" / "semicolons.py").write_text(FORMAT, encoding="utf-8")
    line = '    semicolons="semicolons:SEMICOLONS",\n'
    insert(copy / "programs" / "dialects.py", '    ros2="ros2.writer:ROS2",\n', line)


def add_figure(copy: Path) -> None:
    for after, text in FIGURE.items():
        insert(copy / "report" / "record" / "figures.py", after, text)
    insert(copy / "jobs" / "sweep" / "result.py", "COLUMNS: Final = (", '"travel_s", ')


def add_kind(copy: Path) -> None:
    (copy / "jobs" / "travels.py").write_text(KIND, encoding="utf-8")
    (copy / "jobs" / "travels.html").write_text(KIND_PAGE, encoding="utf-8")
    (copy / "cli" / "improve" / "travels.py").write_text(KIND_COMMAND, encoding="utf-8")
    insert(copy / "cli" / "main.py", "import sweep\n", "from cellplan.cli.improve.travels import travels\n")
    insert(copy / "cli" / "main.py", '"sweep": sweep,\n', '        "travels": travels,\n')
    kinds = copy / "jobs" / "present" / "kinds.py"
    insert(kinds, "import STUDY\n", "from cellplan.jobs.travels import TRAVELS\n")
    insert(kinds, "OF_JOBS: Final = (", "TRAVELS, ")


def copied(folder: Path, *ignored: str) -> Path:
    """A copy of the package without files of some names."""
    return Path(shutil.copytree(PACKAGE, folder / "cellplan", ignore=shutil.ignore_patterns(*ignored)))


@pytest.mark.parametrize(("add", "most"), [(add_check, 3), (add_figure, 2), (add_kind, 5)])
def test_an_addition_touches_few_files(add: Callable[[Path], None], most: int, tmp_path: Path) -> None:
    """Those of the package; a check and a figure have a row in the docs besides, a kind one in the import contracts."""
    copy = copied(tmp_path, "__pycache__")

    add(copy)

    files = {path.relative_to(copy): path.read_bytes() for path in copy.rglob("*") if path.is_file()}
    was = {path.relative_to(PACKAGE): path for path in PACKAGE.rglob("*") if path.is_file()}
    touched = [name for name, content in files.items() if name not in was or was[name].read_bytes() != content]
    assert len(touched) == most, touched


@pytest.fixture(scope="module")
def extended(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with a copy of the package to which the recipes added all that they carry out, and with a run."""
    folder = tmp_path_factory.mktemp("extended")
    copy = copied(folder)  # what is compiled goes with it
    for add in (add_method, add_check, add_format, add_figure, add_kind):
        add(copy)
    cell = (ROOT / "examples" / "plate.yaml").read_text(encoding="utf-8")
    loose = re.sub(r"tolerance: \{.*\}", "tolerance: {position_mm: 1, orientation_deg: 1}", cell)
    (folder / "plate.yaml").write_text(loose, encoding="utf-8")

    run(folder, "solve", "plate.yaml", "--method", "least_norm", "-o", "run")
    return folder


def run(folder: Path, *arguments: str) -> None:
    """Run a command of the copy of the package that lies in a folder."""
    python(folder, "-m", "cellplan", *arguments)


def python(folder: Path, *arguments: str) -> None:
    """Run Python with the copy of the package that lies in a folder."""
    command = [sys.executable, *arguments]
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


@pytest.mark.slow
def test_a_format_that_follows_its_recipe_is_written_after_all_checks(extended: Path) -> None:
    run(extended, "export", "run", "--cell", "plate.yaml", "--format", "semicolons", "-o", "programs")

    lines = (extended / "programs" / "left.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "time_s;A_deg;B_deg;C_deg"
    assert len(lines) == 1 + 151


@pytest.mark.slow
def test_a_figure_that_follows_its_recipe_is_in_the_table_of_a_sweep(extended: Path) -> None:
    run(extended, "sweep", "plate.yaml", "--vary", "motion.duration_s=3,4", "--workers", "1", "-o", "study")

    header, *lines = (extended / "study" / "study.csv").read_text(encoding="utf-8").splitlines()
    values = [float(line.split(",")[header.split(",").index("travel_s")]) for line in lines]
    assert values[0] == pytest.approx(values[1], rel=1e-2)  # the same path at two speeds
    assert 0.0 < values[0] < 3.0


@pytest.mark.slow
def test_a_kind_of_result_that_follows_its_recipe_is_written_and_shown(extended: Path) -> None:
    run(extended, "travels", "plate.yaml", "-o", "travels")

    assert "<p>left/A: " in (extended / "travels" / "travels.html").read_text(encoding="utf-8")
    python(extended, "-c", SHOW)
