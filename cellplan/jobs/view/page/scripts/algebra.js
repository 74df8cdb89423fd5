// Vectors are [x, y, z]. Matrices are 16 numbers, column by column, as WebGL takes them.

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const times = (a, factor) => [a[0] * factor, a[1] * factor, a[2] * factor];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => times(a, 1 / (length(a) || 1));
const radians = (degrees) => (degrees * Math.PI) / 180;
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

function identity() {
  return [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
}

/** The matrix of twelve numbers, the upper three rows of a pose. */
function fromRows(r) {
  return [r[0], r[4], r[8], 0, r[1], r[5], r[9], 0, r[2], r[6], r[10], 0, r[3], r[7], r[11], 1];
}

function multiply(a, b) {
  const found = new Array(16);
  for (let column = 0; column < 16; column += 4) {
    for (let row = 0; row < 4; row += 1) {
      found[column + row] =
        a[row] * b[column] + a[row + 4] * b[column + 1] + a[row + 8] * b[column + 2] + a[row + 12] * b[column + 3];
    }
  }
  return found;
}

/** A point moved by a pose. */
function moved(m, p) {
  return [
    m[0] * p[0] + m[4] * p[1] + m[8] * p[2] + m[12],
    m[1] * p[0] + m[5] * p[1] + m[9] * p[2] + m[13],
    m[2] * p[0] + m[6] * p[1] + m[10] * p[2] + m[14],
  ];
}

/** A point through a projection: x, y, z and w before the division. */
function projected(m, p) {
  const row = (i) => m[i] * p[0] + m[i + 4] * p[1] + m[i + 8] * p[2] + m[i + 12];
  return [row(0), row(1), row(2), row(3)];
}

function inverseRigid(m) {
  const p = [m[12], m[13], m[14]];
  const at = (i) => -(m[4 * i] * p[0] + m[4 * i + 1] * p[1] + m[4 * i + 2] * p[2]);
  return [m[0], m[4], m[8], 0, m[1], m[5], m[9], 0, m[2], m[6], m[10], 0, at(0), at(1), at(2), 1];
}

function translation(p) {
  return [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, p[0], p[1], p[2], 1];
}

function scaling(s) {
  return [s[0], 0, 0, 0, 0, s[1], 0, 0, 0, 0, s[2], 0, 0, 0, 0, 1];
}

/** Turn by an angle about an axis through a point (Rodrigues' formula). */
function turn(axis, angle, point) {
  const [x, y, z] = axis;
  const c = Math.cos(angle);
  const s = Math.sin(angle);
  const v = 1 - c;
  const R = [
    x * x * v + c, x * y * v + z * s, x * z * v - y * s, 0,
    x * y * v - z * s, y * y * v + c, y * z * v + x * s, 0,
    x * z * v + y * s, y * z * v - x * s, z * z * v + c, 0,
    0, 0, 0, 1,
  ];
  const p = subtract(point, moved(R, point));
  R[12] = p[0];
  R[13] = p[1];
  R[14] = p[2];
  return R;
}

/** Pose from a position in m and fixed-axis roll, pitch and yaw in rad: R = Rz Ry Rx. */
function poseOf(xyz, rpy) {
  const origin = [0, 0, 0];
  const R = multiply(turn([0, 0, 1], rpy[2], origin), turn([0, 1, 0], rpy[1], origin));
  return multiply(translation(xyz), multiply(R, turn([1, 0, 0], rpy[0], origin)));
}

function perspective(fieldOfView, aspect, near, far) {
  const f = 1 / Math.tan(fieldOfView / 2);
  const depth = near - far;
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / depth, -1, 0, 0, (2 * far * near) / depth, 0];
}

function lookingAt(eye, target, up) {
  const back = unit(subtract(eye, target));
  const right = unit(cross(up, back));
  const top = cross(back, right);
  return [
    right[0], top[0], back[0], 0,
    right[1], top[1], back[1], 0,
    right[2], top[2], back[2], 0,
    -dot(right, eye), -dot(top, eye), -dot(back, eye), 1,
  ];
}
