// Handles in the picture: a ring to move in a plane, knobs to slide and to turn; of tools, part and starts once selected.

const RING_PX = 40; // radius of the ring
const DOT_PX = 7; // of what has its knobs only when it is selected
const PIXEL_HEIGHT = 1000; // of a picture; handles grow with higher ones
const HIT_PX = 13; // from a knob
const LINE_PX = 8; // from the line of another base
const HANDLE_PARTS = /^(base|obstacle)_(x|y|z|yaw)$|^(part)_(x|y|z|roll|pitch|yaw)$|^(tool)_(length|tilt|roll)$/;
const LINES = "lines of bases";
const GRIDS = { none: [0, 0], "1 mm, 1°": [1, 1], "10 mm, 5°": [10, 5], "50 mm, 15°": [50, 15], "100 mm, 45°": [100, 45], [LINES]: [0, 0] };
const NAMES = { tool: "tool of ", start: "start of " }; // before what a handle belongs to

class Handles {
  constructor(app) {
    this.app = app;
    this.grid = GRIDS.none;
    this.isLined = false; // whether a dragged base comes to rest on the lines of others
    this.lines = []; // lines on which it rests now
    this.selected = null;
    this.held = null;
    for (const name of Object.keys(GRIDS)) byId("grid").append(element("option", { textContent: name }));
    byId("grid").addEventListener("change", (event) => {
      this.grid = GRIDS[event.target.value];
      this.isLined = event.target.value === LINES;
    });
    const stage = byId("stage"); // receives the pointer before the camera does
    stage.addEventListener("pointerdown", (event) => this.press(event), { capture: true });
    stage.addEventListener("pointermove", (event) => this.drag(event), { capture: true });
    for (const kind of ["pointerup", "pointercancel"]) stage.addEventListener(kind, (event) => this.release(event), { capture: true });
  }

  /** A handle for each base, tool, obstacle, start and for the part, as far as something of it may move. */
  setScene() {
    const made = new Map();
    const joints = new Map(); // number of those of each start so far
    for (const variable of this.app.variables.values()) {
      const [prefix, part] = this.meaning(variable, joints);
      if (!prefix || variable.is_locked) continue;
      const key = `${prefix} ${variable.subject}`;
      if (!made.has(key)) made.set(key, { prefix, subject: variable.subject, index: this.indexOf(prefix, variable.subject), active: part });
      made.get(key)[part] ??= variable;
    }
    const before = this.selected;
    this.all = [...made.values()].filter((handle) => handle.index >= 0);
    this.selected = this.all.find((handle) => before && handle.subject === before.subject && handle.prefix === before.prefix) ?? null;
  }

  /** What a number belongs to, and which part of it it is; nothing where the picture has no handle for it. */
  meaning({ kind, subject }, joints) {
    if (kind !== "start") return (kind.match(HANDLE_PARTS) ?? []).slice(1).filter(Boolean);
    joints.set(subject, (joints.get(subject) ?? -1) + 1);
    return ["start", `joint${joints.get(subject)}`];
  }

  indexOf(prefix, subject) {
    const { robots, bodies } = this.app.stage.scene;
    if (prefix === "part") return 0;
    if (prefix === "obstacle") return bodies.findIndex((body) => body.kind === "obstacle" && body.name === subject);
    return robots.findIndex((robot) => robot.name === subject);
  }

  /** Its middle, its motions by part, and the length in m of a pixel there. */
  place(handle) {
    return motionsOf(handle, this.app, this.app.state ?? this.app.stage.at(this.app.player.t));
  }

  /** Length in m of a pixel at a place, of a larger one in a high picture. */
  pixel(at) {
    const { camera } = this.app;
    return (2 * length(subtract(camera.eye, at)) * Math.tan(FIELD_OF_VIEW / 2)) / Math.min(camera.canvas.clientHeight || 1, PIXEL_HEIGHT);
  }

  /** Knobs of bases are always there; others come when they are selected, as cells have many of them. */
  hasKnobs(handle) {
    return handle.prefix === "base" || handle === this.selected;
  }

