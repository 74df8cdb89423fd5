// What the live cell adds to the picture: handles, ranges, arrows of advice, tiles of a map, and the last certified state.

const ACCENT = [0.1, 0.42, 0.85, 1];
const ADVICE_COLOUR = [0.05, 0.6, 0.35, 1];
const RANGE_COLOUR = [0.1, 0.42, 0.85, 0.55];
const TILE_COLOURS = { passes: "#55ad7c", collision: "#e6a7a0", speed: "#eccb85", limit: "#b9c0ca", out_of_reach: "#f1f3f6", not_judged: "#8a6fb0" };
const TILE_TEXTS = { passes: "passes", collision: "collision or too near", speed: "too fast", limit: "beyond a joint limit", out_of_reach: "out of reach", not_judged: "not judged" };
const GHOST_OPACITY = 0.22;
const ARROW_PX = 110; // length of an arrow of advice
const CIRCLE = Array.from({ length: 49 }, (_, i) => (2 * Math.PI * i) / 48);

class Overlay {
  constructor(app) {
    this.app = app;
    this.shown = { handles: true, ranges: true, advice: true, tiles: true, ghost: true };
    this.tiles = new Map(); // by place
    this.ghost = null; // motion, bases and tips of the last certified state
  }

  /** Prepare for another cell: a square for the tiles. */
  setScene() {
    const { stage, view } = this.app;
    const corners = [[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]];
    this.square = stage.geometries.push(gridded({ points: corners, triangles: [0, 1, 2, 0, 2, 3] })) - 1;
    view.replace(this.square, stage.geometries[this.square]);
    this.tiles.clear();
    this.rectangles = [];
    byId("legend").replaceChildren();
    this.ghost = null;
  }

  /** Remember a state that is certified. */
  keepGhost(answer) {
    const { stage } = this.app;
    this.ghost = { motion: stage.motion, bases: [...stage.bases], poses: [...stage.poses], values: { ...answer.values } };
  }

  putTiles(event) {
    if (event.robot !== this.tilesOf) this.tiles.clear();
    this.tilesOf = event.robot;
    for (const tile of event.tiles) this.tiles.set(`${tile.x_mm},${tile.y_mm}`, { ...tile, size: event.size_mm });
    this.rectangles = [...joinedTiles([...this.tiles.values()])];
    const states = Object.keys(TILE_COLOURS).filter((state) => [...this.tiles.values()].some((tile) => tile.state === state));
    byId("legend").replaceChildren(`base of ${event.robot}: `, ...states.map((state) => (
      element("span", {}, element("span", { className: "swatch", style: `background:${TILE_COLOURS[state]}` }), `${TILE_TEXTS[state]} `)
    )));
  }

  lines(state) {
    const { answer, handles } = this.app;
    const lines = [];
    if (this.shown.ranges) for (const handle of handles.all) lines.push(...this.rangeLines(handle));
    if (this.shown.handles) for (const handle of handles.all) lines.push(...this.handleLines(handle));
    if (this.shown.advice) for (const advice of answer.advice) lines.push(this.arrow(advice, state));
    return lines;
  }

  bodies(state) {
    return [...(this.shown.tiles ? this.tileBodies() : []), ...(this.shown.ghost ? this.ghostBodies(state) : [])];
  }

  handleLines(handle) {
    const { handles } = this.app;
    const { at, size, knobs } = handles.knobs(handle);
    const isSelected = handle === handles.selected;
    const width = isSelected ? 4 : 2;
    const lines = [];
    const draw = (points) => lines.push(overlayLine(points, isSelected ? ACCENT : [...ACCENT.slice(0, 3), 0.7], width));
    if (handle.x || handle.y) draw(circle(at, RING_PX * size));
    for (const knob of handles.hasKnobs(handle) ? Object.values(knobs) : []) {
      draw([at, knob]);
      draw(circle(knob, 6 * size));
      draw(circle(knob, 2 * size));
    }
    return lines;
  }

