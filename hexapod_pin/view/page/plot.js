// A plot over time on a canvas: curves, limits, ghosts; zoom by dragging, selection by clicking.

const PALETTE = {
  light: ["#0072b2", "#b87a00", "#00855f", "#a2467f", "#c44e00", "#3a9bdc"],
  dark: ["#5aa9e6", "#e6b13c", "#43c59e", "#e78ac3", "#ff8c42", "#9ad4ff"],
};
const DASHES = [[], [], [], [6, 3], [6, 3], [6, 3]];
const legColor = (k) => PALETTE[isDark() ? "dark" : "light"][k % 6];
const legDash = (k) => DASHES[k % 6];
const plots = [];
let ink = {};

function readInks() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["ink", "soft", "grid", "hot", "select", "line", "bg"]) {
    ink[name] = style.getPropertyValue(`--${name}`).trim();
  }
}

function stale() {
  for (const plot of plots) plot.stale = true;
  bar.stale = true;
  dirty = true;
}

function ticks(low, high, count) {
  const size = niceStep((high - low) / count) || 1, found = [];  // one alone would be no scale
  if (!Number.isFinite(high - low)) return [found, 0];
  for (let v = Math.ceil(low / size - 1e-9) * size; v <= high + 1e-9 * size; v += size) found.push(Math.abs(v) < 1e-9 * size ? 0 : v);
  if (found.length < 2 && count < 20) return ticks(low, high, 2 * count);
  return [found, Math.max(0, -Math.floor(Math.log10(size) + 1e-9))];
}

// Resize a canvas and its still picture to the screen's pixels; return the still's context.
function sized(canvas, still, width, height) {
  const ratio = devicePixelRatio;
  canvas.width = still.width = Math.round(width * ratio);
  canvas.height = still.height = Math.round(height * ratio);
  canvas.style.height = `${height}px`;
  const context = still.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = "10px system-ui, sans-serif";
  return context;
}

function restored(canvas, still) {
  const context = canvas.getContext("2d");
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.clearRect(0, 0, canvas.width, canvas.height);
  context.drawImage(still, 0, 0);
  context.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
  return context;
}

function panel(title, open = true) {
  const box = document.createElement("details");
  box.className = "panel";
  box.open = open;
  const summary = document.createElement("summary"), note = document.createElement("small");
  summary.append(`${title} `, note);
  box.append(summary);
  $("panels").append(box);
  box.addEventListener("toggle", stale);
  return {box, summary, note};
}

const LEFT = 44, RIGHT = 4, BELOW = 15;

