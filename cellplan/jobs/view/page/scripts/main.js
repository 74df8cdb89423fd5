// The page: its data, its picture, and what connects time, camera and lists.

const MOVING_SHARPNESS = 0.6; // pixels of the picture by those of the window, while it moves and the processor draws it

class App {
  /** Parts are the classes of controls, lists and fields. */
  constructor(record, parts) {
    this.record = record;
    this.failure = -1;
    this.markedAt = null; // time at which the bodies of a failure are marked
    this.stage = new Stage(record);
    this.camera = new Camera(byId("canvas"), () => this.turned());
    this.player = new Player(() => this.refresh());
    this.player.setMotion(this.stage.motion);
    this.open();
    this.controls = new parts.Controls(this);
    this.panels = new parts.Panels(this);
    this.bases = new parts.Bases(this);
    this.fillLayouts();
    byId("traces").addEventListener("change", (event) => {
      this.stage.traceIn = event.target.value;
      this.refresh();
    });
    byId("excluded-lines").addEventListener("change", (event) => {
      this.stage.excludedLines = event.target.checked;
      this.refresh();
    });
    addEventListener("resize", () => this.refresh());
    addEventListener("hashchange", () => this.follow());
    this.setScene(0);
    if (record.kind !== "study" && !("t" in readAddress()) && this.stage.scene.failures.length) this.showFailure(0);
    this.follow();
  }

  /** Draw by WebGL, or paint still pictures where it is missing. */
  open() {
    const canvas = byId("canvas");
    const { geometries } = this.stage;
    try {
      if ("still" in readAddress()) throw new Error("still pictures are asked for");
      this.view = new WebglView(canvas, geometries);
      this.isStill = false;
    } catch (error) {
      byId("notice").textContent = `Still pictures: ${error.message}. Slider, views and lists work; playing is slow.`;
      byId("notice").hidden = false;
      this.view = new PaintedView(canvas, geometries);
      this.stage.shown.meshes = false; // bodies of the proof have far fewer triangles
      this.isStill = true;
    }
  }

  setScene(index) {
    this.place = index;
    if (this.stage.scene !== this.record.scenes[index]) this.stage.setScene(this.record.scenes[index]);
    this.failure = -1;
    this.markedAt = null;
    this.player.setMotion(this.stage.motion);
    this.camera.fit(this.stage.machines, this.stage.whole);
    this.controls.setScene();
    this.panels.setScene();
    this.bases.setScene();
    this.makeLabels();
    for (const [number, button] of [...byId("layouts").querySelectorAll("button")].entries()) {
      button.setAttribute("aria-pressed", String(number === index));
    }
    byId("verdict").textContent = this.verdict();
    byId("verdict").className = { true: "passed", false: "failed" }[this.stage.scene.passed] ?? "";
    this.camera.look("oblique");
  }

  verdict() {
    const { scene } = this.stage;
    if (this.record.kind === "study") return scene.name;
    if (this.record.kind === "cell") return scene.passed ? "start is sound, not solved" : "start is not sound";
    return scene.passed ? "passed" : "failed";
  }

  fillLayouts() {
    const { scenes } = this.record;
    byId("layouts-panel").hidden = this.record.kind !== "study";
    byId("layouts").replaceChildren(...scenes.map((scene, index) => {
      const figures = scene.facts.slice(1, -1).map(([label, value]) => `${label} ${value}`).join(", ");
      const button = element("button", { type: "button", className: "jump" }, scene.name, element("small", { textContent: figures }));
      button.addEventListener("click", () => this.setScene(index));
      return element("li", {}, button);
    }));
  }

  /** The next failure of a run, or the next layout of a search. */
  next(step) {
    const { scenes, kind } = this.record;
    if (kind === "study") this.setScene((this.place + step + scenes.length) % scenes.length);
    const count = this.stage.scene.failures.length;
    if (kind !== "study" && count) this.showFailure((Math.max(this.failure, step < 0 ? 0 : -1) + step + count) % count);
  }

  showFailure(index) {
    const failure = this.stage.scene.failures[index];
    this.failure = index;
    this.stage.picked = new Set(failure.bodies);
    for (const [number, button] of [...byId("failures").querySelectorAll("button")].entries()) {
      button.setAttribute("aria-current", String(number === index));
    }
    for (const bar of this.panels.bars) {
      bar.row.classList.toggle("picked", bar.robot === failure.joint[0] && bar.place === failure.joint[1]);
    }
    this.jump(failure.at ?? this.player.t);
    this.markedAt = this.player.t;
  }

  /** Bodies and joint of a failure are marked at its time only. */
  leaveFailure() {
    if (this.markedAt === null || Math.abs(this.player.t - this.markedAt) < 1e-6) return;
    this.markedAt = null;
    this.stage.picked.clear();
    for (const button of byId("failures").querySelectorAll("[aria-current=true]")) button.setAttribute("aria-current", "false");
    for (const bar of this.panels.bars) bar.row.classList.remove("picked");
  }

