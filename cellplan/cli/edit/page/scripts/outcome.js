// What comes of heavy work and of the cell file: progress, verdicts, trials, remedies, and the question of a conflict.

const FILE_TEXTS = {
  changed: "the cell file was changed and is read again",
  broken: "the cell file cannot be read; the last state that could be stays",
  conflict: "the cell file was changed, and so was the cell here: which is to stay?",
  gone: "the cell file is gone; saving writes it again",
  saved: "saved",
};

class Outcome {
  constructor(app) {
    this.app = app;
    this.rows = new Map(); // of progress, by work
    this.judged = null; // version of the state that a shown verdict is of
  }

  take(event) {
    const receivers = {
      answer: () => this.app.apply(event.answer),
      progress: () => this.progress(event),
      verdict: () => this.verdict(event),
      trial: () => {
        this.offer(event.text, event);
        this.app.overlay.showOffer(event.picture);
      },
      remedies: () => this.remedies(event.remedies),
      tiles: () => {
        this.app.overlay.putTiles(event);
        byId("outcome-panel").hidden = false;
      },
      file: () => this.file(event),
      failed: () => {
        this.done(event.work);
        this.say(`${event.work} failed: ${event.text}`, "mark");
      },
      end: () => this.app.leave(event.text || "the session has ended"),
    };
    receivers[event.event]?.();
    this.app.refresh();
  }

  /** A row for each work under way. */
  progress({ work, fraction, text }) {
    if (fraction >= 1) {
      this.done(work);
      if (work === "improve" && text !== "done") this.say(`${work}: ${text}`);
      return;
    }
    if (!this.rows.has(work)) {
      const [bar, words] = [element("progress", { max: 1, attributes: { "aria-label": work } }), element("span", {})];
      this.rows.set(work, { bar, words, row: element("div", {}, bar, " ", words) });
      byId("progress").append(this.rows.get(work).row);
      byId("outcome-panel").hidden = false;
    }
    const { bar, words } = this.rows.get(work);
    bar.value = fraction;
    words.textContent = `${work}: ${text}`;
    byId("stop").disabled = false;
  }

  /** Work has ended; without a name all of it. */
  done(work = null) {
    for (const [name, { row }] of [...this.rows]) {
      if (work !== null && name !== work) continue;
      row.remove();
      this.rows.delete(name);
    }
    byId("stop").disabled = this.rows.size === 0;
  }

  verdict({ passed, lines, version, picture }) {
    this.done("certify");
    if (passed) this.app.overlay.keepGhost(picture);
    this.clear();
    this.judged = version;
    this.say(passed ? "certified: all checks of solve passed" : "not certified: checks of solve failed", passed ? "good" : "mark");
    this.say(lines.join("\n"), "lines");
  }

  /** A verdict is that of one state: after a change it is marked as an older one. */
  age(version) {
    if (this.judged === null || version <= this.judged) return;
    this.judged = null;
    byId("outcome").prepend(element("li", { textContent: "of the state before the last change:" }));
    byId("outcome").classList.add("old");
  }

  remedies(remedies) {
    this.done("repair");
    this.clear();
    if (!remedies.length) this.say("no remedy was found");
    for (const remedy of remedies) this.offer(`${remedy.title}: ${remedy.text}`, remedy);
  }

  /** A button that takes what is offered, by its number; pointed at or focused, its layout is in the picture. */
  offer(text, { number, picture }) {
    const button = element("button", { type: "button", className: "jump", textContent: text });
    button.addEventListener("click", () => this.app.act("take", number));
    for (const kind of ["pointerenter", "focus"]) button.addEventListener(kind, () => this.app.overlay.showOffer(picture));
    byId("outcome").append(element("li", {}, button));
    byId("outcome-panel").hidden = false;
  }

  say(text, className = "") {
    byId("outcome").append(element("li", { textContent: text, className }));
    byId("outcome-panel").hidden = false;
  }

  clear() {
    this.judged = null;
    this.app.overlay.showOffer(null);
    byId("outcome").replaceChildren();
    byId("outcome").classList.remove("old");
  }

  file({ state, text }) {
    byId("file-text").textContent = text || FILE_TEXTS[state];
    byId("file").hidden = state === "saved";
    byId("file").className = state;
    byId("file-choice").hidden = state !== "conflict";
    if (state === "conflict") byId("file-reload").focus();
    if (state === "changed") this.app.reopen();
  }
}
