"""Handles of the live cell in headless Chromium, against a true session: they move what its values move."""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders.browser import Browser
from builders.served_session import live, rest, shown

from cellplan.session.answer import poses
from cellplan.session.session import Session

pytestmark = pytest.mark.slow

CELL = Path(__file__).resolve().parents[3] / "cells" / "find_a_layout.yaml"
STEP = 1e-3  # [mm] or [deg] of a central difference
POINT = [0.1, -0.2, 0.3]  # [m] from a tip or an origin: off every axis
MOVED = f"""
  const POINT = {POINT};
  app.player.pause();
  const state = app.stage.at(app.player.t);
  const handle = app.handles.all.find((one) => one.prefix === prefix && one.subject === subject);
  const {{ motions }} = motionsOf(handle, app, state);
  const {{ along, about, at, factor = 1 }} = motions[part];
  const robot = app.stage.scene.robots[handle.index];
  const links = state.links[handle.index];
  const carrier = (record) => {{
    if (prefix === "tool") return multiply(links[robot.tip_link + 1], fromRows(record.tools[handle.index]));
    const [holder] = app.stage.scene.part;
    if (prefix === "part") return multiply(state.links[holder.robot][holder.link + 1], fromRows(record.part));
    return fromRows(record.bases[handle.index]);
  }};
  const points = poses.map((record) => moved(carrier(record), POINT));
  const middle = times(add(...points), 0.5);
  const rate = about ? cross(about, subtract(middle, at)) : along;
  return [subtract(points[1], points[0]), times(rate, factor)];
"""
OF_START = """
  app.player.pause();
  const state = app.stage.at(app.player.t);
  const handle = app.handles.all.find((one) => one.prefix === "start");
  const { motions } = motionsOf(handle, app, state);
  const robot = app.stage.scene.robots[handle.index];
  const tip = (q) => tipOf(robot, linkPoses(robot, app.stage.bases[handle.index], q));
  return Object.entries(motions).map(([part, { along, about, at, factor }]) => {
    const joint = robot.column + Number(part.slice(5));
    const ends = [-1e-5, 1e-5].map((step) => tip(state.q.map((value, i) => value + (i === joint ? step : 0))));
    const rate = about ? cross(about, subtract(tip(state.q), at)) : along;
    return [times(subtract(ends[1], ends[0]), 5e4), times(rate, factor)];
  });
"""
SPOT = """
  const place = app.handles.place(app.handles.selected);
  const [x, y, , w] = projected(app.camera.matrix(), PART ? place.motions[PART].spot : place.at);
  const box = byId("canvas").getBoundingClientRect();
  return [box.left + (0.5 + (0.5 * x) / w) * box.width, box.top + (0.5 - (0.5 * y) / w) * box.height];
"""


@pytest.fixture(scope="module")
def page() -> Iterator[Browser]:
    with live(CELL) as address, Browser() as browser:
        shown(browser, address)
        yield browser


@pytest.fixture(scope="module")
def session() -> Iterator[Session]:
    with closing(Session.open(CELL)) as session:
        yield session


def ends(session: Session, address: str) -> list[dict[str, Any]]:
    """Where tools, part and bases are with a number a step less and a step more."""
    variables = session._engine.given.variables
    given = variables.variable(address).given
    cells = [variables.layout.placed(variables.numbers({address: given + step})) for step in (-STEP, STEP)]
    return [dict(poses(cell, {})) for cell in cells]


@pytest.mark.parametrize(
    ("prefix", "subject", "part", "address"),
    [
        ("base", "kuka", "x", "robots.kuka.base.x_mm"),
        ("base", "kuka", "yaw", "robots.kuka.base.yaw_deg"),
        *(("tool", "abb", key.partition("_")[0], f"robots.abb.tool.rod.{key}") for key in ("length_mm", "tilt_deg")),
        ("tool", "kuka", "roll", "robots.kuka.tool.rod.roll_deg"),
        *(("part", "part", key.partition("_")[0], f"part.held_by[0].at.{key}") for key in ("x_mm", "z_mm")),
        *(("part", "part", key, f"part.held_by[0].at.{key}_deg") for key in ("roll", "pitch", "yaw")),
    ],
)
def test_a_handle_moves_as_the_derivative_of_what_its_value_places(
    page: Browser, session: Session, prefix: str, subject: str, part: str, address: str
) -> None:
    arguments = f"const [prefix, subject, part, poses] = {[prefix, subject, part, ends(session, address)]};"
    change, rate = page.run(arguments + MOVED)
    by = 2.0 * (np.radians(STEP) if address.endswith("_deg") else 1e-3 * STEP)

    assert np.linalg.norm(rate) > 0.05
    assert np.array(change) / by == pytest.approx(np.array(rate), abs=2e-3)  # poses have nine decimals


