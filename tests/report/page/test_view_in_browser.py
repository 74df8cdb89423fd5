"""3-D pages in headless Chromium: no error, a picture, the instant of the address, controls that work."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from builders.browser import Browser
from builders.view_pages import body_poses, data_of, rows_of

from cellplan import load_cell
from cellplan.jobs.view.write import ViewRequest, view, write_view

pytestmark = pytest.mark.slow

FIGURES = ("cycle_s", "margin_deg", "clearance_mm", "change")
STAGE = np.s_[60:690, 5:925]  # of a window of 1280 by 800: the picture, without the lists
EXCLUDED = "checks: {exclude: [{bodies: [idle/mount, idle/A], reason: its first link lies on it}]}\n"
BOX = "  crate: {box: {size_mm: [400, 400, 400]}, at: {xyz_mm: [500, 4000, 500]}}\n"  # round an arm of the idle robot


@pytest.fixture(scope="module")
def folder(sound: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page of a run, of a cell, and of a cell in which an arm stands in a crate."""
    folder, cell = tmp_path_factory.mktemp("pages"), sound / "cell" / "small.yaml"
    crowded = cell.with_name("in_a_crate.yaml")
    crowded.write_text(cell.read_text().replace("motion:", f"{BOX}motion:"))
    requests = {
        "run": ViewRequest(path=sound / "run", cell=cell),
        "cell": ViewRequest(path=cell, settings=["motion.step_s=0.05", "robots.right.base.x_mm=1900"]),
        "crate": ViewRequest(path=crowded),
    }
    for name, request in requests.items():
        write_view(view(request)[0], folder / f"{name}.html")
    crowded.unlink()
    layout = {"origin": "given", "status": "conforming", "reason": "", **dict.fromkeys(FIGURES, 1.0)}
    top = [{"trial": x, "settings": {"robots.idle.base.x_mm": x}, **layout} for x in (0, 900)]
    (folder / "study.json").write_text(json.dumps({"schema": "cellplan.layout/1", "kind": "layout", "top": top}))
    write_view(view(ViewRequest(path=folder, cell=cell))[0], folder / "study.html")
    return folder


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as browser:
        yield browser


@pytest.fixture(scope="module")
def without_webgl() -> Iterator[Browser]:
    with Browser("--disable-3d-apis") as browser:
        yield browser


def is_red(image: np.ndarray) -> np.ndarray:
    """Pixels of the red of colliding bodies, in light and in shade."""
    return (image[..., 0] > 0.3) & (image[..., 1] < 0.25 * image[..., 0]) & (image[..., 2] < 0.25 * image[..., 0])


def shades(image: np.ndarray) -> int:
    """Number of different colours, in 32 steps of each."""
    return len(np.unique((31 * image).astype(int).reshape(-1, 3), axis=0))


@pytest.mark.parametrize("name", ["run", "cell", "crate"])
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_pages_load_without_a_word_on_the_console(browser: Browser, folder: Path, name: str, theme: str) -> None:
    browser.open(folder / f"{name}.html", theme=theme)

    assert browser.console == []
    assert browser.run("return [document.documentElement.dataset.theme, app.isStill];") == [theme, False]


def test_the_instant_of_the_address_is_shown(browser: Browser, folder: Path) -> None:
    browser.open(folder / "run.html", "#t=0.62&view=top")

    assert browser.text("clock") == "0.620 s of 1.000 s"
    assert browser.run("return Number(byId('time').value);") == pytest.approx(0.62)
    browser.run("location.hash = '#t=0.31'; await drawn(); await drawn();")
    assert browser.text("clock") == "0.310 s of 1.000 s"


def test_bodies_are_drawn_where_the_kinematics_put_them(browser: Browser, folder: Path) -> None:
    browser.open(folder / "run.html")
    places = browser.run("""
      const state = app.stage.at(0.475);
      return app.stage.scene.bodies.map((body, i) => app.stage.bodyPose(i, state.links, 0.475));
    """)

    scene = data_of((folder / "run.html").read_text())["scenes"][0]
    times, q = rows_of(scene["motion"])
    row = int(np.argmin(np.abs(times - 0.475)))
    for column_wise, pose in zip(places, body_poses(scene, q[row]), strict=True):
        assert np.abs(np.reshape(column_wise, (4, 4)).T - pose).max() < 1e-4


