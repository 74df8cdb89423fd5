"""Reproduce the papers' figures: ``python docs/make_reproduction.py`` writes page, plots and record anew.

The record, `docs/reproduction/measured.json`, holds every figure of the page; ``--page`` writes the page from it alone,
and with it `docs/reproduction/lines.json`, every line for machines.
"""

import json
import sys
from collections.abc import Callable
from pathlib import Path

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS))

from reproduction import (  # noqa: E402
    choices,
    davies_planar,
    ellipse,
    filtered,
    nicolato,
    places,
    planar_search,
    ribeiro,
    servo,
    vargas,
)
from reproduction.page import lines, page  # noqa: E402
from reproduction.runs import Numbers, rounded  # noqa: E402

RECORD = DOCS / "reproduction" / "measured.json"
LINES = DOCS / "reproduction" / "lines.json"
PAGE = DOCS / "reproduction.md"
CASES: dict[str, Callable[[], Numbers]] = {
    "vargas_1": lambda: vargas.measure(1),
    "vargas_2": lambda: vargas.measure(2),
    "vargas_3": lambda: vargas.measure(3),
    "nicolato_circle": nicolato.measure_circle,
    "nicolato_line": nicolato.measure_line,
    "nicolato_limits": nicolato.measure_limits,
    "nicolato_ellipse": ellipse.measure_ellipse,
    "nicolato_pose": nicolato.measure_pose,
    "ribeiro_modes": ribeiro.measure_modes,
    "ribeiro_places": places.measure,
    "ribeiro_first_layout": ribeiro.measure_first_layout,
    "ribeiro_appendix_e": ribeiro.measure_appendix,
    "ribeiro_appendix_d": davies_planar.measure,
    "ribeiro_load_sharing": ribeiro.measure_load_sharing,
    "vargas_filter": filtered.measure,
    "nicolato_planar": planar_search.measure,
    "nicolato_servo": servo.measure,
    "nicolato_cooperation": ribeiro.measure_search,
    "choices": choices.measure,
}


def recorded() -> Numbers:
    """The figures of the last time; none when there is no record."""
    return dict(json.loads(RECORD.read_text(encoding="utf-8"))) if RECORD.exists() else {}


def main(words: list[str]) -> None:
    """Measure the named cases, or all of them; then write the page."""
    if unknown := set(words) - set(CASES) - {"--page"}:
        raise SystemExit(f"expected --page or some of {', '.join(CASES)}, got {', '.join(sorted(unknown))}")
    numbers = recorded()
    chosen = [name for name in CASES if name in words or not words]
    for count, name in enumerate(chosen, start=1):
        sys.stderr.write(f"{count} of {len(chosen)}: {name}\n")
        numbers[name] = rounded(CASES[name]())
    record = {name: numbers[name] for name in CASES if name in numbers}
    RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    LINES.write_text(json.dumps(lines(record), indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    PAGE.write_text(page(record), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
