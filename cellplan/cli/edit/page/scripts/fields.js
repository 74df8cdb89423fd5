// A field for each variable: typed, stepped by arrow keys (1 mm or deg, with shift 10), locked where the cell says so.

class Fields {
  constructor(app) {
    this.app = app;
    this.inputs = new Map(); // by address
  }

  /** Fields of the variables, in a group for each subject. */
  setScene() {
    const groups = new Map();
    for (const variable of this.app.variables?.values() ?? []) {
      if (!groups.has(variable.subject)) groups.set(variable.subject, []);
      groups.get(variable.subject).push(variable);
    }
    this.inputs.clear();
    const folded = groups.size > 6;
    byId("fields").replaceChildren(...[...groups].map(([subject, variables]) => {
      const rows = variables.map((variable) => this.field(variable));
      const robot = this.app.stage.scene.robots.find(({ name }) => name === subject);
      const mark = robot ? [element("span", { className: "swatch", style: `background:${robot.colour}` })] : [];
      return element("details", { open: !folded }, element("summary", {}, ...mark, subject), element("div", { className: "grid" }, ...rows));
    }));
  }

  field(variable) {
    const { address, unit } = variable;
    const label = variable.label.replace(`${variable.subject} `, "");
    const input = element("input", { type: "number", step: "any", disabled: variable.is_locked, value: shortest(variable.value) });
    input.dataset.address = address;
    input.addEventListener("input", () => {
      if (Number.isFinite(input.valueAsNumber)) this.app.change({ [address]: input.valueAsNumber });
    });
    input.addEventListener("change", () => this.update(this.app.desired, true));
    input.addEventListener("keydown", (event) => this.step(event, variable));
    const range = variable.is_varied ? `, ${shortest(variable.lower)} to ${shortest(variable.upper)} ${unit}` : "";
    const title = `${address}, in the file ${shortest(variable.given)} ${unit}${range}${variable.is_locked ? ", locked" : ""}`;
    this.inputs.set(address, { input, variable });
    return element("label", { title }, `${label} `, element("span", { className: "soft", textContent: variable.is_locked ? "locked" : unit }), input);
  }

  step(event, variable) {
    const way = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (!way || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    const { address } = variable;
    this.app.change({ [address]: this.app.desired[address] + way * (event.shiftKey ? 10 : 1) });
    this.update(this.app.desired, true);
  }

  /** Show values; the field that is being typed in stays, unless all are meant. */
  update(values, isForAll = false) {
    for (const [address, { input, variable }] of this.inputs) {
      if (!(address in values)) continue;
      const text = shortest(values[address]);
      if (input.value !== text && (isForAll || input !== document.activeElement)) input.value = text;
      input.classList.toggle("changed", values[address] !== variable.given);
    }
  }
}

/** A number with at most four decimals, without zeros at its end. */
function shortest(value) {
  return String(Number(value.toFixed(4)) + 0);
}
