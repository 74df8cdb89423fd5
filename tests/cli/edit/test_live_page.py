"""The page of the live cell in headless Chromium, against a session whose answers are simple functions."""

import time
from collections.abc import Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders.browser import READY, Browser
from builders.live_session import LOST_FROM, TOKEN, FakeSession, fake_session, serving

pytestmark = pytest.mark.slow

CTRL, SHIFT = 2, 8  # modifiers of keys
SPOT = """
  const spot = (name, knob) => {
    const handle = app.handles.all.find((one) => one.subject === name);
    const { at, motions } = app.handles.place(handle);
    const [x, y, , w] = projected(app.camera.matrix(), knob ? motions[knob].spot : at);
    const box = byId("canvas").getBoundingClientRect();
    return [box.left + (0.5 + (0.5 * x) / w) * box.width, box.top + (0.5 - (0.5 * y) / w) * box.height];
  };
"""
IDLE = "await drawn(); while (app.client.isSending) await drawn(); await drawn();"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as browser:
        yield browser


@pytest.fixture
def session(sound: Path) -> FakeSession:
    return fake_session(sound / "cell" / "small.yaml")


@pytest.fixture
def page(browser: Browser, session: FakeSession) -> Iterator[Browser]:
    with serving(session) as address:
        show(browser, address)
        yield browser


def show(browser: Browser, address: str, **options: Any) -> None:
    """Open the page and wait until it is drawn."""
    browser.visit(address, **options)
    browser.run(f"await {READY} look(); }}); await drawn();")


def changes(session: FakeSession) -> list[dict[str, float]]:
    """Values of all changes so far."""
    return [body["values"] for path, body in session.received if path == "/change"]


def drag(browser: Browser, name: str, by: tuple[float, float], knob: str = "", steps: int = 5) -> None:
    """Take a handle and move the mouse by pixels."""
    x, y = browser.run(f"{SPOT} return spot({name!r}, {knob!r});")
    browser.pointer("Moved", x, y)
    browser.pointer("Pressed", x, y)
    for share in np.linspace(0.0, 1.0, steps + 1)[1:]:
        browser.pointer("Moved", x + share * by[0], y + share * by[1])
    browser.pointer("Released", x + by[0], y + by[1])
    browser.run(IDLE)


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("size", [(1024, 700), (3840, 2160)])
def test_the_page_opens_under_its_policy_without_a_word_on_the_console(
    browser: Browser, session: FakeSession, theme: str, size: tuple[int, int]
) -> None:
    with serving(session) as address:
        show(browser, address, theme=theme, size=size)
        seen = browser.run("return [location.hash, history.length > 0, document.documentElement.scrollWidth];")

        assert browser.console == []
        assert "token" not in seen[0]
        assert seen[2] <= size[0]
        assert browser.run("return document.documentElement.dataset.theme;") == theme


def test_a_page_without_the_token_shows_nothing_of_the_cell(browser: Browser, session: FakeSession) -> None:
    with serving(session) as address:
        for place, reason in ((address.partition("#")[0], "No token"), (address[:-1] + "x", "wrong token")):
            browser.visit(place)
            browser.run("while (!document.getElementById('gone')?.textContent) await drawn();")

            assert reason in browser.text("gone-text")
            assert "small" not in browser.run("return document.body.textContent;")


def test_a_dragged_ring_follows_the_pointer_in_the_plane_of_the_base(page: Browser, session: FakeSession) -> None:
    before = dict(session.record["answer"]["values"])
    start = page.run(f"{SPOT} return spot('left');")
    drag(page, "left", (60, 25))
    after = session.record["answer"]["values"]

    assert {name for name in after if after[name] != before[name]} == {f"robots.left.base.{axis}_mm" for axis in "xy"}
    end = page.run(f"{SPOT} return spot('left');")
    assert np.subtract(end, start) == pytest.approx([60, 25], abs=0.5)  # of a pixel; values are rounded to 0.1 mm
    assert page.run("return app.stage.bases[0][12];") == pytest.approx(1e-3 * after["robots.left.base.x_mm"])
    assert page.run("return byId('figures').textContent;").startswith("smallest margin")
    assert f"{sum(after.values()):.2f} deg" in page.text("figures")


