// SPDX-License-Identifier: GPL-3.0-or-later
// The page of `brainshift view`. What it may show it takes from the events alone; it goes grey when
// none comes for SILENCE_MS, and when events wait on their way: an old picture must not look current.
// Places are patient RAS, mm. x: in the MRI (undeformed), p: in the room now (deformed), p = x + u(x).

import { surfaceView } from "./surface.js";

const SILENCE_MS = 700;
const LATE_MS = 700;
const SWAP_MS = 500;  // a field that is announced is fetched and drawn within this, or the old one goes grey
const PX_PER_MM = 1.5;
const MARGIN_MM = 4;
// "across" runs along the axis from the picture's right edge to its left (radiological view).
const PLANES = {
  axial: { across: 0, up: 1, normal: 2, letters: ["R", "L", "A", "P"] },
  coronal: { across: 0, up: 2, normal: 1, letters: ["R", "L", "S", "I"] },
  sagittal: { across: 1, up: 2, normal: 0, letters: ["A", "P", "S", "I"] },
};
const MAPS = {  // stops of viridis, magma and cividis; colour-blind safe
  u: { name: "displacement", unit: "mm", stops: ["440154", "3b528b", "21918c", "5ec962", "fde725"] },
  sd: { name: "standard deviation", unit: "mm", stops: ["000004", "51127c", "b73779", "fc8961", "fcfdbf"] },
  known: { name: "what the data know", unit: "%", stops: ["00224e", "434e6c", "7d7c78", "bcae6c", "fee838"] },
  volume: { name: "local volume change", unit: "%", signed: true, stops: ["2166ac", "92c5de", "f7f7f7", "f4a582", "b2182b"] },
};
for (const map of Object.values(MAPS)) map.table = colours(map.stops);

const byId = (id) => document.getElementById(id);
const chosen = (name) => document.querySelector(`input[name=${name}]:checked`).value;

let state = null;        // of the newest event
let heardAt = -Infinity; // when it came, performance.now()
let earliest = Infinity; // smallest of (arrival - clock of the publisher): an event without a wait
let late = 0;            // how much longer than that the newest was on its way
let model = null;        // { model_id, grids, inside, mri, tumour, brain }
let field = null;        // { of, u, sd, known, vertices, volume (when it was asked for) }
let announcedAt = 0;     // when the newest event's field was first heard of
let history = { of: "", count: -1, points: [] };
let cross = [0, 0, 0];   // p of the three slices
let loading = false;
let advice = null;       // { of, target, before_mm, candidates } or { of, reason }; asked for while its box is checked

function colours(stops) {
  const table = new Uint8Array(3 * 256);
  for (let i = 0; i < 256; ++i) {
    const at = (i / 255) * (stops.length - 1), low = Math.min(Math.floor(at), stops.length - 2);
    for (let c = 0; c < 3; ++c) {
      const part = (k) => parseInt(stops[k].slice(2 * c, 2 * c + 2), 16);
      table[3 * i + c] = part(low) + (at - low) * (part(low + 1) - part(low));
    }
  }
  return table;
}

// ---------- what comes from the program ----------

async function get(path) {
  const answer = await fetch(path, { cache: "no-store" });
  if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
  return answer;
}

async function loadModel() {
  const described = await get("model"), made = await described.json();
  const of = described.headers.get("Of");
  const bytes = async (path) => {
    const answer = await get(path);
    if (answer.headers.get("Of") !== of) throw new Error("another model came meanwhile");
    return new Uint8Array(await answer.arrayBuffer());
  };
  [made.inside, made.grey] = await Promise.all([bytes("inside"), made.mri ? bytes("mri") : null]);
  const last = made.field.dims.map((n, i) => made.field.origin_mm[i] + (n - 1) * made.field.spacing_mm);
  made.low = made.field.origin_mm.map((v) => v + 8 - MARGIN_MM);  // the field's grid has a margin of 10 mm
  made.middle = last.map((v, i) => (v + made.field.origin_mm[i]) / 2);
  made.high = last.map((v) => v - 8 + MARGIN_MM);
  field = null;
  model = made;
  cross = [...made.centre_mm];
  for (const [name, plane] of Object.entries(PLANES)) {
    const canvas = byId(name);
    canvas.width = Math.round(PX_PER_MM * (model.high[plane.across] - model.low[plane.across]));
    canvas.height = Math.round(PX_PER_MM * (model.high[plane.up] - model.low[plane.up]));
  }
  surface?.aim(model.low, model.high, model.centre_mm);
  byId("structures-label").hidden = STRUCTURES.every(([name]) => model[name].triangles.length === 0);
}

