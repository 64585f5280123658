// SPDX-License-Identifier: GPL-3.0-or-later
// The surface of the brain in 3-D, by WebGL2: parallel projection, turned by dragging or by arrow keys. The tumour shines
// through. Places are patient RAS, mm.

const VERTEX = `#version 300 es
in vec3 place, normal, colour;
uniform mat3 turn;   // rows: right, up and towards the eye
uniform vec3 centre;
uniform vec2 scale;  // per mm; of a picture from -1 to 1
uniform float depth;
out vec3 shade;
void main() {
  vec3 p = turn * (place - centre);
  gl_Position = vec4(scale * p.xy, -depth * p.z, 1.0);
  shade = colour * (0.35 + 0.65 * abs((turn * normal).z));
}`;
const FRAGMENT = `#version 300 es
precision mediump float;
in vec3 shade;
uniform float opacity;
out vec4 pixel;
void main() { pixel = vec4(shade, opacity); }`;
const WORDS = [["right", "left"], ["front", "back"], ["top", "bottom"]];

function normals(vertices, triangles) {
  const sums = new Float32Array(vertices.length);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]], e = [], f = [];
    for (let d = 0; d < 3; ++d) { e.push(vertices[b + d] - vertices[a + d]); f.push(vertices[c + d] - vertices[a + d]); }
    for (let d = 0; d < 3; ++d) {
      const n = e[(d + 1) % 3] * f[(d + 2) % 3] - e[(d + 2) % 3] * f[(d + 1) % 3];
      for (const at of [a, b, c]) sums[at + d] += n;
    }
  }
  for (let v = 0; v < sums.length; v += 3) {
    const length = Math.hypot(sums[v], sums[v + 1], sums[v + 2]) || 1;
    for (let d = 0; d < 3; ++d) sums[v + d] /= length;
  }
  return sums;
}

// null where the browser has no WebGL2.
export function surfaceView(canvas, caption) {
  const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) return null;
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return null;
  gl.useProgram(program);
  const at = (name) => gl.getUniformLocation(program, name);
  let parts = [], centre = [0, 0, 0], half = 100, yaw = 0, pitch = 0, zoom = 1;

  function buffer(name, values) {
    const made = gl.createBuffer(), where = gl.getAttribLocation(program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, made);
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(where);
    gl.vertexAttribPointer(where, 3, gl.FLOAT, false, 0, 0);
    return made;
  }
  function part(vertices, triangles, colours, opacity) {
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const buffers = [buffer("place", vertices), buffer("normal", normals(vertices, triangles)), buffer("colour", colours)];
    const index = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, index);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(triangles), gl.STATIC_DRAW);
    return { array, buffers: [...buffers, index], count: triangles.length, opacity };
  }
  // Rows: right, up, towards the eye.
  function turn() {
    const [sy, cy, sp, cp] = [Math.sin(yaw), Math.cos(yaw), Math.sin(pitch), Math.cos(pitch)];
    return [[cy, sy, 0], [sp * sy, -sp * cy, cp], [cp * sy, -cp * cy, -sp]];
  }
  function draw() {
    const rows = turn(), towards = rows[2], { width, height } = canvas, per = zoom / half;
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix3fv(at("turn"), false, [0, 1, 2].flatMap((c) => rows.map((row) => row[c])));
    gl.uniform3fv(at("centre"), centre);
    gl.uniform2f(at("scale"), per * Math.min(1, height / width), per * Math.min(1, width / height));
    gl.uniform1f(at("depth"), 0.2 / half);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    for (const each of parts) {
      if (each.opacity < 1) gl.disable(gl.DEPTH_TEST); else gl.enable(gl.DEPTH_TEST);
      gl.uniform1f(at("opacity"), each.opacity);
      gl.bindVertexArray(each.array);
      gl.drawElements(gl.TRIANGLES, each.count, gl.UNSIGNED_INT, 0);
    }
    const seen = WORDS.map((words, c) => (Math.abs(towards[c]) < 0.38 ? "" : words[towards[c] > 0 ? 0 : 1])).filter(Boolean);
    caption.textContent = `3-D, from the ${seen.join(", ")}`;
  }
  const look = (towards) => {  // from there
    const length = Math.hypot(...towards) || 1;
    pitch = -Math.asin(towards[2] / length);
    yaw = Math.atan2(towards[0], -towards[1]);
  };
  canvas.addEventListener("pointermove", (event) => {
    if (!(event.buttons & 1)) return;
    yaw -= 0.01 * event.movementX;
    pitch = Math.max(-1.57, Math.min(1.57, pitch - 0.01 * event.movementY));
    draw();
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom = Math.max(0.5, Math.min(8, zoom * (event.deltaY < 0 ? 1.1 : 1 / 1.1)));
    draw();
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const moves = { ArrowLeft: [0.17, 0], ArrowRight: [-0.17, 0], ArrowUp: [0, 0.17], ArrowDown: [0, -0.17] };
    if (!moves[event.key]) return;
    event.preventDefault();
    yaw += moves[event.key][0];
    pitch = Math.max(-1.57, Math.min(1.57, pitch + moves[event.key][1]));
    draw();
  });
  return {
    // A new patient: seen from over the tumour.
    aim(low, high, tumour) {
      centre = low.map((v, c) => (v + high[c]) / 2);
      half = 0.5 * Math.max(...high.map((v, c) => v - low[c]));
      zoom = 1;
      look(tumour.map((v, c) => v - centre[c]));
    },
    // surfaces: { vertices, triangles, colours (3 per vertex, 0 to 1), opacity }, the opaque ones first.
    show(surfaces) {
      for (const each of parts) {
        gl.deleteVertexArray(each.array);
        for (const one of each.buffers) gl.deleteBuffer(one);
      }
      parts = surfaces.map((s) => part(s.vertices, s.triangles, s.colours, s.opacity));
      draw();
    },
  };
}
