// The camera turns about a point: dragging turns, shift or two fingers move, the wheel zooms.

const FIELD_OF_VIEW = radians(38);
const FILLED = 0.92; // of the picture
const PRESETS = {
  oblique: [-55, 24],
  front: [-90, 2],
  back: [90, 2],
  left: [180, 2],
  right: [0, 2],
  top: [-90, 89.9],
}; // direction to the camera in deg: about z, above the floor

class Camera {
  constructor(canvas, onChange) {
    this.canvas = canvas;
    this.onChange = onChange;
    this.pointers = new Map();
    this.machines = this.whole = { centre: [0, 0, 0], radius: 1, corners: [] };
    this.target = [0, 0, 0];
    this.distance = 5;
    this.look("oblique");
    canvas.addEventListener("pointerdown", (event) => this.press(event));
    canvas.addEventListener("pointermove", (event) => this.drag(event));
    for (const kind of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(kind, (event) => {
        this.pointers.delete(event.pointerId);
        this.onChange();
      });
    }
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  /** Show the robots, from above the whole cell, from the direction of a preset, as near as the picture allows. */
  look(name) {
    [this.azimuth, this.elevation] = PRESETS[name].map(radians);
    this.preset = name;
    const { centre, corners } = name === "top" ? this.whole : this.machines;
    this.target = [...centre];
    const back = unit(subtract(this.eye, this.target));
    const right = unit(cross([0, 0, 1], back));
    const up = cross(back, right);
    const tall = Math.tan(FIELD_OF_VIEW / 2) * FILLED;
    const wide = (tall * (this.canvas.clientWidth || 1)) / (this.canvas.clientHeight || 1);
    this.distance = 0.1;
    for (const corner of corners) {
      const p = subtract(corner, this.target);
      const across = Math.max(Math.abs(dot(p, right)) / wide, Math.abs(dot(p, up)) / tall);
      this.distance = Math.max(this.distance, across + dot(p, back));
    }
    this.onChange();
  }

  /** What is to be seen, of the robots and of the whole cell: the middle, and the corners of boxes that hold it. */
  fit(machines, whole) {
    this.machines = machines;
    this.whole = whole;
  }

  get eye() {
    const flat = Math.cos(this.elevation) * this.distance;
    const away = [Math.cos(this.azimuth) * flat, Math.sin(this.azimuth) * flat, Math.sin(this.elevation) * this.distance];
    return add(this.target, away);
  }

  /** From the world to the picture, both axes from -1 to 1. */
  matrix() {
    const aspect = (this.canvas.clientWidth || 1) / (this.canvas.clientHeight || 1);
    const far = this.distance + Math.max(12 * this.machines.radius, 3 * this.whole.radius);
    const projection = perspective(FIELD_OF_VIEW, aspect, Math.max(0.01, this.distance * 0.02), far);
    return multiply(projection, lookingAt(this.eye, this.target, [0, 0, 1]));
  }

  press(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
  }

  drag(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    const spread = this.spread();
    this.pointers.set(event.pointerId, now);
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    if (this.pointers.size > 1) {
      this.zoom(spread / (this.spread() || 1));
      this.shift(dx / 2, dy / 2);
    } else if (event.shiftKey || event.buttons & 6) {
      this.shift(dx, dy);
    } else {
      this.turnBy(-dx * 0.008, dy * 0.008);
    }
  }

  spread() {
    const [a, b] = [...this.pointers.values()];
    return b ? Math.hypot(a[0] - b[0], a[1] - b[1]) : 0;
  }

  wheel(event) {
    event.preventDefault();
    this.zoom(Math.exp(clamp(event.deltaY, -200, 200) * 0.0015));
  }

  turnBy(azimuth, elevation) {
    this.azimuth += azimuth;
    this.elevation = clamp(this.elevation + elevation, radians(-89.9), radians(89.9));
    this.onChange();
  }

  zoom(factor) {
    this.distance = clamp(this.distance * factor, 0.05, 40 * this.whole.radius);
    this.onChange();
  }

  shift(dx, dy) {
    const back = unit(subtract(this.eye, this.target));
    const right = unit(cross([0, 0, 1], back));
    const up = cross(back, right);
    const perPixel = (2 * this.distance * Math.tan(FIELD_OF_VIEW / 2)) / (this.canvas.clientHeight || 1);
    this.target = add(this.target, add(times(right, -dx * perPixel), times(up, dy * perPixel)));
    this.onChange();
  }
}