async function loadField() {
  const answer = await get("field"), of = answer.headers.get("Of"), bytes = await answer.arrayBuffer();
  const n = model.inside.length;
  if (bytes.byteLength !== 9 * n) throw new Error("a field of another grid");
  const made = { of, u: new Float32Array(3 * n), sd: new Uint16Array(bytes, 6 * n, n),
                 known: new Uint8Array(bytes, 8 * n, n) };
  const shorts = new Int16Array(bytes, 0, 3 * n);
  for (let i = 0; i < 3 * n; ++i) made.u[i] = shorts[i] / 512;
  made.vertices = moved(made, model.tumour.vertices);
  for (const [name] of STRUCTURES) made[name] = moved(made, model[name].vertices);
  made.most = greatest(made, n);
  field = made;
}

function moved(of, vertices) {
  const made = new Float32Array(vertices.length), u = [0, 0, 0];
  for (let v = 0; v < made.length; v += 3) {
    displacement(of, vertices[v], vertices[v + 1], vertices[v + 2], u);
    for (let c = 0; c < 3; ++c) made[v + c] = vertices[v + c] + u[c];
  }
  return made;
}

// det(I + grad u) - 1 at every voxel with six neighbours in the brain, by central differences; NaN at the others.
function volumeChange(of) {
  const { dims, spacing_mm: s } = model.field, inside = model.inside, n = inside.length;
  const steps = [1, dims[0], dims[0] * dims[1]], made = new Float32Array(n).fill(NaN), g = new Float64Array(9);
  let most = 0;
  for (let v = steps[2]; v < n - steps[2]; ++v) {
    if (!inside[v] || !steps.every((step) => inside[v - step] && inside[v + step])) continue;
    for (let axis = 0; axis < 3; ++axis) {
      const before = 3 * (v - steps[axis]), behind = 3 * (v + steps[axis]);
      for (let c = 0; c < 3; ++c) g[3 * c + axis] = (of.u[behind + c] - of.u[before + c]) / (2 * s) + (c === axis ? 1 : 0);
    }
    made[v] = g[0] * (g[4] * g[8] - g[5] * g[7]) - g[1] * (g[3] * g[8] - g[5] * g[6]) + g[2] * (g[3] * g[7] - g[4] * g[6]) - 1;
    most = Math.max(most, Math.abs(made[v]));
  }
  of.most.volume = Math.max(0.02, Math.ceil(50 * most) / 50);
  return made;
}

function greatest(made, n) {
  let u2 = 0, sd = 0;
  for (let i = 0; i < n; ++i) {
    if (!model.inside[i]) continue;
    u2 = Math.max(u2, made.u[3 * i] ** 2 + made.u[3 * i + 1] ** 2 + made.u[3 * i + 2] ** 2);
    if (made.sd[i] < 65535) sd = Math.max(sd, made.sd[i]);
  }
  const round = (mm) => Math.max(0.5, Math.ceil(2 * mm) / 2);
  return { u: round(Math.sqrt(u2)), sd: round(sd / 1000), known: 1 };
}

// One at a time; what has changed meanwhile is loaded after it.
async function load() {
  if (loading || !state) return;
  const newModel = state.model_id && model?.model_id !== state.model_id;
  const newField = state.field && field?.of !== state.field;
  const newHistory = state.model_id && (history.count !== state.history || history.of !== state.session);
  if (!newModel && !newField && !newHistory) return;
  loading = true;
  try {
    if (newModel) await loadModel();
    if (newField && state.model_id === model?.model_id) await loadField();
    if (newHistory) {
      const count = state.history, answer = await get("history");
      history = { of: answer.headers.get("Of"), count, points: await answer.json() };
    }
    if (newModel || newField) {
      draw();
      // For whoever measures: which field is on the screen, and since when (ms since 1970).
      requestAnimationFrame(() => {
        document.body.dataset.drawn = `${field?.of ?? ""} ${Date.now()}`;
        if (!slicesAlone) return;
        slicesAlone = false;
        setTimeout(draw);
      });
    } else {
      drawStrips();
    }
  } catch (error) {
    console.warn(String(error));  // the next event tries again
  } finally {
    loading = false;
  }
}

function listen() {
  const events = new EventSource("events");
  events.onmessage = (event) => {
    const before = state?.field, heardBefore = heardAt;
    state = JSON.parse(event.data);
    heardAt = performance.now();
    if (state.field !== before) announcedAt = heardAt;
    const way = heardAt - state.clock_ms;
    // Two clocks, as through a tunnel, drift apart by less than 200 us a second.
    earliest = Math.min(Number.isFinite(heardBefore) ? earliest + 2e-4 * (heardAt - heardBefore) : way, way);
    late = way - earliest;
    judge();
    load();
  };
}

// ---------- where to measure next ----------

