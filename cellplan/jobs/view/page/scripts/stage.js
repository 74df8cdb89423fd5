// What is drawn at an instant: bodies with their colours, paths, traces, the closest pair and the floor.

const RED = [0.84, 0.07, 0.07];
const PICKED = [0.98, 0.72, 0.05];
const NEAR_LINE = [0.85, 0.2, 0.05, 1];
const PART_COLOUR = [0.78, 0.66, 0.42];
const FIXED_COLOUR = [0.55, 0.58, 0.62];
const GRID_STEP = 0.5; // m
const FADED = 0.16; // opacity of what stands before the robots

class Stage {
  constructor(record) {
    this.geometries = record.geometries.map(builtGeometry);
    this.shown = { part: true, tools: true, surroundings: true, floor: true, labels: true, nearest: true, meshes: true };
    this.shownRobots = new Set();
    this.shownTasks = new Set();
    this.excludedLines = false;
    this.traceIn = "world";
    this.picked = new Set(); // bodies that a list points at
    this.setScene(record.scenes[0]);
  }

  setScene(scene) {
    this.scene = scene;
    this.motion = new Motion(scene.motion);
    this.bases = scene.robots.map((robot) => fromRows(robot.base));
    this.shownRobots = new Set(scene.robots.keys());
    this.shownTasks = new Set(scene.tasks.keys());
    this.picked.clear();
    this.poses = scene.bodies.map((body) => fromRows(body.pose));
    this.visuals = scene.visuals.map((visual) => fromRows(visual.pose));
    this.paths = scene.tasks.map((task) => Float32Array.from(task.points));
    this.traces = new Traces(this);
    this.grids = scene.bodies.filter((body) => this.isPlane(body)).map((body) => fromRows(body.pose));
    this.measure();
    this.sight = new Sight(this);
    this.gridLines = gridLines(GRID_STEP * Math.ceil((1.3 * this.radius) / GRID_STEP), GRID_STEP);
    this.axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis) => Float32Array.from([0, 0, 0, ...times(axis, 0.4)]));
  }

  isPlane(body) {
    return this.geometries[body.geometry] === null;
  }

  /** Everything at an instant: joints, links, the part and what touches. */
  at(t) {
    const q = this.motion.at(t);
    const links = allLinks(this.scene.robots, this.bases, q);
    const part = partPose(this.scene.part, links, t);
    return { t, q, links, part, red: this.touching(t), nearest: this.nearest(t, links) };
  }

  bodyPose(index, links, t) {
    const body = this.scene.bodies[index];
    if (body.kind === "part") {
      const place = partPlace(this.scene.part, t);
      const first = this.scene.part[0];
      const X_PS = multiply(inverseRigid(fromRows(first.pose)), this.poses[index]);
      return multiply(carriedPose(links, place, fromRows(place.pose)), X_PS);
    }
    if (body.outline.length) return this.wedgePose(index);
    if (body.stands.floor !== undefined || body.stands.ceiling !== undefined) return this.columnPose(index);
    return carriedPose(links, body, this.poses[index]);
  }

  /** An upright column below or above a base, as high as the base says. */
  columnPose(index) {
    const body = this.scene.bodies[index];
    const [now, given] = [this.bases[body.robot], fromRows(this.scene.robots[body.robot].base)];
    const end = body.stands.floor ?? body.stands.ceiling;
    const stretch = Math.abs(now[14] - end) / Math.max(Math.abs(given[14] - end), 1e-6);
    const heading = Math.atan2(now[1], now[0]);
    const place = poseOf([now[12], now[13], (now[14] + end) / 2], [0, 0, heading]);
    return multiply(place, scaling([1, 1, Math.max(stretch, 1e-4)]));
  }

  /** Below a base, on the floor, as the outline of a wedge has it. */
  wedgePose(index) {
    const { robot, stands } = this.scene.bodies[index];
    const now = this.bases[robot];
    return poseOf([now[12], now[13], stands.floor], [0, 0, Math.atan2(now[1], now[0])]);
  }

  /** Cut wedges off along the planes of their bases where these are now; each gets a geometry of its own. */
  fitWedges(view) {
    this.scene.bodies.forEach((body, index) => {
      if (!body.outline.length) return;
      if (body.own === undefined) body.own = this.geometries.push(null) - 1;
      body.geometry = body.own;
      const below = multiply(inverseRigid(this.wedgePose(index)), this.bases[body.robot]);
      this.geometries[body.own] = gridded(wedgeSurface(body.outline, below));
      view.replace(body.own, this.geometries[body.own]);
    });
  }

  /** Bodies that touch what they must not. */
  touching(t) {
    const found = new Set();
    for (const contact of this.scene.contacts) {
      if (contact.allowed || t < contact.first - 5e-4 || t > contact.last + 5e-4) continue;
      contact.bodies.forEach((body) => found.add(body));
    }
    return found;
  }

  /** The closest pair of the nearest instant that has one, with its two points where they are now. */
  nearest(t, links) {
    const { times: sampled, pairs, distances, lower_bound: bounds, points } = this.scene.nearest;
    let index = 0;
    for (let i = 1; i < sampled.length; i += 1) {
      if (Math.abs(sampled[i] - t) <= Math.abs(sampled[index] - t)) index = i;
    }
    const pair = pairs[index];
    if (!pair || pair.length === 0) return null;
    const ends = [0, 1].map((end) => {
      const local = points[index].slice(3 * end, 3 * end + 3);
      return moved(this.bodyPose(pair[end], links, t), local);
    });
    return { at: sampled[index], pair, distance: distances[index], isBound: bounds[index], ends };
  }

  isShown(body) {
    if (this.isPlane(body)) return false;
    if (body.kind === "part") return this.shown.part;
    if (body.kind === "obstacle") return this.shown.surroundings;
    if (body.kind === "tool" && !this.shown.tools) return false;
    return body.robot === WORLD || this.shownRobots.has(body.robot);
  }

  colour(body, index, red) {
    if (red.has(index)) return RED;
    if (this.picked.has(index)) return PICKED;
    if (body.kind === "part") return PART_COLOUR;
    if (body.kind === "obstacle" || body.kind === "pedestal") return FIXED_COLOUR;
    const own = this.robotColour(body.robot);
    if (body.kind === "tool" || body.kind === "attachment") return mixed(own, isDark() ? [1, 1, 1] : [0, 0, 0], 0.45);
    return own;
  }

  robotColour(index) {
    const text = this.scene.robots[index].colour;
    const plain = [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16) / 255);
    return mixed(plain, [1, 1, 1], isDark() ? 0.35 : 0.22);
  }

  /** The picture of an instant from a place of the camera: bodies, and lines in the order in which they are drawn. */
  frame(state, eye = null) {
    const bodies = [];
    const marked = this.markedLinks(state);
    const hiding = eye ? this.sight.from(eye) : new Set();
    this.scene.bodies.forEach((body, index) => {
      if (!this.isShown(body) || (body.replaced && this.shown.meshes && !marked.has(linkKey(body)))) return;
      const place = multiply(this.bodyPose(index, state.links, state.t), this.geometries[body.geometry].place);
      const isFaded = hiding.has(index) && !state.red.has(index) && !this.picked.has(index);
      const opacity = isFaded ? FADED : 1;
      bodies.push({ geometry: body.geometry, place, colour: this.colour(body, index, state.red), opacity });
    });
    if (this.shown.meshes) bodies.push(...this.visualBodies(state, marked));
    const lines = [...this.floorLines(), ...this.pathLines(state), ...this.traces.lines(state)];
    if (this.excludedLines) lines.push(this.excludedLine(state));
    if (this.shown.nearest && state.nearest) lines.push(this.nearestLine(state.nearest));
    bodies.sort((a, b) => (b.opacity ?? 1) - (a.opacity ?? 1)); // what is seen through comes last
    return { bodies, lines: lines.filter(Boolean) };
  }

  /** Links with a body that touches what it must not, or that a list points to: they are drawn by their bodies. */
  markedLinks(state) {
    return new Set([...state.red, ...this.picked].map((index) => linkKey(this.scene.bodies[index])));
  }

  /** The other links of robots as their files draw them. */
  visualBodies(state, marked) {
    return this.scene.visuals.flatMap((visual, index) => {
      if (!this.shownRobots.has(visual.robot) || marked.has(linkKey(visual))) return [];
      const pose = carriedPose(state.links, visual, this.visuals[index]);
      const place = multiply(pose, this.geometries[visual.geometry].place);
      return [{ geometry: visual.geometry, place, colour: this.robotColour(visual.robot) }];
    });
  }

  floorLines() {
    if (!this.shown.floor) return [];
    const colour = isDark() ? [0.6, 0.66, 0.74, 0.3] : [0.35, 0.42, 0.5, 0.28];
    const planes = this.grids.length ? this.grids : [identity()];
    const lines = planes.map((place) => ({
      points: this.gridLines, isPairs: true, place, width: 1, colour, isBelow: true,
    }));
    const colours = [[0.8, 0.2, 0.15, 1], [0.15, 0.6, 0.25, 1], [0.2, 0.4, 0.85, 1]];
    this.axes.forEach((points, i) => {
      lines.push({ points, place: identity(), width: 2, colour: colours[i], isBelow: true, lift: 2e-4 });
    });
    return lines;
  }

  pathLines(state) {
    return this.scene.tasks.map((task, index) => {
      if (!this.shownTasks.has(index) || this.paths[index].length < 6) return null;
      const place = task.in_world ? identity() : state.part;
      const colour = [...mixed(this.robotColour(task.robot), isDark() ? [1, 1, 1] : [0, 0, 0], 0.35), 1];
      return { points: this.paths[index], place, width: 3, colour, lift: 4e-4 };
    });
  }

  nearestLine(nearest) {
    const points = Float32Array.from(nearest.ends.flat());
    return { points, place: identity(), width: 4, colour: NEAR_LINE, onTop: true, isBrief: true };
  }

  /** A line between the middles of each two bodies that are not checked against each other. */
  excludedLine(state) {
    const ends = [];
    for (const { pairs } of this.scene.excluded) {
      for (const pair of pairs) {
        if (pair.some((index) => this.isPlane(this.scene.bodies[index]))) continue;
        for (const index of pair) ends.push(...this.middle(index, state.links, state.t));
      }
    }
    const colour = [0.5, 0.3, 0.8, 0.8];
    return { points: Float32Array.from(ends), isPairs: true, place: identity(), width: 1.5, colour, onTop: true, isBrief: true };
  }

  middle(index, links, t) {
    const { place } = this.geometries[this.scene.bodies[index].geometry];
    return moved(this.bodyPose(index, links, t), moved(place, [0.5, 0.5, 0.5]));
  }

  /** Where robots, tools and part are at the begin of the motion, and where all of the cell is. */
  measure() {
    this.machines = this.extent((body) => body.kind !== "obstacle");
    this.whole = this.extent(() => true);
    Object.assign(this, this.machines);
  }

  /** Of some bodies the corners of their boxes, and the middle and half the diagonal of the box round these. */
  extent(isMeant) {
    const links = allLinks(this.scene.robots, this.bases, this.motion.row(0));
    const corners = [];
    this.scene.bodies.forEach((body, index) => {
      if (this.isPlane(body) || !isMeant(body)) return;
      const whole = multiply(this.bodyPose(index, links, 0), this.geometries[body.geometry].place);
      for (let i = 0; i < 8; i += 1) corners.push(moved(whole, [i & 1, (i >> 1) & 1, (i >> 2) & 1]));
    });
    const over = (pick) => [0, 1, 2].map((axis) => pick(...corners.map((corner) => corner[axis])));
    const [low, high] = corners.length ? [over(Math.min), over(Math.max)] : [[-1, -1, 0], [1, 1, 1]];
    return { corners, centre: times(add(low, high), 0.5), radius: 0.5 * length(subtract(high, low)) };
  }
}

/** What tells the links of all robots apart. */
function linkKey(item) {
  return `${item.robot}/${item.link}`;
}

function mixed(a, b, share) {
  return a.map((value, i) => value + share * (b[i] - value));
}

function isDark() {
  return document.documentElement.dataset.theme === "dark";
}
