// Traces of the tools: where each tool tip goes, in the world or on the part; what is done so far is drawn stronger.

const TRACE_STEPS = 1000; // of the whole motion at first; where a tip leaves the chord they are halved down to the rows
const TRACE_TOL = 5e-4; // m from the chord

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
      const tip = moved(inverseRigid(place), tipOf(stage.scene.robots[robot], state.links[robot]));
      const rest = Float32Array.from([...points.subarray(3 * done, 3 * done + 3), ...tip]);
      lines.push({ points: rest, place, width: 3, colour: [...colour, 1], lift: 6e-4, isBrief: true });
    });
    return lines;
  }

  seenFrom(frame) {
    if (!this.known.has(frame)) this.known.set(frame, this.computed(frame));
    return this.known.get(frame);
  }

  computed(frame) {
    const last = this.stage.motion.count - 1;
    const every = Math.max(1, Math.ceil(last / TRACE_STEPS));
    const rows = [0];
    const tips = [this.tips(frame, 0)];
    const follow = (row, at) => {
      const [before, start] = [rows[rows.length - 1], tips[tips.length - 1]];
      const middle = (before + row) >> 1;
      if (middle > before) {
        const between = this.tips(frame, middle);
        if (between.some((tip, robot) => offChord(tip, start[robot], at[robot]) > TRACE_TOL)) {
          follow(middle, between);
          follow(row, at);
          return;
        }
      }
      rows.push(row);
      tips.push(at);
    };
    for (let row = Math.min(every, last); rows[rows.length - 1] < last; row = Math.min(row + every, last)) {
      follow(row, this.tips(frame, row));
    }
    const points = this.stage.scene.robots.map((_, robot) => Float32Array.from(tips.flatMap((each) => each[robot])));
    return { rows, points };
  }

  /** Places of all tool tips in a row of the motion. */
  tips(frame, row) {
    const { scene, motion, bases } = this.stage;
    const links = allLinks(scene.robots, bases, motion.row(row));
    const from = frame === "part" ? inverseRigid(partPose(scene.part, links, motion.times[row])) : identity();
    return scene.robots.map((robot, index) => moved(from, tipOf(robot, links[index])));
  }
}

/** Distance of a point from the piece of a line between two others. */
function offChord(point, a, b) {
  const way = subtract(b, a);
  const share = clamp(dot(subtract(point, a), way) / (dot(way, way) || 1), 0, 1);
  return length(subtract(point, add(a, times(way, share))));
}

/** Place of a robot's tool tip in the world. */
function tipOf(robot, links) {
  const pose = multiply(links[robot.tip_link + 1], fromRows(robot.tip));
  return [pose[12], pose[13], pose[14]];
}