def test_knobs_turn_and_lift(page: Browser, session: FakeSession) -> None:
    values = session.record["answer"]["values"]
    drag(page, "left", (0, -40), "z")
    assert values["robots.left.base.z_mm"] > 550.0
    assert values["robots.left.base.x_mm"] == 0.0

    middle, knob = page.run(f"{SPOT} return [spot('left'), spot('left', 'yaw')];")
    drag(page, "left", (2 * (middle[0] - knob[0]), 2 * (middle[1] - knob[1])), "yaw", steps=9)
    assert abs(values["robots.left.base.yaw_deg"]) == pytest.approx(180.0, abs=5.0)  # the picture is in perspective


def test_values_stay_on_the_grid_and_in_their_range(page: Browser, session: FakeSession) -> None:
    page.run("byId('grid').value = '50 mm, 15°'; byId('grid').dispatchEvent(new Event('change'));")
    drag(page, "left", (31, 17))
    drag(page, "right", (450, 200))
    values = session.record["answer"]["values"]

    assert [values[f"robots.left.base.{axis}_mm"] % 50.0 for axis in "xy"] == [0.0, 0.0]
    assert values["robots.left.base.x_mm"] != 0.0
    assert values["robots.right.base.x_mm"] == 2900.0  # the end of its range


def test_another_tab_gets_the_token_in_the_fragment_of_its_address(page: Browser) -> None:
    opened = page.run("""
      const opened = [];
      window.open = (...what) => opened.push(what);
      byId("tab").click();
      return opened;
    """)

    assert opened == [[f"/#token={TOKEN}", "_blank", "noopener"]]


def test_what_is_locked_has_no_handle_and_no_open_field(page: Browser, session: FakeSession) -> None:
    subjects, disabled = page.run("""
      app.change({ "robots.idle.base.x_mm": 5, "robots.nobody.base.x_mm": 5 });
      const locked = [...byId("fields").querySelectorAll("input")].filter((input) => input.disabled);
      return [app.handles.all.map((one) => one.subject), locked.map((input) => input.dataset.address)];
    """)

    assert subjects == ["left", "right"]
    assert len(disabled) == 4
    assert all(address.startswith("robots.idle.") for address in disabled)
    assert changes(session) == []


def test_one_change_is_in_flight_and_the_newest_waits(page: Browser, session: FakeSession) -> None:
    session.delay_s = 0.15
    page.run(f"""
      for (let x = 1; x <= 40; x += 1) {{
        app.change({{ "robots.left.base.x_mm": x }});
        if (x === 20) app.change({{ "robots.left.base.y_mm": 7 }});
        await new Promise((go) => setTimeout(go, 5));
      }}
      {IDLE}
    """)

    assert 2 <= len(changes(session)) < 12
    assert session.record["answer"]["values"]["robots.left.base.x_mm"] == 40
    assert session.record["answer"]["values"]["robots.left.base.y_mm"] == 7  # not lost by what came after
    numbers = [body["number"] for path, body in session.received if path == "/change"]
    assert numbers == sorted(set(numbers))


def test_the_next_change_is_sent_before_an_answer_is_shown_and_keeps_what_is_desired(page: Browser) -> None:
    order = page.run(f"""
      const order = [], address = "robots.left.base.x_mm";
      const [record, show] = [app.client.record.bind(app.client), app.client.receivers.answer];
      app.client.record = (path, body) => {{
        order.push(`sent ${{body.values[address]}}`);
        return record(path, body);
      }};
      app.client.receivers.answer = (answer) => {{
        show(answer);
        const number = byId("figures").dataset.number - first;
        order.push(`shown ${{answer.values[address]}} desired ${{app.desired[address]}} of ${{number}}`);
      }};
      const first = app.client.number;
      app.change({{ [address]: 1 }});
      app.change({{ [address]: 2 }});
      {IDLE}
      return order;
    """)

    assert order == ["sent 1", "sent 2", "shown 1 desired 2 of 1", "shown 2 desired 2 of 2"]


def test_a_field_is_typed_and_stepped_by_arrow_keys(page: Browser, session: FakeSession) -> None:
    field = "document.querySelector('[data-address=\"robots.left.base.x_mm\"]')"
    page.run(f"{field}.focus(); {field}.select();")
    page.command("Input.insertText", text="12.5")
    page.key("ArrowUp")
    page.key("ArrowDown", modifiers=SHIFT)
    page.run(IDLE)

    assert [values["robots.left.base.x_mm"] for values in changes(session)][-1] == 3.5
    assert page.run("return document.activeElement.value;") == "3.5"


