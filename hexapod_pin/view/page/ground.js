// The viewer, and the ground: one surface of heights or a profile, with a grid and contours on it.

const THREE = MeshCat.THREE;
const view = $("view"), viewSize = {x: 1, y: 1}, viewer = new MeshCat.Viewer(view, false);
viewer.gui.domElement.style.display = "none";
viewer.renderer.debug.checkShaderErrors = false;  // it waits for each program; they are made together
viewer.set_dirty = () => { dirty = true; };
// The canvas follows its element; it is made anew only where the size is another.
viewer.set_3d_pane_size = () => {
  const width = view.clientWidth, height = view.clientHeight;
  if (!width || !height || (viewSize.x === width && viewSize.y === height && viewSize.ratio === devicePixelRatio)) return;
  Object.assign(viewer.camera, {aspect: width / height, fov: 40});
  viewer.camera.updateProjectionMatrix();
  viewer.renderer.setPixelRatio(devicePixelRatio);
  viewer.renderer.setSize(width, height);
  Object.assign(viewSize, {x: width, y: height, ratio: devicePixelRatio});
  dirty = true;
};
for (const name of ["Grid", "Axes"]) viewer.set_property([name], "visible", false);
const world = viewer.scene_tree.find(["playback"]).object;

// A line at every multiple of a step, one pixel wide, faded where lines would merge; none on a face
// that stands at one value, as a riser does: it would be speckled.
const LINES = `
varying vec3 vPlace;
uniform float uStep; uniform float uContour; uniform vec4 uStrip; uniform vec4 uRim; uniform float uFade; uniform vec3 uInk; uniform float uStrength;
float lineOf(float v, float s) {
  float x = v / s, d = max(fwidth(x), 1e-6);
  return step(1e-5, d) * (1.0 - min(abs(fract(x - 0.5) - 0.5) / d, 1.0)) * clamp(1.4 - 2.8 * d, 0.0, 1.0);
}
`;
// A ground that ends fades out towards its rim.
const RIM = `
{
  vec2 inside = min(vPlace.xy - uRim.xy, uRim.zw - vPlace.xy);
  diffuseColor.a *= smoothstep(0.0, uFade, min(inside.x, inside.y));
}
`;
const DRAWN = `
#include <color_fragment>
${RIM}
if (abs(dot(vPlace.xy, uStrip.xy) - uStrip.z) > uStrip.w) discard;
{
  float fine = max(lineOf(vPlace.x, uStep), lineOf(vPlace.y, uStep));
  float bold = max(lineOf(vPlace.x, 5.0 * uStep), lineOf(vPlace.y, 5.0 * uStep));
  float ink = max(0.45 * fine, 0.9 * bold);
  if (uContour > 0.0) {
    vec3 across = normalize(cross(dFdx(vPlace), dFdy(vPlace)));
    ink = max(ink, 0.6 * lineOf(vPlace.z, uContour) * step(abs(across.z), 0.99999));
  }
  diffuseColor.rgb = mix(diffuseColor.rgb, uInk, uStrength * ink);
}
`;
// Planes go on as far as can be seen: there the fog hides them.
const SEEN = 16 * Math.max(...runs.map((run) => run.data.reach));
const isPlane = (data) => data.rows === 2;
function rimOf(data) {
  const more = isPlane(data) ? SEEN : 0, [x, y] = [0, 1].map((k) => data.high[k] - data.low[k] + 2 * more);
  return {uFade: {value: 0.12 * Math.min(x, y)},
    uRim: {value: new THREE.Vector4(data.low[0] - more, data.low[1] - more, data.high[0] + more, data.high[1] + more)}};
}
function groundMaterial(data) {
  const material = new THREE.MeshPhongMaterial({color: 0xdbded9, side: 2, shininess: 2, flatShading: !!data.mesh, transparent: true});
  material.extensions = {derivatives: true};
  material.userData = {uStep: {value: data.spacing}, uContour: {value: 0}, uInk: {value: new THREE.Color(0x6d7a80)}, uStrength: {value: 0.75},
    uStrip: {value: new THREE.Vector4(0, 1, 0, 1e9)}, ...rimOf(data)};
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, material.userData);
    shader.vertexShader = `varying vec3 vPlace;\n${shader.vertexShader}`.replace(
      "#include <begin_vertex>", "#include <begin_vertex>\nvPlace = position;");
    shader.fragmentShader = (LINES + shader.fragmentShader).replace("#include <color_fragment>", DRAWN);
  };
  return material;
}