// Options: title, unit, digits, height, open; `series()` returns {name, y, run, color, dash, on, pick, band, leg};
// `limit()` returns {y, name}; `floor` is shown always; `rows`: whether a row for each curve can be shown.
class Plot {
  constructor(options) {
    Object.assign(this, {height: 112, digits: 2, limit: () => null}, options);
    Object.assign(this, panel(this.title, options.open));
    this.stale = true;
    this.keys = document.createElement("div");
    this.keys.className = "keys";
    this.canvas = document.createElement("canvas");
    this.still = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `${this.title} over time`);
    this.box.append(this.keys, this.canvas);
    if (options.rows) {
      const button = document.createElement("button");
      button.textContent = "rows";
      button.title = "one row for each leg, or all in one";
      button.onclick = (event) => {
        event.preventDefault();
        this.inRows = !this.inRows;
        button.setAttribute("aria-pressed", !!this.inRows);
        this.stale = dirty = true;
      };
      this.summary.append(button);
    }
    this.listen();
    plots.push(this);
  }

  x(time) { return LEFT + ((time - S.from) / (S.to - S.from)) * (this.width - LEFT - RIGHT); }
  time(x) { return S.from + ((x - LEFT) / (this.width - LEFT - RIGHT)) * (S.to - S.from); }

  range(all, limit) {
    let low = this.floor ?? Infinity, high = -Infinity;
    for (const {y, run, shown} of all) {
      const shift = run.t0 - start, last = sampleAt(run, S.to + shift);
      for (const row of shown ? [y, shown.low, shown.high] : [y]) {
        for (let i = sampleAt(run, S.from + shift); i <= last; i++) {
          if (row[i] < low) low = row[i];
          if (row[i] > high) high = row[i];
        }
      }
    }
    if (!Number.isFinite(low) || !Number.isFinite(high)) [low, high] = [Number.isFinite(low) ? low : 0, 1];
    const span = high - low || Math.abs(high) || 1;
    if (limit) {
      const top = Math.min(...[S.from, 0.5 * (S.from + S.to), S.to].map((t) => limit.y[sampleAt(R, t)]));
      if (top < high + 0.35 * span && top > low) high = Math.max(high, top);
      if (-top > low - 0.35 * span && low < 0) low = Math.min(low, -top);
    }
    if (this.floor === undefined) low -= 0.06 * span;
    return [low, high + 0.08 * span];
  }

  // Curves, with the bands that are drawn: of legs in one picture that of the selected one alone.
  curves() {
    const all = this.series(), chosen = all.some((s) => s.on);
    return all.map((s) => ({...s, shown: this.inRows || s.leg === undefined || s.on || !chosen ? s.band?.() : null}));
  }

  draw() {
    this.stale = false;
    if (!this.box.open || !this.canvas.clientWidth) { this.stale = !this.box.open ? false : true; return; }
    this.width = this.canvas.clientWidth;
    const all = this.curves(), height = this.inRows ? Math.max(this.height, 30 * all.length + BELOW) : this.height;
    this.drawn = height;
    const q = sized(this.canvas, this.still, this.width, height), h = height - BELOW;
    const limit = this.limit(), [low, high] = this.range(all, limit);
    this.shownDigits = decimals(Math.max(Math.abs(low), Math.abs(high)), this.digits);
    const row = this.inRows ? h / all.length : h;
    const Y = (v, k = 0) => (this.inRows ? k * row : 0) + 3 + ((high - v) / (high - low)) * (row - 6);
    this.Y = Y;
    this.axes(q, h, low, high, Y, all);
    q.save();
    q.beginPath();
    q.rect(LEFT, 0, this.width - LEFT, h);
    q.clip();
    const order = all.map((s, k) => [s, k]).sort(([a], [b]) => !!a.on - !!b.on), some = all.some((s) => s.on);
    for (const [s, k] of order) {
      q.fillStyle = s.color;
      q.globalAlpha = s.ghost ? 0.16 : 0.3;
      if (s.shown) this.fillBand(q, s.shown, s.run, (v) => Y(v, k));
    }
    for (const [s, k] of order) {
      q.strokeStyle = s.color;
      q.setLineDash(s.dash ?? []);
      q.lineWidth = s.on ? 2.2 : 1.1;
      q.globalAlpha = s.ghost ? 0.6 : some && !s.on && !this.inRows ? 0.38 : 1;
      this.path(q, s.y, s.run, (v) => Y(v, k));
      q.stroke();
    }
    q.globalAlpha = 1;
    if (limit) this.drawLimit(q, limit, low, high, Y, all);
    q.restore();
    this.legend(all, Math.max(...[low, high].map((v) => v.toFixed(this.shownDigits).length)));
  }

  axes(q, h, low, high, Y, all) {
    q.fillStyle = ink.soft;
    q.strokeStyle = ink.grid;
    q.lineWidth = 1;
    q.textAlign = "right";
    const line = (x0, y0, x1, y1) => { q.beginPath(); q.moveTo(x0, y0); q.lineTo(x1, y1); q.stroke(); };
    if (this.inRows) {
      all.forEach((s, k) => {
        line(LEFT, (k + 1) * h / all.length, this.width, (k + 1) * h / all.length);
        q.fillText(s.name.slice(0, 7), LEFT - 4, (k + 0.5) * h / all.length + 3);
      });
    } else {
      const [values, digits] = ticks(low, high, h > 90 ? 4 : 3);
      for (const v of values) { line(LEFT, Y(v), this.width - RIGHT, Y(v)); q.fillText(v.toFixed(digits), LEFT - 4, Math.max(9, Y(v) + 3)); }
    }
    q.textAlign = "center";
    const [times, digits] = ticks(S.from, S.to, Math.max(3, this.width / 75));
    for (const t of times) {
      line(this.x(t), 2, this.x(t), h);
      q.fillText(t.toFixed(digits) + (t === times.at(-1) ? " s" : ""), Math.min(this.width - 16, this.x(t)), h + 12);
    }
  }

  // A curve; where samples are denser than pixels, the least and the largest of each column.
  path(q, y, run, Y) {
    const shift = run.t0 - start, first = sampleBefore(run, S.from + shift), last = Math.min(run.N - 1, sampleBefore(run, S.to + shift) + 1);
    q.beginPath();
    const ratio = devicePixelRatio, dense = last - first > 3 * this.width * ratio;
    let column = -1, low = 0, high = 0, open = false;
    const flush = () => { if (column >= 0) { q.lineTo(column / ratio, Y(low)); q.lineTo(column / ratio, Y(high)); } };
    for (let i = first; i <= last; i++) {
      const v = y[i], x = this.x(run.time[i] - shift);
      if (!Number.isFinite(v)) { flush(); column = -1; open = false; continue; }
      if (!dense) { q[open ? "lineTo" : "moveTo"](x, Y(v)); open = true; continue; }
      const c = Math.round(x * ratio);
      if (c !== column) { flush(); column = c; low = high = v; } else { low = Math.min(low, v); high = Math.max(high, v); }
    }
    if (dense) flush();
  }

  // A band; of each pixel column its least and its largest value.
  fillBand(q, {low, high}, run, Y) {
    const shift = run.t0 - start, first = sampleBefore(run, S.from + shift), last = Math.min(run.N - 1, sampleBefore(run, S.to + shift) + 1);
    const ratio = devicePixelRatio;
    let columns = [];
    const flush = () => {
      q.beginPath();
      for (const {x, top} of columns) q.lineTo(x, Y(top));
      for (const {x, bottom} of columns.reverse()) q.lineTo(x, Y(bottom));
      q.fill();
      columns = [];
    };
    for (let i = first; i <= last; i++) {
      if (!Number.isFinite(low[i]) || !Number.isFinite(high[i])) { flush(); continue; }
      const x = Math.round(this.x(run.time[i] - shift) * ratio) / ratio, column = columns.at(-1);
      if (column?.x !== x) columns.push({x, top: high[i], bottom: low[i]});
      else { column.top = Math.max(column.top, high[i]); column.bottom = Math.min(column.bottom, low[i]); }
    }
    flush();
  }

  // The limit where it is in sight; else its value at the edge.
  drawLimit(q, limit, low, high, Y, all) {
    const i = now(), value = limit.y[i];
    q.strokeStyle = q.fillStyle = ink.hot;
    q.lineWidth = 1.2;
    q.textAlign = "left";
    if (!Number.isFinite(value)) return;
    const least = Math.min(limit.y[sampleAt(R, S.from)], limit.y[sampleAt(R, S.to)], value);
    let text = limit.name, y = Y(Math.min(high, value));
    if (least <= high) {
      const k = this.inRows ? all.findIndex((s) => s.on) : 0;
      q.setLineDash([5, 3]);
      for (const sign of low < 0 ? [1, -1] : [1]) {
        this.path(q, limit.y.map((v) => sign * v), R, (v) => Y(v, Math.max(0, k)));
        q.stroke();
      }
      q.setLineDash([]);
      y = Y(limit.y[sampleAt(R, S.from)], Math.max(0, k));
    } else { text = `\u25B2 ${limit.name} ${least.toFixed(this.digits)}`; y = 12; }
    const width = q.measureText(text).width;
    y = Math.max(11, y);
    q.globalAlpha = 0.85;
    q.fillStyle = ink.bg;
    q.fillRect(LEFT + 2, y - 10, width + 6, 11);
    q.globalAlpha = 1;
    q.fillStyle = ink.hot;
    q.fillText(text, LEFT + 5, y - 1.5);
  }

  // Values have room for so many characters: lines that broke anew with each value would move the plots.
  legend(all, characters) {
    this.note.textContent = `[${this.unitText?.() ?? this.unit}]`;
    this.keys.textContent = "";
    this.values = all.map((s) => {
      const key = document.createElement("span"), value = document.createElement("output");
      const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg"), stroke = document.createElementNS(svg.namespaceURI, "line");
      for (const [name, v] of Object.entries({width: 16, height: 6})) svg.setAttribute(name, v);
      for (const [name, v] of Object.entries({x1: 0, y1: 3, x2: 16, y2: 3, stroke: s.color, "stroke-width": 2, "stroke-dasharray": (s.dash ?? []).join()})) stroke.setAttribute(name, v);
      svg.append(stroke);
      value.style.minWidth = `${s.shown ? 3 * characters + 5 : characters}ch`;
      key.append(svg, `${s.name} `, value);
      if (s.on) key.className = "on";
      if (s.pick) key.onclick = s.pick;
      this.keys.append(key);
      return {value, ...s};
    });
  }

  cursor() {
    if (!this.box.open || !this.width) return;
    const z = restored(this.canvas, this.still), h = this.drawn - BELOW;
    if (this.drag) {
      z.fillStyle = `${ink.select}33`;
      z.fillRect(Math.min(...this.drag), 0, Math.abs(this.drag[1] - this.drag[0]), h);
    }
    if (S.time >= S.from && S.time <= S.to) { z.fillStyle = ink.ink; z.fillRect(this.x(S.time) - 0.5, 0, 1.2, h); }
    const written = (v) => (Number.isFinite(v) ? v.toFixed(this.shownDigits) : "\u2013");
    for (const {value, y, run, shown} of this.values ?? []) {
      const i = now(run), text = written(y[i]) + (shown ? ` (${written(shown.low[i])} \u2026 ${written(shown.high[i])})` : "");
      if (value.textContent !== text) value.textContent = text;
    }
  }

  // Two fingers: the times that were under them stay under them.
  pinch([a, b]) {
    const apart = b.x - a.x;
    if (apart * Math.sign(b.time - a.time) < 12) return;
    const rate = (b.time - a.time) / apart, from = a.time - (a.x - LEFT) * rate;
    zoom(from, from + (this.width - LEFT - RIGHT) * rate);
  }

  listen() {
    const {canvas} = this, fingers = new Map();
    let from = null, pinched = false;
    canvas.onpointerdown = (event) => {
      const x = event.offsetX;
      if (event.pointerType === "mouse") canvas.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, {x, time: this.time(x)});
      pinched = fingers.size > 1;
      from = pinched ? null : x;
      this.drag = null;
      for (const finger of fingers.values()) finger.time = this.time(finger.x);
      dirty = true;
    };
    canvas.onpointermove = (event) => {
      const finger = fingers.get(event.pointerId);
      if (!finger || !event.buttons) return;
      finger.x = event.offsetX;
      if (fingers.size === 2) this.pinch([...fingers.values()]);
      if (from === null || pinched || (!this.drag && Math.abs(event.offsetX - from) < 6)) return;
      this.drag = [from, event.offsetX];
      dirty = true;
    };
    const ended = (event) => {
      fingers.delete(event.pointerId);
      if (!fingers.size) pinched = false;
      from = this.drag = null;
      dirty = true;
    };
    canvas.onpointerup = (event) => {
      if (this.drag) zoom(...this.drag.map((x) => this.time(x)));
      else if (from !== null && !pinched) { seek(this.time(event.offsetX)); this.pickNear(event.offsetY); }
      ended(event);
    };
    canvas.onpointercancel = canvas.onlostpointercapture = (event) => { if (fingers.has(event.pointerId)) ended(event); };
    canvas.ondblclick = () => zoom(start, END);
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.shiftKey) return;
      event.preventDefault();
      const middle = this.time(event.offsetX), factor = (event.deltaY || event.deltaX) > 0 ? 1.25 : 0.8;
      zoom(middle - (middle - S.from) * factor, middle + (S.to - middle) * factor);
    }, {passive: false});
  }

  pickNear(y) {
    let best = null, least = 14;
    this.series().forEach((s, k) => {
      const away = Math.abs(this.Y(s.y[now(s.run)], k) - y);
      if (s.pick && away < least) { least = away; best = s; }
    });
    best?.pick();
  }
}
