// Header, controls, layers, legend, card, and the table of worst instants.

function element(name, attributes = {}, ...content) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key in made && typeof value !== "string") made[key] = value; else made.setAttribute(key, value);
  }
  made.append(...content);
  return made;
}

const UNITS = {"m": [1e3, "mm", 1], "rad": [DEGREES, "deg", 2], "1": [100, "%", 0], "N m": [1, "N m", 3], "N": [1, "N", 1],
  "rad/s": [1, "rad/s", 2], "m/s": [1e3, "mm/s", 1], "W": [1, "W", 2], "-": [1, "", 3]};

// Decimals of a number: those of its unit, more where that leaves less than three digits.
function decimals(value, least) {
  const size = Math.abs(value);
  return size > 0 && least > 0 ? Math.max(least, Math.min(7, 2 - Math.floor(Math.log10(size)))) : least;
}

function shownNumber(value, unit, error) {
  const [factor, name, least] = UNITS[unit];
  if (value === null || !Number.isFinite(value)) return unit === "m" ? "no foot down" : "none";
  // Five digits at most; a smaller error than the last of them is not shown.
  const most = Math.max(least, 4 - Math.floor(Math.log10(Math.abs(factor * value) || 1)));
  const known = error > 0 ? Math.max(0, -Math.floor(Math.log10(factor * error))) : Infinity;
  const digits = known <= most ? known : error > 0 ? most : decimals(factor * value, least);
  const band = known <= most ? ` \u00B1 ${(factor * error).toFixed(digits)}` : "";
  const plain = digits > 5 && !band ? (factor * value).toPrecision(3) : (factor * value).toFixed(digits);
  return `${plain}${band} ${name}`;
}

function makeHeader() {
  const data = R.data, facts = Object.fromEntries(data.facts);
  const mark = data.good === null ? "" : data.good ? "good" : "bad";
  const verdict = element("span", {class: `verdict ${mark}`, role: "status"}, (mark === "bad" ? "\u26A0 " : "") + data.verdict);
  for (const run of runs.length > 1 ? runs : []) {
    if (run === R) verdict.textContent = "";
    verdict.append(element("span", {class: run.data.good === false ? "bad" : ""}, `${run.data.name}: ${run.data.verdict} `), element("br"));
  }
  const names = runs.length > 1 ? runs.map((run) => run.data.name).join(" / ") : data.name;
  $("header").append(element("b", {}, names), verdict, element("span", {class: "gap"}));
  const captions = runs.map((run) => run.data.caption).filter(Boolean);
  if (captions.length) $("scene").append(element("p", {id: "caption", class: "soft"}, captions.join("; ")));
  if (facts.gait) $("header").append(element("span", {class: "soft wide"}, facts.gait));
  if (D.command) {
    const copy = element("button", {class: "middle", title: `copy the command that made this: ${D.command}`}, "copy ", element("code", {class: "wide"}, D.command));
    copy.onclick = () => copied(D.command, copy);
    $("header").append(copy);
  }
  const list = element("dl");
  for (const run of runs) {
    if (runs.length > 1) list.append(element("dt", {}, "run"), element("dd", {}, element("b", {}, run.data.name), ` ${run.data.verdict}`));
    for (const [name, text] of run.data.facts) list.append(element("dt", {}, name), element("dd", {}, text));
  }
  list.append(element("dt", {}, "made"), element("dd", {}, D.date));
  if (D.command) list.append(element("dt", {}, "command"), element("dd", {}, element("code", {}, D.command)));
  for (const text of spreadTexts()) list.append(element("dt", {}, "bands"), element("dd", {}, text));
  const assumed = [...new Set(runs.flatMap((run) => run.data.assumed))];
  const more = element("div", {}, list);
  for (const [title, texts] of [[`${assumed.length} assumed`, assumed], ["drawing", D.notes]]) {
    if (texts.length) more.append(element("p", {}, title), element("ul", {}, ...texts.map((text) => element("li", {}, text))));
  }
  $("header").append(element("details", {id: "about"}, element("summary", {class: "soft"}, `run, ${assumed.length} assumed`), more));
  const dark = element("button", {"aria-label": "light or dark", title: "light or dark"}, "\u25D0");
  dark.onclick = () => { document.documentElement.classList.toggle("dark"); recolor(); };
  $("header").append(dark);
}

