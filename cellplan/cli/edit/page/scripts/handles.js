// Handles in the picture: a ring to move in the horizontal plane, a knob to turn about the vertical, one to lift.

const RING_PX = 40; // radius of the ring
const KNOB_PX = 60; // distance of the turning knob from the middle
const LIFT_PX = 78; // height of the lifting knob
const PIXEL_HEIGHT = 1000; // of a picture; handles grow with higher ones
const HIT_PX = 13; // from a knob
const HANDLE_KINDS = ["x", "y", "z", "yaw"];
const GRIDS = { none: [0, 0], "1 mm, 1°": [1, 1], "10 mm, 5°": [10, 5], "50 mm, 15°": [50, 15], "100 mm, 45°": [100, 45] };

class Handles {
  constructor(app) {
    this.app = app;
    this.grid = GRIDS.none;
    this.selected = null;
    this.held = null;
    for (const name of Object.keys(GRIDS)) byId("grid").append(element("option", { textContent: name }));
    byId("grid").addEventListener("change", (event) => { this.grid = GRIDS[event.target.value]; });
    const stage = byId("stage"); // receives the pointer before the camera does
    stage.addEventListener("pointerdown", (event) => this.press(event), { capture: true });
    stage.addEventListener("pointermove", (event) => this.drag(event), { capture: true });
    for (const kind of ["pointerup", "pointercancel"]) stage.addEventListener(kind, (event) => this.release(event), { capture: true });
  }

  /** A handle for each base and obstacle of which something may move. */
  setScene() {
    const made = new Map();
    for (const variable of this.app.variables.values()) {
      const [, prefix, part] = variable.kind.match(/^(base|obstacle)_(.*)$/) ?? [];
      if (!prefix || !HANDLE_KINDS.includes(part) || variable.is_locked) continue;
      const key = `${prefix} ${variable.subject}`;
      if (!made.has(key)) made.set(key, { prefix, subject: variable.subject, index: this.indexOf(prefix, variable.subject) });
      made.get(key)[part] = variable;
    }
    const before = this.selected;
    this.all = [...made.values()].filter((handle) => handle.index >= 0);
    this.selected = this.all.find((handle) => before && handle.subject === before.subject && handle.prefix === before.prefix) ?? null;
  }

  indexOf(prefix, subject) {
    const { robots, bodies } = this.app.stage.scene;
    if (prefix === "base") return robots.findIndex((robot) => robot.name === subject);
    return bodies.findIndex((body) => body.kind === "obstacle" && body.name === subject);
  }

  /** Pose as answered, moved by what is desired beyond that: place in m, heading in rad. */
  place(handle) {
    const { stage } = this.app;
    const pose = handle.prefix === "base" ? stage.bases[handle.index] : stage.poses[handle.index];
    const off = (part) => (handle[part] ? this.app.desired[handle[part].address] - this.app.answer.values[handle[part].address] : 0);
    const at = [pose[12] + off("x") / 1000, pose[13] + off("y") / 1000, pose[14] + off("z") / 1000];
    return { at, heading: Math.atan2(pose[1], pose[0]) + radians(off("yaw")) };
  }

  /** Length in m of a pixel at a place, of a larger one in a high picture. */
  pixel(at) {
    const { camera } = this.app;
    return (2 * length(subtract(camera.eye, at)) * Math.tan(FIELD_OF_VIEW / 2)) / Math.min(camera.canvas.clientHeight || 1, PIXEL_HEIGHT);
  }

  knobs(handle) {
    const { at, heading } = this.place(handle);
    const size = this.pixel(at);
    const knobs = {};
    if (handle.yaw) knobs.yaw = add(at, times([Math.cos(heading), Math.sin(heading), 0], KNOB_PX * size));
    if (handle.z) knobs.z = add(at, [0, 0, LIFT_PX * size]);
    return { at, heading, size, knobs };
  }

