"""The live cell as a person meets it: ``python benchmarks/live_page.py CELL [--seconds 60] [--most-ms 100]``.

`cellplan edit CELL` is started, its page is opened in headless Chromium, and a base is dragged by true events of the
mouse. Printed are the times from the event of the pointer to the figures in the page and to the picture that shows
them, the answers in a second, and the memory before and after. With --repair the cell is repaired by nothing but drags
along the arrows of advice. Exit status: 1 where 95 % of the figures take longer than --most-ms, where fewer than 20
answers come in a second, where memory grows by more than 20 %, or where a repair takes more than 15 drags.
"""

import argparse
import contextlib
import math
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

ROOT: Final = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "tests"))

from builders.browser import Browser  # noqa: E402 - the tests' own browser

RATE_HZ: Final = 50.0  # of the events of the mouse
REACH_PX: Final = 40.0  # radius of the circle that the mouse goes
ROUND_S: Final = 3.0  # [s] for one round
LEAST_RATE: Final = 20.0  # answers in a second
MOST_GROWTH: Final = 1.2  # of memory
MOST_DRAGS: Final = 15
SETTLE_S: Final = 20.0  # [s] after which a cell that does not come to rest is given up
PROBE: Final = """
  window.probe = { waiting: [], figures: [], pictures: [], answers: 0, at: 0 };
  addEventListener("pointermove", (event) => { probe.at = event.timeStamp; }, { capture: true });
  const change = app.client.change.bind(app.client);
  app.client.change = (values, block) => { change(values, block); probe.waiting.push([app.client.number, probe.at]); };
  new MutationObserver(() => {
    const now = performance.now(), number = app.client.answered;
    const seen = probe.waiting.filter(([sent]) => sent <= number).map(([, at]) => at);
    if (!seen.length) return;
    probe.waiting = probe.waiting.filter(([sent]) => sent > number);
    probe.answers += 1;
    probe.figures.push(...seen.map((at) => now - at));
    requestAnimationFrame(() => setTimeout(() => probe.pictures.push(...seen.map((at) => performance.now() - at))));
  }).observe(byId("figures"), { attributes: true });
"""
SPOT: Final = """
  const flat = (point) => {
    const [x, y, , w] = projected(app.camera.matrix(), point);
    const box = byId("canvas").getBoundingClientRect();
    return [box.left + (0.5 + (0.5 * x) / w) * box.width, box.top + (0.5 - (0.5 * y) / w) * box.height];
  };
  const isBase = (robot) => (handle) => handle.prefix === "base" && handle.index === robot;
  const baseOf = (robot) => app.handles.place(app.handles.all.find(isBase(robot))).at;
"""


def main() -> None:
    """Measure, or repair."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("cell", type=Path)
    parser.add_argument("--seconds", type=float, default=60.0, help="how long a base is dragged (default: 60)")
    parser.add_argument("--most-ms", type=float, default=100.0, help="demand for 95 %% of the figures (default: 100)")
    parser.add_argument("--robot", type=int, default=1, help="number of the robot whose base is dragged (default: 1)")
    parser.add_argument("--repair", action="store_true", help="follow the arrows until nothing fails")
    options = parser.parse_args()
    with edited(options.cell) as (process, address), Browser() as browser:
        browser.visit(address, size=(1300, 900))
        arrive(browser)
        settled(browser)
        if options.repair:
            sys.exit(not repaired(browser))
        sys.exit(not measured(browser, process.pid, options))


@contextlib.contextmanager
def edited(cell: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A process of ``cellplan edit`` and the file that leads to its page."""
    command = [sys.executable, "-m", "cellplan", "edit", str(cell), "--no-browser"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True) as process:
        try:
            for line in process.stderr or ():
                if place := re.match(r".*open (/.+\.html) in a browser", line):
                    yield process, f"file://{place[1]}"
                    return
            raise SystemExit(f"{cell}: cellplan edit did not say where its page is")
        finally:
            process.terminate()


def arrive(browser: Browser) -> None:
    """Wait until the file has led to the page and the page is drawn."""
    until = time.monotonic() + SETTLE_S
    while time.monotonic() < until:
        with contextlib.suppress(AssertionError):  # the page is left in the midst of a question
            if browser.run("return location.protocol === 'http:' && document.body?.dataset.ready === 'true';"):
                return
        time.sleep(0.05)
    raise SystemExit(f"the page is not drawn after {SETTLE_S:g} s")


def settled(browser: Browser) -> dict[str, Any]:
    """The answer once the session is at rest."""
    until = time.monotonic() + SETTLE_S
    while time.monotonic() < until:
        answer = browser.run("return app.client.isSending || !app.answer.is_settled ? null : app.answer;")
        if answer is not None:
            return dict(answer)
        time.sleep(0.05)
    raise SystemExit(f"the session is not at rest after {SETTLE_S:g} s")


