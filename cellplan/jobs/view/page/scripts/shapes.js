// Shapes as triangles: points on a grid of 16 bit in the box that holds them, as meshes come in the page.

const SIDES = 28; // of a round shape
const RINGS = 5; // of a half ball
const GRID_STEPS = 65535;
const STEEPEST = 0.05; // cosine of the lean of a base on a wedge
const THINNEST = 1e-4; // height in m of what would have none

/** A geometry of the page: points, triangles, and the matrix that brings the points to their places in m. */
function builtGeometry(record) {
  if (record.points) {
    const points = unpacked(record.points, Uint16Array);
    const isWide = points.length / 3 > GRID_STEPS + 1;
    const triangles = unpacked(record.triangles, isWide ? Uint32Array : Uint16Array);
    return placedGeometry(points, triangles, record.low, record.size);
  }
  if (record.box) return gridded(boxSurface(record.box));
  if (record.cylinder) return gridded(revolved(cylinderProfile(...record.cylinder)));
  if (record.capsule) return gridded(revolved(capsuleProfile(...record.capsule)));
  if (record.sphere) return gridded(revolved(capsuleProfile(record.sphere[0], 0)));
  return null; // a plane: the page draws its grid
}

function placedGeometry(points, triangles, low, size) {
  const span = size.map((each) => Math.max(each, 1e-9));
  return { points, triangles, low, size: span, place: multiply(translation(low), scaling(span)) };
}

/** A surface of numbers in m on the grid of the box that holds it. */
function gridded({ points, triangles }) {
  const low = [0, 1, 2].map((axis) => points.reduce((least, point) => Math.min(least, point[axis]), Infinity));
  const high = [0, 1, 2].map((axis) => points.reduce((most, point) => Math.max(most, point[axis]), -Infinity));
  const size = subtract(high, low).map((each) => Math.max(each, 1e-9));
  const steps = new Uint16Array(3 * points.length);
  points.forEach((point, i) => {
    for (let axis = 0; axis < 3; axis += 1) {
      steps[3 * i + axis] = Math.round(((point[axis] - low[axis]) / size[axis]) * GRID_STEPS);
    }
  });
  return placedGeometry(steps, Uint16Array.from(triangles), low, size);
}

function boxSurface([x, y, z]) {
  const points = [];
  for (let i = 0; i < 8; i += 1) {
    points.push([(i & 1 ? 0.5 : -0.5) * x, (i & 2 ? 0.5 : -0.5) * y, (i & 4 ? 0.5 : -0.5) * z]);
  }
  const sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
  return { points, triangles: sides.flatMap(([a, b, c, d]) => [a, b, c, a, c, d]) };
}

/** An upright prism from the floor to the plane of a base, from its corners seen from above and the pose of the base. */
function wedgeSurface(outline, base) {
  const count = outline.length / 2;
  const lower = Array.from({ length: count }, (_, i) => [outline[2 * i], outline[2 * i + 1], 0]);
  const [x, y, z] = base.slice(8, 11);
  const top = (corner) => base[14] - (x * corner[0] + y * corner[1]) / Math.max(z, STEEPEST);
  const upper = lower.map((corner) => [corner[0], corner[1], Math.max(top(corner), THINNEST)]);
  const triangles = lower.flatMap((_, i) => {
    const next = (i + 1) % count;
    const sides = [i, next, next + count, i, next + count, i + count];
    return i > 0 && next > 0 ? [...sides, 0, next, i, count, i + count, next + count] : sides;
  });
  return { points: [...lower, ...upper], triangles };
}

/** Radius and height along the outline of a cylinder, from its lower to its upper end. */
function cylinderProfile(radius, height) {
  return [[0, -height / 2], [radius, -height / 2], [radius, height / 2], [0, height / 2]];
}

function capsuleProfile(radius, height) {
  const profile = [];
  for (const [sign, first] of [[-1, RINGS], [1, 0]]) {
    for (let i = 0; i <= RINGS; i += 1) {
      const angle = ((Math.PI / 2) * Math.abs(first - i)) / RINGS;
      profile.push([radius * Math.cos(angle), sign * (height / 2 + radius * Math.sin(angle))]);
    }
  }
  return profile;
}

/** The surface that an outline sweeps about z. */
function revolved(profile) {
  const points = [];
  const triangles = [];
  profile.forEach(([radius, z], ring) => {
    for (let side = 0; side < SIDES; side += 1) {
      const angle = (2 * Math.PI * side) / SIDES;
      points.push([radius * Math.cos(angle), radius * Math.sin(angle), z]);
      if (ring === 0) continue;
      const next = (side + 1) % SIDES;
      const [a, b] = [(ring - 1) * SIDES, ring * SIDES];
      triangles.push(a + side, a + next, b + next, a + side, b + next, b + side);
    }
  });
  return { points, triangles };
}

/** Lines of a square grid in a plane, as pairs of points, and the axes of its frame. */
function gridLines(half, step) {
  const ends = [];
  const last = Math.ceil(half / step);
  for (let i = -last; i <= last; i += 1) {
    ends.push(i * step, -last * step, 0, i * step, last * step, 0, -last * step, i * step, 0, last * step, i * step, 0);
  }
  return Float32Array.from(ends);
}