@pytest.mark.parametrize("name", ["browser", "without_webgl"])
def test_the_picture_is_not_blank_and_red_bodies_are_those_that_touch(
    folder: Path, name: str, request: pytest.FixtureRequest
) -> None:
    browser: Browser = request.getfixturevalue(name)
    pictures = {}
    for page in ("cell", "crate"):
        browser.open(folder / f"{page}.html")
        pictures[page] = browser.picture()[STAGE]

    assert min(map(shades, pictures.values())) > 40
    assert is_red(pictures["crate"]).mean() > 0.002
    assert is_red(pictures["cell"]).mean() < 0.2 * is_red(pictures["crate"]).mean()  # an axis of the floor is red too


def test_the_picture_changes_with_time(browser: Browser, folder: Path) -> None:
    pictures = []
    for t in (0.0, 1.0):
        browser.open(folder / "run.html", f"#t={t}")
        pictures.append(browser.picture()[STAGE])

    assert (np.abs(pictures[0] - pictures[1]).max(axis=-1) > 0.1).mean() > 0.002


def test_without_webgl_the_page_says_so(without_webgl: Browser, folder: Path) -> None:
    without_webgl.open(folder / "run.html")

    assert without_webgl.text("notice").startswith("Still pictures: WebGL 2 is missing.")
    assert without_webgl.console == []


CONTROLS = """
  const seen = {};
  const key = async (name, options = {}) => {
    document.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true, ...options }));
    await drawn();
  };
  byId("play").click();
  await new Promise((go) => setTimeout(go, 300));
  byId("play").click();
  await drawn();
  seen.played = app.player.t;
  seen.playing = app.player.isPlaying;
  byId("time").value = 0.5;
  byId("time").dispatchEvent(new Event("input"));
  await drawn();
  seen.slid = byId("clock").textContent;
  byId("forward").click();
  seen.stepped = app.player.t;
  await key("ArrowLeft");
  seen.back = app.player.t;
  await key("ArrowRight", { shiftKey: true });
  seen.tenth = app.player.t;
  await key("+");
  seen.speed = byId("speed").value;
  await key("6");
  seen.top = app.camera.eye[2] > 10 * Math.abs(app.camera.eye[0] - app.camera.target[0]);
  seen.bodies = app.stage.frame(app.stage.at(0)).bodies.length;
  byId("show-robots").querySelector("input").click();
  await drawn();
  seen.fewer = app.stage.frame(app.stage.at(0)).bodies.length;
  byId("traces").value = "none";
  byId("traces").dispatchEvent(new Event("change"));
  seen.traces = app.stage.traces.lines(app.stage.at(0)).length;
  const theme = document.documentElement.dataset.theme;
  byId("theme").click();
  seen.theme = theme !== document.documentElement.dataset.theme;
  byId("excluded").querySelector("button").click();
  seen.picked = app.stage.picked.size;
  await key("End");
  seen.end = byId("clock").textContent;
  return seen;
"""


def test_controls_and_keys_do_what_they_say(browser: Browser, folder: Path) -> None:
    browser.open(folder / "run.html")

    seen = browser.run(CONTROLS)

    assert 0.0 < seen["played"] <= 1.0
    assert seen["playing"] is False
    assert seen["slid"] == "0.500 s of 1.000 s"
    assert [seen[name] for name in ("stepped", "back", "tenth")] == pytest.approx([0.525, 0.5, 0.6])
    assert (seen["speed"], seen["top"], seen["theme"], seen["picked"], seen["traces"]) == ("2", True, True, 2, 0)
    assert seen["fewer"] < seen["bodies"]
    assert seen["end"] == "1.000 s of 1.000 s"
    assert browser.console == []


def test_moved_bases_become_options_and_yaml(browser: Browser, folder: Path) -> None:
    browser.open(folder / "cell.html")

    options, yaml, x = browser.run("""
      const input = byId("bases").querySelectorAll("input")[6];
      input.value = 1950;
      input.dispatchEvent(new Event("input"));
      await drawn();
      return [byId("set-text").value, byId("yaml-text").value, app.stage.at(0).links[1][0][12]];
    """)

    assert options.startswith("cellplan check /")
    assert options.endswith("/cell/small.yaml --set motion.step_s=0.05 --set robots.right.base.x_mm=1950")
    assert yaml == "robots:\n  right:\n    base: {xyz_mm: [1950, 300, 480], rpy_deg: [0, 0, 180]}"
    assert x == pytest.approx(1.95)