  /** Where a base may stand: a rectangle, or a piece of a line, in the plane of its base; and how far it may turn. */
  rangeLines(handle) {
    const { x, y, yaw } = handle;
    const { at, heading } = this.app.handles.place(handle);
    const { desired } = this.app;
    const lines = [];
    const end = (variable, bound, axis) => (
      variable?.is_varied ? at[axis] + (variable[bound] - desired[variable.address]) / 1000 : at[axis]
    );
    if (x?.is_varied || y?.is_varied) {
      const [a, b, c, d] = [end(x, "lower", 0), end(x, "upper", 0), end(y, "lower", 1), end(y, "upper", 1)];
      lines.push(overlayLine([[a, c, at[2]], [b, c, at[2]], [b, d, at[2]], [a, d, at[2]], [a, c, at[2]]], RANGE_COLOUR, 2));
    }
    if (yaw?.is_varied) {
      const radius = 0.85 * KNOB_PX * this.app.handles.pixel(at);
      const [from, to] = [yaw.lower, yaw.upper].map((bound) => heading + radians(bound - desired[yaw.address]));
      const arc = CIRCLE.map((angle) => from + (angle / (2 * Math.PI)) * (to - from));
      lines.push(overlayLine([at, ...arc.map((angle) => add(at, times([Math.cos(angle), Math.sin(angle), 0], radius))), at], RANGE_COLOUR, 2));
    }
    return lines;
  }

  /** Where an arrow of advice begins and ends in the world. */
  arrowEnds(advice) {
    const base = this.app.stage.bases[advice.robot];
    const at = [base[12], base[13], base[14]];
    return [at, add(at, times(unit(advice.direction), ARROW_PX * this.app.handles.pixel(at)))];
  }

  arrow(advice) {
    const [from, to] = this.arrowEnds(advice);
    const along = subtract(to, from);
    const across = Math.abs(along[2]) > 0.9 * length(along) ? cross(along, [1, 0, 0]) : cross(along, [0, 0, 1]);
    const barb = (sign) => add(add(from, times(along, 0.8)), times(unit(across), sign * 0.12 * length(along)));
    return overlayLine([from, to, barb(1), barb(-1), to], ADVICE_COLOUR, 5);
  }

  /** Squares on the floor, finer ones above coarser ones. */
  tileBodies() {
    const floor = this.app.stage.grids.length ? Math.min(...this.app.stage.grids.map((grid) => grid[14])) : 0;
    return this.rectangles.map((tile) => {
      const height = floor + 0.002 + 0.004 / (1 + 0.01 * tile.size);
      const text = TILE_COLOURS[tile.state] ?? TILE_COLOURS.not_judged;
      const colour = [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16) / 255);
      const place = multiply(translation([tile.x_mm / 1000, tile.y_mm / 1000, height]), scaling([tile.width / 1000, tile.size / 1000, 1]));
      const whole = multiply(place, this.app.stage.geometries[this.square].place);
      return { geometry: this.square, place: whole, colour: isDark() ? times(colour, 0.6) : colour };
    });
  }

  /** Robots whose base has moved since, where the certified state has them at this instant. */
  ghostBodies(state) {
    if (!this.ghost) return [];
    const { stage, view } = this.app;
    const { scene } = stage;
    const moved = new Set([...scene.robots.keys()].filter((robot) => stage.bases[robot].some((value, i) => Math.abs(value - this.ghost.bases[robot][i]) > 1e-6)));
    if (moved.size === 0 || !view) return [];
    const links = allLinks(scene.robots, this.ghost.bases, this.ghost.motion.at(Math.min(state.t, this.ghost.motion.end)));
    return scene.bodies.flatMap((body, index) => {
      if (!moved.has(body.robot) || body.kind === "part" || body.kind === "pedestal" || stage.isPlane(body)) return [];
      const place = multiply(carriedPose(links, body, this.ghost.poses[index]), stage.geometries[body.geometry].place);
      return [{ geometry: body.geometry, place, colour: FIXED_COLOUR, opacity: GHOST_OPACITY }];
    });
  }
}

/** Tiles of one size and state that are neighbours in a row, as one: their middle and width in mm. */
function* joinedTiles(tiles) {
  const key = (tile) => [tile.size, tile.y_mm, tile.state].join();
  let row = null;
  for (const tile of tiles.sort((a, b) => b.size - a.size || a.y_mm - b.y_mm || a.x_mm - b.x_mm)) {
    if (row && key(row) === key(tile) && Math.abs(tile.x_mm - row.end - tile.size) < 1e-3) {
      row.end = tile.x_mm;
      continue;
    }
    if (row) yield joined(row);
    row = { ...tile, begin: tile.x_mm, end: tile.x_mm };
  }
  if (row) yield joined(row);
}

function joined({ begin, end, ...tile }) {
  return { ...tile, x_mm: (begin + end) / 2, width: end - begin + tile.size };
}

/** A line over everything else, made anew for each picture. */
function overlayLine(points, colour, width) {
  return { points: Float32Array.from(points.flat()), place: identity(), width, colour, onTop: true, isBrief: true };
}

function circle(at, radius) {
  return CIRCLE.map((angle) => [at[0] + radius * Math.cos(angle), at[1] + radius * Math.sin(angle), at[2]]);
}