function copied(text, button) {
  const done = () => { button.firstChild.textContent = "copied "; setTimeout(() => { button.firstChild.textContent = "copy "; }, 1500); };
  const byHand = () => {
    const area = element("textarea", {}, text);
    document.body.append(area);
    area.select();
    document.execCommand("copy");
    area.remove();
    done();
  };
  if (navigator.clipboard) navigator.clipboard.writeText(text).then(done, byHand); else byHand();
}

function makeControls() {
  const button = (label, text, action) => {
    const made = element("button", {"aria-label": label, title: label}, text);
    made.onclick = action;
    return made;
  };
  const rate = element("select", {id: "rate", "aria-label": "speed"});
  for (const speed of [...new Set([...SPEEDS, S.rate])].sort((a, b) => a - b)) rate.add(new Option(`${speed}\u00D7`, speed, false, speed === S.rate));
  rate.onchange = () => setRate(+rate.value);
  $("controls").append(
    Object.assign(button("play or pause (space)", "", () => play(!S.playing)), {id: "play"}),
    button("one sample back (left)", "\u2212\u200A1", () => stepBy(-1)), button("one sample on (right)", "+\u200A1", () => stepBy(1)),
    rate, element("output", {id: "now"}));
}

function setRate(rate) {
  S.rate = rate;
  const list = $("rate");
  for (const option of list.options) if (+option.value === rate) list.value = option.value;
}

function showPlaying() {
  if ($("play")) $("play").textContent = S.playing ? "\u275A\u275A" : "\u25B6";
}

const LAYERS = {
  use: "colour by use of torque", forces: "foot forces", cones: "friction cones", support: "support and margin", mass: "centre of mass, trace",
  paths: "paths of feet", feet: "footholds", slip: "where feet slide", names: "names, direction", loads: "payload and pushes",
  edges: "edges", contour: "contours", shadow: "shadow", apart: "side by side",
};
const boxes = {};
function setLayer(name, on) {
  S.layers[name] = on;
  if (boxes[name]) boxes[name].checked = on;
  if (name === "apart") { placeLanes(); camera(S.camera); }
  if (name === "use") showLegend();
  dirty = true;
}

function makeLayers() {
  for (const name of Object.keys(CAMERAS)) {
    const button = element("button", {}, name);
    button.onclick = () => camera(name);
    $("cameras").append(button);
  }
  const present = {use: R.limited, forces: R.force, cones: R.mu, support: R.com && R.force, mass: R.com, paths: R.force, feet: R.force,
    slip: R.grip, loads: R.data.loads.length, contour: !R.data.ground.level, apart: runs.length > 1};
  for (const [name, text] of Object.entries(LAYERS)) {
    if (name in present && !present[name]) continue;
    const box = element("input", {type: "checkbox", checked: S.layers[name]});
    box.onchange = () => setLayer(name, box.checked);
    boxes[name] = box;
    $("layers").lastElementChild.append(element("label", {}, box, text));
  }
  if (matchMedia("(max-width: 760px)").matches) $("layers").open = false;
}

function showLegend() {
  const legend = $("legend");
  legend.textContent = "";
  legend.hidden = !(S.layers.use && R.limited);
  const scale = element("i");
  scale.style.background = heatCss();
  legend.append("use of torque", element("p", {class: "soft", style: "margin:0"}, R.data.limits.name), scale,
    element("div", {}, ...[0, 50, 100].map((percent) => element("span", {style: `left:${percent / 1.3}%`}, `${percent}`)), "%"));
}

