// Which plots a page has: torques, forces, balance, trunk, slip, power, and torque over speed.

// A curve of a run: what `get` gives of it, with the band over the run and those of its spread.
const curveOf = (run, get, more) => {
  const y = get(run);
  return {run, y, band: () => bandOf(run, y, get), ...more};
};
const curve = (name, get, more) => curveOf(R, get, {name, ...more});
const others = (get) => runs.slice(1).map((run, k) => curveOf(run, get, {name: run.data.name, color: legColor(k + 3),
  dash: [2, 2], ghost: true})).filter((s) => s.y && s.y.length === s.run.total);
const byLeg = (get, kind = S.kind) => R.legs.map((f, leg) => ({f, leg, foot: R.data.feet[f]})).map(({f, leg, foot}) => {
  const joint = foot.joints.find((j) => R.data.kinds[j] === kind);
  return curve(foot.label, (run) => get(f, joint, run), {color: legColor(leg), dash: legDash(leg), leg,
    on: leg === legOf(S.joint), pick: joint === undefined ? null : () => select(joint)});
}).filter((s) => s.y);
const sameJoint = (run) => run.data.joints.indexOf(R.data.joints[S.joint]);
const sameFoot = (run) => {
  const foot = legsOf(R)[legOf(S.joint)];
  return foot ? run.data.feet.findIndex((other) => other.name === foot.name) : -1;
};

function chooser(names, label, change) {
  const element = document.createElement("select");
  element.setAttribute("aria-label", label);
  for (const name of names) element.add(new Option(name));
  element.onclick = (event) => event.preventDefault();
  element.onchange = () => { change(element.value); stale(); };
  return element;
}

// What the bands of the plots are of, in words: once of runs with as many others that differ in the same.
function spreadTexts() {
  const names = new Map();
  for (const run of runs.filter((one) => one.spread.length)) {
    const text = `bands go from the least to the largest value of ${run.spread.length + 1} runs at the same time, ` +
      `the one played included; ${run.data.spread.differ}. Values: the run played (least \u2026 largest).`;
    names.set(text, [...(names.get(text) ?? []), run.data.name]);
  }
  return [...names].map(([text, of]) => (runs.length > 1 ? `${of.join(", ")}: ${text}` : text));
}

function makePanels() {
  for (const text of spreadTexts()) {
    $("panels").append(element("p", {class: "spread"}, element("i", {"aria-hidden": "true"}), text));
  }
  if (R.torque && R.limited) {
    const top = tabulated(R.total, () => 1);
    const worstOf = readOnce((run) => rowsWhenRead(kinds.length, (k) => {
      const row = new Float64Array(run.total);
      for (const j of ofKind(kinds[k])) run.use[j].forEach((use, i) => { if (use > row[i]) row[i] = Math.min(9.99, use); });
      return row;
    }));
    new Plot({title: "Use of limit, worst leg of each kind", unit: "1", floor: 0, height: 100,
      limit: () => ({y: top, name: R.data.limits.name}),
      series: () => kinds.map((kind, k) => curve(kind, (run) => worstOf(run)[k], {color: legColor([0, 4, 2][k % 3] + (k > 2)), on: kind === S.kind,
        pick: () => select(ofKind(kind).reduce((a, j) => (R.use[j][now()] > R.use[a][now()] ? j : a)))}))});
  }
  if (R.torque && R.data.joints.length) makeTorque();
  if (R.force) makeForces();
  if (R.margins) {
    const scaled = readOnce((run) => run.margin?.map((v) => 1e3 * v));
    new Plot({title: "Static stability margin", unit: "mm", digits: 1, height: 86, floor: 0,
      series: () => [curve("margin", scaled, {color: legColor(0), on: true}), ...others(scaled)]});
  }
  makeTrunk();
  if (R.force) {
    const millimetres = readOnce((run) => slipOf(run).map((row) => row.map((v) => 1e3 * v)));
    new Plot({title: "Slip since touch-down", unit: "mm", digits: 2, height: 96, open: false, floor: 0, rows: true,
      series: () => byLeg((f, _, run) => millimetres(run)[f])});
    if (R.slipSpeed) {
      const shown = readOnce((run) => run.slipSpeed && rowsWhenRead(run.slipSpeed.length, (f) => run.slipSpeed[f].map((v) => 1e3 * v)));
      new Plot({title: "Slip speed", unit: "mm/s", digits: 1, height: 96, open: false, floor: 0, rows: true, series: () => byLeg((f, _, run) => shown(run)?.[f])});
    }
  }
  if (R.torque) {
    new Plot({title: "Power", unit: "W", height: 96, open: false, series: () => [
      curve("all joints", totalPower, {color: legColor(0)}),
      curve(shortJoint(S.joint), (run) => run.power?.[S.joint], {color: legColor(4), on: true}), ...others(totalPower)].filter((s) => s.y)});
    const perTorque = R.data.limits.per_torque;
    if (R.current) makeRecorded("Motor current", "A", (run) => run.current);
    else if (R.motorCurrent) makeRecorded("Motor current, its gear's losses included", "A", (run) => run.motorCurrent);
    else if (perTorque.some((ratio) => ratio !== null)) {
      const current = readOnce((run) => run.torque && rowsWhenRead(run.torque.length, (j) => {
        const ratio = run.data.limits.per_torque[j] ?? NaN;
        return run.torque[j].map((v) => ratio * Math.abs(v));
      }));
      new Plot({title: "Motor current, of its torque", unit: "A", height: 96, open: false, floor: 0, rows: true,
        series: () => byLeg((f, j, run) => current(run)?.[j])});
    }
    if (R.temperature) makeRecorded("Winding temperature", "deg C", (run) => run.temperature);
    new Cloud();
  }
}

