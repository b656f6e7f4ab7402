// What is drawn about the first run's forces and balance: arrows, cones, support, paths, loads, names.

const LONGEST = 1e6;  // of an arrow [m]: three.js computes in single precision
const UP = new THREE.Vector3(0, 0, 1);
const BLUE = 0x0072b2, RED = 0xb3261e, GREEN = 0x00855f, PURPLE = 0x7b3fa0;

function dynamic(count, material, Kind) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * count), 3));
  const object = new Kind(geometry, material);
  object.frustumCulled = false;
  return object;
}

// An arrow of unit length along z with a pale outline; seen through the robot.
function arrowOf(color, width) {
  const group = new THREE.Group();
  for (const [shade, grow, order] of [[0xffffff, 1.7, 8], [color, 1, 9]]) {
    const material = new THREE.MeshBasicMaterial({color: shade, depthTest: false, transparent: true,
      opacity: order === 8 ? 0.55 : 0.95, fog: false});
    const shaft = new THREE.CylinderGeometry(width * grow, width * grow, 0.8, 10);
    shaft.rotateX(Math.PI / 2);
    shaft.translate(0, 0, 0.4);
    const head = new THREE.ConeGeometry(2.3 * width * (grow > 1 ? 1.35 : 1), grow > 1 ? 0.23 : 0.2, 14);
    head.rotateX(Math.PI / 2);
    head.translate(0, 0, 0.9);
    for (const geometry of [shaft, head]) {
      const mesh = new THREE.Mesh(geometry, material);
      mesh.renderOrder = order;
      group.add(mesh);
    }
  }
  return group;
}

const pointing = new THREE.Vector3();
function aim(arrow, x, y, z, scale) {
  pointing.set(x, y, z);
  const length = pointing.length();
  arrow.visible = length * scale > 1e-4;
  if (!arrow.visible) return;
  arrow.quaternion.setFromUnitVectors(UP, pointing.divideScalar(length));
  arrow.scale.set(1, 1, Math.min(LONGEST, length * scale));
}