const ADVICE_MS = 700, NUMBERED = 5;
let asking = false;
async function askForAdvice() {
  if (asking || !state?.advises || !byId("advice").checked) return;
  asking = true;
  try {
    const answer = await (await get("advice")).json(), of = answer.of ?? "";
    if (of === (advice?.of ?? "") && answer.reason === advice?.reason) return;
    advice = of ? answer : null;
    tellAdvice();
    draw();
  } catch (error) {
    console.warn(String(error));  // asked again soon
  } finally {
    asking = false;
  }
}
// Of the field on the screen; an older one's stays for as long as it is worked out anew, and says so.
function standingAdvice() {
  const of = drawable();
  return of && advice?.candidates && byId("advice").checked && advice.of.startsWith(state.session + ".") ? advice : null;
}
function tellAdvice() {
  byId("advice-list").hidden = !byId("advice").checked;
  const shown = standingAdvice(), caption = byId("advice-caption");
  if (!shown) {
    caption.textContent = `Where to measure next: ${advice?.reason ?? (drawable() ? "being computed" : "no field")}`;
  } else {
    const update = shown.of.split(".").at(-1), newer = shown.of === state.field ? "" : `, of update ${update}`;
    caption.textContent = `Where to measure next: sd at the ${shown.target} ${shown.before_mm.toFixed(2)} mm now${newer}`;
    if (!shown.candidates.some((one) => one.less_mm >= 0.005)) caption.textContent += "; none of these would take off 0.01 mm";
  }
  rows(byId("advice-rows"), shown ? shown.candidates.slice(0, NUMBERED) : [], (one) => {
    const row = document.createElement("tr"), cells = [0, 1, 2].map(() => document.createElement("td"));
    const button = Object.assign(document.createElement("button"), { textContent: `${shown.candidates.indexOf(one) + 1} ${one.name}`, title: "Move the cross there" });
    button.addEventListener("click", () => { cross = placeNow(one.where_mm); draw(); });
    cells[0].append(button);
    cells[1].textContent = one.less_mm.toFixed(2);
    cells[2].textContent = one.sd_mm.toFixed(2);
    row.append(...cells);
    return row;
  });
}
// Where a place of the MRI is in the brain that is drawn.
function placeNow(x) {
  const of = chosen("brain") === "now" ? drawable() : null, u = [0, 0, 0];
  if (of) displacement(of, x[0], x[1], x[2], u);
  return x.map((v, c) => v + u[c]);
}
// The best, numbered: filled in the slice's plane, hollow where the place lies in front of or behind it.
function drawAdvice(context, plane) {
  const shown = standingAdvice();
  if (!shown) return;
  context.font = "bold 12px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  for (let i = Math.min(NUMBERED, shown.candidates.length); i-- > 0;) {
    const p = placeNow(shown.candidates[i].where_mm), [x, y] = toPixel(plane, p);
    const away = Math.abs(p[plane.normal] - cross[plane.normal]);
    context.globalAlpha = away < 4 ? 1 : 0.45;
    context.beginPath();
    context.arc(x, y, 9, 0, 2 * Math.PI);
    context.fillStyle = away < 4 ? "#ffb000" : "#00000080";
    context.fill();
    context.strokeStyle = "#ffb000";
    context.lineWidth = 1.5;
    context.stroke();
    context.fillStyle = away < 4 ? "#000" : "#ffb000";
    context.fillText(String(i + 1), x, y + 0.5);
  }
  context.globalAlpha = 1;
  context.textBaseline = "alphabetic";
}

// ---------- whether it may be shown ----------

// "live", "grey": show it, but not as current; "none": there is no field to show.
function standing() {
  const silence = performance.now() - heardAt;
  if (!state || silence > SILENCE_MS || late > LATE_MS) {
    return { show: "grey", why: state ? `no word from brainshift view for ${(Math.max(silence, late) / 1000).toFixed(1)} s`
                                      : "waiting for brainshift view" };
  }
  const fits = drawable() && (field.of === state.field || performance.now() - announcedAt < SWAP_MS);
  switch (state.currency) {
    case "current": case "aged": case "superseded": return { show: fits ? "live" : "grey", why: fits ? state.reason : "its field is on its way" };
    case "none": case "expired": return { show: "none", why: state.reason };
    default: return { show: "grey", why: state.reason };
  }
}