function groundGeometry(data) {
  const geometry = new THREE.BufferGeometry();
  const made = (name, numbers) => geometry.setAttribute(name, new THREE.BufferAttribute(numbers, 3));
  if (data.mesh) {
    const [x, y, z] = arrays[data.mesh[0]], corners = new Float32Array(3 * x.length);
    for (let k = 0; k < x.length; k++) { corners[3 * k] = x[k]; corners[3 * k + 1] = y[k]; corners[3 * k + 2] = z[k]; }
    made("position", corners);
    geometry.setIndex(new THREE.BufferAttribute(Uint32Array.from(arrays[data.mesh[1]][0]), 1));
    geometry.computeVertexNormals();
  } else {
    const n = data.rows, columns = Array.from(arrays[data.heights]), corners = new Float32Array(3 * n * n), normals = new Float32Array(3 * n * n);
    const [dx, dy] = [0, 1].map((axis) => (data.high[axis] - data.low[axis]) / (n - 1)), index = new Uint32Array(6 * (n - 1) * (n - 1));
    const more = isPlane(data) ? SEEN : 0;  // with n = 2 the factors beside it are -1 and 1
    let at = 0;
    for (let c = 0; c < n; c++) {
      const own = columns[c], left = columns[Math.max(0, c - 1)], right = columns[Math.min(n - 1, c + 1)];
      const wide = (Math.min(n - 1, c + 1) - Math.max(0, c - 1)) * dx;
      for (let r = 0; r < n; r++) {
        const k = r * n + c, low = Math.max(0, r - 1), high = Math.min(n - 1, r + 1);
        corners[3 * k] = data.low[0] + c * dx + (2 * c - 1) * more;
        corners[3 * k + 1] = data.low[1] + r * dy + (2 * r - 1) * more;
        corners[3 * k + 2] = own[r] + more * ((2 * c - 1) * (right[r] - left[r]) / wide + (2 * r - 1) * (own[high] - own[low]) / ((high - low) * dy));
        const a = (right[r] - left[r]) / wide, b = (own[high] - own[low]) / ((high - low) * dy), size = 1 / Math.sqrt(1 + a * a + b * b);
        normals[3 * k] = -a * size;
        normals[3 * k + 1] = -b * size;
        normals[3 * k + 2] = size;
        if (r < n - 1 && c < n - 1) {
          index[at++] = k; index[at++] = k + 1; index[at++] = k + n + 1;
          index[at++] = k; index[at++] = k + n + 1; index[at++] = k + n;
        }
      }
    }
    made("position", corners);
    made("normal", normals);
    geometry.setIndex(new THREE.BufferAttribute(index, 1));
  }
  geometry.computeBoundingBox();
  return geometry;
}

// Level ribbons along lines from point to point: lines of WebGL are a pixel wide, and hard to see.
function ribbons(ends, wide, data) {
  const corners = [], index = [];
  for (let k = 0; k < ends.length; k += 6) {
    const [x, y, z, u, v, w] = ends.slice(k, k + 6), size = Math.hypot(u - x, v - y) || 1;
    const dx = (-0.5 * wide * (v - y)) / size, dy = (0.5 * wide * (u - x)) / size, at = corners.length / 3;
    corners.push(x + dx, y + dy, z, x - dx, y - dy, z, u + dx, v + dy, w, u - dx, v - dy, w);
    index.push(at, at + 1, at + 2, at + 1, at + 3, at + 2);
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(corners), 3));
  geometry.setIndex(index);
  const material = new THREE.MeshBasicMaterial({transparent: true, side: 2, polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -4});
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, rimOf(data));
    shader.vertexShader = `varying vec3 vPlace;\n${shader.vertexShader}`.replace(
      "#include <begin_vertex>", "#include <begin_vertex>\nvPlace = position;");
    shader.fragmentShader = `varying vec3 vPlace; uniform vec4 uRim; uniform float uFade;\n${shader.fragmentShader}`.replace(
      "#include <color_fragment>", `#include <color_fragment>\n${RIM}`);
  };
  return new THREE.Mesh(geometry, material);
}

