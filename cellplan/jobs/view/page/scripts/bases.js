// Moving the bases of a cell that was not solved, and the change as options and as YAML.

const COMPONENTS = ["x_mm", "y_mm", "z_mm", "roll_deg", "pitch_deg", "yaw_deg"];

class Bases {
  constructor(app) {
    this.app = app;
    byId("bases-reset").addEventListener("click", () => this.setScene());
    for (const id of ["set-text", "yaml-text"]) {
      byId(id).addEventListener("focus", (event) => event.target.select());
    }
  }

  /** Fields for the bases of another scene; none where they cannot be moved. */
  setScene() {
    const { scene } = this.app.stage;
    this.given = scene.bases;
    this.values = scene.bases.map((base) => [...base.xyz_mm, ...base.rpy_deg]);
    byId("bases-panel").hidden = scene.bases.length === 0;
    byId("bases").replaceChildren(...scene.bases.map((base, index) => this.fields(scene.robots[base.robot], index)));
    if (scene.bases.length) this.apply();
  }

  fields(robot, index) {
    const inputs = COMPONENTS.map((component, place) => {
      const input = element("input", { type: "number", step: component.endsWith("_mm") ? 10 : 1, value: this.values[index][place] });
      input.addEventListener("input", () => {
        if (!Number.isFinite(input.valueAsNumber)) return;
        this.values[index][place] = input.valueAsNumber;
        this.apply();
      });
      return element("label", {}, component.replace("_", " in "), input);
    });
    const legend = element("legend", {}, element("span", { className: "swatch", style: `background:${robot.colour}` }), robot.name);
    return element("fieldset", {}, legend, ...inputs);
  }

  /** Move the robots and say how to make the change in the cell. */
  apply() {
    const { stage } = this.app;
    this.given.forEach((base, index) => {
      const v = this.values[index];
      stage.bases[base.robot] = poseOf(times(v.slice(0, 3), 1e-3), v.slice(3).map(radians));
    });
    stage.fitWedges(this.app.view);
    const changes = this.changes();
    byId("set-text").value = changes.length ? this.command(changes) : "";
    byId("yaml-text").value = this.yaml();
    byId("bases-note").hidden = changes.length === 0;
    stage.traces = new Traces(stage);
    stage.sight = new Sight(stage);
    stage.moved = changes.length > 0;
    this.app.refresh();
  }

  /** Addresses in the cell file and values of what differs from the given cell. */
  changes() {
    return this.given.flatMap((base, index) => {
      const given = [...base.xyz_mm, ...base.rpy_deg];
      const name = this.app.stage.scene.robots[base.robot].name;
      return COMPONENTS.flatMap((component, place) => (
        this.values[index][place] === given[place] ? [] : [[`robots.${name}.base.${component}`, this.values[index][place]]]
      ));
    });
  }

  /** The command that examines the cell with the change, beside what was set when the page was written. */
  command(changes) {
    const { source, settings } = this.app.record;
    const addresses = new Set(changes.map(([address]) => address));
    const kept = settings.filter((setting) => !addresses.has(setting.split("=")[0].trim()));
    const options = [...kept, ...changes.map(([address, value]) => `${address}=${value}`)];
    return ["cellplan check", quoted(source), ...options.map((option) => `--set ${quoted(option)}`)].join(" ");
  }

  yaml() {
    const lines = this.given.flatMap((base, index) => {
      const given = [...base.xyz_mm, ...base.rpy_deg];
      const v = this.values[index];
      if (v.every((value, place) => value === given[place])) return [];
      const { name } = this.app.stage.scene.robots[base.robot];
      const pose = `{xyz_mm: [${v.slice(0, 3).join(", ")}], rpy_deg: [${v.slice(3).join(", ")}]}`;
      return [`  ${name}:`, `    base: ${pose}`];
    });
    return lines.length ? ["robots:", ...lines].join("\n") : "";
  }
}

/** A word as a shell takes it for one. */
function quoted(word) {
  return /^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", `'\\''`)}'`;
}
