// What the live cell adds to the picture: handles, ranges, advice, tiles of a map, the certified state, and what is offered.

const ACCENT = [0.1, 0.42, 0.85, 1];
const ADVICE_COLOUR = [0.05, 0.6, 0.35, 1];
const RANGE_COLOUR = [0.1, 0.42, 0.85, 0.55];
const TILE_COLOURS = { passes: "#55ad7c", collision: "#e6a7a0", speed: "#eccb85", limit: "#b9c0ca", out_of_reach: "#f1f3f6", not_judged: "#8a6fb0" };
const TILE_TEXTS = { passes: "passes", collision: "collision or too near", speed: "too fast", limit: "beyond a joint limit", out_of_reach: "out of reach", not_judged: "not judged" };
const RANGE_OPACITY = 0.1;
const GHOST_OPACITY = 0.22;
const ELSEWHERE = 0.01; // rad or m of a joint at the begin: seen
const ARROW_PX = 110; // length of an arrow of advice
const CIRCLE = Array.from({ length: 49 }, (_, i) => (2 * Math.PI * i) / 48);

class Overlay {
  constructor(app) {
    this.app = app;
    this.shown = { handles: true, ranges: true, advice: true, tiles: true, ghost: true, offers: true };
    this.tiles = new Map(); // by place
    this.ghost = null; // the last certified state
    this.offer = null; // layout that a line of the results offers
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
    this.ghost = this.offer = null;
  }

  /** Remember the picture of the last state that is certified; none yet for null. */
  keepGhost(picture) {
    this.ghost = this.prepared(picture);
  }

  /** Show a layout that is offered; none for null. */
  showOffer(picture) {
    this.offer = this.prepared(picture);
    this.app.refresh();
  }

  /** A picture of other values, ready to be drawn. */
  prepared(picture) {
    if (!picture) return null;
    const { values, poses, motions } = picture;
    const made = Object.entries(motions).map(([block, motion]) => [block, new Motion(motion)]);
    return { bases: poses.bases.map(fromRows), tools: poses.tools, poses: this.app.bodyPoses(poses, values), motions: Object.fromEntries(made) };
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
    const lines = this.guideLines();
    if (this.shown.ranges) for (const handle of handles.all) lines.push(...this.rangeLines(handle));
    if (this.shown.handles) for (const handle of handles.all) lines.push(...this.handleLines(handle));
    if (this.shown.offers) lines.push(...this.offerLines());
    if (this.shown.advice) for (const advice of answer.advice) lines.push(this.arrow(advice, state));
    return lines;
  }

  bodies(state) {
    return [...(this.shown.tiles ? this.tileBodies() : []), ...(this.shown.ranges ? this.rangeBodies() : []), ...(this.shown.ghost ? this.ghostBodies(state, this.ghost, FIXED_COLOUR) : []), ...(this.shown.offers ? this.ghostBodies(state, this.offer, ADVICE_COLOUR.slice(0, 3)) : [])];
  }

  handleLines(handle) {
    const { handles, camera } = this.app;
    const { at, size, motions } = handles.place(handle);
    const isSelected = handle === handles.selected;
    const width = isSelected ? 4 : 2;
    const toEye = unit(subtract(camera.eye, at));
    const lines = [];
    const draw = (points, isActive = false) => lines.push(overlayLine(points, isSelected ? ACCENT : [...ACCENT.slice(0, 3), 0.7], isActive ? width + 2 : width));
    if (handles.hasRing(handle)) draw(circle(at, RING_PX * size, ringNormal(motions)));
    else if (!isSelected) [DOT_PX, 2].forEach((radius) => draw(circle(at, radius * size, toEye)));
    for (const [part, motion] of handles.hasKnobs(handle) ? Object.entries(motions) : []) {
      if (!motion.knob) continue;
      draw([motion.from ?? motion.at, motion.spot]);
      draw(circle(motion.spot, 6 * size, toEye), isSelected && part === handle.active);
      draw(circle(motion.spot, 2 * size, toEye));
    }
    return lines;
  }

