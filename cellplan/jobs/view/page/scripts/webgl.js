// Drawing by WebGL 2: flat triangles, and each piece of a line as two triangles.

const BODY_VERTEX = `#version 300 es
layout(location = 0) in vec3 position;
uniform mat4 place, camera;
out vec3 world;
void main() {
  vec4 at = place * vec4(position, 1.0);
  world = at.xyz;
  gl_Position = camera * at;
}`;
const BODY_FRAGMENT = `#version 300 es
precision highp float;
in vec3 world;
uniform vec3 eye;
uniform vec3 colour;
uniform float opacity;
out vec4 pixel;
void main() {
  vec3 toEye = normalize(eye - world);
  vec3 normal = normalize(cross(dFdx(world), dFdy(world)));
  normal *= sign(dot(normal, toEye) + 1e-6);
  vec3 side = normalize(cross(vec3(0.0, 0.0, 1.0), toEye) + vec3(1e-5));
  float lamp = max(dot(normal, normalize(toEye + 0.6 * side + vec3(0.0, 0.0, 0.5))), 0.0);
  pixel = vec4(colour * (0.42 + 0.5 * lamp + 0.12 * normal.z), opacity);
}`;
const LINE_VERTEX = `#version 300 es
layout(location = 0) in vec3 first;
layout(location = 1) in vec3 second;
uniform mat4 place, camera;
uniform vec2 viewport;
uniform float width, lift;
void main() {
  vec4 a = camera * place * vec4(first, 1.0), b = camera * place * vec4(second, 1.0);
  float near = 0.02;
  if (a.w < near && b.w > near) a = mix(a, b, (near - a.w) / (b.w - a.w));
  if (b.w < near && a.w > near) b = mix(b, a, (near - b.w) / (a.w - b.w));
  vec2 along = (b.xy / b.w - a.xy / a.w) * viewport;
  along = length(along) > 1e-6 ? normalize(along) : vec2(1.0, 0.0);
  vec4 at = (gl_VertexID & 2) == 0 ? a : b;
  float way = (gl_VertexID & 1) == 0 ? -1.0 : 1.0;
  at.xy += way * vec2(-along.y, along.x) * width / viewport * at.w;
  at.z -= lift * at.w;
  gl_Position = at;
}`;
const LINE_FRAGMENT = `#version 300 es
precision mediump float;
uniform vec4 colour;
out vec4 pixel;
void main() { pixel = colour; }`;

class WebglView {
  /** Throws where WebGL 2 is missing. */
  constructor(canvas, geometries) {
    this.isSoftware = drawsInSoftware();
    const gl = canvas.getContext("webgl2", { antialias: !this.isSoftware, alpha: false });
    if (!gl) throw new Error("WebGL 2 is missing");
    this.gl = gl;
    this.canvas = canvas;
    this.bodies = this.program(BODY_VERTEX, BODY_FRAGMENT, ["place", "camera", "eye", "colour", "opacity"]);
    this.lines = this.program(LINE_VERTEX, LINE_FRAGMENT, ["place", "camera", "viewport", "width", "lift", "colour"]);
    this.geometries = geometries.map((geometry) => geometry && this.upload(geometry));
    this.strips = new WeakMap(); // by the points of a line
    this.brief = []; // of lines that change from picture to picture
  }

  program(vertex, fragment, names) {
    const gl = this.gl;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    const found = { program };
    for (const name of names) found[name] = gl.getUniformLocation(program, name);
    return found;
  }