let drawn = "";
function judge() {
  const { show, why } = standing();
  document.body.className = show === "live" ? "" : "grey";
  const verdict = byId("verdict");
  let text, kind;
  const recorded = state?.recorded ? "RECORDED · " : "";
  if (show !== "live") {
    const word = show === "none" ? (state.currency === "expired" ? "EXPIRED" : "NO FIELD") : "NOT CURRENT";
    [text, kind] = [`${word}${why ? ": " + why : ""}`, ""];
  } else {
    kind = state.quality === "good" && state.currency !== "aged" ? "good" : "caution";
    text = state.quality.toUpperCase();
    if (state.quality !== "good" && state.quality_reason) text += ": " + state.quality_reason;
    if (state.currency === "aged") text = `AGED: ${why} · ${text}`;
    const shown = state.shown;
    if (shown?.motion_mm != null) {
      const digits = shown.motion_sd != null && shown.motion_sd < 0.1 ? 2 : 1;
      text += ` · tumour moved ${shown.motion_mm.toFixed(digits)}${shown.motion_sd == null ? "" : " ± " + shown.motion_sd.toFixed(digits)} mm`;
    }
  }
  text = recorded + text;
  if (verdict.textContent !== text) verdict.textContent = text;
  verdict.className = kind;
  document.title = text;
  if (state) {
    const parts = [];
    if (show === "live" && state.age_s != null) parts.push(`data ${state.age_s.toFixed(1)} s old`);
    if (state.method) parts.push(`method ${state.method}`, `boundary ${state.boundary}`);
    if (show === "live" && state.shown) parts.push(`update ${state.shown.update}${state.shown.late ? ", LATE" : ""}`);
    if (state.newest_failure) parts.push(`newest update unusable: ${state.newest_failure}`);
    if (state.case_id) parts.push(`case ${state.case_id}`);
    byId("details").textContent = parts.join(" · ");
    byId("origin").textContent = `${state.endpoint}, model ${state.model_id || "none"}`;
    tell();
  }
  const key = `${show} ${state?.model_id}`;
  if (key !== drawn) { drawn = key; draw(); }
}

function rows(parent, all, make) {
  const text = JSON.stringify(all);
  if (parent.dataset.text === text) return;
  parent.dataset.text = text;
  parent.replaceChildren(...all.map(make));
}
function tell() {
  const number = (value, digits) => (value == null ? "" : value.toFixed(digits));
  rows(byId("sources"), state.sources.map((s) => [
    s.name + (s.contradicts ? " CONTRADICTS the others" : ""), number(s.per_s, 1), number(s.age_s, 1), String(s.dropped),
    s.data ? `${s.data} (${s.outliers})` : ""]), (cells) => {
    const row = document.createElement("tr");
    row.append(...cells.map((cell) => Object.assign(document.createElement("td"), { textContent: cell })));
    return row;
  });
  rows(byId("left-out"), state.left_out, (each) => Object.assign(document.createElement("li"), {
    textContent: `${each.part}: ${each.reason}${each.error ? " (" + each.error + ")" : ""}` }));
  byId("advice-label").hidden = !state.advises;
  tellAdvice();
}

// ---------- between the voxels ----------