@pytest.mark.parametrize("column", ["box: {size_mm: [260, 200]}", "cylinder: {radius_mm: 120}"])
def test_a_wedge_below_a_moved_base_is_cut_off_as_the_cell_has_it(
    browser: Browser, sound: Path, tmp_path: Path, column: str
) -> None:
    leaning = "base: {xyz_mm: [0, 4000, 500], rpy_deg: [0, 20, 30]}\n    mount: {tilted: {COLUMN}}"
    text = (sound / "cell" / "small.yaml").read_text()
    path = sound / "cell" / "tilted.yaml"
    path.write_text(text.replace("base: {xyz_mm: [0, 4000, 500]}", leaning.replace("COLUMN", column)) + EXCLUDED)
    write_view(view(ViewRequest(path=path))[0], tmp_path / "tilted.html")
    moved = {"x_mm": 150.0, "z_mm": 620.0, "roll_deg": -5.0, "pitch_deg": 35.0, "yaw_deg": 80.0}
    cell = load_cell(path).with_values({f"robots.idle.base.{key}": value for key, value in moved.items()})
    path.unlink()

    browser.open(tmp_path / "tilted.html")
    places = browser.run(f"""
      const fields = byId("bases").querySelectorAll("fieldset")[2].querySelectorAll("input");
      const changes = {json.dumps(moved)};
      COMPONENTS.forEach((component, i) => {{
        if (!(component in changes)) return;
        fields[i].value = changes[component];
        fields[i].dispatchEvent(new Event("input"));
      }});
      await drawn();
      const index = app.stage.scene.bodies.findIndex((body) => body.name === "idle/mount");
      const geometry = app.stage.geometries[app.stage.scene.bodies[index].geometry];
      const place = multiply(app.stage.bodyPose(index, app.stage.at(0).links, 0), geometry.place);
      const found = [];
      for (let i = 0; i < geometry.points.length; i += 3) {{
        found.push(moved(place, Array.from(geometry.points.slice(i, i + 3), (step) => step / GRID_STEPS)));
      }}
      return found;
    """)

    robot = cell.robot("idle")
    solid, X_BS = robot.pedestal.solid(robot.X_WB)
    X_WS = robot.X_WB @ X_BS
    assert np.abs(np.array(places) - (solid.vertices @ X_WS[:3, :3].T + X_WS[:3, 3])).max() < 2e-5  # a grid of 16 bit
    assert browser.console == []


def test_a_failure_is_shown_with_its_bodies(browser: Browser, folder: Path) -> None:
    browser.open(folder / "crate.html")

    assert browser.run("return app.failure;") == 0  # the page opens there
    picked = browser.run("""
      byId("failures").querySelectorAll("button")[1].click();
      await drawn();
      return [...app.stage.picked].map((index) => app.stage.scene.bodies[index].name);
    """)

    assert "crate" in picked
    assert "crate" in browser.text("touching-now")


def test_layouts_follow_one_another(browser: Browser, folder: Path) -> None:
    browser.open(folder / "study.html")
    place = "return [document.getElementById('verdict').textContent, app.stage.at(0).links[2][0][12]];"

    assert browser.run(place) == ["1 of 2: trial 0, conforming", 0.0]
    browser.run('document.dispatchEvent(new KeyboardEvent("keydown", { key: "n", bubbles: true })); await drawn();')
    assert browser.run(place) == ["2 of 2: trial 900, conforming", 0.9]
    browser.open(folder / "study.html", "#layout=2")
    assert browser.run(place)[1] == 0.9
    assert browser.console == []


@pytest.mark.parametrize("name", ["run", "cell"])
def test_nothing_sticks_out_of_a_narrow_window(browser: Browser, folder: Path, name: str) -> None:
    browser.open(folder / f"{name}.html", size=(390, 844))

    wide = browser.run("""
      for (const each of document.querySelectorAll("details")) each.open = true;
      await drawn();
      const all = [...document.querySelectorAll("body *")].filter((each) => !each.closest("#stage"));
      const wide = all.filter((each) => each.getBoundingClientRect().right > 390.5);
      return [document.documentElement.scrollWidth, ...wide.map((each) => `${each.tagName} ${each.id}`)];
    """)

    assert wide == [390]


FENCE = """\
  fence: {box: {size_mm: [9000, 40, 4000]}, at: {xyz_mm: [700, -1500, 0]}}
  rear: {box: {size_mm: [9000, 40, 4000]}, at: {xyz_mm: [700, 4500, 0]}}
"""
SHELTER = """\
  shelter: {box: {size_mm: [9000, 8000, 40]}, at: {xyz_mm: [700, 1000, 2000]}}
"""
SEEN = """
  const names = (indices) => [...indices].map((index) => app.stage.scene.bodies[index].name);
  const faded = app.stage.frame(app.stage.at(app.player.t), app.camera.eye).bodies.filter((body) => body.opacity < 1);
  return [names(app.stage.sight.from(app.camera.eye)), faded.length];
"""