function hull(points) {
  if (points.length < 3) return points;
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (list) => {
    const found = [];
    for (const p of list) {
      while (found.length > 1) {
        const [a, b] = found.slice(-2);
        if ((b[0] - a[0]) * (p[1] - a[1]) > (b[1] - a[1]) * (p[0] - a[0])) break;
        found.pop();
      }
      found.push(p);
    }
    return found.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

class Overlays {
  constructor(actor) {
    this.actor = actor;
    const {run} = actor, r = run.data.reach;
    this.r = r;
    this.group = new THREE.Group();
    actor.lane.add(this.group);
    const basic = (color, more) => new THREE.MeshBasicMaterial({color, fog: false, ...more});
    const pale = {transparent: true, opacity: 0.18, side: 2, depthWrite: false};
    const seenThrough = {depthTest: false, transparent: true};
    const line = (color) => new THREE.LineBasicMaterial({color});
    const feet = run.force ? run.data.feet : [];
    this.arrows = feet.map(() => this.add(arrowOf(0xd0201a, 0.011 * r)));
    this.cones = feet.map(() => {
      const cone = new THREE.ConeGeometry(1, 1, 32, 1, true);
      cone.rotateX(-Math.PI / 2);
      cone.translate(0, 0, 0.5);
      return this.add(new THREE.Mesh(cone, basic(GREEN, {...pale, opacity: 0.25})));
    });
    if (run.com && feet.length) {
      this.polygon = this.add(dynamic(3 * feet.length, basic(BLUE, pale), THREE.Mesh));
      this.rim = this.add(dynamic(2 * feet.length, line(BLUE), THREE.LineSegments));
      this.reserve = this.add(dynamic(2, line(GREEN), THREE.Line));
    }
    if (run.com) {
      this.mass = this.add(new THREE.Mesh(new THREE.SphereGeometry(0.022 * r, 16, 12), basic(RED, seenThrough)));
      this.mass.renderOrder = 7;
      this.drop = this.add(dynamic(2, line(RED), THREE.Line));
    }
    this.makePaths(line);
    this.travel = this.add(this.travelArrow(basic(0x3f7f5f, {...pale, opacity: 0.75})));
    this.loads = run.data.loads.filter((load) => load.kind !== "lost").map((load) => {
      const object = load.kind === "payload"
        ? new THREE.Mesh(new THREE.BoxGeometry(0.16 * r, 0.16 * r, 0.1 * r), basic(PURPLE, {...seenThrough, opacity: 0.55}))
        : arrowOf(PURPLE, 0.014 * r);
      if (load.kind === "payload") object.renderOrder = 6;
      return {load, object: this.add(object)};
    });
    this.place = new THREE.Vector3();
    this.makeNames();
    this.recolor();
  }

  add(object) {
    this.group.add(object);
    return object;
  }

  // Paths of feet and of the centre of mass, footholds, and where feet slid.
  makePaths(line) {
    const {run} = this.actor, every = Math.max(1, Math.round(0.02 / step()));
    const count = Math.floor((run.N - 1) / every) + 1;
    this.every = every;
    const path = (color, point) => {
      const object = this.add(dynamic(count, line(color), THREE.Line)), {array} = object.geometry.attributes.position;
      for (let k = 0; k < count; k++) array.set(point(Math.min(run.N - 1, k * every)), 3 * k);
      return object;
    };
    const feet = run.force ? run.data.feet : [];
    const sole = (f, i) => [0, 1, 2].map((c) => run.foot[3 * f + c][i] - feet[f].radius * run.normalAt(f, c, i));
    this.sole = sole;
    const lowest = (i) => Math.min(...feet.map((_, f) => sole(f, i)[2]));
    this.trace = run.com && path(RED, (i) => [run.com[0][i], run.com[1][i], (feet.length ? lowest(i) : 0) + 0.004 * this.r]);
    this.swings = run.legs.map((f, k) => path(legColor(k), (i) => sole(f, i)));
    const holds = [], slides = [];
    run.legs.forEach((f) => {
      const down = run.down[f], grip = run.grip?.[f];
      for (let i = 1; i < run.N; i++) {
        if (down[i] && !down[i - 1]) holds.push([f, i]);
        if (grip && i % 4 === 0 && grip[i] >= SLIDES) slides.push([f, i]);
      }
    });
    const marks = (list, geometry, color) => {
      const object = new THREE.InstancedMesh(geometry, new THREE.MeshBasicMaterial({color, side: 2}), Math.max(1, list.length));
      const matrix = new THREE.Matrix4(), turn = new THREE.Quaternion(), one = new THREE.Vector3(1, 1, 1);
      list.forEach(([f, i], k) => {
        const n = new THREE.Vector3(...[0, 1, 2].map((c) => run.normalAt(f, c, i)));
        turn.setFromUnitVectors(UP, n);
        object.setMatrixAt(k, matrix.compose(n.multiplyScalar(0.004 * this.r).add(new THREE.Vector3(...sole(f, i))), turn, one));
      });
      object.frustumCulled = false;
      return Object.assign(this.add(object), {samples: list.map(([, i]) => i)});
    };
    holds.sort((a, b) => a[1] - b[1]);
    slides.sort((a, b) => a[1] - b[1]);
    this.holds = marks(holds, new THREE.RingGeometry(0.026 * this.r, 0.04 * this.r, 24), 0x2f3a45);
    this.slides = marks(slides, new THREE.CircleGeometry(0.012 * this.r, 10), 0xd01c8b);
  }

  travelArrow(material) {
    const shape = new THREE.Shape(), r = this.r;
    [[0, -0.03], [0.22, -0.03], [0.22, -0.08], [0.38, 0], [0.22, 0.08], [0.22, 0.03], [0, 0.03]]
      .forEach(([x, y], k) => shape[k ? "lineTo" : "moveTo"](x * r, y * r));
    // Its depth is that of a place nearer to the eye: hills and steps ahead do not hide it, the robot does.
    material.onBeforeCompile = (shader) => {
      shader.vertexShader = shader.vertexShader.replace("#include <project_vertex>", `#include <project_vertex>
        vec4 nearer = projectionMatrix * vec4(mvPosition.xyz * (1.0 - ${(0.5 * r).toFixed(4)} / length(mvPosition.xyz)), 1.0);
        gl_Position.z = nearer.z / nearer.w * gl_Position.w;`);
    };
    return new THREE.Mesh(new THREE.ShapeGeometry(shape), material);
  }

  makeNames() {
    const {run} = this.actor;
    this.names = legsOf(run).map((foot) => ({foot, element: this.tag(foot.label)}));
    this.hips = legsOf(run).map((foot) => Math.max(0, run.data.tree.findIndex((b) => b.joint === foot.joints[0])));
    this.loadTags = this.loads.map(({load}) => this.tag(loadText(load)));
    if (runs.length > 1) this.runTag = this.tag(run.data.name);
  }

  tag(text) {
    const element = document.createElement("span");
    element.textContent = text;
    $("labels").append(element);
    return element;
  }

  put(tag, shown, body, local, above = -130) {
    const display = shown ? "" : "none";
    if (tag.style.display !== display) tag.style.display = display;
    if (!shown) return;
    this.place.set(...local).applyMatrix4(this.actor.bodies[body].node.matrixWorld).project(viewer.camera);
    const x = (0.5 + 0.5 * this.place.x) * viewSize.x, y = (0.5 - 0.5 * this.place.y) * viewSize.y;
    tag.style.transform = `translate(${x.toFixed(1)}px,${y.toFixed(1)}px) translate(-50%,${above}%)`;
  }

  draw(i) {
    const {run, ghost} = this.actor, L = S.layers, sample = i < run.N ? i : run.near[i - run.N];
    this.group.visible = !ghost;
    const feet = run.force ? run.data.feet : [];
    feet.forEach((foot, f) => {
      const arrow = this.arrows[f], cone = this.cones[f], at = this.sole(f, i);
      arrow.position.set(...at);
      aim(arrow, run.force[3 * f][i], run.force[3 * f + 1][i], run.force[3 * f + 2][i], run.data.force_scale);
      arrow.visible = arrow.visible && L.forces;
      const mu = run.mu ? run.mu(f, i) : 0;
      cone.visible = L.cones && run.down[f][i] > 0 && mu > 0;
      cone.position.set(...at);
      cone.scale.set(0.22 * this.r * mu, 0.22 * this.r * mu, 0.22 * this.r);
      cone.quaternion.setFromUnitVectors(UP, pointing.set(...[0, 1, 2].map((c) => run.normalAt(f, c, i))));
    });
    if (run.com) this.drawBalance(i, feet);
    const shown = (marks) => {
      let k = 0;
      while (k < marks.samples.length && marks.samples[k] <= sample) k++;
      return k;
    };
    const until = Math.floor(sample / this.every) + 1;
    this.swings.forEach((path) => { path.visible = L.paths; path.geometry.setDrawRange(0, until); });
    if (this.trace) { this.trace.visible = L.mass; this.trace.geometry.setDrawRange(0, until); }
    this.holds.count = shown(this.holds);
    this.holds.visible = L.feet && this.holds.count > 0;
    this.slides.count = shown(this.slides);
    this.slides.visible = L.slip && this.slides.count > 0;
    const turn = yawOf(run, i) - yawOf(run, 0), [x, y] = focusOf(run, i), [tx, ty] = run.data.travel;
    const heading = Math.atan2(ty, tx) + turn, far = 1.15 * this.r;
    this.travel.visible = L.names;
    const level = feet.length ? Math.max(...feet.map((_, f) => (run.down[f][i] ? this.sole(f, i)[2] : -Infinity))) : 0;
    this.travel.position.set(x + far * Math.cos(heading), y + far * Math.sin(heading),
      (Number.isFinite(level) ? level : 0) + 0.006 * this.r);
    this.travel.rotation.z = heading;
    this.loads.forEach(({load, object}) => {
      this.actor.point(load.body, load.point, object.position);
      if (load.kind === "payload") object.visible = L.loads;
      else {
        const acts = run.time[i] >= load.start && run.time[i] <= load.end;
        aim(object, ...load.force, run.data.force_scale);
        object.visible = object.visible && acts && L.loads;
      }
    });
  }

  drawBalance(i, feet) {
    const {run} = this.actor, L = S.layers, lift = 0.005 * this.r;
    const [x, y, z] = [0, 1, 2].map((c) => run.com[c][i]);
    const down = feet.map((_, f) => f).filter((f) => run.down[f][i]).map((f) => this.sole(f, i));
    const low = down.length ? down.reduce((sum, p) => sum + p[2], 0) / down.length : 0;
    this.mass.visible = this.drop.visible = L.mass;
    this.mass.position.set(x, y, z);
    const drop = this.drop.geometry.attributes.position;
    drop.setXYZ(0, x, y, z);
    drop.setXYZ(1, x, y, low + lift);
    drop.needsUpdate = true;
    if (!this.polygon) return;
    const corners = hull(down), n = corners.length;
    this.polygon.visible = L.support && n > 2;
    this.rim.visible = L.support && n > 1;
    this.reserve.visible = L.support && n > 2;
    if (n < 2) return;
    const area = this.polygon.geometry.attributes.position, rim = this.rim.geometry.attributes.position;
    let nearest = Infinity, foot = corners[0];
    for (let k = 0; k < n; k++) {
      const a = corners[k], b = corners[(k + 1) % n];
      area.setXYZ(3 * k, corners[0][0], corners[0][1], corners[0][2] + lift);
      area.setXYZ(3 * k + 1, a[0], a[1], a[2] + lift);
      area.setXYZ(3 * k + 2, b[0], b[1], b[2] + lift);
      rim.setXYZ(2 * k, a[0], a[1], a[2] + lift);
      rim.setXYZ(2 * k + 1, b[0], b[1], b[2] + lift);
      const [ex, ey] = [b[0] - a[0], b[1] - a[1]], along = ((x - a[0]) * ex + (y - a[1]) * ey) / (ex * ex + ey * ey || 1);
      const t = Math.max(0, Math.min(1, along)), point = a.map((v, c) => v + t * (b[c] - v));
      const away = Math.hypot(x - point[0], y - point[1]);
      if (away < nearest) [nearest, foot] = [away, point];
    }
    this.polygon.geometry.setDrawRange(0, 3 * n);
    this.rim.geometry.setDrawRange(0, 2 * n);
    const reserve = this.reserve.geometry.attributes.position;
    reserve.setXYZ(0, x, y, low + lift);
    reserve.setXYZ(1, foot[0], foot[1], foot[2] + lift);
    area.needsUpdate = rim.needsUpdate = reserve.needsUpdate = true;
  }

  recolor() {
    this.swings.forEach((path, k) => path.material.color.set(legColor(k)));
    this.holds.material.color.setHex(isDark() ? 0xb7c1cc : 0x2f3a45);
  }

  // Names are placed once the camera is.
  label(i) {
    const {run, ghost} = this.actor, chosen = legOf(S.joint);
    this.names.forEach(({foot, element}, k) => {
      this.put(element, S.layers.names && !ghost, this.hips[k], [0, 0, 0]);
      element.classList.toggle("chosen", k === chosen && run === R);
      const lost = run.data.loads.some((load) => load.kind === "lost" && run.time[i] >= load.start && [foot.label, foot.name].includes(load.leg));
      const text = lost ? `${foot.label} lost` : foot.label;
      if (element.textContent !== text) element.textContent = text;
    });
    this.loads.forEach(({load}, k) => {
      const acts = load.kind === "payload" || (run.time[i] >= load.start && run.time[i] <= load.end);
      this.put(this.loadTags[k], S.layers.loads && acts && !ghost, load.body, load.point, -130 + 110 * k);
    });
    if (this.runTag) this.put(this.runTag, true, 0, [0, 0, 0.5 * this.r]);
  }
}
