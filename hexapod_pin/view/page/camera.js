// Cameras, and picking a link by a click. Axes of the viewer's camera: x, up, and -y.

const CAMERAS = {
  follow: [2.2, 1.75, -2.6], side: [0, 0.75, -4.2], ahead: [4.2, 0.75, 0], above: [-0.01, 4.6, 0], free: null,
};

function camera(name) {
  S.camera = name in CAMERAS ? name : "follow";
  const place = CAMERAS[S.camera];
  if (place) {
    const [tx, ty] = R.data.travel, size = R.data.reach * Math.max(1, 1.25 / Math.max(0.45, viewer.camera.aspect));
    const spread = S.layers.apart && runs.length > 1 ? 1 + 0.6 * (runs.length - 1) : 1;
    const [ahead, up, left] = [place[0], place[1], -place[2]].map((v) => v * size * spread);
    viewer.camera.position.set(ahead * tx - left * ty, up, -(ahead * ty + left * tx));
    viewer.controls.target.set(0, 0, 0);
    viewer.controls.update();
  }
  for (const button of $("cameras").children) button.setAttribute("aria-pressed", button.textContent === S.camera);
  dirty = true;
}

const held = [0, 0, 0];
function followRobot(i) {
  if (S.camera === "free") return;
  const middle = [0, 0];
  const shown = S.layers.apart ? actors : actors.slice(0, 1);
  for (const {run, lane} of shown) {
    const [x, y] = focusOf(run, run === R ? i : now(run));
    middle[0] += (x + lane.position.x) / shown.length;
    middle[1] += (y + lane.position.y) / shown.length;
  }
  const {place} = R.motion(i), drop = place[2][i] - place[2][0];
  world.position.set(-middle[0], -middle[1], -0.75 * R.data.eye - drop);
}

function pickJoint(event) {
  const box = view.getBoundingClientRect(), ray = new THREE.Raycaster();
  ray.setFromCamera({x: ((event.clientX - box.left) / box.width) * 2 - 1, y: 1 - ((event.clientY - box.top) / box.height) * 2}, viewer.camera);
  const meshes = actors[0].bodies.flatMap((body) => body.parts.map((part) => part.mesh));
  const hit = ray.intersectObjects(meshes, false)[0];
  if (hit && hit.object.userData.joint >= 0) select(hit.object.userData.joint);
}

{
  let pressed = null;
  view.addEventListener("pointerdown", (event) => { pressed = [event.clientX, event.clientY]; });
  view.addEventListener("pointerup", (event) => {
    if (pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 5) pickJoint(event);
    pressed = null;
  });
}
