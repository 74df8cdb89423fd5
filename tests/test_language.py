"""Names say what they hold: words that fit anything are no names of the package."""

import ast
import re
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "cellplan"
SOURCES = sorted(PACKAGE.rglob("*.py"))
SCRIPTS = sorted(
    path for folder in ("benchmarks", "docs", "examples", "tests") for path in (ROOT / folder).rglob("*.py")
)
WORDS = frozenset({"asked", "beside", "drawn", "each", "found", "kept", "lacks", "own", "room", "way", "ways"})
KEYS = frozenset(  # of files, which their readers know, and errors
    {"by_derivatives_kept", "each_ms", "ends_kept", "own_accuracy_mm", "seeded_kept", "tasks_kept"}
    | {f"{place}NotFoundError" for place in ("Home", "Start", "Transfer")}
)


BINDS: dict[type[ast.AST], str] = {  # nodes that bind a name, and their attribute that holds it
    ast.Name: "id",
    ast.Attribute: "attr",
    ast.arg: "arg",
    ast.alias: "asname",
    **dict.fromkeys((ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.ExceptHandler), "name"),
    ast.MatchAs: "name",
    ast.MatchStar: "name",
    ast.MatchMapping: "rest",
}


@cache
def nodes_of(path: Path) -> tuple[ast.AST, ...]:
    """All nodes of the syntax tree of a file."""
    return tuple(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))


def bound_names(nodes: Iterable[ast.AST]) -> Iterator[tuple[int, str]]:
    """Every name that a file binds: variables, parameters, fields, attributes of ``self``, functions and classes."""
    for node in nodes:
        attribute = BINDS.get(type(node))
        if attribute is not None and not isinstance(getattr(node, "ctx", None), ast.Load | ast.Del):
            name = getattr(node, attribute)
            if name is not None:
                yield node.lineno, name  # type: ignore[attr-defined]


def places_of(paths: Iterable[Path], is_vague: Callable[[str], bool]) -> list[str]:
    """Where files bind names that say nothing."""
    return [
        f"{path.relative_to(ROOT).as_posix()}:{line}: {name}"
        for path in paths
        for line, name in bound_names(nodes_of(path))
        if is_vague(name)
    ]


@cache
def has_vague_word(name: str) -> bool:
    """Whether a word of a name fits anything."""
    words = {word.lower() for word in re.findall(r"[A-Z]?[a-z0-9]+|[A-Z]+(?![a-z])", name)}
    return bool(words & WORDS) and name not in KEYS


def test_no_name_of_the_package_has_a_word_that_fits_anything() -> None:
    assert places_of(SOURCES, has_vague_word) == []
    assert [path.name for path in SOURCES if path.stem in WORDS] == []


def test_no_name_of_tests_and_scripts_is_a_word_that_fits_anything() -> None:
    assert places_of(SCRIPTS, lambda name: name.lower().strip("_") in WORDS) == []


def test_words_of_a_name_are_told_apart() -> None:
    assert has_vague_word("is_kept")
    assert has_vague_word("_OWN_NAMES")
    assert has_vague_word("FoundStart")
    assert not has_vague_word("shown_foundation")
    assert not has_vague_word("each_ms")


@pytest.mark.parametrize(
    "source",
    [
        "found = 1",
        "for found in (): pass",
        "[0 for found in ()]",
        "def run(found): ...",
        "def found(): ...",
        "class Found: ...",
        "class Result:\n    found: int",
        "self.found = 1",
        "import json as found",
        "match 1:\n    case found: ...",
    ],
)
def test_every_way_to_bind_a_name_is_seen(source: str) -> None:
    assert "found" in {name.lower() for _, name in bound_names(ast.walk(ast.parse(source)))}


ENTRY = re.compile(r"^    \*{0,2}(\w+):", re.MULTILINE)


def described_without_a_parameter(node: ast.FunctionDef) -> list[str]:
    """Names below ``Args:`` that are no parameters of a function."""
    _, _, section = (ast.get_docstring(node) or "").partition("Args:\n")
    taken = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs, node.args.vararg, node.args.kwarg]
    return sorted({*ENTRY.findall(section.partition("\n\n")[0])} - {arg.arg for arg in taken if arg is not None})


def test_docstrings_describe_parameters_by_their_names() -> None:
    functions = [(path.name, node) for path in SOURCES for node in nodes_of(path) if isinstance(node, ast.FunctionDef)]
    wrong = {f"{file}: {node.name}": described_without_a_parameter(node) for file, node in functions}

    assert {place: names for place, names in wrong.items() if names} == {}
    (node,) = ast.parse('def f(a):\n    """One.\n\n    Args:\n        b: Two.\n    """').body
    assert isinstance(node, ast.FunctionDef)
    assert described_without_a_parameter(node) == ["b"]