function makeTable() {
  const {box} = panel("Worst instants", true), table = element("table", {id: "worst"});
  const [from, until] = R.data.window ?? [start, END];
  box.querySelector("small").textContent = `of ${from.toFixed(2)} to ${until.toFixed(2)} s${worst.some((row) => row.during) ? "; of a push or a lost leg: from then on" : ""}; click a time`;
  const alone = runs.length === 1, shares = alone && worst.some((row) => row.use !== undefined);  // else changes have no room
  const many = alone && R.spread.length > 0;
  if (many) {
    const head = ["", "", "", "", "this run", ...(shares ? ["of limit"] : []), `${R.spread.length + 1} runs, each its own`];
    table.append(element("tr", {}, ...head.map((text) => element("th", {}, text))));
  }
  if (!alone) {
    table.append(element("tr", {}, ...["", "", "", "", R.data.name, ...(shares ? ["of limit"] : []),
      ...runs.slice(1).map((run) => run.data.name), ...runs.slice(1).map(() => "change")].map((text) => element("th", {}, text))));
  }
  worst.forEach((row, k) => {
    const leg = row.joint !== undefined ? legName(row.joint) : row.foot !== undefined ? R.data.feet[row.foot].label ?? R.data.feet[row.foot].name : "";
    const same = runs.slice(1).map((run) => run.data.worst.find((other) => other.key === row.key));
    const change = same.map((other) => changeOf(row, other));
    const button = element("button", {title: `stand at ${row.what}${row.during ? `, of ${row.during.map((t) => t.toFixed(2)).join(" to ")} s` : ""}`}, `${row.time.toFixed(3)} s`);
    button.onclick = () => jump(k);
    table.append(element("tr", {}, ...[`${k + 1}`, button, row.what, leg, shownNumber(row.value, row.unit, runs.length > 1 ? 0 : row.error),
      ...(shares ? [row.use === undefined ? "" : shownNumber(row.use, "1")] : []), ...(many ? [spreadOf(row)] : []), ...same.map((other) => (other ? shownNumber(other.value, other.unit) : "")), ...change].map((cell) => element("td", {}, cell))));
  });
  if (!alone) {
    for (const row of R.data.steady) {
      const same = runs.slice(1).map((run) => run.data.steady.find((other) => other.key === row.key));
      table.append(element("tr", {}, ...["", "steady", row.what, "", shownNumber(row.value, row.unit), ...same.map((other) => (other ? shownNumber(other.value, other.unit) : "")),
        ...same.map((other) => changeOf(row, other))].map((cell) => element("td", {}, cell))));
    }
  }
  box.append(element("div", {class: "scroll"}, table));
}

// The least and the largest of a number of the table, over the run and those of its spread: of its size,
// where its sign is a direction.
function spreadOf(row) {
  const found = R.data.spread.runs.map((run) => run.worst.find((other) => other.key === row.key)?.value);
  const size = /margin|height/.test(row.key) ? Number : Math.abs;
  const values = [row.value, ...found].filter((value) => Number.isFinite(value)).map(size);
  if (!values.length) return "";
  const [low, high] = [Math.min(...values), Math.max(...values)].map((value) => shownNumber(value, row.unit).split(" ")[0]);
  return `${low} \u2026 ${high}${values.length <= R.spread.length ? ` of ${values.length}` : ""}`;
}

// The change of a number: of its size, where its sign is a direction; none of a margin that is used up.
function changeOf(row, other) {
  if (!other?.value || !row.value || (/margin|height/.test(row.key) && (row.value < 0 || other.value < 0))) return "";
  const change = 100 * (Math.abs(other.value / row.value) - 1);
  return `${change > 0 ? "+" : ""}${change.toFixed(1).replace("-", "\u2212")} %`;
}

// What a row of the table is about at a sample; null where it is none of its numbers.
function valueAt(row, i) {
  const quantity = row.key.split(" ").at(-1);
  if (quantity === "torque" || quantity === "speed") return Math.abs(R[quantity][row.joint][i]);
  if (quantity === "use" || quantity === "power") return R[quantity][row.joint][i];
  if (quantity === "roll" || quantity === "pitch") return R[quantity][i] / DEGREES;
  if (quantity === "height") return R.place[2][i];
  return quantity === "force" ? R.press[row.foot][i] : quantity === "margin" ? R.margin[i] : null;
}

