// The robots: links as a tree that three.js turns by joint angles; colour by use of torque.

const NEUTRAL = new THREE.Color(0xb4bac1);
const HEAT = [[0, NEUTRAL], [0.4, NEUTRAL], [0.65, new THREE.Color(0xf0cf65)],
  [0.85, new THREE.Color(0xee8433)], [1, new THREE.Color(0xc4161c)], [1.3, new THREE.Color(0x7a0177)]];
const heatCss = () => `linear-gradient(90deg,${HEAT.map(([u, c]) => `#${c.getHexString()} ${100 * u / 1.3}%`).join(",")})`;

function heat(use, into) {
  let k = 0;
  while (k < HEAT.length - 2 && use > HEAT[k + 1][0]) k++;
  const [low, first] = HEAT[k], [high, second] = HEAT[k + 1];
  into.copy(first).lerp(second, Math.max(0, Math.min(1, (use - low) / (high - low))));
}

const meshGeometries = new Map();
function geometryOf(shape) {
  if (shape.type === "BoxGeometry") return new THREE.BoxGeometry(shape.width, shape.height, shape.depth);
  if (shape.type === "SphereGeometry") return new THREE.SphereGeometry(shape.radius, 20, 14);
  if (shape.type === "CylinderGeometry") {
    return new THREE.CylinderGeometry(shape.radiusTop, shape.radiusBottom, shape.height, shape.radialSegments);
  }
  const key = shape.arrays.join();
  if (!meshGeometries.has(key)) {
    const [x, y, z] = arrays[shape.arrays[0]], corners = new Float32Array(3 * x.length);
    for (let k = 0; k < x.length; k++) corners.set([x[k], y[k], z[k]], 3 * k);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(corners, 3));
    geometry.setIndex(Array.from(arrays[shape.arrays[1]][0]));
    geometry.computeVertexNormals();
    meshGeometries.set(key, geometry);
  }
  return meshGeometries.get(key);
}

const edgeGeometries = new Map();
function outlineOf(geometry) {
  if (!edgeGeometries.has(geometry)) edgeGeometries.set(geometry, new THREE.EdgesGeometry(geometry, 28));
  return edgeGeometries.get(geometry);
}

// One run's robot and ground in a lane of their own; `ghost`: translucent, in the first one's place.
class Actor {
  constructor(run) {
    this.run = run;
    this.lane = new THREE.Group();
    this.ground = groundOf(run);
    this.lane.add(this.ground.group);
    world.add(this.lane);
    this.bodies = run.data.tree.map((entry) => this.body(entry));
    this.lane.add(this.bodies[0].node);
    this.bend = new THREE.Quaternion();
  }

  body(entry) {
    const node = new THREE.Group(), parts = [];
    node.position.set(...entry.place);
    for (const shape of entry.shapes) {
      const material = new THREE.MeshPhongMaterial({color: shape.color, side: 2, shininess: 12,
        opacity: shape.opacity, transparent: shape.opacity < 1});
      const mesh = new THREE.Mesh(geometryOf(shape), material);
      mesh.position.set(...shape.place);
      mesh.quaternion.set(...shape.turn);
      mesh.castShadow = shape.opacity === 1;
      mesh.receiveShadow = true;
      mesh.userData = {joint: entry.joint, color: shape.color, opacity: shape.opacity};
      node.add(mesh);
      parts.push({mesh});
    }
    const found = {node, parts, joint: entry.joint, slides: entry.slides,
      place: new THREE.Vector3(...entry.place), base: new THREE.Quaternion(...entry.turn),
      axis: entry.axis && new THREE.Vector3(...entry.axis)};
    if (entry.parent >= 0) {
      this.made[entry.parent].node.add(node);
      node.quaternion.copy(found.base);
    } else this.made = [];
    this.made.push(found);
    return found;
  }

  // Lines along the edges of all parts: not needed for the first picture.
  outline() {
    for (const part of this.bodies.flatMap((body) => body.parts)) {
      part.edge = new THREE.LineSegments(outlineOf(part.mesh.geometry), new THREE.LineBasicMaterial({transparent: true}));
      part.mesh.add(part.edge);
    }
  }