// Calls visit(voxel, weight) for the eight voxels around a place; false outside of the grid.
function around(grid, x, y, z, visit) {
  const { dims, origin_mm: o, spacing_mm: s } = grid;
  const fx = (x - o[0]) / s, fy = (y - o[1]) / s, fz = (z - o[2]) / s;
  const i = Math.floor(fx), j = Math.floor(fy), k = Math.floor(fz);
  if (!(i >= 0 && j >= 0 && k >= 0 && i < dims[0] - 1 && j < dims[1] - 1 && k < dims[2] - 1)) return false;
  const a = fx - i, b = fy - j, c = fz - k, nx = dims[0], nxy = nx * dims[1], at = i + nx * j + nxy * k;
  visit(at, (1 - a) * (1 - b) * (1 - c)); visit(at + 1, a * (1 - b) * (1 - c));
  visit(at + nx, (1 - a) * b * (1 - c)); visit(at + nx + 1, a * b * (1 - c));
  visit(at + nxy, (1 - a) * (1 - b) * c); visit(at + nxy + 1, a * (1 - b) * c);
  visit(at + nxy + nx, (1 - a) * b * c); visit(at + nxy + nx + 1, a * b * c);
  return true;
}
// The same for the vectors of a field, written out: it is called a million times per picture.
function displacement(of, x, y, z, u) {
  const { dims, origin_mm: o, spacing_mm: s } = model.field, nx = 3 * dims[0], nxy = nx * dims[1];
  const fx = (x - o[0]) / s, fy = (y - o[1]) / s, fz = (z - o[2]) / s;
  const i = Math.floor(fx), j = Math.floor(fy), k = Math.floor(fz);
  u[0] = u[1] = u[2] = 0;
  if (!(i >= 0 && j >= 0 && k >= 0 && i < dims[0] - 1 && j < dims[1] - 1 && k < dims[2] - 1)) return;
  const a = fx - i, b = fy - j, c = fz - k, at = 3 * i + nx * j + nxy * k, values = of.u;
  const w00 = (1 - b) * (1 - c), w10 = b * (1 - c), w01 = (1 - b) * c, w11 = b * c;
  for (let d = 0; d < 3; ++d) {
    const v = at + d;
    u[d] = (1 - a) * (w00 * values[v] + w10 * values[v + nx] + w01 * values[v + nxy] + w11 * values[v + nxy + nx]) +
           a * (w00 * values[v + 3] + w10 * values[v + nx + 3] + w01 * values[v + nxy + 3] + w11 * values[v + nxy + nx + 3]);
  }
}
// Where p was in the MRI: x = p - u(x), by repetition from u, which becomes u(x). A brain's strain is well below 1.
function origin(of, p, x, u = [0, 0, 0]) {
  if (!of) u[0] = u[1] = u[2] = 0;
  for (let turn = 0; turn < 8; ++turn) {
    for (let c = 0; c < 3; ++c) x[c] = p[c] - u[c];
    if (!of) return;
    const [a, b, c] = u;
    displacement(of, x[0], x[1], x[2], u);
    if (Math.abs(a - u[0]) + Math.abs(b - u[1]) + Math.abs(c - u[2]) < 0.01) return;
  }
}
function grey(x) {
  if (!model.mri) return isInside(x) ? 96 : 0;
  let sum = 0;
  around(model.mri, x[0], x[1], x[2], (v, w) => { sum += w * model.grey[v]; });
  return sum;
}
function isInside(x) {
  const { dims, origin_mm: o, spacing_mm: s } = model.field;
  const i = Math.round((x[0] - o[0]) / s), j = Math.round((x[1] - o[1]) / s), k = Math.round((x[2] - o[2]) / s);
  if (i < 0 || j < 0 || k < 0 || i >= dims[0] || j >= dims[1] || k >= dims[2]) return false;
  return model.inside[i + dims[0] * (j + dims[1] * k)] === 1;
}
// mm, 0 to 1 of what is known, and the part by which the volume has changed; NaN where there is none.
function value(of, map, x) {
  if (map === "u") {
    const u = [0, 0, 0];
    displacement(of, x[0], x[1], x[2], u);
    return Math.hypot(u[0], u[1], u[2]);
  }
  if (map === "volume") {
    of.volume ??= volumeChange(of);
    let sum = 0, weight = 0;
    around(model.field, x[0], x[1], x[2], (v, w) => {
      if (!Number.isNaN(of.volume[v])) { sum += w * of.volume[v]; weight += w; }
    });
    return weight > 0 ? sum / weight : NaN;
  }
  const [numbers, none, scale] = map === "sd" ? [of.sd, 65535, 1000] : [of.known, 255, 250];
  let sum = 0, weight = 0;
  around(model.field, x[0], x[1], x[2], (v, w) => {
    if (numbers[v] !== none) { sum += w * numbers[v]; weight += w; }
  });
  return weight > 0 ? sum / weight / scale : NaN;
}

// ---------- slices ----------

const toPixel = (plane, p) => [PX_PER_MM * (model.high[plane.across] - p[plane.across]), PX_PER_MM * (model.high[plane.up] - p[plane.up])];
function toPlace(plane, px, py) {
  const p = [...cross];
  p[plane.across] = model.high[plane.across] - px / PX_PER_MM;
  p[plane.up] = model.high[plane.up] - py / PX_PER_MM;
  return p;
}
// The field that may be drawn: of the running session, and none once it has expired.
function drawable() {
  const over = !field || !state || ["none", "expired"].includes(state.currency);
  return over || model.model_id !== state.model_id || !field.of.startsWith(state.session + ".") ? null : field;
}

function draw() {
  if (!model) return;
  const of = drawable(), map = chosen("map"), now = chosen("brain") === "now";
  for (const [name, plane] of Object.entries(PLANES)) drawSlice(byId(name), plane, of, map, now);
  if (!slicesAlone) drawSurface(of, map, now);
  drawLegend(of, map);
  drawStrips();
  point(cross);
}

// 0 to 255 of the map's colours, NaN where there is no value.
function shade(of, map, x) {
  const found = value(of, map, x), share = found / of.most[map];
  return Math.max(0, Math.min(255, Math.round(MAPS[map].signed ? 127.5 * (1 + share) : 255 * share)));
}

// Inside the brain, of models that have them, with their colours in the slices.
const STRUCTURES = [["septa", "#ffd166"], ["ventricles", "#4cc9f0"]];

