// What moves above the print: the bead being laid, the travel under way, the nozzle; and arrows, numbers, a scale.

const NUMBERS_FROM_PX = 46, ARROWS_FROM_PX = 22, MOST_LABELS = 2500;
const ROOM_FOR_NUMBERS_PX = 12, ROOM_FOR_ARROWS_PX = 8; // height of a bead

function drawMoment(ctx, pane, at, colours) {
  const { track, view, nozzle } = pane, { step } = at;
  ctx.clearRect(0, 0, view.width, view.height);
  bed(ctx, view, track.header.bed_mm, colours);
  if (step < track.steps && step > 0 && track.kind[step] <= PRIME) {
    const from = view.px(track.x[step - 1], track.y[step - 1]), to = view.px(at.x, at.y);
    const lays = track.kind[step] !== TRAVEL;
    if (lays || pane.options.travels) {
      ctx.beginPath();
      ctx.moveTo(...from);
      ctx.lineTo(...to);
      ctx.lineCap = "round";
      ctx.setLineDash(lays ? [] : [5, 4]);
      ctx.lineWidth = lays ? Math.max(2, pane.width(step) * view.scale) : 1.5;
      ctx.strokeStyle = lays ? pane.colourOf(step) : colours.travel;
      ctx.stroke();
      ctx.setLineDash([]);
    }
  }
  let pressed = { depth: 0, toolpaths: [] };
  if (pane.options.nozzle) {
    if (nozzle) {
      // What it lays at this moment does not hinder it.
      pressed = hindering(nozzle, pane.strips, at.x, at.y, track.done[Math.min(step, track.steps)]);
      ctx.strokeStyle = colours.fault;
      for (const k of pressed.toolpaths) {
        const [x0, y0, x1, y1] = track.ends(k);
        ctx.lineWidth = Math.max(1, track.height[k] * view.scale * 0.4);
        ctx.beginPath(); ctx.moveTo(...view.px(x0, y0)); ctx.lineTo(...view.px(x1, y1)); ctx.stroke();
      }
    }
    drawNozzle(ctx, view, nozzle, at, colours);
  }
  return pressed;
}

function bed(ctx, view, bedMm, colours) {
  const [, y] = view.px(0, bedMm);
  ctx.strokeStyle = colours.line;
  ctx.lineWidth = 1;
  ctx.beginPath(); ctx.moveTo(0, Math.round(y) + 0.5); ctx.lineTo(view.width, Math.round(y) + 0.5); ctx.stroke();
}

function drawNozzle(ctx, view, nozzle, at, colours) {
  const [x, y] = view.px(at.x, at.y);
  ctx.beginPath();
  if (nozzle) {
    const top = Math.max(1, (y + 20) / view.scale);
    const right = outline(nozzle, top);
    right.forEach(([dx, dy], k) => ctx[k ? "lineTo" : "moveTo"](x + dx * view.scale, y - dy * view.scale));
    right.reverse().forEach(([dx, dy]) => ctx.lineTo(x - dx * view.scale, y - dy * view.scale));
  } else { // a point: a sign of it, whatever the scale
    ctx.moveTo(x, y); ctx.lineTo(x + 7, y - 16); ctx.lineTo(x + 7, y - 30); ctx.lineTo(x - 7, y - 30); ctx.lineTo(x - 7, y - 16);
  }
  ctx.closePath();
  ctx.fillStyle = colours.nozzle;
  ctx.fill();
  ctx.lineWidth = 1.2;
  ctx.strokeStyle = colours.ink;
  ctx.stroke();
  ctx.beginPath(); ctx.arc(x, y, 2.5, 0, 7); ctx.fillStyle = colours.ink; ctx.fill();
}

// Arrows and numbers of the toolpaths that are long enough to bear them; how many of them were drawn.
function drawLabels(ctx, pane, colours) {
  const { view, track, strips } = pane;
  ctx.clearRect(0, 0, view.width, view.height);
  let drawn = 0;
  if (pane.options.labels) {
    const found = [];
    strips.near(view.box, track.n, (k, x0, y0, x1, y1) => {
      const length = Math.hypot(x1 - x0, y1 - y0) * view.scale;
      if (!track.join[k] && length >= ARROWS_FROM_PX && track.height[k] * view.scale >= ROOM_FOR_ARROWS_PX && found.length <= MOST_LABELS) found.push([k, x0, y0, x1, y1, length, track.height[k] * view.scale]);
    });
    if (found.length <= MOST_LABELS) {
      ctx.font = "11px system-ui, sans-serif";
      ctx.textAlign = "center";
      ctx.textBaseline = "middle";
      ctx.lineWidth = 1.4;
      for (const line of found) label(ctx, view, line, track.number[line[0] + 1], colours);
      drawn = found.length;
    }
  }
  scaleBar(ctx, view, colours);
  return drawn;
}

function label(ctx, view, [, x0, y0, x1, y1, length, room], number, colours) {
  const [ax, ay] = view.px(x0, y0), [bx, by] = view.px(x1, y1);
  const dx = (bx - ax) / length, dy = (by - ay) / length;
  const tx = ax + (bx - ax) * 0.7, ty = ay + (by - ay) * 0.7;
  for (const [ink, wide] of [[colours.halo, 3.4], [colours.ink, 1.4]]) {
    ctx.strokeStyle = ink; ctx.lineWidth = wide;
    ctx.beginPath();
    ctx.moveTo(tx - 5 * dx - 4 * dy, ty - 5 * dy + 4 * dx);
    ctx.lineTo(tx + 2 * dx, ty + 2 * dy);
    ctx.lineTo(tx - 5 * dx + 4 * dy, ty - 5 * dy - 4 * dx);
    ctx.stroke();
  }
  if (length < NUMBERS_FROM_PX || room < ROOM_FOR_NUMBERS_PX) return;
  const mx = ax + (bx - ax) * 0.35, my = ay + (by - ay) * 0.35, text = String(number);
  ctx.lineWidth = 3; ctx.strokeStyle = colours.halo; ctx.strokeText(text, mx, my);
  ctx.fillStyle = colours.ink; ctx.fillText(text, mx, my);
}

function scaleBar(ctx, view, colours) {
  const raw = 90 / view.scale, power = 10 ** Math.floor(Math.log10(raw));
  const mm = [5, 2, 1].map((m) => m * power).find((m) => m <= raw) || power, wide = mm * view.scale;
  const y = 22;
  ctx.strokeStyle = colours.ink; ctx.lineWidth = 1.5;
  ctx.beginPath(); ctx.moveTo(12, y - 4); ctx.lineTo(12, y); ctx.lineTo(12 + wide, y); ctx.lineTo(12 + wide, y - 4); ctx.stroke();
  ctx.font = "11px system-ui, sans-serif"; ctx.textAlign = "left"; ctx.textBaseline = "bottom"; ctx.fillStyle = colours.ink;
  ctx.fillText(`${+mm.toPrecision(3)} mm`, 16, y - 2);
}