  get ghost() { return this.run !== R && !S.layers.apart; }

  // Place the robot at a sample, a share of the way to the next.
  pose(i, share) {
    const {run} = this, next = share > 0 ? Math.min(run.N - 1, i + 1) : i;
    const {place, turn, angle} = run.motion(next), at = (row) => row[i] + share * (row[next] - row[i]);
    for (const body of this.bodies) {
      if (body.joint === -1) {
        body.node.position.set(at(place[0]), at(place[1]), at(place[2]));
        body.node.quaternion.set(at(turn[0]), at(turn[1]), at(turn[2]), at(turn[3])).normalize();
      } else if (body.joint >= 0 && body.slides) {
        body.node.position.copy(body.axis).multiplyScalar(at(angle[body.joint]))
          .applyQuaternion(body.base).add(body.place);
      } else if (body.joint >= 0) {
        body.node.quaternion.copy(body.base)
          .multiply(this.bend.setFromAxisAngle(body.axis, at(angle[body.joint])));
      }
    }
    if (run.lift) this.ground.group.position.z = at(run.lift);
    this.ground.group.visible = !this.ghost;
    const sunk = run.data.below.some(([from, until]) => run.time[i] >= from && run.time[i] <= until);
    this.ground.surface.material.opacity = sunk ? 0.55 : 1;  // what is below it is seen
    this.ground.surface.material.userData.uContour.value = S.layers.contour ? this.ground.surface.userData.contour : 0;
  }

  paint(i) {
    const {run, ghost} = this, colored = complete && S.layers.use && run.limited, edgeColor = theme().edge;
    for (const body of this.bodies) {
      const chosen = body.joint >= 0 && body.joint === S.joint && run === R;
      for (const {mesh, edge} of body.parts) {
        const {material} = mesh;
        if (ghost) material.color.setHex(0x7a8794);
        else if (colored && body.joint >= 0) heat(run.use[body.joint][i], material.color);
        else material.color.setHex(mesh.userData.color);
        material.opacity = ghost ? 0.3 : mesh.userData.opacity;
        material.transparent = material.opacity < 1;
        material.depthWrite = !ghost;
        mesh.castShadow = !ghost && mesh.userData.opacity === 1;
        if (!edge) continue;
        edge.visible = !ghost && (chosen || S.layers.edges);
        edge.material.color.setHex(chosen ? 0x0b57d0 : edgeColor);
        edge.material.opacity = chosen ? 1 : 0.4;
        edge.scale.setScalar(chosen ? 1.03 : 1);
      }
    }
  }

  // A point fixed to a body, in the lane's axes.
  point(body, local, into) {
    this.bodies[body].node.updateWorldMatrix(true, false);
    into.set(...local).applyMatrix4(this.bodies[body].node.matrixWorld);
    return this.lane.worldToLocal(into);
  }
}

const actors = runs.map((run) => new Actor(run));

// Lanes beside each other, across the first run's travel; ghosts stand where the first run is.
function placeLanes() {
  const [tx, ty] = R.data.travel, left = new THREE.Vector3(-ty, tx, 0);
  const wide = 3.2 * Math.max(...runs.map((run) => run.data.reach));
  actors.forEach((actor, k) => {
    actor.lane.position.copy(left).multiplyScalar(S.layers.apart ? -k * wide : 0);
    const [x, y] = focusOf(actor.run, 0), [x0, y0] = focusOf(R, 0);
    actor.ground.surface.material.userData.uStrip.value  // grounds of lanes do not overlap
      .set(left.x, left.y, left.x * x + left.y * y, S.layers.apart && runs.length > 1 ? 0.49 * wide : 1e9);
    actor.lane.position.x += x0 - x;
    actor.lane.position.y += y0 - y;
  });
  dirty = true;
}

// What the picture is centred on: the trunk, or the middle of the feet where its frame is aside.
function focusOf(run, i) {
  const turn = yawOf(run, i) - yawOf(run, 0), [x, y] = run.data.aside, c = Math.cos(turn), s = Math.sin(turn), {place} = run.motion(i);
  return [place[0][i] + c * x - s * y, place[1][i] + s * x + c * y];
}