// The numbers of what is selected, at the sample or the peak shown.
function valuesNow() {
  const i = now(), j = S.joint, found = {time: S.time, sample: sampleNow(), sampleTime: R.time[i], place: R.place.map((row) => row[i]),
    roll: R.roll[i], pitch: R.pitch[i], height: R.place[2][i]};
  if (R.data.joints.length) Object.assign(found, {joint: R.data.joints[j], angle: R.angle[j][i], speed: R.speed[j][i]});
  if (R.torque && R.data.joints.length) Object.assign(found, {torque: R.torque[j][i], limit: R.limit[j][i], use: R.use[j][i], power: R.power[j][i]});
  if (R.force) Object.assign(found, {press: R.press.map((row) => row[i]), shear: R.shear.map((row) => row[i]), down: R.down.map((row) => row[i] > 0)});
  if (R.grip) found.grip = R.grip.map((row) => row[i]);
  if (R.margin) found.margin = R.margin[i];
  if (R.torque && R.spread.length) {
    const band = bandOf(R, R.torque[j], (run) => run.torque?.[j]);
    found.band = band && [band.low[i], band.high[i]];
  }
  if (S.peak !== null) found.row = {value: worst[S.peak].value, shown: valueAt(worst[S.peak], i), kept: !!worst[S.peak].at};
  return found;
}

const torqueSizes = new Map();
function torqueDigits() {
  if (!torqueSizes.has(S.joint)) torqueSizes.set(S.joint, R.torque[S.joint].reduce((most, v) => Math.max(most, Math.abs(v)), 0));
  return decimals(torqueSizes.get(S.joint), 3);
}

const cardLines = [];
let markedRow = null;
function showCard() {
  const i = now(), j = S.joint, lines = [];
  if (R.data.joints.length) {
    lines.push([shortJoint(j), ""]);
    const along = slides(j), unit = along ? "N" : "N m";
    if (R.torque) {
      const limit = R.limit[j][i];
      lines.push([along ? "force" : "torque", `${R.torque[j][i].toFixed(torqueDigits())} ${unit}`]);
      if (Number.isFinite(limit)) lines.push([R.data.limits.slope[j] ? "line now" : "limit", `\u00B1${limit.toFixed(torqueDigits())} ${unit}`], ["use", `${(100 * R.use[j][i]).toFixed(1)} %`]);
    }
    const [speed, place] = [R.speed[j][i], R.angle[j][i]];
    if (along) lines.push(["speed", `${(1e3 * speed).toFixed(1)} mm/s`], ["travel", `${(1e3 * place).toFixed(2)} mm`]);
    else lines.push(["speed", `${speed.toFixed(3)} rad/s`], ["angle", `${(DEGREES * place).toFixed(2)}\u00B0`]);
  }
  const row = S.peak === null ? null : worst[S.peak], usual = lines.length;
  if (row) {
    lines.push([`worst ${row.what}`, shownNumber(row.value, row.unit, row.error)], ["at", `${row.time.toFixed(4)} s`]);
    const value = row.at ? null : valueAt(row, now());
    if (value !== null && Math.abs(row.time - R.time[i]) > 1e-6) {
      lines.push([`sample at ${R.time[i].toFixed(4)} s`, shownNumber(value, row.unit)]);
    }
  }
  const card = $("card");
  card.hidden = !lines.length;
  lines.forEach(([name, text], k) => {
    cardLines[k] ??= card.appendChild(element("span", k ? (k === 1 || k === 3 ? {class: "first"} : {}) : {class: "first"}, element(k ? "em" : "b"), element("output")));
    const [label, value] = cardLines[k].children;
    if (label.textContent !== name) label.textContent = name;
    if (value.textContent !== text) value.textContent = text;
    cardLines[k].classList.toggle("also", k >= usual);
  });
  cardLines.forEach((line, k) => {
    const display = k < lines.length ? "" : "none";
    if (line.style.display !== display) line.style.display = display;
  });
  if (S.peak === markedRow) return;
  const rows = $("worst").rows, shift = rows.length - worst.length;
  if (markedRow !== null) rows[markedRow + shift].classList.remove("here");
  if (S.peak !== null) rows[S.peak + shift].classList.add("here");
  markedRow = S.peak;
}