  jump(t) {
    this.player.isPlaying = false;
    this.player.goTo(t);
  }

  /** Go where the address of the page says. */
  follow() {
    const address = readAddress();
    const layout = Number(address.layout) - 1;
    if (Number.isInteger(layout) && this.record.scenes[layout] && layout !== this.place) this.setScene(layout);
    if (address.view in PRESETS) this.camera.look(address.view);
    if (Number.isFinite(parseFloat(address.t))) this.jump(parseFloat(address.t));
    else this.refresh();
  }

  switchTheme() {
    document.documentElement.dataset.theme = isDark() ? "light" : "dark";
    this.refresh();
  }

  turned() {
    if (!this.controls) return;
    const [azimuth, elevation] = PRESETS[this.camera.preset].map(radians);
    if (azimuth !== this.camera.azimuth || elevation !== this.camera.elevation) this.camera.preset = null;
    this.camera.preset ??= "oblique";
    this.refresh();
  }

  /** Whether the processor draws the picture. */
  get isSlow() {
    return this.isStill || this.view.isSoftware;
  }

  get moves() {
    return this.player.isPlaying || this.camera.pointers.size > 0;
  }

  get movingSharpness() {
    return MOVING_SHARPNESS;
  }

  /** What a page adds to the picture of an instant. */
  decorated(frame) {
    return frame;
  }

  /** As many pixels as the window has; fewer while the picture moves and the processor draws it. */
  fitCanvas() {
    const canvas = byId("canvas");
    const sharpness = this.isSlow ? (this.moves ? this.movingSharpness : 1) : Math.min(devicePixelRatio || 1, 2);
    const size = [canvas.clientWidth, canvas.clientHeight].map((each) => Math.max(1, Math.round(each * sharpness)));
    if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
  }

  /** Draw soon; several changes at once are one picture. */
  refresh() {
    if (!this.controls || this.isWaiting) return;
    this.isWaiting = true;
    requestAnimationFrame(() => {
      this.isWaiting = false;
      this.draw();
    });
  }

  draw() {
    this.leaveFailure();
    const state = this.stage.at(this.player.t);
    if (this.stage.moved) Object.assign(state, { nearest: null, red: new Set() });
    this.fitCanvas();
    this.view.draw(this.decorated(this.stage.frame(state, this.camera.eye), state), this.camera, background());
    this.controls.update();
    this.panels.update(state);
    this.placeLabels(state);
    if (!this.player.isPlaying) this.keepAddress();
    document.body.dataset.ready = "true";
  }

  keepAddress() {
    const values = { ...readAddress(), t: String(Number(this.player.t.toFixed(4))) };
    if (this.record.kind === "study") values.layout = this.place + 1;
    if (location.hash || this.player.t > 0) writeAddress(values);
  }

  makeLabels() {
    const texts = this.stage.scene.robots.map((robot) => robot.name);
    this.labels = texts.map((text) => element("span", { textContent: text }));
    this.distanceLabel = element("span", { className: "distance" });
    byId("labels").replaceChildren(...this.labels, this.distanceLabel);
  }

  /** Put names at the bases of the robots, and the distance in the middle of its line. */
  placeLabels(state) {
    const matrix = this.camera.matrix();
    this.labels.forEach((label, robot) => {
      const base = state.links[robot][0];
      const isShown = this.stage.shown.labels && this.stage.shownRobots.has(robot);
      this.placeLabel(label, matrix, isShown ? [base[12], base[13], base[14]] : null);
    });
    const { nearest } = state;
    const middle = nearest && this.stage.shown.nearest ? times(add(...nearest.ends), 0.5) : null;
    this.distanceLabel.textContent = nearest ? distanceText(nearest) : "";
    this.distanceLabel.classList.toggle("mark", nearest !== null && nearest.distance < this.stage.scene.nearest.required);
    this.placeLabel(this.distanceLabel, matrix, middle);
    keepInside(this.distanceLabel);
  }

  placeLabel(label, matrix, point) {
    const at = point && projected(matrix, point);
    label.hidden = !at || at[3] < 0.02;
    if (label.hidden) return;
    label.style.left = `${50 + (50 * at[0]) / at[3]}%`;
    label.style.top = `${50 - (50 * at[1]) / at[3]}%`;
  }
}

/** Move a label whose place is in the picture so that all of it is. */
function keepInside(label) {
  const half = label.offsetWidth / 2;
  const percent = parseFloat(label.style.left);
  if (percent >= 0 && percent <= 100) label.style.left = `clamp(${half}px, ${label.style.left}, calc(100% - ${half}px))`;
}

/** Colour behind the picture, as the style sheet of the page has it. */
function background() {
  const text = getComputedStyle(byId("stage")).backgroundColor;
  return text.match(/[\d.]+/g).slice(0, 3).map((value) => Number(value) / 255);
}

function followSystemTheme() {
  document.documentElement.dataset.theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
}