let slicesAlone = true;  // at first: WebGL without a graphics card takes its time
let surfaceShown = "";  // what of what; the cross changes nothing of it
function drawSurface(of, map, now) {
  const key = `${model.model_id} ${of?.of} ${map} ${now} ${byId("tumour").checked}`;
  if (!surface || key === surfaceShown) return;
  surfaceShown = key;
  const { vertices, triangles } = model.brain, n = vertices.length / 3, colours = new Float32Array(3 * n).fill(0.62);
  const table = MAPS[map]?.table, x = [0, 0, 0];
  for (let v = 0; of && table && v < n; ++v) {
    // A little inwards: the grid has no value at the very boundary.
    for (let c = 0; c < 3; ++c) x[c] = vertices[3 * v + c] + 0.03 * (model.middle[c] - vertices[3 * v + c]);
    const colour = 3 * shade(of, map, x);
    if (Number.isNaN(colour)) continue;
    for (let c = 0; c < 3; ++c) colours[3 * v + c] = table[colour + c] / 255;
  }
  const shown = [{ vertices: of && now ? moved(of, vertices) : new Float32Array(vertices), triangles, colours, opacity: 1 }];
  if (byId("tumour").checked) {
    const tumour = of && now ? of.vertices : new Float32Array(model.tumour.vertices), pink = new Float32Array(tumour.length);
    for (let v = 0; v < pink.length; v += 3) pink.set([1, 0.35, 0.82], v);
    shown.push({ vertices: tumour, triangles: model.tumour.triangles, colours: pink, opacity: 0.45 });
  }
  surface.show(shown);
}

function drawSlice(canvas, plane, of, map, now) {
  const context = canvas.getContext("2d"), { width, height } = canvas;
  const image = context.createImageData(width, height), data = image.data;
  const p = [...cross], x = [0, 0, 0], u = [0, 0, 0], table = MAPS[map]?.table;
  for (let py = 0, at = 0; py < height; ++py) {
    p[plane.up] = model.high[plane.up] - (py + 0.5) / PX_PER_MM;
    for (let px = 0; px < width; ++px, at += 4) {
      p[plane.across] = model.high[plane.across] - (px + 0.5) / PX_PER_MM;
      origin(now ? of : null, p, x, u);  // from the neighbour's displacement
      const level = grey(x);
      data[at] = data[at + 1] = data[at + 2] = level;
      data[at + 3] = 255;
      if (!of || !table || !isInside(x)) continue;
      const colour = 3 * shade(of, map, x);
      if (Number.isNaN(colour)) continue;
      for (let c = 0; c < 3; ++c) data[at + c] = 0.55 * level + 0.45 * table[colour + c];
    }
  }
  context.putImageData(image, 0, 0);
  if (of && byId("arrows").checked) drawArrows(context, plane, of, now);
  for (const [name, colour] of byId("structures").checked ? STRUCTURES : []) {
    const { triangles, vertices } = model[name];
    drawSection(context, plane, triangles, of && now ? of[name] : vertices, colour, 1.5);
  }
  if (byId("tumour").checked) {
    context.setLineDash([4, 3]);
    drawSection(context, plane, model.tumour.triangles, model.tumour.vertices, "#7fe0ff", 1.2);
    context.setLineDash([]);
    if (of) drawSection(context, plane, model.tumour.triangles, of.vertices, "#ff5ad1", 2);
  }
  drawAdvice(context, plane);
  if (byId("cross").checked) {
    const [cx, cy] = toPixel(plane, cross);
    context.strokeStyle = "#ffffff90";
    context.lineWidth = 1;
    context.beginPath();
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      context.moveTo(cx + 6 * dx, cy + 6 * dy);
      context.lineTo(cx + 400 * dx, cy + 400 * dy);
    }
    context.stroke();
  }
  context.fillStyle = "#fff";
  context.font = "13px system-ui, sans-serif";
  context.textAlign = "center";
  const [left, right, top, bottom] = plane.letters;
  context.fillText(left, 9, height / 2);
  context.fillText(right, width - 9, height / 2);
  context.fillText(top, width / 2, 14);
  context.fillText(bottom, width / 2, height - 5);
}

// From where a point was to where it is, at its true length, projected on the slice.
function drawArrows(context, plane, of, now) {
  const step = 9 * PX_PER_MM, x = [0, 0, 0], u = [0, 0, 0];
  context.strokeStyle = "#ffe14d";
  context.lineWidth = 1.4;
  context.beginPath();
  for (let py = step / 2; py < context.canvas.height; py += step) {
    for (let px = step / 2; px < context.canvas.width; px += step) {
      const p = toPlace(plane, px, py);
      origin(now ? of : null, p, x);
      if (!isInside(x)) continue;
      displacement(of, x[0], x[1], x[2], u);
      const from = toPixel(plane, x), to = toPixel(plane, [x[0] + u[0], x[1] + u[1], x[2] + u[2]]);
      const dx = to[0] - from[0], dy = to[1] - from[1], length = Math.hypot(dx, dy);
      if (length < 0.7) continue;
      const head = Math.min(4, 0.5 * length) / length;
      context.moveTo(from[0], from[1]);
      context.lineTo(to[0], to[1]);
      context.lineTo(to[0] - head * (dx + 0.6 * dy), to[1] - head * (dy - 0.6 * dx));
      context.moveTo(to[0], to[1]);
      context.lineTo(to[0] - head * (dx - 0.6 * dy), to[1] - head * (dy + 0.6 * dx));
    }
  }
  context.stroke();
}

