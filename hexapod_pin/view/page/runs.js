// The runs: their samples by name, and what follows from them.

const DEGREES = 180 / Math.PI;
const SLIDES = 0.98;  // share of the largest friction force from which a foot counts as sliding

// Samples 0 to N - 1, and behind them the states kept of peaks between samples; what such a state has
// not is that of the sample nearest to it.
function runOf(data, number) {
  const time = arrays[data.channels.time][0], N = time.length;
  const run = {data, number, N, time, t0: time[0], end: time[N - 1]};
  run.even = N > 1 ? (run.end - run.t0) / (N - 1) : 1;
  const kept = data.worst.filter((row) => row.state && N > 1);
  run.near = kept.map((row) => sampleAt(run, row.time));
  kept.forEach((row, k) => { row.at = N + k; });
  run.total = N + kept.length;
  const extended = (row, of) => {
    if (row.length !== N || !kept.length) return row;
    const all = new Float64Array(run.total);
    all.set(row);
    kept.forEach((one, k) => { all[N + k] = of(one) ?? row[run.near[k]]; });
    return all;
  };
  run.time = extended(time, (one) => one.time);
  const part = (name) => {
    if (!(name in data.channels)) return null;
    const rows = arrays[data.channels[name]];
    return rowsWhenRead(rows.length, (c) => extended(rows[c], (one) => one.state[name]?.[c]));
  };
  Object.assign(run, {
    place: part("place"), turn: part("turn"),
    angle: part("angle"), speed: part("speed"), torque: part("torque"), force: part("force"),
    foot: part("foot"), normal: part("normal"), down: part("down"), friction: part("friction"),
    margins: part("margin"), com: part("com"), slipSpeed: part("slip_speed"),
    current: part("current"), motorCurrent: part("motor_current"), temperature: part("temperature"),
    lift: "lift" in data.ground ? extended(arrays[data.ground.lift][0], () => undefined) : null,
    legs: data.feet.map((_, f) => f).filter((f) => data.feet[f].label),
  });
  // The motion up to a sample: all that a picture needs before all samples are there.
  let few = null, until = -1;
  run.motion = (i) => {
    if (complete) return run;
    if (i > until) {
      until = i + 1;
      few = Object.fromEntries(["place", "turn", "angle"].map((name) => [name, arrays[data.channels[name]].upTo(until)]));
    }
    return few;
  };
  derive(run);
  run.spread = (data.spread?.runs ?? []).map((one) => runOf({...data, ...one, worst: [], spread: null}, number));
  return run;
}
const runs = D.runs.map(runOf);
const R = runs[0];

// The least and the largest of a row over a run and those of its spread, sample by sample, made when they
// are first read; null where one of them has no such row. A state kept of a peak has those of the sample
// nearest to it, and its own.
const bands = new Map();
function bandOf(run, row, get) {
  if (!run.spread.length || !row) return null;
  if (bands.has(row)) return bands.get(row);
  const rows = run.spread.map(get), low = Float64Array.from(row), high = Float64Array.from(row);
  const found = rows.every((one) => one?.length >= run.N) ? {low, high} : null;
  for (const one of found ? rows : []) {
    for (let i = 0; i < run.total; i++) {
      const v = one[i < run.N ? i : run.near[i - run.N]];
      low[i] = Math.min(low[i], v);
      high[i] = Math.max(high[i], v);
    }
  }
  bands.set(row, found);
  return found;
}

// Values of a row, computed when they are first read: of each run once.
function readOnce(make) {
  const found = new Map();
  return (run) => {
    if (!found.has(run)) found.set(run, make(run));
    return found.get(run);
  };
}

function tabulated(count, value) {
  const row = new Float64Array(count);
  for (let i = 0; i < count; i++) row[i] = value(i);
  return row;
}

// The limit at rest; infinite where there is none.
function atRest(run, j) {
  const {stall, cap} = run.data.limits;
  return Math.min(stall[j] ?? Infinity, cap[j] ?? Infinity);
}