  /** Whether it has a ring now: axes of the plane in which it moves. */
  hasRing(handle) {
    return (handle.x || handle.y) && (handle.prefix !== "part" || handle === this.selected);
  }

  /** Where the pointer's line of sight begins and goes. */
  ray(event) {
    const { camera } = this.app;
    const box = camera.canvas.getBoundingClientRect();
    const tall = Math.tan(FIELD_OF_VIEW / 2);
    const x = ((2 * (event.clientX - box.left)) / box.width - 1) * tall * (box.width / box.height);
    const y = (1 - (2 * (event.clientY - box.top)) / box.height) * tall;
    const back = unit(subtract(camera.eye, camera.target));
    const right = unit(cross([0, 0, 1], back));
    return { from: camera.eye, along: unit(add(times(back, -1), add(times(right, x), times(cross(back, right), y)))) };
  }

  /** The handle below the pointer and what it does there: x and y together, a part of it, or nothing but be selected. */
  under(event) {
    const ray = this.ray(event);
    let nearest = null;
    for (const handle of this.all) {
      const place = this.place(handle);
      const { at, size, motions } = place;
      const options = (this.hasKnobs(handle) ? Object.entries(motions) : []).filter(([, motion]) => motion.knob).map(([part, motion]) => [part, offRay(ray, motion.spot) / size / HIT_PX]);
      const middle = offRay(ray, at) / size / HIT_PX;
      if (this.hasRing(handle)) {
        const floor = onPlane(ray, at, ringNormal(motions));
        options.push(["xy", Math.min(floor ? length(subtract(floor, at)) / size / (RING_PX + 6) : Infinity, middle)]);
      } else options.push(["", middle]);
      for (const [part, share] of options) {
        if (share <= 1 && (!nearest || share < nearest.share)) nearest = { handle, part, share, place };
      }
    }
    return nearest;
  }

  press(event) {
    if (event.target !== this.app.camera.canvas || event.button !== 0 || event.shiftKey) return;
    const hit = this.under(event);
    if (!hit) return;
    this.select(hit.handle);
    if (!hit.part) return; // the camera may turn
    event.stopPropagation();
    const { player } = this.app;
    byId("canvas").focus();
    byId("canvas").setPointerCapture(event.pointerId);
    if (hit.part !== "xy") hit.handle.active = hit.part;
    const wasPlaying = player.isPlaying;
    if (isCarried(hit.handle)) player.pause(); // what moves with a robot stands still while it is held
    this.held = { ...hit, pointer: event.pointerId, from: this.pointed(event, hit), given: { ...this.app.desired }, wasPlaying };
    this.app.refresh();
  }

  /** What the pointer means for a part of a handle: a place in the plane, a length in m, or an angle in rad. */
  pointed(event, { part, place }) {
    const ray = this.ray(event);
    return part === "xy" ? onPlane(ray, place.at, ringNormal(place.motions)) : readOn(place.motions[part], ray);
  }

  drag(event) {
    if (!this.held) {
      if (event.target === this.app.camera.canvas && !event.buttons) byId("canvas").style.cursor = this.under(event) ? "move" : "";
      return;
    }
    if (event.pointerId !== this.held.pointer) return;
    event.stopPropagation();
    const { handle, part, from, given, place } = this.held;
    const now = this.pointed(event, this.held);
    if (now === null || from === null) return;
    const values = {};
    this.lines = [];
    const put = (name, by, { factor = 1 } = {}) => {
      const variable = handle[name];
      if (!variable) return;
      const value = given[variable.address] + by / factor;
      values[variable.address] = this.lined(handle, name, value) ?? this.snapped(variable, value);
    };
    if (part === "xy") {
      for (const axis of ["x", "y"]) if (handle[axis]) put(axis, 1000 * dot(subtract(now, from), place.motions[axis].along), place.motions[axis]);
    } else if (place.motions[part].along) put(part, 1000 * (now - from), place.motions[part]);
    else put(part, turned(now - from) / radians(1), place.motions[part]);
    this.app.change(values);
  }

  release(event) {
    if (!this.held || event.pointerId !== this.held.pointer) return;
    event.stopPropagation();
    if (this.held.wasPlaying) this.app.player.play();
    this.held = null;
    this.lines = [];
    this.app.refresh();
  }

