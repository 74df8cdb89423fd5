"""Compare two trees of run folders: ``python benchmarks/compare_runs.py OLD NEW [--texts RENAMED.json]``.

Every run folder below OLD is compared with the folder of the same name below NEW:

- joint tables byte for byte below their headers; where OLD has tables for each task and NEW has one program, the rows
  of each task must occur in the program in one piece, on whatever clock;
- ``report.json`` key by key; series that OLD keeps in it are compared with ``series.json`` of NEW. Keys that only one
  of the two has are counted where ``report_paths.json`` lists them as added or removed, and differ otherwise. Texts
  may differ by the pairs in RENAMED.json (here ``renamed_texts.json``), old and new pieces; with ``--reworded`` also
  in any other words around the same figures, and those texts are counted.

The exit status is 1 if anything else differs.
"""

import argparse
import json
import re
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Final

MAX_SHOWN: Final = 12  # differences of a report that are listed
ONLY_NEW: Final = "only new"
ONLY_OLD: Final = "only old"
PATHS: Final[Mapping[str, list[str]]] = json.loads(Path(__file__).with_name("report_paths.json").read_text("utf-8"))
REWORDED: Final = "reworded"
FIGURE: Final = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?")
IGNORED: Final = frozenset({"inputs", "digests", "versions"})  # digests of files and versions of packages


def main() -> None:
    """Compare, print one line for each run, and exit with 1 if anything differs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--texts", type=Path, help="JSON object of old and new pieces of text")
    parser.add_argument("--reworded", action="store_true", help="count texts with other words round the same figures")
    options = parser.parse_args()
    texts = json.loads(options.texts.read_text(encoding="utf-8")) if options.texts else {}
    runs = sorted(path.parent for path in options.old.rglob("report.json"))
    roots = [run for run in runs if run.parent not in runs and run.parent.parent not in runs]
    compare = partial(compare_run, texts=texts, may_be_reworded=options.reworded)
    different = [run for run in roots if compare(run, options.new / run.relative_to(options.old))]
    sys.exit(bool(different))


def compare_run(old: Path, new: Path, *, texts: Mapping[str, str], may_be_reworded: bool = False) -> bool:
    """Print what differs between two run folders; returns whether anything does."""
    if not (new / "report.json").is_file():
        print(f"{old.name}: missing")
        return True
    tables = list(different_tables(old, new))
    differences = [
        f"{file.relative_to(old)}: {line}"
        for file in sorted(old.rglob("report.json"))
        for line in report_differences(file, new / file.relative_to(old), texts)
    ]
    added = [line for line in differences if is_listed(line)]
    reworded = [line for line in differences if may_be_reworded and line.endswith(REWORDED)]
    changed = [line for line in differences if line not in {*added, *reworded}]
    count = len(list(old.rglob("tables/*.csv")))
    print(
        f"{old.name}: {count} tables, {len(tables)} differ; report: {len(changed)} differences, {len(added)} new keys, "
        f"{len(reworded)} texts reworded"
    )
    for line in [*tables, *changed[:MAX_SHOWN]]:
        print(f"    {line}")
    return bool(tables or changed)


def is_listed(difference: str) -> bool:
    """Whether a key that only one of two reports has is listed as added or removed."""
    path = difference.partition(": ")[2].partition(": ")[0]
    kinds = {ONLY_NEW: "added", ONLY_OLD: "removed"}
    return any(difference.endswith(ending) and path in PATHS[kind] for ending, kind in kinds.items())


def different_tables(old: Path, new: Path) -> Iterator[str]:
    """Tables whose rows are not those of the new run."""
    for table in sorted(old.rglob("tables/*.csv")):
        name = table.relative_to(old)
        same = new / name
        if same.is_file():
            is_equal = rows(same) == rows(table)
        else:  # the program of one task: its rows without the clock occur in the one program
            program = new / "tables" / table.name
            is_equal = program.is_file() and contains(without_clock(rows(program)), without_clock(rows(table)))
        if not is_equal:
            yield str(name)


def rows(table: Path) -> list[str]:
    """Column names and rows of a table, without its header."""
    return [line for line in table.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]


def without_clock(lines: list[str]) -> list[str]:
    """The rows of joint positions as text."""
    return [line.partition(",")[2] for line in lines[1:]]


def contains(whole: list[str], part: list[str]) -> bool:
    """Whether a list occurs in another one in one piece."""
    starts = (i for i, line in enumerate(whole) if line == part[0])
    return any(whole[i : i + len(part)] == part for i in starts)


def report_differences(old: Path, new: Path, texts: Mapping[str, str]) -> Iterator[str]:
    """Differences between two reports, with the series in a file of their own or not."""
    if not new.is_file():
        yield "missing"
        return
    before, after = (with_series(file) for file in (old, new))
    yield from differences(before, after, texts)


def with_series(report: Path) -> dict[str, Any]:
    """A report with its series under one key."""
    record: dict[str, Any] = json.loads(report.read_text(encoding="utf-8"))
    series = report.parent / "series.json"
    if series.is_file():
        record["series"] = json.loads(series.read_text(encoding="utf-8"))
        record["series"].pop("schema", None)
    return {key: value for key, value in record.items() if key not in IGNORED}


def differences(old: Any, new: Any, texts: Mapping[str, str], path: str = "") -> Iterator[str]:
    """Key paths at which two records differ, with both values."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in dict.fromkeys([*old, *new]):
            place = f"{path}.{key}" if path else key
            if key not in old or key not in new:
                yield f"{place}: {ONLY_NEW if key in new else ONLY_OLD}"
            else:
                yield from differences(old[key], new[key], texts, place)
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for index, (left, right) in enumerate(zip(old, new, strict=True)):
            yield from differences(left, right, texts, f"{path}[{index}]")
    elif renamed(old, texts) != new:
        both = isinstance(old, str) and isinstance(new, str)
        ending = f" {REWORDED}" if both and Counter(FIGURE.findall(old)) == Counter(FIGURE.findall(new)) else ""
        yield f"{path}: {old!r:.90} -> {new!r:.90}{ending}"


def renamed(value: Any, texts: Mapping[str, str]) -> Any:
    """A text with its renamed pieces; any other value as it is."""
    if isinstance(value, str):
        for piece, replacement in texts.items():
            value = value.replace(piece, replacement)
    return value


if __name__ == "__main__":
    main()
