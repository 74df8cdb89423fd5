// What the numbers of a handle do in the picture: each moves something along a direction, or turns it about an axis.

const KNOB_PX = 60; // distance of a turning knob from its axis
const LIFT_PX = 78; // of a sliding knob from the middle
const TIP_PX = 34; // of knobs of tools from the tip
const EDGE_ON = 0.15; // cosine between sight and axis below which a turn is read along its tangent

const column = (m, i) => [m[4 * i], m[4 * i + 1], m[4 * i + 2]];
const origin = (m) => column(m, 3);

/** The middle of a handle, and by part its motion: `along` or `about` a unit vector, at a place, its knob at `spot`. */
function motionsOf(handle, app, state) {
  const found = { base: ofPose, obstacle: ofPose, part: ofPart, tool: ofRod, start: ofJoints }[handle.prefix](handle, app, state);
  const size = app.handles.pixel(found.at);
  for (const motion of Object.values(found.motions)) motion.spot = motion.knob ? add(motion.from ?? motion.at, times(motion.knob, motion.px * size)) : motion.at;
  return { ...found, size };
}

/** A number as it is desired, in rad or mm; 0 where the handle lacks it. */
function desiredOf(handle, part, app) {
  const variable = handle[part];
  if (!variable) return 0;
  const value = app.desired[variable.address];
  return variable.unit === "deg" ? radians(value) : value;
}

/** A base or an obstacle: as answered, and moved by what is desired beyond that. */
function ofPose(handle, app) {
  const { stage } = app;
  const pose = handle.prefix === "base" ? stage.bases[handle.index] : stage.poses[handle.index];
  const off = (part) => (handle[part] ? app.desired[handle[part].address] - app.answer.values[handle[part].address] : 0);
  const at = add(origin(pose), times([off("x"), off("y"), off("z")], 1 / 1000));
  const heading = Math.atan2(pose[1], pose[0]) + radians(off("yaw"));
  return { at, motions: sixMotions(handle, at, identity(), { yaw: [Math.cos(heading), Math.sin(heading), 0] }) };
}

/** The part: at rest as any pose; held, it moves against the tip that holds it, along its own axes. */
function ofPart(handle, app, state) {
  const { robots, part } = app.stage.scene;
  const at = origin(state.part);
  const holder = part[0].robot;
  const rpy = ["roll", "pitch", "yaw"].map((name) => desiredOf(handle, name, app));
  const pose = poseOf([0, 0, 0], rpy);
  const axes = holder === WORLD ? identity() : state.part;
  const tilted = { roll: column(pose, 0), pitch: [-Math.sin(rpy[2]), Math.cos(rpy[2]), 0] };
  const motions = sixMotions(handle, at, axes, { yaw: column(axes, 0), pitch: times(column(axes, 2), -1) }, tilted);
  if (holder === WORLD) return { at, motions };
  const pivot = tipOf(robots[holder], state.links[holder]);
  for (const motion of Object.values(motions)) {
    if (motion.about) motion.at = motion.from = pivot;
    motion.factor = -1;
  }
  return { at, motions };
}

/** Motions of x, y, z along some axes, and of roll, pitch and yaw as far as their own axes are said. */
function sixMotions(handle, at, axes, knobs, tilted = {}) {
  const motions = {};
  ["x", "y", "z"].forEach((part, i) => {
    if (handle[part]) motions[part] = { along: column(axes, i), at, knob: part === "z" ? column(axes, 2) : null, px: LIFT_PX };
  });
  const directions = { ...tilted, yaw: [0, 0, 1] };
  for (const [part, direction] of Object.entries(directions)) {
    if (!handle[part]) continue;
    const about = subtract(moved(axes, direction), origin(axes));
    motions[part] = { about, at, knob: knobs[part] ?? across(about), px: KNOB_PX };
  }
  return motions;
}

