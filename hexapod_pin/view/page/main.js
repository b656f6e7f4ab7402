// One loop draws everything that changed. The first picture is the robot on its ground, drawn at once; other
// samples, colours, the table, plots and what is drawn about the robot follow, some milliseconds at a time.

if (matchMedia("(prefers-color-scheme: dark)").matches) document.documentElement.classList.add("dark");
readLink();
makeHeader();
makeLayers();
showLegend();
const overlays = [];

function recolor() {
  readInks();
  colorScene();
  for (const overlay of overlays) overlay.recolor();
  stale();
}

// What is left to make before all is shown; what needs all makes it at once.
const left = [makeTable, makePanels, stale, ...actors.map((actor) => () => actor.outline()), ...actors.map((actor) => () => { overlays.push(new Overlays(actor)); })];
function makeAll() {
  while (left.length) left.shift()();
}

const stat = {pictures: 0, scene: 0, graphics: 0, plots: 0,
  load: {inflate: inflatedAt - began, viewer: viewerAt - inflatedAt}};
let lastTime = performance.now(), filled = false;

// Everything of a picture but the rasteriser's part: what the scene's objects are, and what is read.
function arrange() {
  const i = now();
  actors.forEach((actor, k) => {
    const {run} = actor, at = now(run);
    if (at >= run.N) actor.pose(at, 0);
    else {
      const time = timeOf(run), before = sampleBefore(run, time), next = Math.min(run.N - 1, before + 1);
      const gap = run.time[next] - run.time[before];
      actor.pose(before, gap > 0 ? (time - run.time[before]) / gap : 0);
    }
    actor.paint(at);
    overlays[k]?.draw(at);
  });
  followRobot(i);
  const [x, y] = focusOf(R, i);
  sun.target.position.set(x, y, 0);
  sun.position.copy(sun.target.position).add(sun.userData.offset);
  sun.castShadow = S.layers.shadow && complete;
}

function readOut() {
  world.updateWorldMatrix(true, true);
  viewer.camera.updateMatrixWorld();
  overlays.forEach((overlay) => overlay.label(now(overlay.actor.run)));
  for (const plot of [bar, ...plots]) readPlot(plot);
  showCard();
}

function readPlot(plot) {
  if (plot.stale) plot.draw();
  plot.cursor();
}

function picture() {
  const a = performance.now();
  arrange();
  const b = performance.now();
  viewer.renderer.render(viewer.scene, viewer.camera);
  const c = performance.now();
  $("now").textContent = `${S.time.toFixed(3)} s`;
  if (filled) readOut();
  const d = performance.now();
  stat.pictures++;
  if (filled) stat.all ??= d;
  if (!stat.first) {
    stat.first = d;
    // Once it is on its way to the screen: inflating leaves the page no time for it.
    requestAnimationFrame(() => setTimeout(() => fill(samples.bytes.length).then(allSamples, trouble)));
  }
  stat.scene += b - a;
  stat.graphics += c - b;
  stat.plots += d - c;
}

function loop(at) {
  if (S.playing) {
    S.time += (Math.min(100, at - lastTime) / 1e3) * S.rate;
    S.peak = null;
    if (S.time > END) {
      if (D.loop) S.time = start; else { S.time = END; play(false); }
    }
    dirty = true;
  }
  lastTime = at;
  if (dirty) {
    dirty = false;
    picture();
  }
  requestAnimationFrame(loop);
}

addEventListener("keydown", onKey);
addEventListener("hashchange", () => { readLink(); stale(); showPlaying(); });
new ResizeObserver(() => { viewer.set_3d_pane_size(); stale(); }).observe(document.body);
new ResizeObserver(() => { viewer.set_3d_pane_size(); stale(); }).observe(view);
viewer.controls.addEventListener("change", () => { dirty = true; });
recolor();
placeLanes();
makeControls();
showPlaying();
viewer.set_3d_pane_size();
camera(S.camera);

// All samples are there: what a test or a program in the page may read and do.
function allSamples() {
  complete = dirty = true;
  left.push(showCard, () => { left.push(...[bar, ...plots].map((plot) => () => readPlot(plot))); });
  fillIn();
  window.playback = {
    state: S, data: D, runs, worst, stat, plots, seek, play, select, zoom, jump, camera, setLayer, setRate, values: valuesNow, viewer, actors,
    bar, overlays, slip: () => slipOf(R), draw: () => { makeAll(); arrange(); $("now").textContent = `${S.time.toFixed(3)} s`; readOut(); }, start, end: END,
  };
}

// Make what is left for some milliseconds at a time, so that keys and fingers are not kept waiting.
function fillIn() {
  const until = performance.now() + 12;
  while (left.length && performance.now() < until) left.shift()();
  if (left.length) { setTimeout(fillIn); return; }
  filled = dirty = true;
}
stat.ready = performance.now();
loop(stat.ready);