  /** On the grid where there is one, otherwise to a tenth of a mm or to a hundredth of a deg. */
  snapped(variable, value) {
    const step = this.grid[variable.unit === "deg" ? 1 : 0] || (variable.unit === "deg" ? 0.01 : 0.1);
    return Number((Math.round(value / step) * step).toFixed(4));
  }

  /** A coordinate in mm of a dragged base on the line of another base nearby, which is drawn then; null without one. */
  lined(handle, part, value) {
    const axis = ["x", "y"].indexOf(part);
    if (!this.isLined || handle.prefix !== "base" || axis < 0) return null;
    const off = (base) => Math.abs(1000 * base[12 + axis] - value);
    const others = this.app.stage.bases.filter((_, robot) => robot !== handle.index).sort((a, b) => off(a) - off(b));
    if (!others.length || off(others[0]) > 1000 * LINE_PX * this.held.place.size) return null;
    this.lines.push({ axis, from: origin(others[0]) });
    return Number((1000 * others[0][12 + axis]).toFixed(4));
  }

  select(handle) {
    this.selected = handle;
    this.app.refresh();
  }

  /** The next handle, or the one before. */
  next(step) {
    const { length: count } = this.all;
    if (count) this.select(this.all[(this.all.indexOf(this.selected) + step + count + (this.selected || step > 0 ? 0 : 1)) % count]);
  }

  /** What is selected, and its keys. */
  words() {
    const handle = this.selected;
    const keys = { tool: "↑ ↓ length, ← → tilt, q e roll", start: `↑ ↓ choose a joint, ← → move ${handle[handle.active].label.split(" ").pop()}` }[handle.prefix];
    return `${NAMES[handle.prefix] ?? ""}${handle.subject} is selected: ${keys ?? "arrow keys move it"}`;
  }

  /** Move what is selected by 1 mm or deg, or by 10; in a plane along the axis nearest to the arrow in the picture. */
  nudge(key, isLarge) {
    const handle = this.selected;
    const by = (isLarge ? 10 : 1) * (["PageDown", "ArrowDown", "ArrowLeft", "e", "E"].includes(key) ? -1 : 1);
    const isArrow = key.startsWith("Arrow");
    const isAcross = key === "ArrowLeft" || key === "ArrowRight";
    if (!isArrow && !/^(Page(Up|Down)|[qe])$/i.test(key)) return false;
    if (handle.prefix === "start") {
      const parts = Object.keys(handle).filter((name) => name.startsWith("joint"));
      if (isArrow && !isAcross) handle.active = parts[(parts.indexOf(handle.active) + Math.sign(by) + parts.length) % parts.length];
      this.app.refresh();
      return isArrow && !isAcross ? true : this.shift(handle[handle.active], by);
    }
    const isTurn = !isArrow && !key.startsWith("Page");
    if (handle.prefix === "tool") return this.shift(isTurn ? handle.roll : isAcross ? handle.tilt : handle.length, by);
    if (!isArrow) return this.shift(isTurn ? handle.yaw : handle.z, by);
    const { azimuth } = this.app.camera;
    const direction = isAcross ? [-Math.sin(azimuth), Math.cos(azimuth), 0] : [-Math.cos(azimuth), -Math.sin(azimuth), 1];
    const { motions } = this.place(handle);
    const likeness = (part) => (motions[part] ? dot(motions[part].along, direction) / (motions[part].factor ?? 1) : 0);
    const [part] = ["x", "y"].sort((a, b) => Math.abs(likeness(b)) - Math.abs(likeness(a)));
    return this.shift(handle[part], Math.sign(likeness(part)) * by);
  }

  shift(variable, by) {
    if (variable) this.app.change({ [variable.address]: this.app.desired[variable.address] + by });
    return true;
  }
}

/** What is across the plane in which a handle moves. */
function ringNormal({ x, y }) {
  return x && y ? cross(x.along, y.along) : [0, 0, 1];
}

/** Whether a handle moves with a robot. */
function isCarried({ prefix }) {
  return prefix === "tool" || prefix === "part" || prefix === "start";
}
