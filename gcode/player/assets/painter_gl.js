// Draws what has been printed, each step once: a frame of a print under way adds what is new to the one before.

//
// Each bead is six vertices that find it in textures by their number. Instances would be simpler, but drivers that
// draw in software begin each one anew: 100,000 of them take seconds, this a tenth of one.

const ACROSS = 2048; // texels of a row

const VERTEX = `#version 300 es
precision highp float;
uniform highp sampler2D ends_of, colour_of; // by bead: x0, y0, x1, y1 in mm; r, g, b
uniform highp sampler2D half_of;            // half its width in mm; negative: a travel
uniform vec3 view;      // centre in mm, pixels a mm
uniform vec2 size;      // in pixels
uniform vec2 thin;      // half the least width of a bead and of a travel, in pixels; 0: none is drawn
uniform vec4 override;  // a colour for all, where its alpha is above 0
out vec4 tint; out vec3 along; out float radius;
void main() {
  int bead = gl_VertexID / 6, turn = gl_VertexID - 6 * bead;
  ivec2 place = ivec2(bead % ${ACROSS}, bead / ${ACROSS});
  vec4 ends = texelFetch(ends_of, place, 0);
  float half_mm = texelFetch(half_of, place, 0).r;
  int id = turn < 3 ? turn : 6 - turn; // 0 1 2, 3 2 1
  vec2 corner = vec2(float(id & 1), float(id >> 1)) * 2.0 - 1.0;
  bool travel = half_mm < 0.0;
  radius = travel ? thin.y : max(half_mm * view.z, thin.x);
  if (radius <= 0.0) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
  vec2 a = (ends.xy - view.xy) * view.z, b = (ends.zw - view.xy) * view.z;
  float length_px = distance(a, b);
  vec2 d = length_px > 1e-4 ? (b - a) / length_px : vec2(1.0, 0.0);
  float reach = radius + 1.0;
  vec2 at = (corner.x < 0.0 ? a - d * reach : b + d * reach) + vec2(-d.y, d.x) * corner.y * reach;
  along = vec3(corner.x < 0.0 ? -reach : length_px + reach, corner.y * reach, length_px);
  tint = override.a > 0.0 ? override : texelFetch(colour_of, place, 0);
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
  // Null where there is no WebGL2, or only one that a processor draws, unless that is `wanted`.
  static open(canvas, wanted) {
    if (!wanted && !GlPainter.quick) return null;
    const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, preserveDrawingBuffer: true, powerPreference: "high-performance" });
    return gl ? new GlPainter(canvas, gl) : null;
  }

  // Whether there is a WebGL2 that is more than a processor's imitation. Asked of a canvas of its own, since one that
  // has been asked gives nothing else any more.
  static get quick() {
    const gl = document.createElement("canvas").getContext("webgl2", { failIfMajorPerformanceCaveat: true });
    if (!gl) return false;
    const told = gl.getExtension("WEBGL_debug_renderer_info"), name = told ? gl.getParameter(told.UNMASKED_RENDERER_WEBGL) : "";
    gl.getExtension("WEBGL_lose_context")?.loseContext();
    return !/swiftshader|llvmpipe|softpipe|swrast|software|basic render/i.test(name);
  }

  constructor(canvas, gl) {
    this.canvas = canvas; this.gl = gl; this.drawn = -1; this.freed = 0;
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
    this.is = Object.fromEntries(["view", "size", "thin", "override", "ends_of", "half_of", "colour_of"].map((name) => [name, gl.getUniformLocation(program, name)]));
    ["ends_of", "half_of", "colour_of"].forEach((name, unit) => gl.uniform1i(this.is[name], unit));
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    this.tints = gl.createTexture();
    this.shapes = [gl.createTexture(), gl.createTexture()];
    this.laid = [gl.createTexture(), gl.createTexture()];
    this.free = [gl.createTexture(), gl.createTexture()];
    this.filled = false;
  }

  // `parts` numbers for each of `count` beads, as a texture.
  fill(texture, count, [inside, format, type], parts, data) {
    const gl = this.gl, rows = Math.max(1, Math.ceil(count / ACROSS)), whole = new data.constructor(parts * ACROSS * rows);
    whole.set(data);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.texImage2D(gl.TEXTURE_2D, 0, inside, ACROSS, rows, 0, format, type, whole);
  }

  fillShapes([ends, halves], shapes) {
    const gl = this.gl, count = shapes.length / 5, four = new Float32Array(4 * count), one = new Float32Array(count);
    for (let i = 0; i < count; i++) {
      for (let c = 0; c < 4; c++) four[4 * i + c] = shapes[5 * i + c];
      one[i] = shapes[5 * i + 4];
    }
    gl.activeTexture(gl.TEXTURE0);
    this.fill(ends, count, [gl.RGBA32F, gl.RGBA, gl.FLOAT], 4, four);
    this.fill(halves, count, [gl.R32F, gl.RED, gl.FLOAT], 1, one);
  }

  load(shapes, colours) {
    this.job = [shapes, colours];
    this.origin = shapes.middle;
    this.drawn = -1;
    const { all } = shapes, count = all.length / 5;
    // What is to come is drawn without its travels: of what is laid alone there is a second list.
    this.laidBefore = new Int32Array(count + 1);
    for (let i = 0; i < count; i++) this.laidBefore[i + 1] = this.laidBefore[i] + (all[5 * i + 4] >= 0 ? 1 : 0);
    const laid = new Float32Array(5 * this.laidBefore[count]);
    for (let i = 0, p = 0; i < count; i++) {
      if (all[5 * i + 4] >= 0) for (let c = 0; c < 5; c++) laid[p++] = all[5 * i + c];
    }
    this.fillShapes(this.shapes, all);
    this.fillShapes(this.laid, laid);
    this.filled = false;
    this.recolour(colours);
  }

  recolour(colours) {
    const gl = this.gl;
    this.job[1] = colours;
    gl.activeTexture(gl.TEXTURE0 + 2);
    this.fill(this.tints, colours.length / 4, [gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE], 4, colours);
  }

  range([ends, halves], from, to, override, beads, travels) {
    if (to <= from) return;
    const gl = this.gl;
    [ends, halves, this.tints].forEach((texture, unit) => { gl.activeTexture(gl.TEXTURE0 + unit); gl.bindTexture(gl.TEXTURE_2D, texture); });
    gl.uniform4fv(this.is.override, override || [0, 0, 0, 0]);
    gl.uniform2f(this.is.thin, beads, travels);
    gl.drawArrays(gl.TRIANGLES, 6 * from, 6 * (to - from));
  }

  frame(view) {
    const gl = this.gl, ratio = this.canvas.width / view.width;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.uniform3f(this.is.view, view.cx - this.origin[0], view.cy - this.origin[1], view.scale * ratio);
    gl.uniform2f(this.is.size, this.canvas.width, this.canvas.height);
    return ratio;
  }

  // What is wanted, anew or by what is new since the last frame; whether that is all, which it is.
  draw(view, { drawn, freed }, style, stale) {
    if (stale || drawn < this.drawn || this.drawn < 0) this.redraw(view, drawn, freed, style);
    else this.advance(view, drawn, freed, style);
    return true;
  }

  // All anew: what is to come, what of it can be laid now, and the first `drawn` of what is printed.
  redraw(view, drawn, freed, style) {
    if (this.lost) return;
    const gl = this.gl, ratio = this.frame(view);
    gl.clearColor(...style.ground, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    if (style.ghosts) this.range(this.laid, this.laidBefore[drawn], this.laidBefore.at(-1), style.ghost, 0.4 * ratio, 0);
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
    if (style.free && !this.filled) { this.fillShapes(this.free, this.job[0].free.shapes); this.filled = true; }
    if (style.free) this.range(this.free, this.freed, freed, style.free, 0.5 * ratio, 0);
    this.freed = freed;
  }
}