function drawSection(context, plane, triangles, vertices, colour, width) {
  const level = cross[plane.normal], n = plane.normal;
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.beginPath();
  for (let t = 0; t < triangles.length; t += 3) {
    const ends = [];
    for (let k = 0; k < 3; ++k) {
      const a = 3 * triangles[t + k], b = 3 * triangles[t + ((k + 1) % 3)];
      const da = vertices[a + n] - level, db = vertices[b + n] - level;
      if ((da < 0) === (db < 0)) continue;
      const s = da / (da - db);
      ends.push(toPixel(plane, [0, 1, 2].map((c) => vertices[a + c] + s * (vertices[b + c] - vertices[a + c]))));
    }
    if (ends.length === 2) {
      context.moveTo(...ends[0]);
      context.lineTo(...ends[1]);
    }
  }
  context.stroke();
}

function drawLegend(of, map) {
  const bar = byId("bar"), context = bar.getContext("2d"), table = MAPS[map]?.table;
  bar.style.visibility = table && of ? "" : "hidden";
  byId("scale").textContent = "";
  if (!table || !of) return;
  for (let i = 0; i < bar.width; ++i) {
    const c = 3 * Math.round((255 * i) / (bar.width - 1));
    context.fillStyle = `rgb(${table[c]} ${table[c + 1]} ${table[c + 2]})`;
    context.fillRect(i, 0, 1, bar.height);
  }
  const { name, unit, signed } = MAPS[map], most = of.most[map];
  byId("scale").textContent = signed ? `${name}: −${Math.round(100 * most)} to ${Math.round(100 * most)} %` : unit === "%" ? `${name}: 0 to 100 % of the uncertainty before the data`
                                           : `${name}: 0 to ${of.most[map]} ${unit}`;
}

// ---------- the value at a place ----------

const place = (p) => `R ${p[0].toFixed(1)}, A ${p[1].toFixed(1)}, S ${p[2].toFixed(1)}`;
// p: of the brain that is drawn, now or before surgery.
function point(p) {
  const of = drawable(), now = chosen("brain") === "now", x = [0, 0, 0];
  origin(now ? of : null, p, x);
  let text = now ? `In the room: ${place(p)} mm` : `In the MRI: ${place(p)} mm`;
  if (of && isInside(x)) {
    const sd = value(of, "sd", x), known = value(of, "known", x);
    if (now) text += ` · in the MRI: ${place(x)}`;
    text += ` · moved ${value(of, "u", x).toFixed(2)}${Number.isNaN(sd) ? "" : " ± " + sd.toFixed(2)} mm`;
    if (!Number.isNaN(known)) text += ` · ${Math.round(100 * known)} % known by the data`;
    const volume = chosen("map") === "volume" ? value(of, "volume", x) : NaN;
    if (!Number.isNaN(volume)) text += ` · volume ${volume < 0 ? "−" : "+"}${Math.abs(100 * volume).toFixed(1)} %`;
    if (state.grid_error_mm != null) text += ` · drawn within ${state.grid_error_mm.toFixed(2)} mm of the mesh`;
  } else if (of) {
    text += " · outside the brain";
  }
  byId("cursor").textContent = text;
}

function follow(name, plane) {
  const canvas = byId(name);
  const at = (event) => toPlace(plane, (event.offsetX * canvas.width) / canvas.clientWidth, (event.offsetY * canvas.height) / canvas.clientHeight);
  canvas.addEventListener("pointermove", (event) => {
    if (!model) return;
    const p = at(event);
    if (event.buttons & 1) { cross = p; draw(); } else point(p);
  });
  canvas.addEventListener("pointerdown", (event) => { if (model) { cross = at(event); draw(); } });
  canvas.addEventListener("pointerleave", () => { if (model) point(cross); });
  canvas.addEventListener("wheel", (event) => {
    if (!model) return;
    event.preventDefault();
    cross[plane.normal] += event.deltaY < 0 ? 1 : -1;
    draw();
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const moves = { ArrowLeft: [plane.across, 1], ArrowRight: [plane.across, -1], ArrowUp: [plane.up, 1],
                    ArrowDown: [plane.up, -1], PageUp: [plane.normal, 1], PageDown: [plane.normal, -1] };
    if (!model || !moves[event.key]) return;
    event.preventDefault();
    cross[moves[event.key][0]] += moves[event.key][1];
    draw();
  });
}

