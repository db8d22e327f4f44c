// What a colour says: one rule for each thing by which toolpaths can be told apart.

// Viridis, in nine steps: even to the eye, and for those who see few colours.
const RAMP = [[68, 1, 84], [72, 40, 120], [62, 74, 137], [49, 104, 142], [38, 130, 142], [31, 158, 137], [53, 183, 121], [144, 215, 67], [253, 231, 37]];
const KINDS = [[86, 180, 233], [0, 158, 115], [230, 159, 0], [204, 121, 167], [240, 228, 66], [213, 94, 0], [0, 114, 178], [150, 150, 150]];

const SHADES = Array.from({ length: 1024 }, (_, shade) => {
  // The darkest is not to be told from a dark ground, nor the lightest from a light one.
  const at = (0.12 + 0.82 * shade / 1023) * (RAMP.length - 1), k = Math.min(Math.floor(at), RAMP.length - 2);
  return RAMP[k].map((value, c) => Math.round(value + (at - k) * (RAMP[k + 1][c] - value)));
});

const ramp = (share) => SHADES[Math.round(1023 * Math.min(1, Math.max(0, share)))];

function hue(degrees, light = 0.55, strength = 0.6) {
  const channel = (n) => {
    const k = (n + degrees / 30) % 12;
    return Math.round(255 * (light - strength * Math.min(light, 1 - light) * Math.max(-1, Math.min(k - 3, 9 - k, 1))));
  };
  return [channel(0), channel(8), channel(4)];
}

const tiltOf = ([x0, y0, x1, y1]) => {
  const tilt = Math.atan2(y1 - y0, x1 - x0) * 180 / Math.PI;
  return tilt > 90 ? tilt - 180 : tilt <= -90 ? tilt + 180 : tilt;
};

// For each: a name, (track) => (k) => [r, g, b], and (track) => what its legend says at either end.
const COLOURS = {
  order: { name: "order", of: (t) => (k) => ramp(k / Math.max(1, t.n - 1)), legend: (t) => ["1", String(t.toolpaths)] },
  time: { name: "time", of: (t) => (k) => ramp(t.end[t.stepOf[k]] / t.total), legend: (t) => [clock(0), clock(t.total)] },
  tilt: { name: "tilt", of: (t) => (k) => hue((tiltOf(t.ends(k)) + 90) * 2), legend: () => ["-90°", "90°"], hues: true },
  tile: {
    name: "tile",
    of: (t) => (k) => t.tile[k] < 0 ? [140, 140, 140] : hue((t.tile[k] * 137.508) % 360, 0.5 + 0.12 * (t.tile[k] % 3 - 1)),
    legend: () => ["one colour a tile", ""],
    possible: (t) => t.tile.length > 0,
  },
  speed: {
    name: "speed",
    of: (t) => { const [low, high] = speeds(t); return (k) => ramp((t.speed[t.stepOf[k]] - low) / Math.max(high - low, 1e-9)); },
    legend: (t) => speeds(t).map((v) => `${v.toFixed(1)} mm/s`),
  },
  tool: { name: "tool", of: (t) => (k) => KINDS[t.tool[t.stepOf[k]] % KINDS.length], legend: () => ["one colour a tool", ""] },
  plain: { name: "extrusion and travel", of: () => () => [214, 39, 40], legend: () => ["extrusion red, travel blue", ""] },
};

function speeds(track) {
  let low = Infinity, high = 0;
  for (let k = 0; k < track.n; k++) {
    const speed = track.speed[track.stepOf[k]];
    low = Math.min(low, speed); high = Math.max(high, speed);
  }
  return [Math.min(low, high), high];
}

const HANGING = [255, 140, 0], FAULTY = [255, 0, 160], TRAVELS = [31, 119, 180], FILLS = [150, 150, 150];

// Bytes r, g, b, a for each step that draws anything.
function coloursOf(track, drawn, choice, { hanging, faults }) {
  const rgb = COLOURS[choice].of(track), bytes = new Uint8Array(4 * drawn.length);
  const faulty = new Set(faults ? track.findings.map((f) => f.step) : []);
  for (let i = 0; i < drawn.length; i++) {
    const s = drawn[i], kind = track.kind[s];
    let colour = kind === TRAVEL ? TRAVELS : FILLS;
    if (kind === TOOLPATH) {
      const k = track.done[s];
      colour = hanging && track.hangs[k] > 50 ? HANGING : rgb(k);
    }
    if (faulty.has(s)) colour = FAULTY;
    bytes[4 * i] = colour[0]; bytes[4 * i + 1] = colour[1]; bytes[4 * i + 2] = colour[2]; bytes[4 * i + 3] = 255;
  }
  return bytes;
}

function clock(seconds) {
  const whole = Math.max(0, Math.round(seconds));
  const two = (value) => String(value).padStart(2, "0");
  return `${Math.floor(whole / 3600)}:${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)}`;
}