def test_a_joint_of_the_start_turns_the_tip_about_the_axis_of_its_knob(page: Browser) -> None:
    rows = page.run(OF_START)

    assert len(rows) == 6
    for change, rate in rows:
        assert change == pytest.approx(rate, abs=1e-6)


def drag(page: Browser, part: str, by: tuple[float, float]) -> tuple[Any, Any]:
    """Take a knob of what is selected, move it by pixels; where the knob was before and after, in the picture."""
    spot = SPOT.replace("PART", repr(part))
    x, y = page.run(spot)
    page.pointer("Moved", x, y)
    page.pointer("Pressed", x, y)
    for share in (0.3, 0.6, 1.0):
        page.pointer("Moved", x + share * by[0], y + share * by[1])
    page.run(
        "await drawn(); while (app.client.isSending) await drawn(); await new Promise((go) => setTimeout(go, 200));"
    )
    after = page.run(spot)
    page.pointer("Released", x + by[0], y + by[1])
    return (x, y), after


def test_the_part_follows_the_pointer_at_its_start_and_plays_on_when_it_is_let_go(page: Browser) -> None:
    page.run("app.handles.select(app.handles.all.find((one) => one.prefix === 'part')); app.camera.look('oblique');")
    page.run("app.player.goTo(0); await drawn();")
    before, after = drag(page, "z", (0.0, -12.0))
    assert np.subtract(after, before) == pytest.approx([0.0, -12.0], abs=1.5)  # the knob is of constant size

    page.run("app.player.speed = 0.01; app.player.play(); await drawn();")
    x, y = page.run(SPOT.replace("PART", "''"))
    page.pointer("Pressed", x, y)
    is_standing = not page.run("return app.player.isPlaying;")
    page.pointer("Released", x, y)
    assert (is_standing, page.run("return app.player.isPlaying;")) == (True, True)
    page.run("app.player.speed = 1; app.player.pause(); app.act('reset');")
    rest(page, "app.answer.values['part.held_by[0].at.z_mm'] === app.variables.get('part.held_by[0].at.z_mm').given")


def test_keys_change_the_length_the_tilt_and_the_roll_of_a_tool_and_a_joint_of_the_start(page: Browser) -> None:
    keys = [("ArrowUp", "length_mm", 1), ("ArrowRight", "tilt_deg", 1), ("q", "roll_deg", 1)]
    page.run("app.handles.select(app.handles.all.find((one) => one.prefix === 'tool')); byId('canvas').focus();")
    for key, _, _ in keys:
        page.key(key)
    names = [f"robots.kuka.tool.rod.{name}" for _, name, _ in keys]
    changed = page.run(f"return {names}.map((name) => app.desired[name] - app.variables.get(name).given);")
    assert changed == pytest.approx([by for _, _, by in keys])

    page.run("app.handles.select(app.handles.all.find((one) => one.prefix === 'start'));")
    page.key("ArrowUp")
    page.key("ArrowRight", modifiers=8)
    starts = page.run("""
      const starts = [...app.variables.values()].filter(({ kind }) => kind === "start");
      return starts.map(({ address, given }) => app.desired[address] - given);
    """)
    assert starts == pytest.approx([0.0, 10.0, 0.0, 0.0, 0.0, 0.0])
    assert page.console == []


def test_a_dragged_base_rests_on_the_line_of_another_one(page: Browser) -> None:
    page.run("""
      app.act("reset");
      app.handles.select(app.handles.all.find((one) => one.subject === "staubli"));
      app.camera.look("top");
      byId("grid").value = LINES;
      byId("grid").dispatchEvent(new Event("change"));
      await drawn(); while (app.client.isSending) await drawn(); await drawn();
    """)
    (x, y), (to_x, _) = [
        page.run(SPOT.replace("PART ? place.motions[PART].spot : place.at", f"origin(app.stage.bases[{robot}])"))
        for robot in (3, 1)
    ]
    drag(page, "", (to_x - x + 4.0, 30.0))
    other, mine, along = page.run("""
      const [other, mine] = ["kuka", "staubli"].map((name) => `robots.${name}.base.x_mm`);
      return [app.desired[other], app.desired[mine], app.desired["robots.staubli.base.y_mm"]];
    """)

    assert mine == other
    assert along != page.run("return app.variables.get('robots.staubli.base.y_mm').given;")
    assert y > 0.0