// What a run recorded of every joint.
function makeRecorded(title, unit, rowsOf) {
  new Plot({title, unit, height: 96, open: false, rows: true, series: () => byLeg((f, j, run) => (j === undefined ? null : rowsOf(run)?.[j]))});
}

function makeTorque() {
  const pick = chooser(kinds, "kind of joint", (kind) => {
    const leg = legOf(S.joint), own = ofKind(kind);
    select(own.find((j) => legOf(j) === leg) ?? own[0]);
  });
  const plot = new Plot({title: "Torque", digits: 3, unitText: () => (slides(S.joint) ? "N, of a sliding joint" : "N m"), height: 148, rows: true,
    limit: () => (atRest(R, S.joint) === Infinity ? null
      : {y: R.limit[S.joint], name: `${R.data.limits.slope[S.joint] ? "line at this speed" : "limit"}, ${legName(S.joint)}`}),
    series: () => {
      pick.value = S.kind;
      const legged = byLeg((_, j, run) => (j === undefined ? null : run.torque?.[j]));
      const found = legged.length ? legged : ofKind(S.kind).map((j, k) => curve(shortJoint(j), (run) => run.torque?.[j], {
        color: legColor(k), dash: legDash(k), leg: k, on: j === S.joint, pick: () => select(j)}));
      return [...found, ...others((run) => run.torque?.[sameJoint(run)])];
    }});
  plot.summary.append(pick);
}

function makeForces() {
  const shown = {
    "normal": {rows: "press", unit: "N", digits: 1}, "tangential": {rows: "shear", unit: "N", digits: 1},
    "tangential / (mu normal)": {rows: "grip", unit: "1", digits: 2},
  };
  if (!R.grip) delete shown["tangential / (mu normal)"];
  let name = "normal";
  const one = tabulated(R.total, () => 1);
  const plot = new Plot({title: "Foot forces", height: 124, rows: true, floor: 0, unitText: () => shown[name].unit,
    limit: () => (name.includes("mu") ? {y: one, name: "friction cone"} : null),
    series: () => {
      plot.digits = shown[name].digits;
      const {rows} = shown[name];
      return [...byLeg((f, _, run) => run[rows]?.[f]), ...others((run) => run[rows]?.[sameFoot(run)])];
    }});
  plot.summary.append(chooser(Object.keys(shown), "which force", (value) => { name = value; }));
}

