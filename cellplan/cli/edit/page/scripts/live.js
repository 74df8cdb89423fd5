// The live cell: the page of a session, its answers in the picture and beside it.

const KEY_ACTIONS = { c: "certify", i: "improve", r: "repair", m: "map" };
const CONTROL_ACTIONS = { z: "undo", y: "redo", s: "save" };
const SLOW_PICTURE_MS = 90; // between pictures that the processor draws during a drag, each while an answer is awaited
const LATE_PICTURE_MS = 200; // after which one is drawn without an answer
const DRAGGED_SHARPNESS = 0.4; // pixels of such a picture by those of the window
const BUTTONS = ["certify", "improve", "repair", "map", "stop", "undo", "redo", "reset", "save", "end"];

class LiveApp extends App {
  constructor(record, client) {
    super(viewOf(record), { Controls: LiveControls, Panels: LivePanels, Bases: Fields });
    this.client = client;
    this.player.isLooping = true;
    this.handles = new Handles(this);
    this.overlay = new Overlay(this);
    this.figures = new Figures(this);
    this.outcome = new Outcome(this);
    for (const action of BUTTONS) byId(action).addEventListener("click", () => this.act(action));
    byId("file-reload").addEventListener("click", () => this.act("reload"));
    byId("file-keep").addEventListener("click", () => this.act("keep"));
    byId("tab").addEventListener("click", () => open(`/#token=${client.token}`, "_blank", "noopener"));
    byId("copy").addEventListener("click", () => navigator.clipboard?.writeText(byId("history").value));
    for (const name of Object.keys(this.overlay.shown)) {
      byId("show-live").append(checkbox(name, true, (isOn) => {
        this.overlay.shown[name] = isOn;
        this.refresh();
      }));
    }
    this.setRecord(record);
    if (!this.isSlow && !matchMedia("(prefers-reduced-motion: reduce)").matches) this.player.play();
  }

  /** Show another cell, or the same one read again. */
  setRecord(record) {
    this.variables = new Map(record.variables.map((variable) => [variable.address, variable]));
    this.rods = new Map(record.variables.filter(({ kind }) => kind === "tool_length").map((rod) => [rod.subject, rod]));
    byId("name").textContent = record.cell;
    byId("file-name").textContent = record.file;
    document.title = `${record.cell}: live cell`;
    this.version = -1;
    this.stage.moved = true; // distances of the start are not those of an answer
    this.desired = record.answer.values;
    this.bases.setScene();
    this.handles.setScene();
    this.overlay.setScene();
    this.overlay.keepGhost(record.certified);
    this.apply(record.answer);
  }

  /** Ask for the cell again, after its file was changed. */
  async reopen() {
    await this.client.guarded(async () => {
      const record = await this.client.record("/open", {});
      const { azimuth, elevation, distance, target } = this.camera;
      this.record = viewOf(record);
      this.stage = new Stage(this.record);
      this.open();
      this.setScene(0);
      this.setRecord(record);
      Object.assign(this.camera, { azimuth, elevation, distance, target });
      this.turned();
    });
  }

  /** Take an answer that is not older than the last one. */
  apply(answer) {
    if (answer.version < this.version) return;
    this.version = answer.version;
    this.answer = answer;
    this.desired = this.client.isSending || this.handles.held ? { ...answer.values, ...this.desired } : { ...answer.values };
    this.outcome.age(answer.version);
    this.pose(answer);
    this.bases.update(this.desired);
    this.figures.show(answer);
    this.controls.setScene();
    this.refresh();
    if (this.postponed && performance.now() - (this.drawnAt ?? 0) > SLOW_PICTURE_MS) this.drawPostponed();
  }

  /** Bring robots, tools, part and obstacles where an answer has them. */
  pose({ motion, poses, values, is_settled: isSettled }) {
    const { stage } = this;
    const { scene } = stage;
    poses.bases.forEach((pose, robot) => { stage.bases[robot] = fromRows(pose); });
    poses.tools.forEach((pose, robot) => { scene.robots[robot].tip = pose; });
    stage.poses = this.bodyPoses(poses, values);
    scene.part[0].pose = poses.part ?? scene.part[0].pose;
    if (motion) {
      stage.motion = new Motion(motion);
      this.player.setMotion(stage.motion);
    }
    stage.fitWedges(this.view);
    stage.traces = new Traces(stage);
    if (isSettled) stage.sight = new Sight(stage);
  }

  /** Poses of all bodies at some values. */
  bodyPoses(poses, values) {
    return this.stage.scene.bodies.map((body, index) => multiply(fromRows(poses.bodies[index] ?? body.pose), scaling([1, 1, this.stretch(body, values)])));
  }

  /** By how much the rod of a tool is longer than in the file, as a factor. */
  stretch(body, values) {
    const { capsule } = this.record.geometries[body.geometry] ?? {};
    const rod = body.kind === "tool" && capsule && this.rods.get(this.stage.scene.robots[body.robot].name);
    if (!rod) return 1;
    const [radius, line] = capsule;
    return 1 + (values[rod.address] - rod.given) / 1000 / (line + 2 * radius);
  }

