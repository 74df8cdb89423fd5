// Where everything is: joints between their rows, links by successive screw displacements, bodies on their links.

const WORLD = -1; // number of the robot of what no robot moves

/** The typed array that a text in base64 holds. */
function unpacked(text, Kind) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Kind(bytes.buffer);
}

/** Joint positions over time; joints move linearly from row to row. */
class Motion {
  constructor(record) {
    this.count = record.count;
    this.total = record.total;
    this.phases = record.phases;
    this.times = unpacked(record.times, Float64Array);
    this.q = unpacked(record.q, Float32Array);
    this.width = this.q.length / this.count;
  }

  get end() {
    return this.times[this.count - 1];
  }

  /** The last row that is not after an instant. */
  rowBefore(t) {
    let low = 0;
    let high = this.count - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.times[middle] <= t + 1e-9) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  row(index) {
    return this.q.subarray(index * this.width, (index + 1) * this.width);
  }

  at(t) {
    const before = this.rowBefore(t);
    const after = Math.min(before + 1, this.count - 1);
    const span = this.times[after] - this.times[before];
    const share = span > 0 ? clamp((t - this.times[before]) / span, 0, 1) : 0;
    const a = this.row(before);
    const b = this.row(after);
    return Float64Array.from(a, (value, i) => value + share * (b[i] - value));
  }
}

/** Displacements of the base and of all links of a robot from the configuration where all joints read zero. */
function linkPoses(robot, base, q) {
  const poses = [base];
  const place = (link) => {
    if (poses[link + 1]) return poses[link + 1];
    const axis = robot.axes[link];
    const position = axis.ratio * q[robot.column + axis.joint] + axis.offset;
    const step = axis.turns ? turn(axis.axis, position, axis.point) : translation(times(axis.axis, position));
    return (poses[link + 1] = multiply(place(axis.parent), step));
  };
  robot.axes.forEach((_, link) => place(link));
  return poses;
}

/** Poses of all links by robot. */
function allLinks(robots, bases, q) {
  return robots.map((robot, index) => linkPoses(robot, bases[index], q));
}

/** Pose of something that is fixed to a link, or to the world. */
function carriedPose(links, item, own) {
  return item.robot === WORLD ? own : multiply(links[item.robot][item.link + 1], own);
}

/** What carries the part at an instant. */
function partPlace(places, t) {
  let found = places[0];
  for (const place of places) if (place.begin <= t + 1e-9) found = place;
  return found;
}

/** Pose of the part frame in the world. */
function partPose(places, links, t) {
  const place = partPlace(places, t);
  return carriedPose(links, place, fromRows(place.pose));
}