def measured(browser: Browser, pid: int, options: argparse.Namespace) -> bool:
    """Drag a base in circles and print what it took."""
    browser.run(PROBE)
    x, y = browser.run(f"{SPOT} return flat(baseOf({options.robot}));")
    press(browser, x, y)
    circle(browser, x, y, min(5.0, options.seconds))  # begin: whatever is made once is made
    before = memory(browser, pid)
    browser.run("Object.assign(probe, { figures: [], pictures: [], answers: 0 });")
    used = processor_s(pid)
    seconds = circle(browser, x, y, options.seconds)
    used = processor_s(pid) - used
    after = memory(browser, pid)
    browser.pointer("Released", x, y)
    probe = browser.run("return probe;")
    rate = probe["answers"] / seconds
    print(f"{options.cell.name}: a base dragged for {seconds:.0f} s, {len(probe['figures'])} events of the pointer")
    for name in ("figures", "pictures"):
        half, most, longest = np.percentile(probe[name], [50, 95, 100])
        print(f"  pointer to {name:9} {half:6.0f} ms half of them, {most:.0f} ms 95 % of them, {longest:.0f} ms all")
    used_ms = 1e3 * used / max(probe["answers"], 1)
    print(f"  answers            {rate:6.1f} in a second, {used_ms:.0f} ms of processor time of the session for each")
    for name, value in after.items():
        print(f"  memory, {name:10} {before[name]:6.1f} MB before, {value:.1f} MB after")
    is_bounded = all(value < MOST_GROWTH * before[name] for name, value in after.items())
    return bool(np.percentile(probe["figures"], 95) <= options.most_ms and rate >= LEAST_RATE and is_bounded)


def circle(browser: Browser, x: float, y: float, seconds: float) -> float:
    """Move the mouse round a place at its rate; gives the time in [s] that it took."""
    begin = time.monotonic()
    while (t := time.monotonic() - begin) < seconds:
        angle = 2.0 * math.pi * t / ROUND_S
        browser.pointer("Moved", x + REACH_PX * math.sin(angle), y + REACH_PX * (1.0 - math.cos(angle)) / 2.0)
        time.sleep(max(0.0, 1.0 / RATE_HZ - (time.monotonic() - begin - t)))
    return time.monotonic() - begin


def press(browser: Browser, x: float, y: float) -> None:
    """Take what is at a place of the window."""
    browser.pointer("Moved", x, y)
    browser.pointer("Pressed", x, y)


def memory(browser: Browser, pid: int) -> dict[str, float]:
    """Memory in [MB] of the scripts of the page, after garbage is collected, and of the session."""
    browser.command("HeapProfiler.collectGarbage")
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    heap = browser.command("Runtime.getHeapUsage")["usedSize"]
    return {"page": 1e-6 * heap, "session": 1e-6 * 4096 * pages}


def processor_s(pid: int) -> float:
    """Processor time of the session in [s]."""
    user, system = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def repaired(browser: Browser) -> bool:
    """Drag bases along arrows, each by the step that its arrow says, until nothing fails; then certify."""
    answer = settled(browser)
    print(f"  {answer['verdict']}")
    for number in range(1, MOST_DRAGS + 1):
        if answer["state"] == "planned" or not answer["advice"]:
            break
        advice = max(answer["advice"], key=lambda it: gain(it["text"]))
        follow(browser, advice)
        answer = settled(browser)
        print(f"  drag {number}: robot {advice['robot']}, {advice['text']} -> {answer['verdict']}")
    if answer["state"] != "planned":
        return False
    browser.run("byId('canvas').focus();")
    browser.key("c")
    until = time.monotonic() + SETTLE_S
    while time.monotonic() < until and browser.run("return app.answer.state;") != "certified":
        time.sleep(0.1)
    print(f"  {browser.text('state')} {browser.text('verdict')}")
    return bool(browser.run("return app.answer.state;") == "certified")


def gain(text: str) -> float:
    """Gain of the smallest margin that an arrow promises, in deg."""
    promised = re.search(r"([+-][\d.e+-]+) deg margin", text)
    return float(promised[1]) if promised else 0.0


def follow(browser: Browser, advice: dict[str, Any]) -> None:
    """Drag the ring of a base to where the arrow of its advice says."""
    step = [1e-3 * advice["step_mm"] * component for component in advice["direction"]]
    begin, end = browser.run(f"""{SPOT}
      app.camera.look("top");
      await drawn();
      const at = baseOf({advice["robot"]});
      return [flat(at), flat(add(at, {step}))];
    """)
    press(browser, *begin)
    for share in np.linspace(0.0, 1.0, 9)[1:]:
        browser.pointer("Moved", *(np.add(begin, share * np.subtract(end, begin)).tolist()))
        time.sleep(0.02)
    browser.pointer("Released", *end)
    time.sleep(0.3)


if __name__ == "__main__":
    main()