  /** Change values by address, within their ranges; locked ones stay. */
  change(values, block) {
    const sent = {};
    for (const [address, value] of Object.entries(values)) {
      const variable = this.variables.get(address);
      if (variable && !variable.is_locked) sent[address] = clamp(value, variable.lower, variable.upper);
    }
    if (block === undefined && Object.keys(sent).length === 0) return;
    this.desired = { ...this.desired, ...sent };
    this.client.change(sent, block);
    this.bases.update(this.desired);
    this.refresh();
  }

  /** Move a base by what an arrow says. */
  followAdvice(advice) {
    const handle = this.handles.all.find(({ prefix, index }) => prefix === "base" && index === advice.robot);
    if (!handle) return;
    const values = {};
    ["x", "y", "z"].forEach((axis, i) => {
      const variable = handle[axis];
      if (variable) values[variable.address] = this.handles.snapped(variable, this.desired[variable.address] + advice.step_mm * unit(advice.direction)[i]);
    });
    this.change(values);
  }

  act(action, argument) {
    const working = Object.values(KEY_ACTIONS).includes(action);
    if (working) {
      if (action !== "map") this.outcome.clear();
      this.outcome.progress({ work: action, fraction: 0, text: "begins" });
    }
    if (action === "stop") this.outcome.done();
    if (action === "reload" || action === "keep") byId("file").hidden = true;
    return this.client.act(action, action === "map" ? this.mapped() : argument);
  }

  /** Number of the robot whose base is mapped: the selected one if it has a task, else the first that has one. */
  mapped() {
    const { selected } = this.handles;
    const operators = this.stage.scene.tasks.map((task) => task.robot);
    return selected?.prefix === "base" && operators.includes(selected.index) ? selected.index : operators[0];
  }

  /** The session has ended: say so, and leave what was changed to be copied. */
  leave(text) {
    this.client.isGone = true;
    byId("gone-text").textContent = text;
    byId("gone").hidden = false;
    byId("history-panel").open = true;
    for (const control of document.querySelectorAll("#tools button, #fields input, #advice button, #strip button")) control.disabled = true;
  }

  refused(text) {
    this.outcome.done();
    this.outcome.say(text, "mark");
    if (this.answer) this.desired = { ...this.answer.values };
    this.bases.update(this.desired, true);
    this.refresh();
  }

  get moves() {
    return super.moves || Boolean(this.handles?.held);
  }

  /** Draw soon; where the processor draws, not so often that answers to a drag wait for it. */
  refresh() {
    if (!this.handles?.held || !this.isSlow) {
      super.refresh();
      return;
    }
    this.postponed ||= setTimeout(() => this.drawPostponed(), LATE_PICTURE_MS);
  }

  /** Draw a picture that was put off: the next change is on its way, and its answer does not wait for the picture. */
  drawPostponed() {
    clearTimeout(this.postponed);
    this.postponed = 0;
    this.drawnAt = performance.now();
    super.refresh();
  }

  get movingSharpness() {
    return this.handles?.held ? DRAGGED_SHARPNESS : super.movingSharpness;
  }

  decorated(frame, state) {
    this.state = state;
    if (!this.answer) return frame;
    return { bodies: [...this.overlay.bodies(state), ...frame.bodies].sort((a, b) => (b.opacity ?? 1) - (a.opacity ?? 1)), lines: [...frame.lines, ...this.overlay.lines(state)] };
  }

  verdict() {
    return this.answer?.verdict ?? "";
  }

  keepAddress() {} // the address of a session leads to no instant
}

/** The record of the picture; what was found at the start is not what an answer says. */
function viewOf(record) {
  const scenes = record.view.scenes.map((scene) => ({ ...scene, facts: [], failures: [], contacts: [], passed: null }));
  return { ...record.view, scenes };
}

class LiveControls extends Controls {
  /** The bar stays where a motion does not begin, so that the picture is not moved below the pointer. */
  setScene() {
    super.setScene();
    byId("transport").hidden = false;
    byId("curve").setAttribute("aria-label", "largest share of a limit over time; what is beyond is marked red");
  }

  curve() {
    const { answer, stage } = this.app;
    if (!answer) return [];
    this.cursor = svgElement("line", { x1: 0, x2: 0, y1: 0, y2: CURVE_HEIGHT, class: "cursor" });
    return [...shareCurve(answer, stage.motion.end), this.cursor];
  }

  press(event) {
    const action = (event.ctrlKey || event.metaKey) && !event.altKey && CONTROL_ACTIONS[event.key.toLowerCase()];
    if (!action || event.target.tagName === "TEXTAREA") {
      super.press(event);
      return;
    }
    event.preventDefault();
    this.app.act(action === "undo" && event.shiftKey ? "redo" : action);
  }

  act(key, isShifted) {
    const { handles } = this.app;
    if (KEY_ACTIONS[key]) this.app.act(KEY_ACTIONS[key]);
    else if (key === "b" || key === "B") handles.next(isShifted ? -1 : 1);
    else if (key === "Escape" && handles.selected) handles.select(null);
    else if (!handles.selected || !handles.nudge(key, isShifted)) return super.act(key, isShifted);
    return true;
  }
}

class LivePanels extends Panels {
  /** In place of the closest pair of a run: what is selected. */
  nearestText() {
    const { selected } = this.app.handles;
    return selected ? [this.app.handles.words()] : [];
  }
}