// The limit at a speed in the torque's direction, as the budget takes it.
function limitRow(run, j) {
  const {stall, slope, cap} = run.data.limits, most = cap[j] ?? Infinity;
  if (stall[j] === null) return new Float64Array(run.total).fill(most);
  const torque = run.torque[j], speed = run.speed[j];
  return tabulated(run.total, (i) => Math.max(0, Math.min(most, stall[j] - slope[j] * Math.sign(torque[i]) * speed[i])));
}

// Each row is computed when it is first read: a page opens with few of them.
function derive(run) {
  const {data, total} = run, {joints} = data, feet = data.feet.length;
  if (run.torque) {
    run.limit = rowsWhenRead(joints.length, (j) => limitRow(run, j));
    run.use = rowsWhenRead(joints.length, (j) => {
      const torque = run.torque[j], limit = run.limit[j];
      return tabulated(total, (i) => (torque[i] === 0 ? 0 : Math.abs(torque[i]) / limit[i]));
    });
    run.limited = joints.some((_, j) => atRest(run, j) < Infinity);
    run.power = rowsWhenRead(joints.length, (j) => {
      const torque = run.torque[j], speed = run.speed[j];
      return tabulated(total, (i) => torque[i] * speed[i]);
    });
  }
  if (run.force) {
    const moving = D.table[data.channels.normal].n > 1;
    const normal = (f, c, i) => run.normal[3 * f + c][moving ? i : 0];
    const along = (f) => [0, 1, 2].map((c) => [run.force[3 * f + c], run.normal[3 * f + c]]);
    run.normalAt = normal;
    run.press = rowsWhenRead(feet, (f) => {
      const [[x, a], [y, b], [z, c]] = along(f);
      return tabulated(total, (i) => { const k = moving ? i : 0; return x[i] * a[k] + y[i] * b[k] + z[i] * c[k]; });
    });
    run.shear = rowsWhenRead(feet, (f) => {
      const [[x, a], [y, b], [z, c]] = along(f), press = run.press[f];
      return tabulated(total, (i) => {
        const k = moving ? i : 0, p = press[i];
        const dx = x[i] - p * a[k], dy = y[i] - p * b[k], dz = z[i] - p * c[k];
        return Math.sqrt(dx * dx + dy * dy + dz * dz);  // hypot is several times slower
      });
    });
    run.mu = run.friction && ((f, i) => run.friction[f][run.friction[f].length > 1 ? i : 0]);
    if (run.friction) {
      run.grip = rowsWhenRead(feet, (f) => {
        const mu = run.friction[f], press = run.press[f], shear = run.shear[f], down = run.down[f], same = mu.length === 1;
        return tabulated(total, (i) => {
          const most = mu[same ? 0 : i] * press[i];
          return down[i] && most > 0 ? shear[i] / most : 0;
        });
      });
    }
  }
  Object.defineProperty(run, "margin", {get: () => run.margins?.[0]});
  const angles = {
    roll: (i, [x, y, z, w]) => DEGREES * Math.atan2(2 * (w[i] * x[i] + y[i] * z[i]), 1 - 2 * (x[i] * x[i] + y[i] * y[i])),
    pitch: (i, [x, y, z, w]) => DEGREES * Math.asin(Math.max(-1, Math.min(1, 2 * (w[i] * y[i] - z[i] * x[i])))),
  };
  for (const [name, angle] of Object.entries(angles)) {
    Object.defineProperty(run, name, {configurable: true, get() {
      const {turn} = run, rows = [turn[0], turn[1], turn[2], turn[3]], value = tabulated(total, (i) => angle(i, rows));
      Object.defineProperty(run, name, {value});
      return value;
    }});
  }
}

function yawOf(run, i) {
  const {turn: [x, y, z, w]} = run.motion(i);
  return Math.atan2(2 * (w[i] * z[i] + x[i] * y[i]), 1 - 2 * (y[i] * y[i] + z[i] * z[i]));
}

// The power of all joints together.
function totalPower(run) {
  if (!run.totalPower && run.power) {
    run.totalPower = new Float64Array(run.total);
    for (const row of run.power) row.forEach((p, i) => { run.totalPower[i] += p; });
  }
  return run.totalPower;
}

