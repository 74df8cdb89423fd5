"""Names say what they hold: words that fit anything are no names of the package."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / "cellplan"
SOURCES = sorted(PACKAGE.rglob("*.py"))
WORDS = frozenset({"asked", "beside", "each", "found", "kept", "own", "room"})


def bound_names(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Every name that a file binds: variables, parameters, fields, attributes of ``self``, functions and classes."""
    for node in ast.walk(tree):
        match node:
            case ast.Name(ctx=ast.Store()):
                yield node.lineno, node.id
            case ast.Attribute(ctx=ast.Store()):
                yield node.lineno, node.attr
            case ast.arg():
                yield node.lineno, node.arg
            case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
                yield node.lineno, node.name
            case ast.alias(asname=str(name)):
                yield node.lineno, name
            case ast.ExceptHandler(name=str(name)) | ast.MatchAs(name=str(name)) | ast.MatchStar(name=str(name)):
                yield node.lineno, name
            case ast.MatchMapping(rest=str(name)):
                yield node.lineno, name


def test_no_name_of_the_package_is_a_word_that_fits_anything() -> None:
    named = [
        f"{path.relative_to(PACKAGE.parent).as_posix()}:{line}: {name}"
        for path in SOURCES
        for line, name in bound_names(ast.parse(path.read_text(encoding="utf-8")))
        if name.lower().strip("_") in WORDS
    ]

    assert named == []
    assert [path.name for path in SOURCES if path.stem in WORDS] == []


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
    assert "found" in {name.lower() for _, name in bound_names(ast.parse(source))}
