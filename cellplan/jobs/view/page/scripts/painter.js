// Drawing without WebGL: a still picture, its triangles painted from the farthest to the nearest.

class PaintedView {
  constructor(canvas, geometries) {
    this.context = canvas.getContext("2d");
    this.canvas = canvas;
    this.geometries = geometries;
  }

  /** Take another shape for a geometry. */
  replace(index, geometry) {
    this.geometries[index] = geometry;
  }

  draw(frame, camera, background) {
    const { context, canvas } = this;
    const matrix = camera.matrix();
    context.fillStyle = css(background);
    context.fillRect(0, 0, canvas.width, canvas.height);
    this.drawLines(frame.lines.filter((line) => line.isBelow), matrix);
    const triangles = frame.bodies.flatMap((body) => this.triangles(body, matrix, camera.eye));
    triangles.sort((a, b) => b.depth - a.depth);
    for (const { corners, shade, isSolid } of triangles) {
      context.fillStyle = context.strokeStyle = shade;
      context.lineWidth = 0.7;
      context.beginPath();
      for (const [x, y] of corners) context.lineTo(x, y);
      context.closePath();
      context.fill();
      if (isSolid) context.stroke(); // closes the gaps between neighbours
    }
    this.drawLines(frame.lines.filter((line) => !line.isBelow), matrix);
  }

  /** The triangles of a body in the picture, those that turn away left out. */
  triangles(body, matrix, eye) {
    const geometry = this.geometries[body.geometry];
    const world = [];
    for (let i = 0; i < geometry.points.length; i += 3) {
      const steps = [geometry.points[i], geometry.points[i + 1], geometry.points[i + 2]];
      world.push(moved(body.place, times(steps, 1 / GRID_STEPS)));
    }
    const flat = world.map((point) => this.onCanvas(matrix, point));
    const found = [];
    for (let i = 0; i < geometry.triangles.length; i += 3) {
      const [a, b, c] = geometry.triangles.subarray(i, i + 3);
      const corners = [flat[a], flat[b], flat[c]];
      if (corners.some((corner) => corner === null)) continue;
      const normal = unit(cross(subtract(world[b], world[a]), subtract(world[c], world[a])));
      const lamp = Math.abs(dot(normal, unit(subtract(eye, world[a]))));
      const depth = (corners[0][2] + corners[1][2] + corners[2][2]) / 3;
      const [opacity, colour] = [body.opacity ?? 1, times(body.colour, 0.45 + 0.5 * lamp + 0.1 * normal[2])];
      found.push({ corners, depth, shade: css(colour, opacity), isSolid: opacity === 1 });
    }
    return found;
  }

  drawLines(lines, matrix) {
    const { context } = this;
    const scale = this.canvas.width / (this.canvas.clientWidth || 1);
    for (const line of lines) {
      const whole = multiply(matrix, line.place);
      context.strokeStyle = css(line.colour, line.colour[3]);
      context.lineWidth = line.width * scale;
      context.beginPath();
      const count = line.count ?? segmentCount(line);
      for (let i = 0; i < count; i += 1) {
        const first = line.isPairs ? 6 * i : 3 * i;
        const ends = [first, first + 3].map((at) => this.onCanvas(whole, line.points.subarray(at, at + 3)));
        if (ends.some((end) => end === null)) continue;
        context.moveTo(ends[0][0], ends[0][1]);
        context.lineTo(ends[1][0], ends[1][1]);
      }
      context.stroke();
    }
  }

  /** Place of a point in the picture in pixels, and its depth; null behind the camera. */
  onCanvas(matrix, point) {
    const [x, y, , w] = projected(matrix, point);
    if (w < 0.02) return null;
    return [(0.5 + (0.5 * x) / w) * this.canvas.width, (0.5 - (0.5 * y) / w) * this.canvas.height, w];
  }
}

/** A colour of three shares as style sheets have it. */
function css(colour, opacity = 1) {
  const [r, g, b] = colour.map((share) => Math.round(255 * clamp(share, 0, 1)));
  return `rgba(${r}, ${g}, ${b}, ${opacity})`;
}
