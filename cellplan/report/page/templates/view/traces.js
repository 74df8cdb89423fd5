// Traces of the tools: where each tool tip goes, in the world or on the part; what is done so far is drawn stronger.

const TRACE_POINTS = 300; // of each robot

class Traces {
  constructor(stage) {
    this.stage = stage;
    this.known = new Map(); // by what they are seen from
  }

  /** Lines of the traces of all robots that are shown. */
  lines(state) {
    const { stage } = this;
    if (stage.traceIn === "none" || stage.motion.count < 2) return [];
    const traces = this.seenFrom(stage.traceIn);
    const place = stage.traceIn === "part" ? state.part : identity();
    const lines = [];
    traces.points.forEach((points, robot) => {
      if (!stage.shownRobots.has(robot)) return;
      const colour = stage.robotColour(robot);
      let done = 0;
      while (done < traces.rows.length - 1 && stage.motion.times[traces.rows[done + 1]] <= state.t) done += 1;
      lines.push({ points, place, width: 1.5, colour: [...colour, 0.45], lift: 5e-4 });
      lines.push({ points, place, width: 3, colour: [...colour, 1], count: done, lift: 6e-4 });
    });
    return lines;
  }

  seenFrom(frame) {
    if (!this.known.has(frame)) this.known.set(frame, this.computed(frame));
    return this.known.get(frame);
  }

  computed(frame) {
    const { scene, motion, bases } = this.stage;
    const every = Math.max(1, Math.ceil(motion.count / TRACE_POINTS));
    const rows = [];
    for (let row = 0; row < motion.count; row += every) rows.push(row);
    if (rows[rows.length - 1] !== motion.count - 1) rows.push(motion.count - 1);
    const points = scene.robots.map(() => new Float32Array(3 * rows.length));
    rows.forEach((row, i) => {
      const links = allLinks(scene.robots, bases, motion.row(row));
      const from = frame === "part" ? inverseRigid(partPose(scene.part, links, motion.times[row])) : identity();
      scene.robots.forEach((robot, index) => points[index].set(moved(from, tipOf(robot, links[index])), 3 * i));
    });
    return { rows, points };
  }
}

/** Place of a robot's tool tip in the world. */
function tipOf(robot, links) {
  const pose = multiply(links[robot.tip_link + 1], fromRows(robot.tip));
  return [pose[12], pose[13], pose[14]];
}