def page_of(sound: Path, folder: Path, surroundings: str) -> Path:
    """The 3-D page of the small cell with more surroundings."""
    shutil.copytree(sound / "cell", folder)
    cell = folder / "small.yaml"
    cell.write_text(cell.read_text().replace("motion:", f"{surroundings}motion:"))
    write_view(view(ViewRequest(path=cell))[0], folder / "page.html")
    return folder / "page.html"


@pytest.mark.parametrize("preset", ["front", "back", "top"])
@pytest.mark.parametrize("name", ["browser", "without_webgl"])
def test_robots_are_seen_through_what_stands_before_them(
    sound: Path, tmp_path: Path, name: str, preset: str, request: pytest.FixtureRequest
) -> None:
    browser: Browser = request.getfixturevalue(name)
    hiding = {"front": "fence", "back": "rear", "top": "shelter"}[preset]
    pictures = {}
    for page, surroundings in (("open", ""), ("fenced", SHELTER if preset == "top" else FENCE)):
        browser.open(page_of(sound, tmp_path / page, surroundings), f"#view={preset}")
        if page == "fenced":
            names, faded = browser.run(SEEN)
            assert hiding in names
            assert faded == len(names) < 3
        browser.run("app.camera.whole = app.stage.machines; app.camera.look(app.camera.preset); await drawn();")
        pictures[page] = browser.picture()[STAGE]

    # colours of robots stay colours: grey walls have none
    vivid = {page: (image[..., :3].max(-1) - image[..., :3].min(-1) > 0.12).mean() for page, image in pictures.items()}
    assert vivid["fenced"] > 0.5 * vivid["open"] > 0.001


def test_what_touches_a_robot_is_not_faded(browser: Browser, folder: Path) -> None:
    browser.open(folder / "crate.html")

    names, faded = browser.run(SEEN)

    assert "crate" in names
    assert faded < len(names)


def test_the_view_from_above_holds_the_whole_cell(sound: Path, tmp_path: Path, browser: Browser) -> None:
    browser.open(page_of(sound, tmp_path / "fenced", FENCE), "#view=top")

    outside = browser.run("""
      const matrix = app.camera.matrix();
      const places = app.stage.whole.corners.map((corner) => projected(matrix, corner));
      return places.filter(([x, y, , w]) => Math.abs(x) > w || Math.abs(y) > w).length;
    """)

    assert outside == 0
    corners = browser.run("return [app.stage.whole, app.stage.machines].map((each) => each.corners.length);")
    assert corners[0] > corners[1]


@pytest.mark.parametrize("frame", ["world", "part"])
def test_traces_follow_the_rows_of_a_long_program(browser: Browser, folder: Path, frame: str) -> None:
    """A minute of motion with a turn of a tool each second: chords of a second would cut straight across."""
    browser.open(folder / "run.html")
    worst, count, end = browser.run(f"""
      const stage = app.stage;
      const rows = 60001;
      const width = stage.motion.width;
      stage.motion.count = rows;
      stage.motion.times = Float64Array.from({{ length: rows }}, (_, i) => i / 1000);
      stage.motion.q = Float32Array.from({{ length: rows * width }}, (_, i) => {{
        const t = Math.floor(i / width) / 1000;
        return 0.3 * Math.sin(2 * Math.PI * t + (i % width));
      }});
      stage.traces = new Traces(stage);
      const {{ rows: shown, points }} = stage.traces.seenFrom("{frame}");
      let worst = 0;
      for (let i = 0; i + 1 < shown.length; i += 7) {{
        const middle = stage.traces.tips("{frame}", (shown[i] + shown[i + 1]) >> 1);
        middle.forEach((tip, robot) => {{
          const [a, b] = [i, i + 1].map((at) => [...points[robot].subarray(3 * at, 3 * at + 3)]);
          worst = Math.max(worst, offChord(tip, a, b));
        }});
      }}
      stage.traceIn = "{frame}";
      const state = stage.at(30.0123);
      const rest = stage.traces.lines(state).filter((line) => line.isBrief)[0];
      const tip = moved(inverseRigid(rest.place), tipOf(stage.scene.robots[0], state.links[0]));
      return [worst, shown.length, length(subtract([...rest.points.subarray(3)], tip))];
    """)

    assert worst < 6e-4  # [m]
    assert count < 20_000
    assert end < 1e-6  # [m] the trace ends at the tool