  upload(geometry) {
    const gl = this.gl;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const buffers = [gl.createBuffer(), gl.createBuffer()];
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers[0]);
    gl.bufferData(gl.ARRAY_BUFFER, geometry.points, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.UNSIGNED_SHORT, true, 6, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers[1]);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, geometry.triangles, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    const kind = geometry.triangles.BYTES_PER_ELEMENT === 4 ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT;
    return { array, buffers, kind, count: geometry.triangles.length };
  }

  /** Take another shape for a geometry. */
  replace(index, geometry) {
    const old = this.geometries[index];
    if (old) {
      this.gl.deleteVertexArray(old.array);
      old.buffers.forEach((buffer) => this.gl.deleteBuffer(buffer));
    }
    this.geometries[index] = this.upload(geometry);
  }

  /** Draw one picture; see `Stage.frame` for what it consists of. */
  draw(frame, camera, background) {
    const gl = this.gl;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(...background, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    const matrix = camera.matrix();
    gl.useProgram(this.bodies.program);
    gl.uniformMatrix4fv(this.bodies.camera, false, matrix);
    gl.uniform3fv(this.bodies.eye, camera.eye);
    for (const body of frame.bodies) {
      const shape = this.geometries[body.geometry];
      gl.uniformMatrix4fv(this.bodies.place, false, body.place);
      gl.uniform3fv(this.bodies.colour, body.colour);
      this.seeThrough(body.opacity ?? 1);
      gl.bindVertexArray(shape.array);
      gl.drawElements(gl.TRIANGLES, shape.count, shape.kind, 0);
    }
    this.seeThrough(1);
    this.drawLines(frame.lines, matrix);
  }

  /** Opacity of the next bodies; what is seen through hides nothing that is drawn later. */
  seeThrough(opacity) {
    const gl = this.gl;
    gl.uniform1f(this.bodies.opacity, opacity);
    gl.depthMask(opacity === 1);
    if (opacity === 1) gl.disable(gl.BLEND);
    else gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  }

  drawLines(lines, matrix) {
    const gl = this.gl;
    gl.useProgram(this.lines.program);
    gl.uniformMatrix4fv(this.lines.camera, false, matrix);
    gl.uniform2f(this.lines.viewport, this.canvas.width, this.canvas.height);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    const scale = this.canvas.width / (this.canvas.clientWidth || 1);
    for (const line of lines) {
      if (line.onTop) gl.disable(gl.DEPTH_TEST);
      else gl.enable(gl.DEPTH_TEST);
      gl.uniformMatrix4fv(this.lines.place, false, line.place);
      gl.uniform1f(this.lines.width, line.width * scale);
      gl.uniform1f(this.lines.lift, line.lift ?? 0);
      gl.uniform4fv(this.lines.colour, line.colour);
      gl.bindVertexArray(this.strip(line));
      gl.drawElements(gl.TRIANGLES, 6 * (line.count ?? segmentCount(line)), gl.UNSIGNED_INT, 0);
    }
    gl.bindVertexArray(null);
    this.forget();
  }

  /** Buffers of a line, a chain of points or pairs of them: four corners of each piece, all with both its ends. */
  strip(line) {
    const known = this.strips.get(line.points);
    if (known) return known;
    const gl = this.gl;
    const { ends, triangles } = stripBuffers(line);
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const buffers = [gl.createBuffer(), gl.createBuffer()];
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers[0]);
    gl.bufferData(gl.ARRAY_BUFFER, ends, gl.STATIC_DRAW);
    for (const place of [0, 1]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 24, 12 * place);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers[1]);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, triangles, gl.STATIC_DRAW);
    if (line.isBrief) this.brief.push({ array, buffers });
    else this.strips.set(line.points, array);
    return array;
  }

  /** Give back the buffers of lines that are drawn once. */
  forget() {
    for (const { array, buffers } of this.brief) {
      this.gl.deleteVertexArray(array);
      buffers.forEach((buffer) => this.gl.deleteBuffer(buffer));
    }
    this.brief = [];
  }
}

/** Whether WebGL is computed by the processor: pictures are drawn coarser then while they move. */
function drawsInSoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  if (!gl) return false;
  const names = gl.getExtension("WEBGL_debug_renderer_info");
  const name = String(gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

/** Both ends of each piece of a line, four times, and the two triangles of its strip. */
function stripBuffers(line) {
  const count = segmentCount(line);
  const ends = new Float32Array(24 * count);
  const triangles = new Uint32Array(6 * count);
  for (let i = 0; i < count; i += 1) {
    const first = (line.isPairs ? 6 : 3) * i;
    for (let corner = 0; corner < 4; corner += 1) ends.set(line.points.subarray(first, first + 6), 24 * i + 6 * corner);
    triangles.set([0, 1, 2, 2, 1, 3].map((corner) => 4 * i + corner), 6 * i);
  }
  return { ends, triangles };
}

/** Number of pieces of a line. */
function segmentCount(line) {
  const points = line.points.length / 3;
  return line.isPairs ? points / 2 : Math.max(0, points - 1);
}
