// The picture itself: textures and programs, drawn anew whenever something changes.

const DOTS = ["#e4572e", "#2e86ab", "#8e44ad", "#17a398", "#c0ca33", "#f18f01", "#ad1457", "#607d8b"];
const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255);

class Picture {
  constructor(canvas, cells) {
    this.canvas = canvas;
    this.cells = cells;
    const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("this browser or its graphics driver does not offer WebGL2");
    this.gl = gl;
    const most = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    if (Math.max(cells.count, cells.nodes) * 2 > most * ACROSS) throw new Error("the mesh is too large for this graphics driver");
    this.cellProgram = this.program(CELL_VERTEX, CELL_FRAGMENT);
    this.markProgram = this.program(MARK_VERTEX, MARK_FRAGMENT);
    const { fine, arrays } = cells.scene;
    this.places = ["beforeHigh", "afterHigh"].map((_, state) => this.placesTexture(cells.high[state]));
    this.places.push(...[0, 1].map((state) => (fine ? this.placesTexture(cells.low[state]) : this.texture(new Float32Array(4), 4))));
    this.layers = new Map();
    this.marks = new Map();
    if (arrays.lines.length) this.marks.set("lines", { list: this.texture(arrays.lines, 1), count: arrays.lines.length });
  }

  program(vertex, fragment) {
    const { gl } = this;
    const made = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    const places = {};
    const count = gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS);
    for (let k = 0; k < count; k++) {
      const name = gl.getActiveUniform(made, k).name.replace("[0]", "");
      places[name] = gl.getUniformLocation(made, name);
    }
    return { made, places };
  }

  /** An array of 1, 2 or 4 numbers a value as a texture. */
  texture(array, width, old = null) {
    const { gl } = this;
    const whole = array instanceof Uint32Array;
    const [inner, format] = whole
      ? { 1: [gl.R32UI, gl.RED_INTEGER], 4: [gl.RGBA32UI, gl.RGBA_INTEGER] }[width]
      : { 2: [gl.RG32F, gl.RG], 4: [gl.RGBA32F, gl.RGBA] }[width];
    const rows = Math.max(1, Math.ceil(array.length / width / ACROSS));
    const padded = new array.constructor(rows * ACROSS * width);
    padded.set(array);
    const texture = old || gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, inner, ACROSS, rows, 0, format, whole ? gl.UNSIGNED_INT : gl.FLOAT, padded);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
    return texture;
  }

  placesTexture(columns) {
    const { nodes, dimension } = this.cells;
    const values = new Float32Array(4 * nodes);
    for (let d = 0; d < dimension; d++) for (let i = 0; i < nodes; i++) values[4 * i + d] = columns[d * nodes + i];
    return this.texture(values, 4);
  }

  /** Triangles by a name; null takes them away. */
  setLayer(name, triangles) {
    const old = this.layers.get(name);
    if (triangles && triangles.length) {
      this.layers.set(name, { texture: this.texture(triangles, 4, old && old.texture), count: (3 * triangles.length) / 4 });
    } else if (old) {
      this.gl.deleteTexture(old.texture);
      this.layers.delete(name);
    }
  }

  setDots(name, nodes, kind) {
    const old = this.marks.get(name);
    if (old) this.gl.deleteTexture(old.list);
    this.marks.delete(name);
    if (nodes) this.marks.set(name, { list: this.texture(nodes, 1), count: nodes.length, paint: rgb(DOTS[kind % DOTS.length]) });
  }

  /** (2 per cell) the measure before and after, 0 to 1; −1 inverted, −2 not known. */
  setValues(values) {
    this.values = this.texture(values, 2, this.values);
  }

  common({ made, places }, look) {
    const { gl } = this;
    gl.useProgram(made);
    this.places.forEach((texture, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.uniform1i(places[["beforeHigh", "afterHigh", "beforeLow", "afterLow"][unit]], unit);
    });
    const { camera } = look;
    const high = camera.centre.map(Math.fround);
    gl.uniform3fv(places.centreHigh, high);
    gl.uniform3fv(places.centreLow, camera.centre.map((value, k) => value - high[k]));
    gl.uniformMatrix3fv(places.turn, true, camera.rows.flat());
    gl.uniform2f(places.scale, (2 * camera.zoom) / camera.width, (2 * camera.zoom) / camera.height);
    const reach = 4 * Math.min(1, (2 * Math.hypot(camera.width, camera.height)) / camera.zoom + 0.02);
    gl.uniform1f(places.depth, 1 / reach);
    gl.uniform1f(places.mixing, look.mixing);
    gl.uniform1i(places.fine, this.cells.low ? 1 : 0);
  }

  draw(look, picking = false) {
    const { gl, canvas } = this;
    const ratio = look.camera.width ? canvas.width / look.camera.width : 1;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...(picking ? [0, 0, 0, 0] : [...look.paper, 1]));
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.drawCells(look, picking, ratio);
    if (!picking) this.drawMarks(look, ratio);
  }

  drawCells(look, picking, ratio) {
    const { gl, cells } = this;
    const { colours } = cells.scene;
    const { places } = this.cellProgram;
    const flatland = cells.dimension === 2;
    this.common(this.cellProgram, look);
    const flags = { flatland, displaced: look.displaced, picking, edged: look.edged };
    for (const [name, value] of Object.entries(flags)) gl.uniform1i(places[name], value ? 1 : 0);
    gl.uniform1f(places.greatest, look.greatest || 1);
    gl.uniform1f(places.pixel, ratio);
    gl.uniform3fv(places.good, colours.good.flatMap(rgb));
    gl.uniform3fv(places.displacement, colours.moved.flatMap(rgb));
    gl.uniform3fv(places.inverted, rgb(colours.inverted));
    gl.uniform3fv(places.other, rgb(colours.other));
    gl.activeTexture(gl.TEXTURE5);
    gl.bindTexture(gl.TEXTURE_2D, this.values);
    gl.uniform1i(places.values, 5);
    gl.uniform1i(places.triangles, 4);
    for (const [name, { texture, count }] of this.layers) {
      this.clip(places, name === "shell" ? look : { clip: null });
      gl.activeTexture(gl.TEXTURE4);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.drawArrays(gl.TRIANGLES, 0, count);
    }
  }

  /** Takes away what lies before the plane of the cut. */
  clip(places, { clip, camera }) {
    const { gl } = this;
    gl.uniform1i(places.clipped, clip ? 1 : 0);
    if (!clip) return;
    const side = camera.rows[2][clip.axis] < 0 ? -1 : 1;
    const plane = [0, 0, 0, side * (clip.offset - camera.centre[clip.axis])];
    plane[clip.axis] = side;
    gl.uniform4fv(places.clip, plane);
  }

  drawMarks(look, ratio) {
    const { gl, cells } = this;
    const { places } = this.markProgram;
    this.common(this.markProgram, look);
    const flatland = cells.dimension === 2;
    if (flatland) gl.disable(gl.DEPTH_TEST);
    this.clip(places, look);
    gl.uniform1f(places.forward, flatland ? 0 : 2e-3);
    gl.uniform1f(places.size, 7 * ratio);
    gl.uniform3fv(places.rim, look.paper);
    for (const [name, { list, count, paint }] of this.marks) {
      gl.activeTexture(gl.TEXTURE4);
      gl.bindTexture(gl.TEXTURE_2D, list);
      gl.uniform1i(places.list, 4);
      gl.uniform1i(places.round, paint ? 1 : 0);
      gl.uniform3fv(places.paint, paint || look.ink);
      gl.drawArrays(name === "lines" ? gl.LINES : gl.POINTS, 0, count);
    }
  }

  /** The cell at (x, y), in pixels of the page from the upper left corner; −1 for none. */
  cellAt(look, x, y) {
    const { gl, canvas } = this;
    const frame = gl.createFramebuffer();
    const [colour, depth] = [gl.createRenderbuffer(), gl.createRenderbuffer()];
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    for (const [buffer, format, point] of [
      [colour, gl.RGBA8, gl.COLOR_ATTACHMENT0],
      [depth, gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT],
    ]) {
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, format, canvas.width, canvas.height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, point, gl.RENDERBUFFER, buffer);
    }
    this.draw(look, true);
    const ratio = canvas.width / look.camera.width;
    const code = new Uint8Array(4);
    gl.readPixels(Math.floor(x * ratio), canvas.height - 1 - Math.floor(y * ratio), 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, code);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(frame);
    gl.deleteRenderbuffer(colour);
    gl.deleteRenderbuffer(depth);
    return code[0] + 256 * (code[1] + 256 * (code[2] + 256 * code[3])) - 1;
  }
}