def test_keys_select_move_and_act(page: Browser, session: FakeSession) -> None:
    page.run("app.camera.look('front'); byId('canvas').focus();")
    for key, modifiers in (("b", 0), ("ArrowRight", 0), ("ArrowUp", SHIFT), ("PageDown", 0), ("q", 0)):
        page.key(key, modifiers=modifiers)
        page.run(IDLE)
    moved = {name: value for values in changes(session) for name, value in values.items()}
    for key, modifiers in (("z", CTRL), ("y", CTRL), ("s", CTRL), ("c", 0), ("i", 0), ("r", 0)):
        page.key(key, modifiers=modifiers)
        page.run("await new Promise((go) => setTimeout(go, 60));" + IDLE)

    base = "robots.left.base."
    assert moved == {f"{base}x_mm": 1, f"{base}y_mm": 10, f"{base}z_mm": 499, f"{base}yaw_deg": 1}
    actions = [body["action"] for path, body in session.received if path == "/do"]
    assert actions == ["undo", "redo", "save", "certify", "improve", "repair"]


def test_certified_holds_until_the_next_change_and_its_state_stays_as_a_ghost(page: Browser) -> None:
    seen = []
    for step in ("", "await app.act('certify');", "app.change({ 'robots.left.base.x_mm': 300 });"):
        page.run(f"{step} {IDLE} await new Promise((go) => setTimeout(go, 700));")
        ghosts = page.run("return app.overlay.ghostBodies(app.stage.at(0), app.overlay.ghost, FIXED_COLOUR).length;")
        seen.append((page.text("state"), page.run("return byId('state').className;"), ghosts > 0))

    assert seen == [
        ("○ planned", "planned", False),
        ("✓ certified", "certified", False),
        ("○ planned", "planned", True),
    ]
    assert page.text("outcome").startswith("of the state before the last change:certified: all checks of solve passed")


def test_a_job_that_breaks_off_is_red_with_the_time_to_which_it_gets(page: Browser) -> None:
    page.run(f"app.change({{ 'robots.right.base.x_mm': {LOST_FROM + 1} }}); {IDLE}")

    assert page.text("state") == "✗ breaks off"
    assert page.text("lost") == "gets to 0.600 s"
    row, hit = page.run(
        "return [byId('figures').rows[0].className, byId('curve').querySelector('.hit').getAttribute('x')];"
    )
    assert (row, float(hit)) == ("mark", 600.0)


@pytest.mark.parametrize("reasons", [["first", "second"], ["far " * 200], []])
def test_all_reasons_are_to_be_read_whatever_the_line_at_the_top_has_room_for(
    page: Browser, session: FakeSession, reasons: list[str]
) -> None:
    session.reasons = reasons
    page.run(f"app.change({{ 'robots.right.base.x_mm': {LOST_FROM + 1} }}); {IDLE}")
    listed = page.run("return [...byId('reasons').children].map((item) => item.textContent.trim());")

    assert listed == (reasons if len(reasons) != 1 else [f"left/C leaves its range {reasons[0]}".strip()])
    page.run(f"app.change({{ 'robots.right.base.x_mm': 0 }}); {IDLE}")
    assert page.text("reasons") == ""


def test_advice_is_an_arrow_and_a_button_that_moves_the_base(page: Browser, session: FakeSession) -> None:
    before = session.record["answer"]["values"]["robots.right.base.y_mm"]
    start, end = page.run("return app.overlay.arrowEnds(app.answer.advice[0]);")
    page.run(f"byId('advice').querySelector('button').click(); {IDLE}")

    assert np.subtract(end, start)[[0, 2]] == pytest.approx([0.0, 0.0])
    assert end[1] > start[1]
    assert session.record["answer"]["values"]["robots.right.base.y_mm"] == before + 20.0


TILE = {"x_mm": 0, "y_mm": 0, "value": 1, "state": "passes"}
EVENTS: list[dict[str, Any]] = [
    {"event": "progress", "work": "improve", "fraction": 0.5, "text": "trial 3"},
    {"event": "trial", "work": "improve", "text": "margin 12 deg", "number": 3, "picture": None},
    {"event": "tiles", "robot": "left", "size_mm": 200, "tiles": [TILE]},
    {"event": "file", "state": "conflict", "text": "the file was changed"},
]