// How far each foot's contact point slid within the ground since it touched down [m], rolling of the
// foot's sphere left out: the sum of what the material point on the ground moves between samples.
function slipOf(run) {
  if (run.slip || !run.force) return run.slip;
  const V = THREE.Vector3, turns = run.data.feet.map(() => new THREE.Quaternion());
  const bodies = run.data.tree.map((b) => ({...b, base: new THREE.Quaternion(...b.turn), now: new THREE.Quaternion(),
    along: b.axis && new V(...b.axis)}));
  const bend = new THREE.Quaternion(), change = new THREE.Quaternion(), arm = new V(), before = new V(), move = new V();
  run.slip = run.data.feet.map(() => new Float64Array(run.total));
  const sums = run.data.feet.map(() => new V());
  for (let i = 0; i < run.N; i++) {
    bodies.forEach((b) => {
      if (b.parent < 0) b.now.set(run.turn[0][i], run.turn[1][i], run.turn[2][i], run.turn[3][i]).normalize();
      else {
        b.now.copy(bodies[b.parent].now).multiply(b.base);
        if (b.joint >= 0 && !b.slides) b.now.multiply(bend.setFromAxisAngle(b.along, run.angle[b.joint][i]));
      }
    });
    run.data.feet.forEach((foot, f) => {
      const now = bodies[foot.body].now;
      if (i && run.down[f][i] && run.down[f][i - 1]) {
        arm.set(...[0, 1, 2].map((c) => -foot.radius * run.normalAt(f, c, i)));
        before.copy(arm);
        change.copy(now).multiply(turns[f].invert());
        arm.applyQuaternion(change).sub(before);
        move.set(...[0, 1, 2].map((c) => run.foot[3 * f + c][i] - run.foot[3 * f + c][i - 1])).add(arm);
        const out = move.x * run.normalAt(f, 0, i) + move.y * run.normalAt(f, 1, i) + move.z * run.normalAt(f, 2, i);
        move.x -= out * run.normalAt(f, 0, i);
        move.y -= out * run.normalAt(f, 1, i);
        move.z -= out * run.normalAt(f, 2, i);
        sums[f].add(move);
      } else sums[f].set(0, 0, 0);
      run.slip[f][i] = sums[f].length();
      turns[f].copy(now);
    });
  }
  run.slip.forEach((row) => run.near.forEach((i, k) => { row[run.N + k] = row[i]; }));
  return run.slip;
}

// The sample nearest to a time, and the one at or before it.
function sampleAt(run, time) {
  const before = sampleBefore(run, time), after = Math.min(run.N - 1, before + 1);
  return time - run.time[before] <= run.time[after] - time ? before : after;
}

function sampleBefore(run, time) {
  let low = 0, high = run.N - 1;
  if (!(time > run.time[0])) return 0;
  if (time >= run.time[high]) return high;
  const guess = Math.min(high - 1, Math.floor((time - run.t0) / run.even));
  if (run.time[guess] <= time && time < run.time[guess + 1]) return guess;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (run.time[middle] <= time) low = middle; else high = middle;
  }
  return low;
}

const legsOf = (run) => run.legs.map((f) => run.data.feet[f]);
const kinds = [...new Set(R.data.kinds)];
const ofKind = (kind, run = R) => run.data.kinds.map((_, j) => j).filter((j) => run.data.kinds[j] === kind);
const legOf = (j, run = R) => legsOf(run).findIndex((foot) => foot.joints.includes(j));
const shortJoint = (j, run = R) => run.data.joints[j].replace(/_joint$/, "");
const slides = (j) => R.data.tree.some((body) => body.joint === j && body.slides);
const pushText = ({force, torque}) => [[force, "N"], [torque, "N m"]].filter(([v]) => Math.hypot(...v) > 0)
  .map(([v, unit]) => `${+Math.hypot(...v).toPrecision(3)} ${unit}`).join(", ");
const loadText = (load) => (load.kind === "payload" ? `payload ${+load.mass.toPrecision(4)} kg` : `push ${pushText(load)}`);
const legName = (j, run = R) => legsOf(run)[legOf(j, run)]?.label ?? shortJoint(j, run);
