"""Pages of every kind in headless Chromium: no error, nothing that sticks out, legible text, tables that sort."""

import shutil
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
from builders.browser import Browser
from builders.layout_search import searched_pair

from cellplan.cli.main import run

pytestmark = pytest.mark.slow

PAGES = {
    "run": "run/report.html",
    "view": "run/view.html",
    "unmade view": "failed/view.html",
    "program": "program/report.html",
    "phase": "program/path/report.html",
    "failed": "failed/report.html",
    "sweep": "sweep/study.html",
    "comparison": "comparison/study.html",
    "fastest": "fastest/fastest.html",
    "map": "map/map.html",
    "rehearsal": "rehearsal/rehearsal.html",
    "repair": "repair/advice.html",
    "layout": "layout/study/study.html",
}
SIZES = ((1280, 800), (390, 844))
THEMES = ("light", "dark")
MIN_CONTRAST = 4.5  # [-] WCAG 2.2, 1.4.3: of text of ordinary size
CRATE = "  crate: {box: {size_mm: [200, 200, 200]}, at: {xyz_mm: [700, 300, 500]}}\n"  # at an arm
ERRORS = "cellplan_errors: 1\nrobots:\n  left: {base: {xyz_mm: [0.5, 0, 0]}}\n"


@pytest.fixture(scope="module")
def folder(sound: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page of every kind."""
    folder, cell = tmp_path_factory.mktemp("kinds"), str(sound / "cell" / "small.yaml")
    crowded, errors = Path(cell).with_name("crowded.yaml"), folder / "errors.yaml"
    crowded.write_text(Path(cell).read_text().replace("environment:\n", f"environment:\n{CRATE}"))
    errors.write_text(ERRORS)
    for name, command in {
        "run": ["solve", cell, "--view"],
        "program": ["solve", cell, "--mode", "pairwise", "--view"],
        "failed": ["solve", str(crowded)],
        "sweep": ["sweep", cell, "--vary", "motion.duration_s=1,2", "--workers", "1"],
        "comparison": ["compare", str(folder / "run"), str(folder / "program")],
        "fastest": ["fastest", cell],
        "map": ["map", cell, "--robot", "right", "--grid", "400", "--workers", "1"],
        "rehearsal": ["rehearse", cell, "--errors", str(errors)],
        "repair": ["layout", str(crowded), "--repair", "--workers", "1"],
    }.items():
        run([*command, "-q", "-o", str(folder / name)])
    crowded.unlink()
    (folder / "layout").mkdir()
    searched_pair(folder / "layout")
    return folder


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as browser:
        yield browser


FAINT = """
  const pixel = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const parts = (colour) => {
    pixel.clearRect(0, 0, 1, 1);
    pixel.fillStyle = colour;
    pixel.fillRect(0, 0, 1, 1);
    return [...pixel.getImageData(0, 0, 1, 1).data];
  };
  const luminance = ([r, g, b]) => {
    const linear = [r, g, b].map((c) => (c / 255 <= 0.04045 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
  };
  const behind = (element) => {
    for (let each = element; each; each = each.parentElement) {
      const found = parts(getComputedStyle(each).backgroundColor);
      if (found[3] === 255) return found;
    }
    return parts(getComputedStyle(document.documentElement).colorScheme.includes("dark") ? "black" : "white");
  };
  const faint = [];
  for (const each of document.querySelectorAll("body *")) {
    const own = [...each.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim());
    if (!own || each.closest("svg, script, style, [aria-hidden]") || !each.checkVisibility()) continue;
    if (each.disabled) continue;
    const [one, other] = [parts(getComputedStyle(each).color), behind(each)].map(luminance);
    const contrast = (Math.max(one, other) + 0.05) / (Math.min(one, other) + 0.05);
    if (contrast < MIN) faint.push(`${each.tagName}.${each.className} ${contrast}: ${each.textContent}`);
  }
  return faint;
""".replace("MIN)", f"{MIN_CONTRAST})")


@pytest.mark.parametrize("theme", THEMES)
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", PAGES)
def test_every_page_is_quiet_fits_and_can_be_read(
    browser: Browser, folder: Path, name: str, size: tuple[int, int], theme: str
) -> None:
    browser.open(folder / PAGES[name], size=size, theme=theme)

    wide = browser.run("""
      const page = [document.documentElement.scrollWidth, innerWidth];
      for (const each of document.querySelectorAll("details")) each.open = true;
      await drawn();
      return [...page, document.documentElement.scrollWidth];
    """)
    assert browser.console == []
    assert max(wide) <= size[0]
    assert browser.run(FAINT) == []


@pytest.mark.parametrize("name", [name for name in PAGES if name != "view"])
def test_headings_descend_by_one_level_and_tables_name_their_columns(browser: Browser, folder: Path, name: str) -> None:
    browser.open(folder / PAGES[name])

    levels, nameless = browser.run("""
      const levels = [...document.querySelectorAll("h1, h2, h3, h4")].map((each) => Number(each.tagName[1]));
      const nameless = [...document.querySelectorAll("thead th:not([scope]), tbody th:not([scope])")].length;
      const captionless = [...document.querySelectorAll("table")].filter((each) => !each.caption).length;
      return [levels, nameless + captionless];
    """)

    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(deeper - level <= 1 for level, deeper in pairwise(levels))
    assert nameless == 0


def test_the_first_screen_of_a_failed_run_says_what_where_when_and_by_how_much(browser: Browser, folder: Path) -> None:
    browser.open(folder / PAGES["failed"])

    below, rows = browser.run("""
      const rows = [...document.querySelectorAll(".failure li")];
      const bottom = Math.max(...rows.map((each) => each.getBoundingClientRect().bottom));
      return [bottom, rows.map((each) => each.textContent)];
    """)

    assert below < SIZES[0][1]
    assert any("crate" in row and "in contact for" in row for row in rows)
    assert all((" from " if "in contact for" in row else " at ") in row for row in rows)


SORTED = """
  const table = [...document.querySelectorAll("table")].find((each) => /peak speed/.test(each.tHead.textContent));
  const headings = [...table.querySelectorAll("thead th")];
  const column = headings.findIndex((each) => each.textContent === "peak speed");
  const button = headings[column].querySelector("button");
  const state = () => [
    headings[column].getAttribute("aria-sort"),
    [...table.tBodies[0].rows].map((row) => Number(row.cells[column].textContent)),
  ];
  const found = [state()];
  for (let click = 0; click < 3; click += 1) { button.click(); found.push(state()); }
  return found;
"""


def test_a_column_sorts_as_numbers_up_then_down_then_as_printed(browser: Browser, folder: Path) -> None:
    browser.open(folder / PAGES["run"])

    (none, printed), (up, rising), (down, falling), (again, last) = browser.run(SORTED)

    assert [none, up, down, again] == ["none", "ascending", "descending", "none"]
    assert rising == sorted(printed)
    assert falling == sorted(printed, reverse=True)
    assert last == printed


CHOSEN = """
  const heard = [];
  document.addEventListener("cellplan:time", (event) => heard.push(event.detail));
  const at = document.querySelector(".figures .at");
  at.click();
  await drawn();
  const link = document.querySelector("#chosen a");
  const cursor = document.querySelector(".strip-cursor");
  const shown = [heard[0], Number(at.dataset.at), link.getAttribute("href"), !document.getElementById("chosen").hidden];
  shown.push(parseFloat(cursor.style.left) / 100 * Number(document.querySelector(".strips").dataset.total));
  const span = document.querySelector(".span.work");
  span.dispatchEvent(new KeyboardEvent("keydown", { key: "Enter", bubbles: true }));
  shown.push(heard[1], Number(span.dataset.at));
  document.querySelector("#chosen button").click();
  shown.push(document.getElementById("chosen").hidden, document.querySelectorAll(".strip-cursor").length);
  return shown;
"""


def test_a_chosen_time_is_told_shown_and_leads_to_the_3_d_page(browser: Browser, folder: Path) -> None:
    browser.open(folder / PAGES["run"])

    heard, at, link, is_shown, cursor, by_key, begin, is_hidden, cursors = browser.run(CHOSEN)

    assert heard == at == pytest.approx(cursor, abs=1e-9)
    assert link == f"view.html#t={at:g}"
    assert is_shown
    assert by_key == begin
    assert (is_hidden, cursors) == (True, 0)


def test_a_time_leads_a_phase_to_the_clock_of_the_program(browser: Browser, folder: Path) -> None:
    browser.open(folder / PAGES["phase"])

    assert browser.run("""
      const at = document.querySelector(".figures .at");
      const begin = Number(document.querySelector("a[data-view]").dataset.begin);
      const t = Number(at.href.split("#t=")[1]);
      return Math.abs(t - begin - Number(at.dataset.at)) < 1e-9 && at.pathname.endsWith("/program/view.html");
    """)


def test_the_report_leads_to_a_3_d_page_that_is_made_later(browser: Browser, sound: Path, tmp_path: Path) -> None:
    shutil.copytree(sound / "run", tmp_path / "run")
    browser.open(tmp_path / "run" / "report.html")
    link = browser.run("return document.querySelector('a.go').href;")
    page, t = link.removeprefix("file://").split("#t=")

    browser.open(Path(page), f"#t={t}")
    unmade = browser.run("return document.body.innerText;")
    run(["view", str(tmp_path / "run"), "--cell", str(sound / "cell" / "small.yaml"), "-q"])
    browser.open(Path(page), f"#t={t}")

    assert "cellplan view RUN --cell CELL" in unmade
    assert browser.text("clock").startswith(f"{float(t):.3f} s of ")
    assert browser.console == []


def test_an_address_unfolds_what_it_leads_to(browser: Browser, folder: Path) -> None:
    browser.open(folder / PAGES["failed"])

    assert browser.run("""
      const inside = document.querySelector("details.all-failed p");
      inside.id = "inside";
      location.hash = "#inside";
      await drawn();
      return inside.closest("details").open;
    """)


def test_a_script_that_was_added_does_not_run(browser: Browser, folder: Path, tmp_path: Path) -> None:
    page = (folder / PAGES["run"]).read_text(encoding="utf-8")
    (tmp_path / "page.html").write_text(page.replace("</main>", "<script>document.title = 'safe'</script></main>"))
    browser.open(tmp_path / "page.html")

    assert browser.run("return document.title;") != "safe"
    assert any("Content Security Policy" in line for line in browser.console)
