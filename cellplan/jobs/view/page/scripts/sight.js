// What of the surroundings stands between the camera and the robots: it is drawn faded, so that they are seen through it.

const SIGHT_TIMES = 8; // times of the motion at which robots, tools and part are looked for
const MOST_TESTS = 200000; // of a line of sight against a triangle, for one body and one place of the camera

class Sight {
  constructor(stage) {
    this.stage = stage;
    this.eye = [NaN, NaN, NaN];
    this.hiding = new Set();
    this.obstacles = [];
    stage.scene.bodies.forEach((body, index) => {
      if (body.kind === "obstacle" && !stage.isPlane(body)) this.obstacles.push(index);
    });
    this.points = this.obstacles.length ? this.looked() : [];
  }

  /** Middles of robots, tools and part in the world, at times of the motion. */
  looked() {
    const { scene, motion } = this.stage;
    const points = [];
    for (let i = 0; i < SIGHT_TIMES; i += 1) {
      const t = motion.times[0] + ((motion.end - motion.times[0]) * i) / (SIGHT_TIMES - 1);
      const links = allLinks(scene.robots, this.stage.bases, motion.at(t));
      scene.bodies.forEach((body, index) => {
        if (body.kind !== "obstacle" && !this.stage.isPlane(body)) points.push(this.stage.middle(index, links, t));
      });
    }
    return points;
  }

  /** Numbers of the bodies that hide one of these places from a camera. */
  from(eye) {
    if (eye.some((value, i) => value !== this.eye[i])) {
      this.eye = eye;
      this.hiding = new Set(this.obstacles.filter((index) => this.hides(index, eye)));
    }
    return this.hiding;
  }

  hides(index, eye) {
    const { scene, geometries, poses } = this.stage;
    const geometry = geometries[scene.bodies[index].geometry];
    const back = inverseRigid(poses[index]);
    const inBox = (p) => moved(back, p).map((value, i) => (value - geometry.low[i]) / geometry.size[i]);
    const from = inBox(eye);
    const every = Math.ceil((this.points.length * geometry.triangles.length) / 3 / MOST_TESTS);
    return this.points.some((point, i) => i % every === 0 && isCrossed(geometry, from, inBox(point)));
  }
}

/** Whether a piece of a line, in the box of a geometry from 0 to 1, meets the surface before its end. */
function isCrossed(geometry, from, to) {
  const way = subtract(to, from);
  let [first, last] = [0, 1];
  for (let axis = 0; axis < 3; axis += 1) {
    const sides = [0, 1].map((side) => (side - from[axis]) / (way[axis] || 1e-12)).sort((a, b) => a - b);
    [first, last] = [Math.max(first, sides[0]), Math.min(last, sides[1])];
  }
  if (first > last) return false;
  const corner = (i) => [0, 1, 2].map((axis) => geometry.points[3 * geometry.triangles[i] + axis] / GRID_STEPS);
  for (let i = 0; i < geometry.triangles.length; i += 3) {
    if (meets(corner(i), corner(i + 1), corner(i + 2), from, way)) return true;
  }
  return false;
}

/** Whether a piece of a line, a place and the way from there, meets a triangle. */
function meets(a, b, c, from, way) {
  const [along, across] = [subtract(b, a), subtract(c, a)];
  const normal = cross(way, across);
  const size = dot(along, normal);
  if (Math.abs(size) < 1e-14) return false;
  const off = subtract(from, a);
  const u = dot(off, normal) / size;
  const turned = cross(off, along);
  const v = dot(way, turned) / size;
  const t = dot(across, turned) / size;
  return u >= 0 && v >= 0 && u + v <= 1 && t > 0 && t < 1;
}