def test_events_show_progress_trials_tiles_and_the_question_of_a_conflict(page: Browser, session: FakeSession) -> None:
    for event in EVENTS:
        session.events.put(event)
    page.run("while (byId('file').hidden) await drawn();")
    seen = page.run("""
      const before = [byId("progress").textContent.trim(), app.overlay.tileBodies().length, document.activeElement.id];
      byId("outcome").querySelector("button").click();
      byId("file-keep").click();
      return before;
    """)
    page.run("await new Promise((go) => setTimeout(go, 100));" + IDLE)

    assert seen == ["improve: trial 3", 1, "file-reload"]
    assert ("/do", {"action": "take", "argument": 3}) in session.received
    assert ("/do", {"action": "keep"}) in session.received


def test_an_offered_layout_is_in_the_picture_while_its_line_is_pointed_at(page: Browser, session: FakeSession) -> None:
    answer = session.record["answer"]
    for number, by in enumerate((0.0, 0.3)):
        bases = deepcopy(answer["poses"]["bases"])
        bases[0][3] += by
        shown = {
            "values": answer["values"],
            "poses": {**answer["poses"], "bases": bases},
            "motions": {"0": answer["motion"]},
        }
        session.events.put({"event": "trial", "work": "improve", "text": f"{by}", "number": number, "picture": shown})
    page.run("while (byId('outcome').querySelectorAll('button').length < 2) await drawn();")
    offered = "app.overlay.ghostBodies(app.stage.at(0), app.overlay.offer, FIXED_COLOUR)"
    newest, line = page.run(f"return [{offered}.length, app.overlay.offerLines()[0].points];")
    page.run("byId('outcome').querySelector('button').focus();")

    assert newest > 0
    assert line["3"] - line["0"] == pytest.approx(0.3, abs=1e-6)
    assert page.run(f"return {offered}.length;") == 0  # of the first one nothing stands elsewhere


def test_an_answer_that_another_page_caused_arrives(page: Browser, session: FakeSession) -> None:
    session.events.put({"event": "answer", "answer": session.change({"robots.left.base.x_mm": 77.0}, None)})
    page.run("while (app.desired['robots.left.base.x_mm'] !== 77) await drawn(); await drawn();")

    assert page.run("return document.querySelector('[data-address=\"robots.left.base.x_mm\"]').value;") == "77"


def test_a_refused_change_is_said_and_the_values_stay(page: Browser, session: FakeSession) -> None:
    session.refusal = "robots.left.base.x_mm: expected at most 10"
    page.run(f"app.change({{ 'robots.left.base.x_mm': 50 }}); {IDLE}")

    assert session.refusal in page.text("outcome")
    assert page.run("return app.desired['robots.left.base.x_mm'];") == 0


def test_another_block_is_shown_when_it_is_pressed(page: Browser, session: FakeSession) -> None:
    page.run(f"byId('strip').querySelectorAll('button')[1].click(); {IDLE}")

    assert [body["block"] for path, body in session.received if path == "/change"] == [1]
    assert page.run("return byId('strip').querySelector('[aria-pressed=true]').textContent;") == "○ second"


def test_a_session_that_ends_is_said_and_the_history_stays(page: Browser, session: FakeSession) -> None:
    page.run(f"app.change({{ 'robots.left.base.x_mm': 5 }}); {IDLE}")
    session.events.put({"event": "cut"})
    page.run("while (byId('gone').hidden) await drawn();")
    time.sleep(0.1)

    assert "has ended" in page.text("gone-text")
    assert "--set robots.left.base.x_mm=5" in page.run("return byId('history').value;")
    assert page.run("return byId('certify').disabled && byId('fields').querySelector('input').disabled;")


def test_without_webgl_figures_live_and_the_picture_stands(session: FakeSession) -> None:
    with Browser("--disable-3d-apis") as browser, serving(session) as address:
        show(browser, address)
        browser.run(f"app.change({{ 'robots.left.base.x_mm': 5 }}); {IDLE}")

        assert browser.text("notice").startswith("Still pictures")
        assert f"{sum(session.record['answer']['values'].values()):.2f} deg" in browser.text("figures")
        assert browser.console == []


def test_memory_does_not_grow_with_answers(page: Browser) -> None:
    def used(rounds: int) -> float:
        page.run(f"""
          for (let i = 0; i < {rounds}; i += 1) {{
            app.change({{ "robots.left.base.x_mm": i % 7 }});
            await drawn();
          }}
          {IDLE}
        """)
        page.command("HeapProfiler.collectGarbage")
        return float(page.command("Runtime.getHeapUsage")["usedSize"])

    first = used(60)

    assert used(200) < first + 500_000  # [bytes] an answer of this cell has 10 kB
