// The time bar is the gait diagram: stance of each leg, worst instants, pushes, contacts of the trunk.

const bar = {
  canvas: $("bar"), still: document.createElement("canvas"), stale: true, width: 100, h: 80,

  // What is written in a row of its own between the numbers and the legs: they would hide stances.
  flags: [
    ...R.data.loads.filter((load) => load.kind !== "payload").map((load) => [load.start, load.kind === "push" ? loadText(load) : `${load.leg} lost`]),
    ...(R.data.fall ? [[R.data.fall.time, "falls"]] : []),
  ].sort((a, b) => a[0] - b[0]),

  left: 12 + 7 * Math.min(6, Math.max(2, ...legsOf(R).map((foot) => foot.label.length))),
  x(time) { return this.left + ((time - start) / (END - start || 1)) * (this.width - this.left - 8); },
  time(x) { return start + ((x - this.left) / (this.width - this.left - 8)) * (END - start); },

  draw() {
    this.stale = false;
    const {canvas} = this, width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width) return;
    this.width = width;
    const q = sized(canvas, this.still, width, height), rows = R.legs.length;
    canvas.style.height = "";
    const marks = this.flags.length ? 24 : 12, h = height - 15 - marks, row = rows ? h / rows : h, chosen = legOf(S.joint);
    this.h = marks + h;
    q.translate(0, marks);
    if (R.data.window) {
      const [a, b] = R.data.window.map((t) => Math.max(start, Math.min(END, t)));
      q.fillStyle = ink.grid;
      q.fillRect(this.x(a), 0, this.x(b) - this.x(a), h);
    }
    R.legs.forEach((f, leg) => {
      q.fillStyle = leg === chosen ? ink.ink : ink.soft;
      q.textAlign = "left";
      q.fillText(R.data.feet[f].label.slice(0, 6), 3, (leg + 0.5) * row + 3.5);
      q.fillStyle = legColor(leg);
      q.globalAlpha = leg === chosen ? 1 : 0.75;
      const down = R.down[f];
      for (let i = 0; i < R.N;) {
        if (!down[i]) { i++; continue; }
        let k = i;
        while (k < R.N && down[k]) k++;
        const from = this.x(R.time[i]), to = this.x(R.time[Math.min(R.N - 1, k)]);
        q.fillRect(from, leg * row + 1.5, Math.max(1, to - from - 0.5), row - 3);
        i = k;
      }
      q.globalAlpha = 1;
    });
    this.events(q, h);
    q.fillStyle = ink.soft;
    q.textAlign = "center";
    const [times, digits] = ticks(start, END, Math.max(3, width / 90));
    for (const t of times) {
      const text = `${t.toFixed(digits)} s`;
      q.fillText(text, Math.max(this.left, Math.min(width - 1 - 0.5 * q.measureText(text).width, this.x(t))), h + 12);
    }
    this.peaks(q);
    if (S.from > start || S.to < END) {
      q.strokeStyle = ink.select;
      q.lineWidth = 2;
      q.strokeRect(this.x(S.from), 0, this.x(S.to) - this.x(S.from), h);
    }
  },

  // Numbers as in the table; marks that would coincide share one.
  peaks(q) {
    const groups = [];
    worst.map((row, k) => [this.x(row.time), k + 1]).sort((a, b) => a[0] - b[0]).forEach(([x, number]) => {
      const last = groups.at(-1), least = x > this.width - 50 ? 110 : 52;  // there numbers stand on the left
      if (last && x - last.x < least) last.numbers.push(number); else groups.push({x, numbers: [number]});
    });
    const low = this.flags.length ? -12 : 0;
    q.fillStyle = ink.hot;
    q.textAlign = "center";
    for (const {x, numbers} of groups) {
      numbers.sort((a, b) => a - b);
      q.beginPath();
      q.moveTo(x, low); q.lineTo(x - 3.5, low - 5); q.lineTo(x + 3.5, low - 5); q.fill();
      const text = numbers.length > 3 ? `${numbers.slice(0, 2).join(",")}\u2026` : numbers.join(",");
      q.textAlign = x > this.width - 50 ? "right" : "left";
      q.fillText(text, x + (q.textAlign === "left" ? 5 : -5), low - 3);
    }
  },

  events(q, h) {
    const line = (time, color) => { q.fillStyle = color; q.fillRect(this.x(time) - 1, 0, 2, h); };
    for (const load of R.data.loads) {
      if (load.kind === "push") {
        q.fillStyle = "#7b3fa055";
        q.fillRect(this.x(load.start), 0, Math.max(3, this.x(load.end) - this.x(load.start)), h);
      } else if (load.kind === "lost") {
        line(load.start, "#7b3fa0");
      }
    }
    for (const event of R.data.events.slice(0, 200)) line(event.time, ink.hot);
    if (R.data.fall) line(R.data.fall.time, ink.hot);
    // Texts that would meet stand behind each other.
    const texts = [];
    for (const [time, text] of this.flags) {
      const last = texts.at(-1), x = this.x(time) - 1;
      if (last && x < last.x + q.measureText(last.text).width + 6) last.text += `, ${text}`; else texts.push({x, text});
    }
    q.fillStyle = ink.ink;
    q.textAlign = "left";
    for (const {x, text} of texts) q.fillText(text, Math.max(0, Math.min(x, this.width - q.measureText(text).width - 2)), -3);
  },

  cursor() {
    const z = restored(this.canvas, this.still);
    z.fillStyle = ink.ink;
    z.fillRect(this.x(S.time) - 1, 8, 2, this.h - 6);
    this.canvas.setAttribute("aria-valuenow", S.time.toFixed(3));
    this.canvas.setAttribute("aria-valuetext", `${S.time.toFixed(3)} seconds`);
  },
};

bar.canvas.classList.toggle("flagged", bar.flags.length > 0);
bar.canvas.setAttribute("aria-valuemin", start.toFixed(3));
bar.canvas.setAttribute("aria-valuemax", END.toFixed(3));
bar.canvas.onpointerdown = bar.canvas.onpointermove = (event) => {
  if (!event.buttons) return;
  bar.canvas.setPointerCapture(event.pointerId);
  seek(bar.time(event.offsetX));
};
