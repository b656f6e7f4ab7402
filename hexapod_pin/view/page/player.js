// Time: what is shown when, at what speed; selection, keys, and the link that carries both.

const start = R.t0, END = start + Math.max(...runs.map((run) => run.end - run.t0));
const S = {
  time: start, playing: true, rate: D.speed, from: start, to: END,
  joint: 0, kind: kinds[0] ?? "", camera: "follow", peak: null,
  layers: {use: true, forces: true, cones: false, support: true, mass: true, paths: true, feet: true,
    slip: true, names: true, edges: true, shadow: true, contour: true, loads: true, apart: runs.length > 1},
};
let dirty = true, complete = false;  // whether all samples are there, not only those of the first picture

const worst = R.data.worst;
{
  const steady = worst.filter((row) => row.joint !== undefined && !row.during);
  const uses = steady.filter((row) => row.unit === "1"), torques = steady.filter((row) => row.key.endsWith(" torque"));
  const share = ({use = 0}) => use ?? Infinity;
  const first = uses.sort((a, b) => (b.value ?? Infinity) - (a.value ?? Infinity))[0]
    ?? torques.sort((a, b) => share(b) - share(a) || b.value - a.value)[0];
  if (first) Object.assign(S, {joint: first.joint, kind: R.data.kinds[first.joint]});
}

const timeOf = (run) => Math.min(run.end, Math.max(run.t0, S.time - start + run.t0));
const sampleNow = (run = R) => sampleAt(run, timeOf(run));
// What is shown of a run: a sample, or at a peak of the first run the state kept of it.
const now = (run = R) => (run === R && S.peak !== null && worst[S.peak].at) || sampleNow(run);
const step = () => (R.N > 1 ? R.even : 0.01);

function seek(time, keepPlaying = false) {
  S.time = Math.max(start, Math.min(END, time));
  S.peak = null;
  if (!keepPlaying) play(false);
  else writeLink();
  dirty = true;
}

function stepBy(samples) {
  const i = sampleNow() + samples;
  seek(i >= 0 && i < R.N ? R.time[i] : S.time + samples * step());
}

function play(on) {
  if (on && S.time >= END) S.time = start;
  S.playing = on;
  showPlaying();
  if (!on) writeLink();
  dirty = true;
}

function select(joint) {
  if (!(joint >= 0 && joint < R.data.joints.length)) return;
  S.joint = joint;
  S.kind = R.data.kinds[joint];
  stale();
  writeLink();
}

// Stand at the worst instant of a row of the table, with its joint selected.
function jump(k) {
  const row = worst[k];
  if (row.joint !== undefined) select(row.joint);
  else if (row.foot !== undefined) {
    const foot = R.data.feet[row.foot], same = foot.joints.find((j) => R.data.kinds[j] === S.kind);
    if (same !== undefined) select(same);
  }
  seek(row.time);
  S.peak = k;
  if (row.time < S.from || row.time > S.to) zoom(start, END);
}

const SPEEDS = [0.05, 0.1, 0.25, 0.5, 1, 2, 4];
function faster(change) {
  const nearest = SPEEDS.reduce((a, b) => (Math.abs(b - S.rate) < Math.abs(a - S.rate) ? b : a));
  setRate(SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, SPEEDS.indexOf(nearest) + change))]);
}

function zoom(from, to) {
  S.from = Math.max(start, Math.min(from, to));
  S.to = Math.min(END, Math.max(from, to));
  const least = 5 * step();
  if (S.to - S.from < least) [S.from, S.to] = [Math.max(start, S.from - least), Math.min(END, S.to + least)];
  stale();
}

// The link: not more often than browsers allow, and not where the page has no address of its own.
let linkTimer = 0;
const hashOf = () => `#t=${S.time.toFixed(3)}&joint=${encodeURIComponent(shortJoint(S.joint))}`;
function writeLink() {
  if (!R.data.joints.length || !/^(http|file)/.test(location.protocol)) return;
  clearTimeout(linkTimer);
  linkTimer = setTimeout(() => {
    if (location.hash === hashOf()) return;
    try { history.replaceState(null, "", hashOf()); } catch { /* a frame without an address */ }
  }, 200);
}

function readLink() {
  const found = new URLSearchParams(location.hash.slice(1));
  const joint = found.get("joint"), time = parseFloat(found.get("t"));
  if (joint) {
    const k = R.data.joints.findIndex((name, j) => name === joint || shortJoint(j) === joint);
    if (k >= 0) Object.assign(S, {joint: k, kind: R.data.kinds[k]});
  }
  if (Number.isFinite(time)) {
    S.time = Math.max(start, Math.min(END, time));
    S.playing = false;
  }
  if (found.get("camera") in CAMERAS) S.camera = found.get("camera");
}

const KEYS = {
  " ": () => play(!S.playing),
  ArrowLeft: (e) => (e.shiftKey ? seek(S.time - 0.1) : stepBy(-1)),
  ArrowRight: (e) => (e.shiftKey ? seek(S.time + 0.1) : stepBy(1)),
  Home: () => seek(start),
  End: () => seek(END),
  "+": () => faster(1), "=": () => faster(1), "-": () => faster(-1),
  0: () => zoom(start, END),
};
function onKey(event) {
  if (/SELECT|INPUT|TEXTAREA/.test(event.target.tagName) || event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === " " && /BUTTON|SUMMARY/.test(event.target.tagName)) return;
  const action = KEYS[event.key];
  if (!action) return;
  event.preventDefault();
  action(event);
}
