// Draws what has been printed, each step once: a frame of a print under way adds what is new to the one before.

const VERTEX = `#version 300 es
in vec4 ends; in float half_mm; in vec4 colour;
uniform vec3 view;      // centre in mm, pixels a mm
uniform vec2 size;      // in pixels
uniform vec2 thin;      // half the least width of a bead and of a travel, in pixels; 0: none is drawn
uniform vec4 override;  // a colour for all, where its alpha is above 0
out vec4 tint; out vec3 along; out float radius;
void main() {
  vec2 corner = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 2.0 - 1.0;
  bool travel = half_mm < 0.0;
  radius = travel ? thin.y : max(half_mm * view.z, thin.x);
  if (radius <= 0.0) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
  vec2 a = (ends.xy - view.xy) * view.z, b = (ends.zw - view.xy) * view.z;
  float length_px = distance(a, b);
  vec2 d = length_px > 1e-4 ? (b - a) / length_px : vec2(1.0, 0.0);
  float reach = radius + 1.0;
  vec2 at = (corner.x < 0.0 ? a - d * reach : b + d * reach) + vec2(-d.y, d.x) * corner.y * reach;
  along = vec3(corner.x < 0.0 ? -reach : length_px + reach, corner.y * reach, length_px);
  tint = override.a > 0.0 ? override : colour;
  gl_Position = vec4(at / size * 2.0, 0.0, 1.0);
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec4 tint; in vec3 along; in float radius;
out vec4 pixel;
void main() {
  float beyond = max(max(-along.x, along.x - along.z), 0.0);
  float off = length(vec2(beyond, along.y));
  float alpha = tint.a * clamp(radius - off + 0.5, 0.0, 1.0) * min(1.0, radius * 2.0);
  float edge = radius > 2.0 ? 1.0 - 0.35 * smoothstep(0.35, 1.0, off / radius) : 1.0;
  pixel = vec4(tint.rgb * edge * alpha, alpha);
}`;

class GlPainter {
  static open(canvas) {
    const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, preserveDrawingBuffer: true, powerPreference: "high-performance" });
    return gl ? new GlPainter(canvas, gl) : null;
  }

  constructor(canvas, gl) {
    this.canvas = canvas; this.gl = gl; this.drawn = 0; this.freed = 0;
    this.lost = false;
    canvas.addEventListener("webglcontextlost", (event) => { event.preventDefault(); this.lost = true; });
    canvas.addEventListener("webglcontextrestored", () => { this.lost = false; this.prepare(); if (this.job) this.load(...this.job); this.onrestored?.(); });
    this.prepare();
  }

  prepare() {
    const gl = this.gl, program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    gl.useProgram(program);
    this.at = Object.fromEntries(["ends", "half_mm", "colour"].map((name) => [name, gl.getAttribLocation(program, name)]));
    this.is = Object.fromEntries(["view", "size", "thin", "override"].map((name) => [name, gl.getUniformLocation(program, name)]));
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    for (const place of Object.values(this.at)) { gl.enableVertexAttribArray(place); gl.vertexAttribDivisor(place, 1); }
    this.shapes = gl.createBuffer(); this.colours = gl.createBuffer(); this.free = gl.createBuffer();
  }

  // shapes: Float32Array, x0, y0, x1, y1 from `origin` and half the width (negative: a travel) of all that is drawn;
  // free: the same of the toolpaths alone, in the order in which they can be laid.
  load(origin, shapes, colours, free) {
    const gl = this.gl;
    this.job = [origin, shapes, colours, free];
    this.origin = origin;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.shapes); gl.bufferData(gl.ARRAY_BUFFER, shapes, gl.STATIC_DRAW);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.free); gl.bufferData(gl.ARRAY_BUFFER, free, gl.STATIC_DRAW);
    this.recolour(colours);
    this.count = shapes.length / 5;
    this.freeCount = free.length / 5;
  }

  recolour(colours) {
    const gl = this.gl;
    this.job[2] = colours;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.colours); gl.bufferData(gl.ARRAY_BUFFER, colours, gl.STATIC_DRAW);
  }

  range(buffer, from, to, override, beads, travels) {
    if (to <= from) return;
    const gl = this.gl, { ends, half_mm, colour } = this.at;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.vertexAttribPointer(ends, 4, gl.FLOAT, false, 20, 20 * from);
    gl.vertexAttribPointer(half_mm, 1, gl.FLOAT, false, 20, 20 * from + 16);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.colours);
    gl.vertexAttribPointer(colour, 4, gl.UNSIGNED_BYTE, true, 4, override ? 0 : 4 * from);
    gl.uniform4fv(this.is.override, override || [0, 0, 0, 0]);
    gl.uniform2f(this.is.thin, beads, travels);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, to - from);
  }

  frame(view) {
    const gl = this.gl, ratio = this.canvas.width / view.width;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.uniform3f(this.is.view, view.cx - this.origin[0], view.cy - this.origin[1], view.scale * ratio);
    gl.uniform2f(this.is.size, this.canvas.width, this.canvas.height);
    return ratio;
  }

  // All anew: what is to come, what of it can be laid now, and the first `drawn` of what is printed.
  redraw(view, drawn, freed, style) {
    if (this.lost) return;
    const gl = this.gl, ratio = this.frame(view);
    gl.clearColor(...style.ground, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    if (style.ghosts) this.range(this.shapes, drawn, this.count, style.ghost, 0.4 * ratio, 0);
    this.drawn = drawn; this.freed = 0;
    this.addFree(freed, style, ratio);
    this.range(this.shapes, 0, drawn, null, 0.5 * ratio, style.travels ? 0.5 * ratio : 0);
  }

  // Only what is new since the last frame.
  advance(view, drawn, freed, style) {
    if (this.lost || (drawn === this.drawn && freed === this.freed)) return;
    const ratio = this.frame(view);
    this.addFree(freed, style, ratio);
    this.range(this.shapes, this.drawn, drawn, null, 0.5 * ratio, style.travels ? 0.5 * ratio : 0);
    this.drawn = drawn;
  }

  addFree(freed, style, ratio) {
    if (style.free) this.range(this.free, this.freed, freed, style.free, 0.5 * ratio, 0);
    this.freed = freed;
  }
}