function makeTrunk() {
  new Plot({title: "Trunk roll and pitch", unit: "deg", digits: 2, height: 86, open: false, series: () => [
    curve("roll", (run) => run.roll, {color: legColor(0)}), curve("pitch", (run) => run.pitch, {color: legColor(4), dash: [6, 3]}),
    ...others((run) => run.pitch).map((s) => ({...s, name: `${s.name} pitch`}))]});
  const heights = readOnce((run) => run.place[2].map((v) => 1e3 * v));
  new Plot({title: "Trunk height", unit: "mm", digits: 1, height: 80, open: false, series: () => [
    curve("height", heights, {color: legColor(0), on: true}), ...others(heights)]});
}

// Torque over speed of the selected joint, all samples, under the line it is held against.
class Cloud {
  constructor() {
    Object.assign(this, panel("Torque over speed"));
    this.canvas = document.createElement("canvas");
    this.still = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", "torque over speed of the selected joint");
    this.box.append(this.canvas);
    this.stale = true;
    plots.push(this);
  }

  draw() {
    this.stale = false;
    if (!this.box.open || !this.canvas.clientWidth) return;
    const width = this.canvas.clientWidth, height = 190, j = S.joint, torque = R.torque[j], speed = R.speed[j];
    const q = sized(this.canvas, this.still, width, height), {stall, slope, name} = R.data.limits, rest = atRest(R, j);
    const [force, rate] = slides(j) ? ["N", "m/s"] : ["N m", "rad/s"];
    let most = 0.05, fast = 0.05;
    for (let i = 0; i < R.N; i++) { most = Math.max(most, Math.abs(torque[i])); fast = Math.max(fast, Math.abs(speed[i])); }
    if (rest < 3 * most) most = Math.max(most, rest);
    most *= 1.12;
    fast *= 1.1;
    const X = (v) => LEFT + ((v + fast) / (2 * fast)) * (width - LEFT - RIGHT), Y = (v) => 4 + ((most - v) / (2 * most)) * (height - 24);
    Object.assign(this, {X, Y, width});
    q.strokeStyle = ink.grid;
    q.fillStyle = ink.soft;
    const line = (x0, y0, x1, y1) => { q.beginPath(); q.moveTo(x0, y0); q.lineTo(x1, y1); q.stroke(); };
    const [xs, dx] = ticks(-fast, fast, 6), [ys, dy] = ticks(-most, most, 5);
    q.textAlign = "center";
    for (const v of xs) { line(X(v), 4, X(v), height - 20); q.fillText(v.toFixed(dx) + (v === xs.at(-1) ? ` ${rate}` : ""), Math.min(X(v), width - 22), height - 6); }
    q.textAlign = "right";
    for (const v of ys) { line(LEFT, Y(v), width - RIGHT, Y(v)); q.fillText(v.toFixed(dy), LEFT - 4, Y(v) + 3); }
    q.fillStyle = legColor(Math.max(0, legOf(j)));
    q.globalAlpha = 0.35;
    for (let i = 0; i < R.N; i++) q.fillRect(X(speed[i]) - 1, Y(torque[i]) - 1, 2, 2);
    q.globalAlpha = 1;
    q.strokeStyle = ink.hot;
    q.setLineDash([6, 3]);
    if (rest < Infinity) for (const sign of [1, -1]) {
      const allowed = (v) => Math.min(R.data.limits.cap[j] ?? Infinity, stall[j] === null ? Infinity : stall[j] - sign * slope[j] * v);
      q.beginPath();
      for (let k = 0; k <= 40; k++) q.lineTo(X((k / 20 - 1) * fast), Y(sign * allowed((k / 20 - 1) * fast)));
      q.stroke();
    }
    q.setLineDash([]);
    const far = rest < Infinity && rest > most ? ` (${rest.toFixed(2)} ${force}, out of sight)` : "";
    this.note.textContent = `[${force}] ${shortJoint(j)}, every sample${rest === Infinity ? "" : `; dashed: ${name}${far}`}`;
  }

  cursor() {
    if (!this.box.open || !this.width) return;
    const z = restored(this.canvas, this.still), i = now();
    z.strokeStyle = ink.ink;
    z.lineWidth = 2;
    z.beginPath();
    z.arc(this.X(R.speed[S.joint][i]), this.Y(R.torque[S.joint][i]), 5, 0, 7);
    z.stroke();
  }
}