/** A rod on its flange: the length moves the tip, tilt and roll turn it about axes of the flange. */
function ofRod(handle, app, state) {
  const robot = app.stage.scene.robots[handle.index];
  const tip = multiply(state.links[handle.index][robot.tip_link + 1], fromRows(robot.tip));
  const values = app.answer.values;
  const held = (part) => values[`robots.${handle.subject}.tool.rod.${part}`];
  const [tilt, roll] = [radians(held("tilt_deg")), radians(held("roll_deg"))];
  const flange = multiply(tip, inverseRigid(multiply(poseOf([0, 0, 0], [0, tilt, roll]), translation([0, 0, held("length_mm") / 1000]))));
  const [at, foot, along] = [origin(tip), origin(flange), column(tip, 2)];
  const leaning = subtract(moved(flange, [-Math.sin(roll), Math.cos(roll), 0]), foot);
  const motions = {};
  if (handle.length) motions.length = { along, at, knob: along, px: TIP_PX };
  if (handle.tilt) motions.tilt = { about: leaning, at: foot, from: at, knob: cross(leaning, along), px: TIP_PX };
  if (handle.roll) motions.roll = { about: column(flange, 2), at: foot, from: at, knob: leaning, px: TIP_PX };
  return { at, motions };
}

/** Joints of a robot where it begins: each knob turns or slides with its link. */
function ofJoints(handle, app, state) {
  const robot = app.stage.scene.robots[handle.index];
  const links = state.links[handle.index];
  const motions = {};
  let at = origin(links[0]);
  robot.axes.forEach((axis, link) => {
    const part = `joint${axis.joint}`;
    if (!handle[part] || motions[part]) return;
    const [before, after] = [links[axis.parent + 1], links[link + 1]];
    at = moved(before, axis.point);
    const direction = subtract(moved(before, axis.axis), origin(before));
    const knob = subtract(moved(after, across(axis.axis)), origin(after));
    motions[part] = { [axis.turns ? "about" : "along"]: direction, at, knob: axis.turns ? knob : direction, px: KNOB_PX, factor: axis.ratio };
  });
  return { at, motions };
}

/** A direction across another one. */
function across(direction) {
  return unit(cross(direction, Math.abs(direction[2]) > 0.9 ? [0, 1, 0] : [0, 0, 1]));
}

/** Where a ray is on a motion: a length in m along it, or an angle in rad about it; null where it cannot be said. */
function readOn({ along, about, at, spot }, ray) {
  if (along) return nearestAlong(ray, at, along);
  const arm = subtract(spot, at);
  const lever = subtract(arm, times(about, dot(arm, about)));
  const tangent = cross(about, lever);
  if (Math.abs(dot(ray.along, about)) < EDGE_ON) {
    const gone = nearestAlong(ray, spot, unit(tangent));
    return gone === null ? null : gone / length(lever);
  }
  const hit = onPlane(ray, spot, about);
  return hit && Math.atan2(dot(subtract(hit, at), unit(tangent)), dot(subtract(hit, at), unit(lever)));
}

/** Where on a line a ray comes nearest to it, in m from its place; null where both run alike. */
function nearestAlong(ray, at, along) {
  const off = subtract(ray.from, at);
  const rise = dot(ray.along, along);
  const flat = 1 - rise * rise;
  return flat < 1e-6 ? null : (dot(off, along) - rise * dot(off, ray.along)) / flat;
}

/** Where a ray meets a plane before the camera; null where it does not. */
function onPlane(ray, at, normal) {
  const share = dot(subtract(at, ray.from), normal) / (dot(ray.along, normal) || 1e-12);
  return share > 0 && share < 1e3 ? add(ray.from, times(ray.along, share)) : null;
}

/** Distance in m of a point from a ray. */
function offRay(ray, point) {
  return length(cross(subtract(point, ray.from), ray.along));
}

/** An angle in rad from -pi to pi. */
function turned(angle) {
  return Math.atan2(Math.sin(angle), Math.cos(angle));
}