  /** Knobs of obstacles come when they are selected, as cells have many of them. */
  hasKnobs(handle) {
    return handle.prefix === "base" || handle === this.selected;
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

  /** The handle below the pointer and what it does there: x and y together, yaw or z. */
  under(event) {
    const ray = this.ray(event);
    let nearest = null;
    for (const handle of this.all) {
      const { at, size, knobs } = this.knobs(handle);
      const options = (this.hasKnobs(handle) ? Object.entries(knobs) : []).map(([part, knob]) => [part, offRay(ray, knob) / size / HIT_PX]);
      const floor = onPlane(ray, at[2]);
      if ((handle.x || handle.y) && floor) options.push(["xy", Math.min(length(subtract(floor, at)) / size / (RING_PX + 6), offRay(ray, at) / size / HIT_PX)]);
      for (const [part, share] of options) {
        if (share <= 1 && (!nearest || share < nearest.share)) nearest = { handle, part, share };
      }
    }
    return nearest;
  }

  press(event) {
    if (event.target !== this.app.camera.canvas || event.button !== 0 || event.shiftKey) return;
    const hit = this.under(event);
    if (!hit) return;
    event.stopPropagation();
    this.select(hit.handle);
    byId("canvas").focus();
    byId("canvas").setPointerCapture(event.pointerId);
    const { at } = this.place(hit.handle);
    this.held = { ...hit, pointer: event.pointerId, at, from: this.pointed(event, hit.part, at), given: { ...this.app.desired } };
    this.app.refresh();
  }

  /** What the pointer means for a part of a handle: a place in the plane, an angle in rad, or a height in m. */
  pointed(event, part, at) {
    const ray = this.ray(event);
    if (part === "z") return heightOf(ray, at);
    const floor = onPlane(ray, at[2]);
    if (part === "xy" || !floor) return floor;
    return Math.atan2(floor[1] - at[1], floor[0] - at[0]);
  }

  drag(event) {
    if (!this.held) {
      if (event.target === this.app.camera.canvas && !event.buttons) byId("canvas").style.cursor = this.under(event) ? "move" : "";
      return;
    }
    if (event.pointerId !== this.held.pointer) return;
    event.stopPropagation();
    const { handle, part, at, from, given } = this.held;
    const now = this.pointed(event, part, at);
    if (now === null || from === null) return;
    const values = {};
    const put = (variable, by) => {
      if (variable) values[variable.address] = this.snapped(variable, given[variable.address] + by);
    };
    if (part === "xy") ["x", "y"].forEach((axis, i) => put(handle[axis], 1000 * (now[i] - from[i])));
    if (part === "z") put(handle.z, 1000 * (now - from));
    if (part === "yaw") put(handle.yaw, turned(now - from) / radians(1));
    this.app.change(values);
  }

  release(event) {
    if (!this.held || event.pointerId !== this.held.pointer) return;
    event.stopPropagation();
    this.held = null;
    this.app.refresh();
  }

  /** On the grid where there is one, otherwise to a tenth of a mm or to a hundredth of a deg. */
  snapped(variable, value) {
    const step = this.grid[variable.unit === "deg" ? 1 : 0] || (variable.unit === "deg" ? 0.01 : 0.1);
    return Number((Math.round(value / step) * step).toFixed(4));
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

  /** Move what is selected by 1 mm or deg, or by 10, along the axis that is nearest to the arrow in the picture. */
  nudge(key, isLarge) {
    const by = isLarge ? 10 : 1;
    const handle = this.selected;
    const sign = { PageUp: 1, PageDown: -1, q: 1, e: -1, Q: 1, E: -1 }[key];
    const variable = key.startsWith("Page") ? handle.z : handle.yaw;
    if (sign) return this.shift(variable, sign * by);
    const way = { ArrowRight: 0, ArrowUp: 1, ArrowLeft: 2, ArrowDown: 3 }[key];
    if (way === undefined) return false;
    const quarter = (way + Math.round((this.app.camera.azimuth + Math.PI / 2) / (Math.PI / 2)) + 8) % 4; // 0: +x, 1: +y
    return this.shift(quarter % 2 ? handle.y : handle.x, quarter < 2 ? by : -by);
  }

  shift(variable, by) {
    if (variable) this.app.change({ [variable.address]: this.app.desired[variable.address] + by });
    return true;
  }
}

/** Distance in m of a point from a ray. */
function offRay(ray, point) {
  return length(cross(subtract(point, ray.from), ray.along));
}

/** Where a ray meets a horizontal plane before the camera; null where it does not. */
function onPlane(ray, height) {
  const share = (height - ray.from[2]) / (ray.along[2] || 1e-12);
  return share > 0 && share < 1e3 ? add(ray.from, times(ray.along, share)) : null;
}

/** Height on the vertical through a point that is nearest to a ray. */
function heightOf(ray, at) {
  const off = subtract(ray.from, at);
  const rise = ray.along[2];
  const flat = 1 - rise * rise;
  return flat < 1e-6 ? null : at[2] + (off[2] - rise * dot(off, ray.along)) / flat;
}

/** An angle in rad from -pi to pi. */
function turned(angle) {
  return Math.atan2(Math.sin(angle), Math.cos(angle));
}