// ---------- strips ----------

const STRIPS = {
  motion: { value: (p) => p.motion_mm, sd: (p) => p.motion_sd, digits: 2 },
  misfit: { value: (p) => p.misfit_mm, sd: () => null, digits: 2 },
  latency: { value: (p) => p.latency_ms, sd: () => null, digits: 0 },
};
function drawStrips() {
  for (const [name, strip] of Object.entries(STRIPS)) drawStrip(byId(name), strip, byId(name + "-value"), history.points.length - 1);
}
const stripX = (i, n, width) => (n < 2 ? width / 2 : 4 + ((width - 8) * i) / (n - 1));

function drawStrip(canvas, strip, label, marked) {
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  const context = canvas.getContext("2d"), points = history.points, n = points.length;
  context.scale(ratio, ratio);
  const css = getComputedStyle(document.body), has = (p) => strip.value(p) != null;
  const top = 1.15 * Math.max(0.1, ...points.filter(has).map((p) => strip.value(p) + (strip.sd(p) ?? 0)));
  const y = (v) => height - 14 - ((height - 18) * v) / top;
  context.strokeStyle = css.getPropertyValue("--rule");
  context.beginPath();
  context.moveTo(0, y(0) + 0.5);
  context.lineTo(width, y(0) + 0.5);
  context.stroke();
  context.fillStyle = css.getPropertyValue("--soft");
  context.font = "11px system-ui, sans-serif";
  context.fillText(top.toFixed(strip.digits), 2, 11);
  if (n > 0) {
    context.fillText(`update ${points[0].update}`, 2, height - 2);
    const last = `${points[n - 1].update}`;
    context.fillText(last, width - 2 - context.measureText(last).width, height - 2);
  }
  context.fillStyle = css.getPropertyValue("--band");
  const band = points.map((p, i) => [i, p]).filter(([, p]) => has(p) && strip.sd(p) != null);
  context.beginPath();
  for (const [i, p] of band) context.lineTo(stripX(i, n, width), y(strip.value(p) + strip.sd(p)));
  for (const [i, p] of band.reverse()) context.lineTo(stripX(i, n, width), y(Math.max(0, strip.value(p) - strip.sd(p))));
  context.fill();
  context.strokeStyle = context.fillStyle = css.getPropertyValue("--line");
  context.lineWidth = 1.5;
  context.beginPath();
  points.forEach((p, i) => { if (has(p)) context.lineTo(stripX(i, n, width), y(strip.value(p))); });
  context.stroke();
  points.forEach((p, i) => {
    const bad = !has(p), x = stripX(i, n, width);
    context.fillStyle = css.getPropertyValue(bad ? "--bad" : p.quality === "good" ? "--line" : "--caution");
    context.fillRect(x - 2, (bad ? y(0) : y(strip.value(p))) - 2, i === marked ? 6 : 4, i === marked ? 6 : 4);
  });
  const p = points[marked];
  if (!p) { label.textContent = ""; return; }
  const sd = strip.sd(p);
  label.textContent = `${has(p) ? strip.value(p).toFixed(strip.digits) : "–"}${sd == null ? "" : " ± " + sd.toFixed(strip.digits)} (update ${p.update}, ${p.quality}${p.late ? ", late" : ""})`;
}

for (const [name, strip] of Object.entries(STRIPS)) {
  const canvas = byId(name), label = byId(name + "-value");
  canvas.addEventListener("pointermove", (event) => {
    const n = history.points.length;
    if (n === 0) return;
    const i = n < 2 ? 0 : Math.round(((event.offsetX - 4) / (canvas.clientWidth - 8)) * (n - 1));
    drawStrip(canvas, strip, label, Math.max(0, Math.min(n - 1, i)));
  });
  canvas.addEventListener("pointerleave", drawStrips);
}
for (const [name, plane] of Object.entries(PLANES)) follow(name, plane);
const surface = surfaceView(byId("surface"), byId("surface-from"));
if (!surface) byId("surface-from").textContent = "3-D: this browser has no WebGL2";
for (const input of document.querySelectorAll("input")) input.addEventListener("change", draw);
window.addEventListener("resize", () => { if (model) drawStrips(); });
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { if (model) drawStrips(); });
byId("advice").addEventListener("change", () => { tellAdvice(); askForAdvice(); });
setInterval(askForAdvice, ADVICE_MS);
setInterval(judge, 100);
listen();
