"""Size of the product and what a change added to it: ``python benchmarks/size.py [--words] [--since COMMIT]``.

Python and JavaScript of ``cellplan/`` are counted apart. Code lines are lines of Python with a token that is neither a
comment, a docstring nor part of an import. Neighbours are the modules and packages that stand in one folder.
With ``--words`` the words of the README and of ``docs/`` are counted instead, with those of code blocks. Pages that a
script writes, or whose figures a test compares with measurements or with the program, are counted apart.
"""

import argparse
import ast
import io
import subprocess
import tokenize
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Final

ROOT: Final = Path(__file__).resolve().parent.parent
LANGUAGES: Final = {".py": "Python", ".js": "JavaScript"}
MADE: Final = frozenset(  # by docs/make_*.py and benchmarks/, or compared with tables of robots and keys of records
    PurePosixPath("docs", page)
    for page in (
        "benchmarks.md",
        "concepts/profile.md",
        "guides/which-method.md",
        "reference/api.md",
        "reference/cell-file.md",
        "reference/commands.md",
        "reference/errors-file.md",
        "reference/layout-json.md",
        "reference/recovery-json.md",
        "reference/report-json.md",
        "reference/robots.md",
        "reproduction.md",
    )
)
SILENT: Final = frozenset(
    {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
)


def main() -> None:
    """Print the sizes, and the differences to a commit where one is named."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--since", metavar="COMMIT", help="print the differences to this commit as well")
    parser.add_argument("--words", action="store_true", help="count the words of the documentation instead")
    options = parser.parse_args()
    places, measure = (("README.md", "docs"), words) if options.words else (("cellplan",), sizes)
    now = measure(working_files(places))
    before = measure(committed_files(options.since, places)) if options.since else {}
    for figure, value in now.items():
        print(f"{figure:28}{value:9,d}" + (f"{value - before[figure]:+9,d} since {options.since}" if before else ""))


def working_files(places: Sequence[str]) -> dict[PurePosixPath, str]:
    """Texts of the files in some places that git tracks or would track, by their paths."""
    listed = git("ls-files", "--cached", "--others", "--exclude-standard", *places)
    paths = (path for path in text_paths(listed) if (ROOT / path).exists())
    return {path: (ROOT / path).read_text(encoding="utf-8") for path in paths}


def committed_files(commit: str, places: Sequence[str]) -> dict[PurePosixPath, str]:
    """Texts of the files in some places of a commit, by their paths."""
    return {
        path: git("show", f"{commit}:{path}")
        for path in text_paths(git("ls-tree", "-r", "--name-only", commit, *places))
    }


def text_paths(listed: str) -> Iterator[PurePosixPath]:
    """The files in the languages that are counted."""
    return (path for path in map(PurePosixPath, sorted(set(listed.splitlines()))) if path.suffix in {*LANGUAGES, ".md"})


def git(*words: str) -> str:
    """What git answers in the checkout."""
    return subprocess.run(["git", *words], cwd=ROOT, check=True, capture_output=True, text=True).stdout


def sizes(files: Mapping[PurePosixPath, str]) -> dict[str, int]:
    """Files and lines by language, lines of code, and the largest number of neighbours."""
    figures = {}
    for suffix, language in LANGUAGES.items():
        texts = [text for path, text in files.items() if path.suffix == suffix]
        figures[f"{language} files"] = len(texts)
        figures[f"{language} lines"] = sum(len(text.splitlines()) for text in texts)
    python = {path: text for path, text in files.items() if path.suffix == ".py"}
    figures["Python code lines"] = sum(map(code_lines, python.values()))
    figures["neighbours in one folder"] = max(neighbours(python).values())
    return figures


def words(files: Mapping[PurePosixPath, str]) -> dict[str, int]:
    """Pages of the documentation and their words, written by hand and made from something else."""
    figures = {}
    for origin, is_made in (("hand-written", False), ("generated or measured", True)):
        texts = [text for path, text in files.items() if path.suffix == ".md" and (path in MADE) == is_made]
        figures[f"{origin} pages"] = len(texts)
        figures[f"{origin} words"] = sum(len(text.split()) for text in texts)
    return figures


def code_lines(text: str) -> int:
    """Lines with a token of code: no blank line, comment, docstring or import."""
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in SILENT:
            lines.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(text)):
        is_text = (
            isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        )
        if is_text or isinstance(node, ast.Import | ast.ImportFrom):
            lines.difference_update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return len(lines)


def neighbours(paths: Mapping[PurePosixPath, str]) -> Counter[PurePosixPath]:
    """Number of modules and packages that stand side by side in each folder, without ``__init__``."""
    names = {parent / step for path in paths for parent, step in zip(path.parents, path.parts[::-1], strict=False)}
    return Counter(name.parent for name in names if name.stem != "__init__")


if __name__ == "__main__":
    main()