  /** How far what a cell varies may move: an area, a piece of a line, or an arc; of what has no knobs now nothing. */
  rangeLines(handle) {
    if (!this.app.handles.hasKnobs(handle)) return [];
    const { at, motions } = this.app.handles.place(handle);
    const { desired } = this.app;
    const lines = [];
    const ends = (part) => {
      const [variable, { factor = 1 } = {}] = [handle[part], motions[part]];
      const scale = (variable?.unit === "deg" ? radians(1) : 0.001) * factor;
      return variable?.is_varied ? [variable.lower, variable.upper].map((bound) => (bound - desired[variable.address]) * scale) : [0, 0];
    };
    const along = (part, by) => (motions[part] ? times(motions[part].along, by) : [0, 0, 0]);
    const [[a, b], [c, d]] = [ends("x"), ends("y")];
    if (a !== b || c !== d) lines.push(overlayLine([[a, c], [b, c], [b, d], [a, d], [a, c]].map(([x, y]) => add(at, add(along("x", x), along("y", y)))), RANGE_COLOUR, 2));
    for (const [part, motion] of Object.entries(motions)) {
      const [low, high] = ends(part);
      if (low === high || !motion.knob) continue;
      if (motion.along) lines.push(overlayLine([low, high].map((by) => add(motion.at, times(motion.along, by))), RANGE_COLOUR, 2));
      else {
        const from = add(motion.at, times(subtract(motion.spot, motion.at), 0.85));
        lines.push(overlayLine([motion.at, ...CIRCLE.map((share) => moved(turn(motion.about, low + (share / (2 * Math.PI)) * (high - low), motion.at), from)), motion.at], RANGE_COLOUR, 2));
      }
    }
    return lines;
  }

  /** Areas in which bases may stand, tinted. */
  rangeBodies() {
    const { stage, handles } = this.app;
    return handles.all.filter(({ prefix, x, y }) => prefix === "base" && x?.is_varied && y?.is_varied).map(({ index, x, y }) => {
      const base = stage.bases[index];
      const middle = ({ lower, upper, address }, i) => base[12 + i] + ((lower + upper) / 2 - this.app.answer.values[address]) / 1000;
      const place = multiply(translation([middle(x, 0), middle(y, 1), base[14]]), scaling([(x.upper - x.lower) / 1000, (y.upper - y.lower) / 1000, 1]));
      return { geometry: this.square, place: multiply(place, stage.geometries[this.square].place), colour: ACCENT.slice(0, 3), opacity: RANGE_OPACITY };
    });
  }

  /** Lines of other bases on which a dragged one rests. */
  guideLines() {
    return this.app.handles.lines.map(({ axis, from }) => {
      const way = axis ? [1, 0, 0] : [0, 1, 0];
      return overlayLine([-1, 1].map((sign) => add(from, times(way, 3 * sign * this.app.stage.radius))), ADVICE_COLOUR, 1.5);
    });
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

  /** From each base to where an offered layout has it. */
  offerLines() {
    const { bases } = this.app.stage;
    const pairs = this.offer ? bases.map((base, robot) => [base, this.offer.bases[robot]]).filter(([now, then]) => differ(now, then)) : [];
    return pairs.map(([now, then]) => overlayLine([origin(now), origin(then)], ADVICE_COLOUR, 3));
  }

  /** What stands or moves elsewhere in another picture, at this instant; of blocks without a motion there the bases. */
  ghostBodies(state, ghost, colour) {
    const { stage, view, answer } = this.app;
    if (!ghost || !view) return [];
    const { scene } = stage;
    const motion = ghost.motions[answer.block];
    const moved = scene.robots.map((robot, index) => {
      const own = (q) => [...q.subarray(robot.column, robot.column + robot.joints.length)];
      const begins = motion && stage.motion.count ? [stage.motion.row(0), motion.row(0)].map(own) : [[], []];
      return differ(stage.bases[index], ghost.bases[index]) || differ(robot.tip, ghost.tools[index]) || differ(...begins, ELSEWHERE);
    });
    const links = allLinks(scene.robots, ghost.bases, motion ? motion.at(Math.min(state.t, motion.end)) : state.q);
    return scene.bodies.flatMap((body, index) => {
      if (body.kind === "part" || body.kind === "pedestal" || stage.isPlane(body)) return [];
      const isElsewhere = body.robot === WORLD ? differ(stage.poses[index], ghost.poses[index]) : moved[body.robot] && (motion || body.link < 0);
      if (!isElsewhere) return [];
      const place = multiply(carriedPose(links, body, ghost.poses[index]), stage.geometries[body.geometry].place);
      return [{ geometry: body.geometry, place, colour, opacity: GHOST_OPACITY }];
    });
  }
}

/** Whether two lists of numbers are different. */
function differ(some, others, by = 1e-6) {
  return some.some((value, i) => Math.abs(value - others[i]) > by);
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

function circle(at, radius, normal) {
  const first = across(normal);
  const second = cross(normal, first);
  return CIRCLE.map((angle) => add(at, add(times(first, radius * Math.cos(angle)), times(second, radius * Math.sin(angle)))));
}
