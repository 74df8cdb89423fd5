"""Figures of pages in headless Chromium: one time cursor, values that are those of the run, zoom, narrow screens."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders.browser import Browser
from builders.records import phase_record

from cellplan.report.page.render import report_page
from cellplan.report.plots.rendering import pictures
from cellplan.report.plots.run import run_figures

pytestmark = pytest.mark.slow

SHARE = 1 / 400  # [-] of the height of a panel: how exactly a value is read from a curve
HELP = """
const figure = (name) => [...document.querySelectorAll("figure > svg")].find((each) => each.textContent.includes(name));
const panel = (name, title) =>
  [...figure(name).querySelectorAll(".panel")].find((each) => each.querySelector(".title").textContent === title);
const reading = (name, title) => panel(name, title).querySelector(".reading")?.textContent ?? "";
const tell = (t) => document.dispatchEvent(new CustomEvent("cellplan:time", { detail: t }));
const heard = [];
document.addEventListener("cellplan:time", ({ detail }) => heard.push(detail));
const spot = (name, title, share) => {
  figure(name).scrollIntoView({ block: "center", behavior: "instant" });
  const box = panel(name, title).querySelector(".frame").getBoundingClientRect();
  return { clientX: box.left + share * box.width, clientY: box.top + box.height / 2, bubbles: true, pointerId: 1 };
};
const point = (kind, name, at, more = {}) => figure(name).dispatchEvent(new PointerEvent(kind, { ...at, ...more }));
const labels = (name, title) => {
  const found = panel(name, title).querySelectorAll(".own-tick");
  return [...found].map((each) => Number(each.textContent));
};
for (const each of document.querySelectorAll("details")) each.open = true;
SVGElement.prototype.setPointerCapture = () => {};
await drawn();
"""
MARGINS = "joint margins"


@pytest.fixture(scope="module")
def page(passed_run: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    run, path = passed_run, tmp_path_factory.mktemp("page") / "report.html"
    record = phase_record(run.report, cell=run.cell, provenance=run.provenance)
    plots = pictures(run_figures(run.report, cell=run.cell))
    path.write_text(report_page(record, cell=run.cell, plots=plots), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as browser:
        yield browser


def ask(browser: Browser, script: str) -> Any:
    return browser.run(HELP + script)


def numbers(text: str) -> list[float]:
    """Numbers of a reading, without digits in names."""
    return [float(match.replace("−", "-")) for match in re.findall(r"(?<![\w.])[-−]?\d+(?:\.\d+)?(?![\w.]*\d)", text)]


def test_a_chosen_time_shows_the_values_of_the_run_in_every_figure(
    page: Path, browser: Browser, passed_run: Any
) -> None:
    report = passed_run.report
    browser.open(page)
    for row in (0, 1234, len(report.times) - 1):
        t = float(report.times[row])
        result = ask(
            browser,
            f"tell({t}); return [reading('kuka: joint positions', 'B1, in deg'), reading('{MARGINS}', 'kuka'), "
            "document.querySelectorAll('.panel[data-time]').length, document.querySelectorAll('.read').length];",
        )
        uses = [use for use in report.joints if use.robot == "kuka"]
        said, position = numbers(result[0].removesuffix(" deg"))
        assert said == pytest.approx(t, abs=5e-4)
        span = np.degrees(uses[0].upper - uses[0].lower)
        assert position == pytest.approx(np.degrees(report.q["kuka"][row, 0]), abs=SHARE * 1.12 * span + 0.05)
        q = report.q["kuka"][row]
        expected = [
            100.0 * min(q[i] - use.lower, use.upper - q[i]) / (0.5 * (use.upper - use.lower))
            for i, use in enumerate(uses)
        ]
        assert numbers(result[1].removesuffix(" %"))[1:] == pytest.approx(expected, abs=110 * SHARE + 0.05)
        assert result[2] - result[3] <= 24 + 8, "speeds are between the samples, and have none at the two ends"
    assert ask(browser, "tell(null); return document.querySelectorAll('.read').length;") == 0
    assert browser.console == []


def test_pointing_reads_and_clicking_chooses_the_time_below_the_pointer(page: Path, browser: Browser) -> None:
    browser.open(page)

    said, marked, heard, gone = ask(
        browser,
        f"""
        const at = spot("{MARGINS}", "abb", 0.25);
        point("pointermove", "{MARGINS}", at);
        const said = reading("{MARGINS}", "staubli");
        point("pointerdown", "{MARGINS}", at); point("pointerup", "{MARGINS}", at);
        point("pointerleave", "{MARGINS}", at);
        const kept = reading("clearance over time", "part, in mm");
        tell(null);
        return [said, kept, heard, reading("{MARGINS}", "abb")];""",
    )

    assert numbers(said)[0] == pytest.approx(1.0, abs=5e-3)
    assert numbers(marked)[0] == pytest.approx(1.0, abs=5e-3)
    assert heard[0] == pytest.approx(1.0, abs=5e-3)
    assert (heard[1:], gone) == ([None], "")


def test_keys_move_the_cursor_say_its_values_choose_and_zoom(page: Path, browser: Browser) -> None:
    browser.open(page)

    steps, spoken, heard, zoomed, whole = ask(
        browser,
        f"""
        const holder = figure("{MARGINS}").parentElement;
        const press = (key, shiftKey = false) =>
          holder.dispatchEvent(new KeyboardEvent("keydown", {{ key, shiftKey }}));
        holder.focus();
        const steps = [];
        for (const [name, shift] of [["Home"], ["ArrowRight"], ["ArrowRight", true], ["ArrowLeft"], ["End"]]) {{
          press(name, shift); steps.push(parseFloat(reading("{MARGINS}", "abb")));
        }}
        const spoken = document.querySelector(".figure-status").textContent;
        press("ArrowLeft", true); press("Enter"); press("+");
        const zoomed = labels("{MARGINS}", "abb");
        press("0"); press("Escape");
        return [steps, spoken, heard, zoomed, labels("{MARGINS}", "abb").length];""",
    )

    assert steps == pytest.approx([0.0, 0.04, 0.44, 0.4, 4.0], abs=1e-3)
    assert spoken.startswith("4.000 s. ")
    assert "staubli: C1 " in spoken
    assert heard == [pytest.approx(3.6), None]
    assert min(zoomed) > 1.5, "about the cursor"
    assert whole == 0


def test_a_dragged_range_fills_every_panel_and_values_stay_where_they_were(page: Path, browser: Browser) -> None:
    browser.open(page)

    before, after, ticks, everywhere, inside, restored = ask(
        browser,
        f"""
        const d = () =>
          [...document.querySelectorAll(".panel[data-time] .curve")].map((each) => each.getAttribute("d"));
        const whole = d();
        tell(1.5);
        const before = reading("{MARGINS}", "kuka");
        const from = spot("{MARGINS}", "kuka", 0.25), to = spot("{MARGINS}", "kuka", 0.5);
        point("pointerdown", "{MARGINS}", from);
        point("pointermove", "{MARGINS}", to);
        point("pointerup", "{MARGINS}", to);
        const after = reading("{MARGINS}", "kuka");
        const ticks = labels("{MARGINS}", "abb");
        const lines = [...document.querySelectorAll(".cursor-line")];
        const views = new Set(lines.map((each) => each.getAttribute("d").split(" ")[0]));
        const inside = panel("{MARGINS}", "kuka").querySelectorAll(".mark[style*='none']").length;
        document.querySelector(".figure-tools button:last-child").click();
        return [before, after, ticks, [...views], inside, d().every((each, i) => each === whole[i])];""",
    )

    assert after == before
    assert min(ticks) >= 1.0 - 1e-2
    assert max(ticks) <= 2.0 + 1e-2
    assert len(ticks) >= 4
    assert len(everywhere) == 2, "one place for each width of a panel: in two and in three columns"
    assert inside in {0, 1}
    assert restored
    assert browser.console == []


def test_two_fingers_zoom_about_their_middle_and_one_reads(page: Path, browser: Browser) -> None:
    browser.open(page, size=(390, 844))

    said, ticks, heard = ask(
        browser,
        f"""
        const finger = (kind, id, share) =>
          point(kind, "{MARGINS}", spot("{MARGINS}", "abb", share), {{ pointerId: id, pointerType: "touch" }});
        finger("pointerdown", 1, 0.5); finger("pointermove", 1, 0.75);
        const said = reading("{MARGINS}", "kuka");
        finger("pointerup", 1, 0.75); finger("pointerleave", 1, 0.75);
        finger("pointerdown", 2, 0.4); finger("pointerdown", 3, 0.6);
        finger("pointermove", 2, 0.3); finger("pointermove", 3, 0.7);
        const ticks = labels("{MARGINS}", "abb");
        finger("pointerup", 2, 0.3); finger("pointerup", 3, 0.7);
        return [said, ticks, heard];""",
    )

    assert numbers(said)[0] == pytest.approx(3.0, abs=0.02)
    assert heard == [pytest.approx(3.0, abs=0.02)]
    assert 0.0 < min(ticks) < 2.0 < max(ticks) < 4.0
    assert browser.console == []


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_figures_are_readable_on_a_telephone(page: Path, browser: Browser, theme: str) -> None:
    browser.open(page, size=(390, 844), theme=theme)

    result = ask(
        browser,
        """
        const pictures = [...document.querySelectorAll("figure > svg")];
        const shown = pictures.filter((each) => each.querySelector("[data-time]"));
        const sizes = shown.map((each) => {
          const scale = each.getBoundingClientRect().width / each.viewBox.baseVal.width;
          const words = [...each.querySelectorAll("text")];
          return scale * Math.min(...words.map((text) => parseFloat(getComputedStyle(text).fontSize)));
        });
        const wide = shown.map((each) => each.getBoundingClientRect().right);
        const title = figure("joint margins").querySelector(".title");
        const ink = getComputedStyle(title).fill;
        return { count: shown.length, size: Math.min(...sizes), wide: Math.max(...wide), ink };""",
    )

    assert result["count"] == 15
    assert result["size"] >= 8.5
    assert result["wide"] <= 390
    channels = list(map(int, re.findall(r"\d+", result["ink"])))[:3]
    assert (min(channels) > 200) == (theme == "dark")
    assert browser.console == []


def test_print_shows_what_is_in_the_files(page: Path, browser: Browser) -> None:
    """Given a narrow window and a zoom: then paper shows the whole motion in the width of the file."""
    browser.open(page, size=(390, 844))

    before, printed, after = ask(
        browser,
        f"""
        const svg = figure("{MARGINS}");
        const shown = () =>
          svg.getAttribute("viewBox") + [...svg.querySelectorAll(".curve")].map((each) => each.getAttribute("d"));
        tell(1.0);
        document.querySelector(".figure-tools button:nth-child(2)").click();
        const before = shown();
        dispatchEvent(new Event("beforeprint"));
        const printed = shown();
        dispatchEvent(new Event("afterprint"));
        return [before, printed, shown()];""",
    )
    browser.command("Emulation.setEmulatedMedia", media="print")
    is_shown = browser.run("return getComputedStyle(document.querySelector('.figure-cursor')).display !== 'none';")
    browser.command("Emulation.setEmulatedMedia", media="")

    text = page.read_text(encoding="utf-8")
    drawing = text[text.rindex("<svg", 0, text.index(f"<title>{MARGINS}")) :]
    drawing = drawing[: drawing.index("</figure>")]
    size = re.search(r'viewBox="([^"]+)"', drawing)
    assert size is not None
    curves = re.findall(r'class="curve"[^>]* d="([^"]+)"', drawing)
    assert printed == size[1] + ",".join(curves)
    assert before == after != printed
    assert not is_shown


def test_a_script_that_was_changed_does_not_run(page: Path, browser: Browser, tmp_path: Path) -> None:
    text = page.read_text(encoding="utf-8")
    changed = tmp_path / "changed.html"
    changed.write_text(text.replace("const KEYS", "document.title = 'safe'; const KEYS"), encoding="utf-8")
    without = changed.with_name("ready.html")
    without.write_text(
        changed.read_text(encoding="utf-8").replace("<body>", '<body data-ready="true">'), encoding="utf-8"
    )

    browser.open(without)

    assert browser.run("return document.title;") != "safe"
    assert browser.run("return document.querySelectorAll('.figure-tools').length;") == 0
    assert browser.run("return document.querySelectorAll('figure > svg .curve').length;") > 50
    assert any("Content Security Policy" in line for line in browser.console)
