"""Defects of run folders that add something which no figure contradicts; each makes the manifest anew."""

from typing import Any

from builders.run_edits import edit_json, first_row, pick, seal
from cellplan.report.plots.svg import inline_svg


def words_in_a_picture(rng, copy):
    """A picture, in its file and on the page alike, that says or does more than the one that is drawn."""
    page = copy.run / "report.html"
    text = page.read_text(encoding="utf-8")
    pictures = {path: path.read_text(encoding="utf-8") for path in sorted((copy.run / "plots").glob("*.svg"))}
    picture, drawing = pick(rng, [(path, drawing) for path, drawing in pictures.items() if inline_svg(drawing) in text])
    old, new = pick(
        rng,
        (
            ("</svg>", "<text>clearance 500 mm</text></svg>"),
            ("</svg>", "<script>document.title = 'safe'</script></svg>"),
            ("</svg>", "</svg><h1>released at full speed</h1>"),
            ("<path ", '<path onclick="alert()" '),
        ),
    )
    forged = drawing.replace(old, new, 1)
    picture.write_text(forged, encoding="utf-8")
    page.write_text(text.replace(inline_svg(drawing), inline_svg(forged)), encoding="utf-8")
    seal(copy)


def more_header_lines(rng, copy):
    path = copy.any_table(rng)
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    caution = first_row(lines) - 2
    more = pick(rng, ("# note: run at full speed\n", "# remark: proved by others\n", lines[caution]))
    lines.insert(int(rng.integers(1, caution)) if more.startswith(("# note", "# remark")) else caution, more)
    path.write_text("".join(lines), encoding="utf-8")
    seal(copy)


def misshapen_series(rng, copy):
    """Label, or too few figures, in the place of a series that only the planner knows."""
    forged = pick(rng, ("safe at full speed", [1.0], ["safe"] * 40, {"safe": True}, [True] * 40, False))
    edit_json(copy.run / "series.json", lambda record: record.update({pick(rng, ("iterations", "slack")): forged}))
    seal(copy)


def counts_beside_the_truth(rng, copy):
    """Counts that lie nearer to the truth than the noise of other figures."""

    def change(record: dict[str, Any]) -> None:
        record[pick(rng, ("samples", "pair_count"))] += 1e-6

    edit_json(copy.run / "report.json", change)
    seal(copy)