function groundOf(run) {
  const data = run.data.ground, group = new THREE.Group();
  const surface = new THREE.Mesh(groundGeometry(data), groundMaterial(data));
  surface.receiveShadow = true;
  surface.renderOrder = -1;  // what lies on it and is translucent, too, comes after it
  const {min, max} = surface.geometry.boundingBox;
  surface.userData.contour = data.level ? 0 : niceStep((max.z - min.z) / 12);
  group.add(surface);
  const lines = {};
  for (const name of ["edges", "patches"]) {
    if (!data[name]) continue;
    lines[name] = ribbons(data[name], 0.022 * run.data.reach, data);
    group.add(lines[name]);
  }
  return {group, surface, lines};
}

// 1, 2 or 5 times a power of ten, at least a value.
function niceStep(value) {
  if (!(value > 0)) return 0;
  const power = 10 ** Math.floor(Math.log10(value));
  return power * [1, 2, 5, 10].find((m) => m * power >= value * (1 - 1e-9));
}

// Light from all sides, and one that throws a shadow and follows the robot.
viewer.set_property(["Lights"], "visible", false);
world.add(new THREE.HemisphereLight(0xffffff, 0xb4babf, 0.74));
const sun = new THREE.DirectionalLight(0xffffff, 0.46);
sun.castShadow = false;  // until all samples are there
sun.shadow.mapSize.set(1024, 1024);
{
  const reach = 2.2 * Math.max(...runs.map((run) => run.data.reach));
  Object.assign(sun.shadow.camera, {left: -reach, right: reach, top: reach, bottom: -reach, near: 0.05 * reach, far: 8 * reach});
  Object.assign(sun.shadow, {bias: -0.0015, radius: 4});
  sun.userData.offset = new THREE.Vector3(0.9, -1.2, 2.9).multiplyScalar(reach);
}
world.add(sun, sun.target);

const COLORS = {
  light: {top: [0.80, 0.88, 0.95], bottom: [0.97, 0.98, 1], fog: 0xeef3f8, ground: 0xdbded9, ink: 0x6d7a80, edge: 0x1d2530, edges: 0x3a4652, patches: 0x3366cc},
  dark: {top: [0.08, 0.10, 0.12], bottom: [0.15, 0.17, 0.20], fog: 0x22272d, ground: 0x39424c, ink: 0x151a1f, edge: 0x0b0e11, edges: 0xa9b4c0, patches: 0x7aa7ff},
};
const isDark = () => document.documentElement.classList.contains("dark");
const theme = () => COLORS[isDark() ? "dark" : "light"];

// Programs of the first picture are made by the graphics process while the robot and its ground are.
{
  const early = new THREE.Group(), body = new THREE.MeshPhongMaterial({side: 2});
  for (const material of [body, ...runs.map((run) => groundMaterial(run.data.ground))]) {
    early.add(Object.assign(new THREE.Mesh(new THREE.BufferGeometry(), material), {receiveShadow: true}));
  }
  viewer.scene.fog = new THREE.Fog(0);
  world.add(early);
  viewer.renderer.compile(viewer.scene, viewer.camera);
  world.remove(early);
}

function colorScene() {
  const colors = theme(), reach = R.data.reach;
  viewer.set_property(["Background"], "top_color", colors.top);
  viewer.set_property(["Background"], "bottom_color", colors.bottom);
  viewer.scene.fog = new THREE.Fog(colors.fog, 5 * reach, 14 * reach);
  for (const actor of actors) {
    const material = actor.ground.surface.material;
    material.color.setHex(colors.ground);
    material.userData.uInk.value.setHex(colors.ink);
    material.fog = true;
    for (const [name, {material: line}] of Object.entries(actor.ground.lines)) line.color.setHex(colors[name]);
  }
  dirty = true;
}
