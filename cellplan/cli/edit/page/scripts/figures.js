// The figures of an answer, each with what binds and when; its state, its blocks, its advice, and the history.

const STATE_CLASS = { planned: "planned", certified: "certified", "breaks off": "broken", fails: "broken", unknown: "unknown", "working out": "unknown" };
const MARKS = { planned: "○", certified: "✓", "breaks off": "✗", fails: "✗", unknown: "?", "working out": "…" };

class Figures {
  constructor(app) {
    this.app = app;
    byId("history").addEventListener("focus", (event) => event.target.select());
  }

  show(answer) {
    byId("state").textContent = `${MARKS[answer.state]} ${answer.state}`;
    byId("state").className = STATE_CLASS[answer.state];
    byId("verdict").textContent = answer.verdict.replace(`${answer.state}: `, "");
    byId("verdict").title = answer.verdict;
    byId("lost").textContent = answer.lost_at === null ? "" : answer.lost_at > 0 ? `gets to ${seconds(answer.lost_at)}` : "does not begin";
    byId("settling").textContent = answer.is_settled ? "" : "…";
    if (answer.is_settled) byId("spoken").textContent = `${answer.state}: ${answer.verdict}`;
    byId("figures").replaceChildren(...answer.figures.map((figure) => this.row(figure)));
    this.showReasons(answer);
    this.showAdvice(answer);
    this.showStrip(answer);
    const lines = answer.history.join("\n");
    if (byId("history").value !== lines) byId("history").value = lines;
    for (const [name, can] of Object.entries(answer.can)) byId(name).disabled = !can;
    byId("saved").textContent = answer.is_saved ? "saved" : "not saved";
    byId("figures").dataset.number = this.app.client.answered; // last: what watches it sees the rest
  }

  /** At rest all that fails, where the line at the top has only the first or cannot be seen as a whole. */
  showReasons(answer) {
    const [list, line] = [byId("reasons"), byId("verdict")];
    list.classList.toggle("old", !answer.is_settled);
    if (!answer.is_settled) return;
    const isCut = line.scrollHeight > line.clientHeight + 1;
    const reasons = answer.reasons.length > 1 ? answer.reasons : isCut ? [line.textContent] : [];
    list.replaceChildren(...reasons.map((textContent) => element("li", { textContent })));
  }

  /** One figure; pressed, it leads to its instant and marks the bodies that it names. */
  row(figure) {
    const { name, value, unit, limit, is_met: isMet, binds, at } = figure;
    const text = (number) => (number === null ? "–" : `${printed(number, unit === "s" ? 3 : unit === "%" ? 0 : 2)} ${unit}`);
    const where = [binds, at === null ? "" : `at ${seconds(at)}`].filter(Boolean).join(" ");
    const button = element("button", { type: "button", className: "jump", textContent: where });
    button.addEventListener("click", () => this.mark(binds ?? "", at));
    return element("tr", { className: isMet ? "" : "mark" },
      element("th", { attributes: { scope: "row" } }, name, ...(where ? [button] : [])), element("td", { textContent: text(value) }),
      element("td", { className: "soft", textContent: limit === null ? "" : text(limit) }));
  }

  mark(binds, at) {
    const { stage } = this.app;
    const names = new Set(binds.split(/ - | – | and |, /));
    stage.picked = new Set([...stage.scene.bodies.keys()].filter((index) => names.has(stage.scene.bodies[index].name)));
    if (at !== null) this.app.jump(at);
    this.app.refresh();
  }

  /** What would help; while things move, what was advised last stays in its place, but cannot be followed. */
  showAdvice(answer) {
    const isOld = !answer.is_settled && answer.advice.length === 0;
    byId("advice").classList.toggle("old", isOld);
    if (!isOld) byId("advice").replaceChildren(...answer.advice.map((advice) => this.advice(advice)));
    for (const button of byId("advice").querySelectorAll("button")) button.disabled = isOld;
    byId("advice-panel").hidden = byId("advice").children.length === 0;
  }

  advice(advice) {
    const robot = this.app.stage.scene.robots[advice.robot];
    const button = element("button", { type: "button", className: "jump" },
      element("span", { className: "swatch", style: `background:${robot.colour}` }), `${robot.name}: ${advice.text}`);
    button.addEventListener("click", () => this.app.followAdvice(advice));
    return element("li", {}, button);
  }

  /** All blocks by their state; the one that is shown is marked. */
  showStrip(answer) {
    byId("strip").hidden = answer.strip.length < 2;
    byId("strip").replaceChildren(...answer.strip.map((block, index) => {
      const text = `${MARKS[block.state]} ${block.name}`;
      const button = element("button", { type: "button", textContent: text, title: `${block.name}: ${block.state} ${block.text ?? ""}`, className: STATE_CLASS[block.state] });
      button.setAttribute("aria-pressed", String(index === answer.block));
      button.addEventListener("click", () => this.app.change({}, index));
      return button;
    }));
  }
}

/** The largest share of a limit over time, as drawings of the time line; red from where the job breaks off. */
function shareCurve(answer, end) {
  const x = (t) => (1000 * t) / end;
  const most = Math.max(1.25, Math.min(3, ...[Math.max(...answer.worst.values.filter(Number.isFinite), 0)]));
  const y = (share) => CURVE_HEIGHT - 2 - (CURVE_HEIGHT - 4) * clamp(share / most, 0, 1);
  const drawn = [];
  if (answer.lost_at !== null) drawn.push(svgElement("rect", { x: x(answer.lost_at), y: 0, width: Math.max(1000 - x(answer.lost_at), 3), height: CURVE_HEIGHT, class: "hit" }));
  drawn.push(svgElement("line", { x1: 0, x2: 1000, y1: y(1), y2: y(1), class: "demand" }));
  const points = answer.worst.times.flatMap((t, i) => (Number.isFinite(answer.worst.values[i]) ? [[x(t), y(answer.worst.values[i]), answer.worst.values[i] > 1]] : []));
  const chain = (some) => some.map(([a, b]) => `${a.toFixed(1)},${b.toFixed(1)}`).join(" ");
  drawn.push(svgElement("polyline", { points: chain(points), class: "distance" }));
  points.forEach(([a, b, isBeyond], i) => {
    if (isBeyond && i) drawn.push(svgElement("polyline", { points: chain([points[i - 1], points[i]]), class: "failure" }));
  });
  return drawn;
}
