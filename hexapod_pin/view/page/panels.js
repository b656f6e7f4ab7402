// Which plots a page has: torques, forces, balance, trunk, slip, power, and torque over speed.

const others = (get) => runs.slice(1).map((run, k) => ({run, name: run.data.name, y: get(run), color: legColor(k + 3),
  dash: [2, 2], ghost: true})).filter((s) => s.y && s.y.length === s.run.total);
const byLeg = (get, kind = S.kind) => R.legs.map((f, leg) => ({f, leg, foot: R.data.feet[f]})).map(({f, leg, foot}) => {
  const joint = foot.joints.find((j) => R.data.kinds[j] === kind);
  return {name: foot.label, run: R, y: get(f, joint), color: legColor(leg), dash: legDash(leg),
    on: leg === legOf(S.joint), pick: joint === undefined ? null : () => select(joint)};
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

function makePanels() {
  if (R.torque && R.limited) {
    const top = tabulated(R.total, () => 1);
    const worstOf = rowsWhenRead(kinds.length, (k) => {
      const row = new Float64Array(R.total);
      for (const j of ofKind(kinds[k])) R.use[j].forEach((use, i) => { if (use > row[i]) row[i] = Math.min(9.99, use); });
      return row;
    });
    new Plot({title: "Use of limit, worst leg of each kind", unit: "1", floor: 0, height: 100,
      limit: () => ({y: top, name: R.data.limits.name}),
      series: () => kinds.map((kind, k) => ({name: kind, run: R, y: worstOf[k], color: legColor([0, 4, 2][k % 3] + (k > 2)), on: kind === S.kind,
        pick: () => select(ofKind(kind).reduce((a, j) => (R.use[j][now()] > R.use[a][now()] ? j : a)))}))});
  }
  if (R.torque && R.data.joints.length) makeTorque();
  if (R.force) makeForces();
  if (R.margins) {
    const scaled = readOnce((run) => run.margin?.map((v) => 1e3 * v));
    new Plot({title: "Static stability margin", unit: "mm", digits: 1, height: 86, floor: 0,
      series: () => [{name: "margin", run: R, y: scaled(R), color: legColor(0), on: true}, ...others(scaled)]});
  }
  makeTrunk();
  if (R.force) {
    const millimetres = new Map();
    new Plot({title: "Slip since touch-down", unit: "mm", digits: 2, height: 96, open: false, floor: 0, rows: true,
      series: () => {
        if (!millimetres.size) slipOf(R).forEach((row, f) => millimetres.set(f, row.map((v) => 1e3 * v)));
        return byLeg((f) => millimetres.get(f));
      }});
    if (R.slipSpeed) {
      const shown = rowsWhenRead(R.slipSpeed.length, (f) => R.slipSpeed[f].map((v) => 1e3 * v));
      new Plot({title: "Slip speed", unit: "mm/s", digits: 1, height: 96, open: false, floor: 0, rows: true, series: () => byLeg((f) => shown[f])});
    }
  }
  if (R.torque) {
    new Plot({title: "Power", unit: "W", height: 96, open: false, series: () => [
      {name: "all joints", run: R, y: totalPower(R), color: legColor(0)},
      {name: shortJoint(S.joint), run: R, y: R.power[S.joint], color: legColor(4), on: true}, ...others(totalPower)].filter((s) => s.y)});
    const perTorque = R.data.limits.per_torque;
    if (R.current) makeRecorded("Motor current", "A", R.current);
    else if (R.motorCurrent) makeRecorded("Motor current, its gear's losses included", "A", R.motorCurrent);
    else if (perTorque.some((ratio) => ratio !== null)) {
      const current = rowsWhenRead(R.torque.length, (j) => R.torque[j].map((v) => (perTorque[j] ?? NaN) * Math.abs(v)));
      new Plot({title: "Motor current, of its torque", unit: "A", height: 96, open: false, floor: 0, rows: true,
        series: () => byLeg((f, j) => current[j])});
    }
    if (R.temperature) makeRecorded("Winding temperature", "deg C", R.temperature);
    new Cloud();
  }
}

// What a run recorded of every joint.
function makeRecorded(title, unit, rows) {
  new Plot({title, unit, height: 96, open: false, rows: true, series: () => byLeg((f, j) => (j === undefined ? null : rows[j]))});
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
      const legged = byLeg((_, j) => (j === undefined ? null : R.torque[j]));
      const found = legged.length ? legged : ofKind(S.kind).map((j, k) => ({name: shortJoint(j), run: R, y: R.torque[j],
        color: legColor(k), dash: legDash(k), on: j === S.joint, pick: () => select(j)}));
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
      return [...byLeg((f) => R[rows][f]), ...others((run) => run[rows]?.[sameFoot(run)])];
    }});
  plot.summary.append(chooser(Object.keys(shown), "which force", (value) => { name = value; }));
}

function makeTrunk() {
  new Plot({title: "Trunk roll and pitch", unit: "deg", digits: 2, height: 86, open: false, series: () => [
    {name: "roll", run: R, y: R.roll, color: legColor(0)}, {name: "pitch", run: R, y: R.pitch, color: legColor(4), dash: [6, 3]},
    ...others((run) => run.pitch).map((s) => ({...s, name: `${s.name} pitch`}))]});
  const heights = readOnce((run) => run.place[2].map((v) => 1e3 * v));
  new Plot({title: "Trunk height", unit: "mm", digits: 1, height: 80, open: false, series: () => [
    {name: "height", run: R, y: heights(R), color: legColor(0), on: true}, ...others(heights)]});
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
