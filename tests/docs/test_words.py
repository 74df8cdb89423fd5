"""Private words stay out of the program, its messages and its documentation; the glossary lists what to say instead."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
GLOSSARY = ROOT / "docs" / "glossary.md"
WORDS = {
    "wanted": r"wanted",
    "told": r"told",
    "lane": r"lanes?",
    "laid": r"laid",
    "lay": r"lays?",
    "unnoticed": r"unnoticed",
    "posture": r"(?<![\"'`._])(?<!start )(?<!Start )postures?(?![\"'`_]| ?[:=])",  # not the key, not the term
    "nobody": r"nobody",
    "leap": r"leap(?:s|ed|ing)?",
    "goes there": r"goe?s?\s+there",
    "way on": r"ways?\s+on",
    "as they come": r"as\s+they\s+come",
    "stands by": r"stands?\s+by(?!\s+the\s+standard)",
    "wish": r"wish(?:es|ed)?",
    "slip": r"slips?",
    "hears": r"hears?",
    "looks at": r"look(?:s|ed|ing)?\s+at",
    "aside": r"aside",
    "instants": r"instants",
    "who wants to know": r"who\s+wants\s+to\s+know",
}
NAMED = re.compile(rf"\b(?:{'|'.join(WORDS.values())})\b", re.I)
SUFFIXES = {".py", ".md", ".txt", ".html", ".css", ".js", ".toml"}


def sources() -> list[Path]:
    """Everything that is read by people: package, benchmarks, docs and examples; neither the glossary nor history."""
    folders = [ROOT / name for name in ("cellplan", "benchmarks", "docs", "examples")]
    files = [path for folder in folders for path in sorted(folder.rglob("*")) if path.suffix in SUFFIXES]
    pages = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "Makefile", "pyproject.toml")]
    return [path for path in [*files, *pages] if path != GLOSSARY and "__pycache__" not in path.parts]


def comments(path: Path) -> str:
    """A cell without its keys and values."""
    return "\n".join(line.partition("#")[2] for line in path.read_text(encoding="utf-8").splitlines())


def hits(path: Path, text: str) -> list[str]:
    """Place and text of every private word; words that are split by a line break count as well."""
    return [
        f"{path.relative_to(ROOT).as_posix()}:{text.count(chr(10), 0, match.start()) + 1}: {match[0]!r}"
        for match in NAMED.finditer(text)
    ]


def test_no_private_word_is_used() -> None:
    result = [hit for path in sources() for hit in hits(path, path.read_text(encoding="utf-8"))]
    result += [hit for path in sorted((ROOT / "cells").rglob("*.yaml")) for hit in hits(path, comments(path))]

    assert result == []


def test_the_glossary_lists_every_private_word_with_its_replacement() -> None:
    section = GLOSSARY.read_text(encoding="utf-8").partition("## Words that are not used")[2].partition("\n## ")[0]
    rows = dict(re.findall(r"^\| ([^|,]+?)(?:, [^|]*)? \| ([^|]+) \|$", section, re.MULTILINE))

    assert set(rows) - {"not"} == set(WORDS)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("what nobody\nwants", ["nobody"]),
        ("is looked\n   at", ["looked\n   at"]),
        ("is looked at", ["looked at"]),
        ("start posture, `posture`, solver.secondary.posture, posture: {}", []),
        ("in every posture", ["posture"]),
        ("layout, slipping, plane, planes, instant, leapfrog", []),
        ("Who wants to know how far it is", ["Who wants to know"]),
    ],
)
def test_words_are_found_as_whole_words_with_the_named_exceptions(text: str, words: list[str]) -> None:
    assert [match[0] for match in NAMED.finditer(text)] == words
