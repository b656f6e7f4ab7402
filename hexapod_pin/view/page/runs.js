// The runs: their samples by name, and what follows from them.

const DEGREES = 180 / Math.PI;
const SLIDES = 0.98;  // share of the largest friction force from which a foot counts as sliding

const runs = D.runs.map((data, number) => {
  const part = (name) => (name in data.channels ? arrays[data.channels[name]] : null);
  const time = part("time")[0], N = time.length;
  const run = {
    data, number, N, time, t0: time[0], end: time[N - 1], place: part("place"), turn: part("turn"),
    angle: part("angle"), speed: part("speed"), torque: part("torque"), force: part("force"),
    foot: part("foot"), normal: part("normal"), down: part("down"), friction: part("friction"),
    margin: part("margin")?.[0], com: part("com"), slipSpeed: part("slip_speed"),
    current: part("current"), temperature: part("temperature"), lift: "lift" in data.ground ? arrays[data.ground.lift][0] : null,
    legs: data.feet.map((_, f) => f).filter((f) => data.feet[f].label),
  };
  run.even = N > 1 ? (run.end - run.t0) / (N - 1) : 1;
  derive(run);
  return run;
});
const R = runs[0];

function tabulated(N, value) {
  const row = new Float64Array(N);
  for (let i = 0; i < N; i++) row[i] = value(i);
  return row;
}

// The limit at rest and at a speed in the torque's direction, as the budget takes it.
function limitAt(run, j, i) {
  const stall = run.data.limits.stall[j];
  if (stall === null) return Infinity;
  const slope = run.data.limits.slope[j];
  if (!slope) return stall;
  return Math.max(0, stall - slope * Math.sign(run.torque[j][i]) * run.speed[j][i]);
}

function derive(run) {
  const {N, data} = run, joints = data.joints;
  if (run.torque) {
    run.limit = joints.map((_, j) => tabulated(N, (i) => limitAt(run, j, i)));
    run.use = joints.map((_, j) => tabulated(N, (i) => {
      const size = Math.abs(run.torque[j][i]), limit = run.limit[j][i];
      return size === 0 ? 0 : size / limit;
    }));
    run.limited = data.limits.stall.some((stall) => stall !== null);
    run.power = joints.map((_, j) => tabulated(N, (i) => run.torque[j][i] * run.speed[j][i]));
    run.totalPower = tabulated(N, (i) => run.power.reduce((sum, p) => sum + p[i], 0));
  }
  if (run.force) {
    const normal = (f, c, i) => run.normal[3 * f + c][run.normal[0].length > 1 ? i : 0];
    run.normalAt = normal;
    run.press = data.feet.map((_, f) => tabulated(N, (i) =>
      run.force[3 * f][i] * normal(f, 0, i) + run.force[3 * f + 1][i] * normal(f, 1, i)
        + run.force[3 * f + 2][i] * normal(f, 2, i)));
    run.shear = data.feet.map((_, f) => tabulated(N, (i) => Math.hypot(
      ...[0, 1, 2].map((c) => run.force[3 * f + c][i] - run.press[f][i] * normal(f, c, i)))));
    const mu = (f, i) => run.friction[f][run.friction[f].length > 1 ? i : 0];
    run.mu = run.friction && mu;
    if (run.friction) {
      run.grip = data.feet.map((_, f) => tabulated(N, (i) => {
        const most = mu(f, i) * run.press[f][i];
        return run.down[f][i] && most > 0 ? run.shear[f][i] / most : 0;
      }));
    }
  }
  const [x, y, z, w] = run.turn;
  run.roll = tabulated(N, (i) => DEGREES * Math.atan2(
    2 * (w[i] * x[i] + y[i] * z[i]), 1 - 2 * (x[i] * x[i] + y[i] * y[i])));
  run.pitch = tabulated(N, (i) => DEGREES * Math.asin(
    Math.max(-1, Math.min(1, 2 * (w[i] * y[i] - z[i] * x[i])))));
  run.yaw = tabulated(N, (i) => Math.atan2(
    2 * (w[i] * z[i] + x[i] * y[i]), 1 - 2 * (y[i] * y[i] + z[i] * z[i])));
}

// How far each foot's contact point slid within the ground since it touched down [m], rolling of the
// foot's sphere left out: the sum of what the material point on the ground moves between samples.
function slipOf(run) {
  if (run.slip || !run.force) return run.slip;
  const V = THREE.Vector3, turns = run.data.feet.map(() => new THREE.Quaternion());
  const bodies = run.data.tree.map((b) => ({...b, base: new THREE.Quaternion(...b.turn), now: new THREE.Quaternion(),
    along: b.axis && new V(...b.axis)}));
  const bend = new THREE.Quaternion(), change = new THREE.Quaternion(), arm = new V(), before = new V(), move = new V();
  run.slip = run.data.feet.map(() => new Float64Array(run.N));
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
const legName = (j, run = R) => legsOf(run)[legOf(j, run)]?.label ?? shortJoint(j, run);
