// The bar below the picture: play, slider, speed, views, the curve of the closest distance, and the keys.

const VIEW_KEYS = { 1: "oblique", 2: "front", 3: "right", 4: "back", 5: "left", 6: "top" };
const CURVE_HEIGHT = 36; // of the drawing of the distances

class Controls {
  constructor(app) {
    this.app = app;
    const { player } = app;
    byId("play").addEventListener("click", () => player.toggle());
    byId("back").addEventListener("click", () => player.step(-1));
    byId("forward").addEventListener("click", () => player.step(1));
    byId("time").addEventListener("input", (event) => {
      player.isPlaying = false;
      player.goTo(Number(event.target.value));
    });
    byId("speed").addEventListener("change", (event) => {
      player.speed = Number(event.target.value);
      app.refresh();
    });
    for (const speed of SPEEDS) byId("speed").append(element("option", { value: speed, textContent: `${speed} ×` }));
    for (const [key, name] of Object.entries(VIEW_KEYS)) {
      const button = element("button", { type: "button", textContent: name, title: `key ${key}` });
      button.dataset.view = name;
      button.addEventListener("click", () => app.camera.look(name));
      byId("views").append(button);
    }
    byId("theme").addEventListener("click", () => app.switchTheme());
    document.addEventListener("keydown", (event) => this.press(event));
  }

  /** Fit slider and curve to another scene. */
  setScene() {
    const { motion } = this.app.stage;
    const slider = byId("time");
    slider.max = motion.end;
    const stands = motion.end <= 0;
    for (const id of ["play", "back", "forward", "time", "speed"]) byId(id).disabled = stands;
    byId("transport").hidden = stands;
    byId("curve").replaceChildren(...(stands ? [] : this.curve()));
    byId("phases").replaceChildren(...motion.phases.map((phase) => this.phase(phase)));
  }

  phase(phase) {
    const { end } = this.app.stage.motion;
    const button = element("button", { type: "button", textContent: phase.name, title: `${phase.name}: ${seconds(phase.begin)}` });
    button.style.flexGrow = Math.max((phase.end - phase.begin) / end, 0.01);
    button.addEventListener("click", () => this.app.jump(phase.begin));
    return button;
  }

  /** The distance over time, certified where it can be, what is demanded of it, and contacts that are not allowed. */
  curve() {
    const { scene, motion } = this.app.stage;
    const { required, pairs } = scene.nearest;
    const isCertified = scene.certified.times.length > 0;
    const { times: sampled, distances } = isCertified ? scene.certified : scene.nearest;
    const most = Math.max(3 * required, 10);
    const x = (t) => (1000 * t) / motion.end;
    const y = (mm) => CURVE_HEIGHT - 2 - (CURVE_HEIGHT - 4) * clamp(mm / most, 0, 1);
    const marks = scene.contacts.filter((contact) => !contact.allowed).map((contact) => svgElement("rect", {
      x: x(contact.first), y: 0, width: Math.max(x(contact.last) - x(contact.first), 3), height: CURVE_HEIGHT, class: "hit",
    }));
    const isKnown = (i) => (isCertified ? distances[i] !== null : pairs[i].length > 0);
    const what = isCertified ? "certified smallest distance" : "distance of the closest pair";
    byId("curve").setAttribute("aria-label", `${what} over time; contacts are marked red`);
    const points = sampled.flatMap((t, i) => (isKnown(i) ? [`${x(t).toFixed(1)},${y(distances[i]).toFixed(1)}`] : []));
    const demand = svgElement("line", { x1: 0, x2: 1000, y1: y(required), y2: y(required), class: "demand" });
    const line = svgElement("polyline", { points: points.join(" "), class: "distance" });
    const ticks = scene.failures.filter((failure) => failure.at !== null).map((failure) => svgElement("line", {
      x1: x(failure.at), x2: x(failure.at), y1: 0, y2: CURVE_HEIGHT, class: "failure",
    }));
    this.cursor = svgElement("line", { x1: 0, x2: 0, y1: 0, y2: CURVE_HEIGHT, class: "cursor" });
    return [...marks, demand, line, ...ticks, this.cursor];
  }

  /** Show the instant and what plays. */
  update() {
    const { player, stage } = this.app;
    const slider = byId("time");
    slider.value = player.t;
    slider.setAttribute("aria-valuetext", seconds(player.t));
    byId("clock").textContent = `${seconds(player.t)} of ${seconds(stage.motion.end)}`;
    byId("play").textContent = player.isPlaying ? "❚❚" : "▶";
    byId("play").setAttribute("aria-label", player.isPlaying ? "pause" : "play");
    byId("speed").value = String(player.speed);
    if (this.cursor && stage.motion.end > 0) {
      const x = (1000 * player.t) / stage.motion.end;
      this.cursor.setAttribute("x1", x);
      this.cursor.setAttribute("x2", x);
    }
    for (const button of byId("views").children) {
      button.setAttribute("aria-pressed", String(button.dataset.view === this.app.camera.preset));
    }
  }

  press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (/^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) && event.target.type !== "range" && event.key !== "Escape") return;
    if (/^(BUTTON|SUMMARY)$/.test(event.target.tagName) && [" ", "Enter"].includes(event.key)) return;
    if (this.act(event.key, event.shiftKey)) event.preventDefault();
  }

  /** What a key does; false for keys that mean nothing here. */
  act(key, isShifted) {
    const { player, camera, stage } = this.app;
    const actions = {
      " ": () => player.toggle(),
      ArrowRight: () => (isShifted ? player.goTo(player.t + 0.1) : player.step(1)),
      ArrowLeft: () => (isShifted ? player.goTo(player.t - 0.1) : player.step(-1)),
      ArrowUp: () => camera.zoom(0.9),
      ArrowDown: () => camera.zoom(1.1),
      Home: () => player.goTo(0),
      End: () => player.goTo(stage.motion.end),
      "+": () => player.faster(1),
      "-": () => player.faster(-1),
      a: () => camera.turnBy(-0.1, 0),
      d: () => camera.turnBy(0.1, 0),
      w: () => camera.turnBy(0, 0.1),
      s: () => camera.turnBy(0, -0.1),
      n: () => this.app.next(1),
      p: () => this.app.next(-1),
      t: () => this.app.switchTheme(),
    };
    if (VIEW_KEYS[key]) actions[key] = () => camera.look(VIEW_KEYS[key]);
    if (!actions[key]) return false;
    actions[key]();
    return true;
  }
}
