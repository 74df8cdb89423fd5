// The lists beside the picture: failures, layouts, joints, what is shown, the closest pair, and what is not checked.

class Panels {
  constructor(app) {
    this.app = app;
  }

  /** Fill all lists for another scene. */
  setScene() {
    const { scene } = this.app.stage;
    byId("facts").replaceChildren(...scene.facts.map(([label, value]) => (
      element("li", {}, element("span", { className: "label", textContent: label }), ` ${value}`)
    )));
    byId("remarks").replaceChildren(...scene.remarks.map((text) => element("li", { textContent: text })));
    this.fillFailures(scene);
    this.fillJoints(scene);
    this.fillShown(scene);
    this.fillExcluded(scene);
  }

  fillFailures(scene) {
    byId("failures-panel").hidden = scene.failures.length === 0;
    byId("failures-count").textContent = String(scene.failures.length);
    byId("failures").replaceChildren(...scene.failures.map((failure, index) => {
      const button = element("button", { type: "button", className: "jump", textContent: failure.text });
      button.addEventListener("click", () => this.app.showFailure(index));
      return element("li", {}, button);
    }));
  }

  /** A bar for each joint, from its lower to its upper limit. */
  fillJoints(scene) {
    this.bars = [];
    byId("joints").replaceChildren(...scene.robots.map((robot, index) => {
      const rows = robot.joints.map((joint, place) => this.bar(robot, joint, index, place));
      const name = element("span", { className: "swatch", style: `background:${robot.colour}` });
      return element("div", { className: "joint-group" }, element("h3", {}, name, robot.name), ...rows);
    }));
  }

  bar(robot, joint, index, place) {
    const value = element("output", {});
    const needle = element("i", {});
    const track = element("span", { className: "track" }, needle);
    const isBounded = joint.lower !== null && joint.upper !== null;
    const limits = isBounded ? `${printed(joint.lower * joint.scale, 0)} … ${printed(joint.upper * joint.scale, 0)} ${joint.unit}` : "no limits";
    const row = element("div", { className: "joint", title: `${robot.name}/${joint.name}: ${limits}` },
      element("span", { className: "name", textContent: joint.name }), track, value);
    this.bars.push({ joint, column: robot.column + place, robot: index, place, row, needle, value, isBounded });
    return row;
  }

  fillShown(scene) {
    const { stage } = this.app;
    const flag = (name, text) => checkbox(text, stage.shown[name], (isOn) => {
      stage.shown[name] = isOn;
      this.app.refresh();
    });
    const members = (set, items, colour) => items.map((item, index) => checkbox(item.name, true, (isOn) => {
      if (isOn) set.add(index);
      else set.delete(index);
      this.app.refresh();
    }, colour(item)));
    byId("show-robots").replaceChildren(...members(stage.shownRobots, scene.robots, (robot) => robot.colour));
    byId("show-tasks").replaceChildren(...members(stage.shownTasks, scene.tasks, (task) => scene.robots[task.robot].colour));
    byId("show-things").replaceChildren(flag("part", "part"), flag("tools", "tools"), flag("surroundings", "surroundings"),
      flag("floor", "floor and axes"), flag("labels", "names"), flag("nearest", "closest pair"));
    if (scene.visuals.length) byId("show-things").append(flag("meshes", "visual meshes (off: bodies of the proof)"));
    byId("traces").value = stage.traceIn;
    byId("traces-choice").hidden = stage.motion.count < 2;
  }

  /** Pairs by the reason for which they are not checked; a pair that is pressed is marked in the picture. */
  fillExcluded(scene) {
    const count = scene.excluded.reduce((sum, each) => sum + each.pairs.length, 0);
    byId("excluded-count").textContent = String(count);
    byId("excluded").replaceChildren(...scene.excluded.map(({ reason, pairs }) => {
      const items = pairs.map((pair) => {
        const names = pair.map((index) => scene.bodies[index].name).join(" – ");
        const button = element("button", { type: "button", className: "pair", textContent: names });
        button.setAttribute("aria-pressed", "false");
        button.addEventListener("click", () => this.pick(pair, button));
        return element("li", {}, button);
      });
      const title = element("summary", {}, `${reason} `, element("span", { className: "count", textContent: pairs.length }));
      return element("details", {}, title, element("ul", {}, ...items));
    }));
  }

  pick(pair, button) {
    const { picked } = this.app.stage;
    const wasPicked = button.getAttribute("aria-pressed") === "true";
    for (const other of byId("excluded").querySelectorAll("[aria-pressed=true]")) other.setAttribute("aria-pressed", "false");
    picked.clear();
    if (!wasPicked) pair.forEach((index) => picked.add(index));
    button.setAttribute("aria-pressed", String(!wasPicked));
    this.app.refresh();
  }

  /** Show an instant in all lists. */
  update(state) {
    for (const bar of this.bars) this.updateBar(bar, state.q[bar.column]);
    byId("nearest-now").replaceChildren(...this.nearestText(state));
    const bodies = this.app.stage.scene.bodies;
    const names = [...state.red].map((index) => bodies[index].name);
    byId("touching-now").textContent = names.length ? `in collision: ${names.join(", ")}` : "";
  }

  updateBar({ joint, row, needle, value, isBounded }, position) {
    value.textContent = `${printed(position * joint.scale)} ${joint.unit}`;
    row.hidden = false;
    needle.style.display = isBounded ? "" : "none";
    if (!isBounded) return;
    const share = (position - joint.lower) / (joint.upper - joint.lower);
    needle.style.left = `${100 * clamp(share, 0, 1)}%`;
    row.classList.toggle("beyond", share < 0 || share > 1);
    row.classList.toggle("close", share >= 0 && share <= 1 && Math.min(share, 1 - share) < 0.05);
  }

  nearestText({ nearest }) {
    const { scene } = this.app.stage;
    if (!nearest) return ["no pair that must keep a clearance is near"];
    const names = nearest.pair.map((index) => scene.bodies[index].name).join(" – ");
    const isBelow = nearest.distance < scene.nearest.required;
    const figure = element("b", { className: isBelow ? "mark" : "", textContent: distanceText(nearest) });
    const every = scene.nearest.step > 0 ? ` (at ${seconds(nearest.at)}, computed every ${printed(1000 * scene.nearest.step, 0)} ms)` : "";
    return ["closest pair ", figure, ` ${names}${every}`];
  }
}

function distanceText(nearest) {
  if (nearest.distance <= 0) return "touching";
  return `${nearest.isBound ? "≥ " : ""}${printed(nearest.distance)} mm`;
}
