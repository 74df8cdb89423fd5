"""The structure of the code: sizes, doors to the engines, tests that assert, and a command line that starts at once."""

import ast
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path, PurePosixPath

import pytest

ROOT = Path(__file__).resolve().parent.parent
CONFIGURATION = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGE = ROOT / "cellplan"
TESTS = ROOT / "tests"
SOURCES = sorted(PACKAGE.rglob("*.py"))
SCRIPTS = sorted(path for folder in ("tests", "docs", "benchmarks") for path in (ROOT / folder).rglob("*.py"))

FILE_LINES = 400
BODY_LINES = 40
CLASS_METHODS = 12
PARAMETERS = 6

EVERYWHERE = {"cellplan", "numpy"}
HEAVY = {"numpy", "pinocchio", "fcl", "coal", "daqp", "trimesh", "matplotlib", "pydantic", "jinja2", "yaml"}

Function = ast.FunctionDef | ast.AsyncFunctionDef


def place(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@cache
def parsed(path: Path) -> ast.Module:
    """The tree of a file, which nobody may change."""
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def nodes(path: Path) -> tuple[ast.AST, ...]:
    """All nodes of the tree of a file."""
    return tuple(ast.walk(parsed(path)))


def functions(path: Path) -> Iterator[Function]:
    return (node for node in nodes(path) if isinstance(node, Function))


def has_docstring(node: Function) -> bool:
    return ast.get_docstring(node, clean=False) is not None


def body_lines(node: Function) -> int:
    statements = node.body[1:] if has_docstring(node) else node.body
    if not statements:
        return 0
    first = node.body[0].end_lineno if has_docstring(node) else statements[0].lineno - 1
    return (node.end_lineno or 0) - (first or 0)


def parameters(node: Function) -> list[ast.arg]:
    arguments = node.args
    named = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
    return [argument for argument in named if argument.arg not in {"self", "cls"}]


@cache
def imported_modules(path: Path) -> set[str]:
    modules = set()
    for node in nodes(path):
        if isinstance(node, ast.Import):
            modules |= {alias.name.partition(".")[0] for alias in node.names}
        if isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            modules.add(node.module.partition(".")[0])
    return modules


def modules_loaded_by(*arguments: str) -> set[str]:
    run = subprocess.run(
        [sys.executable, "-X", "importtime", *arguments], capture_output=True, text=True, check=True, cwd=ROOT
    )
    return {match[1] for match in re.finditer(r"^import time:.*\|\s*([\w]+)", run.stderr, flags=re.MULTILINE)}


def test_no_file_is_longer_than_one_can_read_at_once() -> None:
    lengths = {place(path): len(path.read_text(encoding="utf-8").splitlines()) for path in [*SOURCES, *SCRIPTS]}

    assert {path: lines for path, lines in lengths.items() if lines > FILE_LINES} == {}


def test_functions_and_classes_stay_small() -> None:
    assert [f"{place(path)}: {words}" for path in SOURCES for words in oversized(path)] == []


def oversized(path: Path) -> Iterator[str]:
    """Functions and classes of a file that are too large."""
    for node in nodes(path):
        if isinstance(node, Function):
            if body_lines(node) > BODY_LINES:
                yield f"{node.name}: {body_lines(node)} lines"
            if len(parameters(node)) > PARAMETERS:
                yield f"{node.name}: {len(parameters(node))} parameters"
        elif isinstance(node, ast.ClassDef):
            methods = sum(isinstance(child, Function) for child in node.body)
            if methods > CLASS_METHODS:
                yield f"{node.name}: {methods} methods"


def test_no_file_is_an_empty_placeholder() -> None:
    empty = [place(path) for path in [*SOURCES, *SCRIPTS] if not path.read_text(encoding="utf-8").strip()]
    hollow = [place(path) for path in SOURCES if path.name != "__init__.py" and len(parsed(path).body) < 2]
    packages_without_content = [
        place(path.parent) for path in SOURCES if path.name == "__init__.py" and not any_other_module(path.parent)
    ]

    assert empty + hollow + packages_without_content == []


def any_other_module(folder: Path) -> bool:
    return any(path.name != "__init__.py" for path in folder.rglob("*.py"))


def test_no_import_closes_a_circle() -> None:
    """Imports inside functions count as well; those for type checkers do not."""
    modules = {".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in SOURCES}
    arrows = {name: {other for other in module_imports(path) if other in modules} for name, path in modules.items()}

    order = list(TopologicalSorter(arrows).static_order())  # raises CycleError, which names the circle

    assert sorted(order) == sorted(modules)


def module_imports(path: Path) -> set[str]:
    """Modules from which a file imports names, without those that it imports for type checkers only."""
    branches = [node for node in nodes(path) if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"]
    for_types = {child for branch in branches for statement in branch.body for child in ast.walk(statement)}
    result = [
        node for node in nodes(path) if isinstance(node, ast.ImportFrom) and node.module and node not in for_types
    ]
    return {node.module for node in result} | {f"{node.module}.{alias.name}" for node in result for alias in node.names}


def test_fields_of_frozen_classes_are_set_by_one_helper() -> None:
    setters = re.compile(r"object\.__setattr__|\bvars\(.+\)\[|\.__dict__\[")

    assert [place(path) for path in SOURCES if setters.search(path.read_text(encoding="utf-8"))] == [
        "cellplan/geometry/frozen.py"
    ]


def test_the_package_uses_no_public_name_but_its_version() -> None:
    """Results know nothing of what stands above them: ``cellplan`` introduces their presenter."""
    attributes = (node for path in SOURCES for node in nodes(path) if isinstance(node, ast.Attribute))

    assert {node.attr for node in attributes if ast.unparse(node.value) == "cellplan"} == {"__version__"}


def test_measures_give_no_verdicts() -> None:
    judged = {place(path) for path in SOURCES if PACKAGE / "measures" in path.parents and "Check" in names(path)}

    assert judged == set()


def names(path: Path) -> set[str]:
    """All names that a file uses."""
    return {node.id for node in nodes(path) if isinstance(node, ast.Name)}


def test_every_engine_has_one_door() -> None:
    """Also an engine that no contract names yet; a change of engine is then a change of one file."""
    doors = doors_of_the_contracts()
    imports = {path: imported_modules(path) - sys.stdlib_module_names - EVERYWHERE for path in SOURCES}

    smuggled = [
        f"{place(path)} imports {name}" for path in SOURCES for name in imports[path] if not is_door(path, name, doors)
    ]

    assert smuggled == []


def doors_of_the_contracts() -> dict[str, list[str]]:
    """Files that may import an engine, as the contracts "one door for ..." in pyproject.toml state them."""
    doors: dict[str, list[str]] = {}
    for contract in CONFIGURATION["tool"]["importlinter"]["contracts"]:
        if contract["name"].startswith("one door for "):
            assert contract["source_modules"] == ["cellplan"]
            for allowed in contract["ignore_imports"]:
                module, engine = allowed.removeprefix("cellplan.").split(" -> ")
                assert engine in contract["forbidden_modules"]
                doors.setdefault(engine, []).append(module.replace(".", "/") + ".py")
    return doors


def is_door(path: Path, engine: str, doors: dict[str, list[str]]) -> bool:
    """Whether a file may import an engine."""
    inside = PurePosixPath(path.relative_to(PACKAGE).as_posix())
    return any(inside.match(door) for door in doors.get(engine, []))


def test_the_table_of_engines_is_that_of_the_imports() -> None:
    doors: dict[str, set[str]] = {}
    for path in SOURCES:
        for name in imported_modules(path) - sys.stdlib_module_names - EVERYWHERE:
            if path.name != "presented.py":  # names pandas for type checkers only
                doors.setdefault(name.removesuffix("_core"), set()).add(path.relative_to(PACKAGE).as_posix())
    page = (ROOT / "docs" / "developing.md").read_text(encoding="utf-8")
    table = re.findall(r"^\| (\w+) \| (`[^|]+`) \|$", page.partition("| engine | door |")[2], re.MULTILINE)

    assert table == [(name, ", ".join(f"`{door}`" for door in short(places))) for name, places in sorted(doors.items())]


def short(places: set[str]) -> list[str]:
    """Two files at most by their names; more by their package, or by their folders."""
    if len(places) < 3:
        return sorted(places)
    packages = {place.partition("/")[0] for place in places}
    return [f"{packages.pop()}/"] if len(packages) == 1 else sorted({f"{PurePosixPath(it).parent}/" for it in places})


def test_every_engine_is_a_declared_dependency() -> None:
    """Extras read xacro and STEP files, talk to a cluster, write DXF, make frames: only who does so needs them."""
    extras = CONFIGURATION["project"]["optional-dependencies"]
    further = [
        requirement
        for name in ("assign", "xacro", "cluster", "plots", "dxf", "frames", "step")
        for requirement in extras[name]
    ]
    requirements = [*CONFIGURATION["project"]["dependencies"], *further]
    declared = {re.split(r"[<>=!~ \[]", requirement)[0].lower() for requirement in requirements}
    package_of = {"pinocchio": "pin", "fcl": "python-fcl", "yaml": "pyyaml", "pydantic_core": "pydantic"}
    package_of |= {"collada": "pycollada", "OCP": "cadquery-ocp-novtk"}

    used = {name for path in SOURCES for name in imported_modules(path)} - sys.stdlib_module_names - {"cellplan"}

    assert {package_of.get(name, name) for name in used} <= declared


@pytest.mark.parametrize("arguments", [("-c", "import cellplan.cli.main"), ("-m", "cellplan", "--help")], ids=" ".join)
def test_help_starts_without_any_engine(arguments: tuple[str, ...]) -> None:
    assert modules_loaded_by(*arguments) & HEAVY == set()


def test_every_test_asserts_something() -> None:
    """With an assertion, an expected error, a function of numpy.testing, or a helper that does one of these."""
    calls = {path: called_names(path) for path in SCRIPTS if TESTS in path.parents}
    shared = {name: called for path in calls if path.parent.name == "builders" for name, called in calls[path].items()}
    shared = {name: called for name, called in shared.items() if name in asserting(shared)}

    silent = [
        f"{place(path)}: {name}"
        for path, called in calls.items()
        for name in called.keys() - asserting(shared | called)
        if name.startswith("test_")
    ]

    assert silent == []


def called_names(path: Path) -> dict[str, set[str]]:
    """What each function of a file calls, by the last part of the name; a statement ``assert`` counts as a call."""
    results: dict[str, set[str]] = {}
    for node in functions(path):
        names = results.setdefault(node.name, set())
        for child in ast.walk(node):
            if isinstance(child, ast.Assert):
                names.add("assert_")
            elif isinstance(child, ast.Call):
                names.add(child.func.attr if isinstance(child.func, ast.Attribute) else getattr(child.func, "id", ""))
    return results


def asserting(calls: dict[str, set[str]]) -> set[str]:
    """Names of the functions that assert, themselves or by a function that they call."""
    result = {name for name, called in calls.items() if any(re.match("raises$|assert_", other) for other in called)}
    while more := {name for name, called in calls.items() if name not in result and called & result}:
        result |= more
    return result


BLOCKING = {"wait", "join", "result", "exception", "acquire", "communicate"}  # without an argument they wait for ever


def waits_without_limit(path: Path) -> list[str]:
    """Calls of a file that wait for a process, a thread or an answer for as long as it takes."""
    lines = []
    for node in nodes(path):
        if not isinstance(node, ast.Call) or any(keyword.arg == "timeout" for keyword in node.keywords):
            continue
        is_method = isinstance(node.func, ast.Attribute) and node.func.attr in BLOCKING
        is_subprocess = isinstance(node.func, ast.Attribute) and ast.unparse(node.func) == "subprocess.run"
        is_function = isinstance(node.func, ast.Name) and node.func.id == "wait"
        if is_subprocess or is_function or (is_method and not (node.args or node.keywords)):
            lines.append(f"{place(path)}:{node.lineno}: {ast.unparse(node)}")
    return lines


def test_nothing_waits_without_a_limit() -> None:
    assert [line for path in SOURCES for line in waits_without_limit(path)] == []


def test_nothing_unfinished_is_shipped() -> None:
    marks = re.compile(r"\b(TODO|FIXME|XXX|NotImplementedError)\b")

    unfinished = [place(path) for path in SOURCES if marks.search(path.read_text(encoding="utf-8"))]

    assert unfinished == []


def test_scripts_are_executable() -> None:
    assert os.access(ROOT / ".ci" / "run", os.X_OK)
