"""What a playback shows of a run: its samples at its error's resolution, limits, worst instants.

Everything is plain data for the page, and arrays of a `SampleBlock`. SI units; the page converts.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.drive.motor import Motor
from hexapod_pin.errors import HexapodError
from hexapod_pin.ground.terrain import PatchedGround, ShakingGround
from hexapod_pin.results.recorded_robot import RecordedRobot
from hexapod_pin.results.sizing.motor_budget import motor_budget
from hexapod_pin.results.steady_window import steady_window
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.walk_answer import WalkAnswer
from hexapod_pin.results.walk_causes import Slip
from hexapod_pin.results.walk_verdict import walk_verdict
from hexapod_pin.view.ground_shapes import (
    Sizes,
    eye_level,
    ground_data,
    middle,
    shaking,
    terrain_of,
)
from hexapod_pin.view.robot_shapes import RobotShapes
from hexapod_pin.view.sample_block import SampleBlock
from hexapod_pin.view.scene_graph import DrawnMeshes, feet_of, loads_of, robot_tree
from hexapod_pin.view.torque_limits import current_of, limits_of
from hexapod_pin.view.worst_instants import (
    budget_of,
    kinds_of,
    margins_of,
    steady_numbers,
    worst_instants,
)

ERROR_SHARE = 0.1
"""Resolution of samples, over the run's error."""

COARSEST = {"place": 1e-5, "turn": 1e-5, "joint": 1e-4, "torque": 1e-3, "foot_force": 1e-2}
"""Resolutions where the error is larger, or not known [m, 1, rad, N m, N]."""

FINEST = 0.05
"""Least resolution, over the coarsest."""

LEAST_SHARE = 2e-4
"""Resolution of torques and forces over the largest, at most."""

FOOT_DIGITS = 2e-5
"""Resolution of the feet's places [m]."""

NORMAL_DIGITS = 2e-4
"""Resolution of the ground's normals [1]."""

REQUESTED = {"slip_speed": 1e-4, "current": 1e-3, "temperature": 1e-2}
"""Resolutions of samples that a run records where they are named [m/s, A, deg C]."""

SPEED_DIGITS = 2e-3
"""Resolution of joint rates [rad/s]."""


def run_data(
    trace: Trace, shapes: RobotShapes, block: SampleBlock, meshes: DrawnMeshes, *,
    name: str = "", record: MotorRecord | None = None, force_scale: float | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Return everything that a page shows of a run.

    Args:
        trace: of the run.
        shapes: of its robot.
        block: takes the samples.
        meshes: takes the robot's meshes.
        name: of the run; empty: the robot's.
        record: the motor to hold torques against.
        force_scale: length of a force arrow [m/N]; None fits it to the robot's weight.
    """
    sizes, feet = Sizes.of(trace, force_scale), feet_of(trace, shapes)
    tree = robot_tree(shapes, trace.joint_names, meshes)
    ground = ground_data(trace, sizes, block)  # first: the first picture needs its heights
    sampled = sampled_data(trace, feet, tree, block, record)
    least = next((row["value"] for row in sampled["worst"] if row["key"] == "margin"), None)
    start = middle(trace, np.zeros(1, dtype=np.intp))[0] - trace.q[0, :2]
    return {
        "name": name or trace.run.robot.name,
        "robot": trace.run.robot.name,
        "joints": list(trace.joint_names),
        "kinds": list(kinds_of(trace)),
        "feet": feet,
        "tree": tree,
        "ground": ground,
        "loads": loads_of(trace, shapes),
        "events": [event.to_dict() for event in trace.events],
        "reach": sizes.reach, "eye": eye_level(trace), "aside": start.tolist(),
        "force_scale": sizes.force_scale,
        "up": (-np.array(trace.run.gravity) / (np.linalg.norm(trace.run.gravity) or 1.0)).tolist(),
        "travel": list(trace.run.walk.travel_direction),
        **sampled,
        **below_ground(trace),
        **header(trace, record, None if sampled["window"] is None else least, _sliding(tree)),
    }  # fmt: skip


def sampled_data(
    trace: Trace, feet: Sequence[Mapping[str, Any]], tree: Sequence[Mapping[str, Any]],
    block: SampleBlock, record: MotorRecord | None,
) -> dict[str, Any]:  # fmt: skip
    """Return window, limits, places of the samples and worst instants of a run.

    Args:
        trace: of the run.
        feet: of its robot, as `feet_of` gives them.
        tree: of its robot, as `robot_tree` gives it.
        block: takes the samples.
        record: the motor to hold torques against.
    """
    slides = _sliding(tree)
    limits, window = limits_of(trace, record), _window(trace)
    margin = margins_of(trace) if feet else None
    return {
        "window": window,
        "limits": {
            "name": limits.name,
            "stall": [None if math.isinf(x) else float(x) for x in limits.stall],
            "slope": limits.slope.tolist(),
            "cap": [None if math.isinf(x) else float(x) for x in limits.cap],
            "per_torque": [float(x) if math.isfinite(x) else None for x in limits.per_torque],
        },
        "channels": channels(trace, feet, block, margin, current_of(trace, record)),
        "worst": worst_instants(trace, limits, feet, window, margin, slides),
    }


def _sliding(tree: Sequence[Mapping[str, Any]]) -> set[int]:
    """Return the joints that slide."""
    return {body["joint"] for body in tree if body.get("slides") and body["joint"] >= 0}


LEAST_DEPTH = 5e-3
"""Depth below the ground from which a joint is said to be in it [m]."""

DEPTH_SAMPLES = 200
"""Samples at which joints are looked for below the ground, at most."""


def below_ground(trace: Trace) -> dict[str, Any]:
    """Return in words that joints are below the ground, how deep and why, and from when to when.

    `caption` is empty, and so is `below` [s], where none is. Only feet, and the trunk where a scene
    says so, touch the ground: the legs of a robot that has fallen go through it in the run itself,
    not only in the picture.
    """
    terrain = terrain_of(trace)
    try:
        model = RecordedRobot.of(trace).robot.model
    except HexapodError:
        model = None
    if model is None or terrain is None or model.njoints < 3:
        return {"caption": "", "below": []}
    import pinocchio as pin

    data, surface = model.createData(), terrain.surface()
    rows = np.unique(np.linspace(0, len(trace.time) - 1, DEPTH_SAMPLES).astype(int))
    places = np.empty((len(rows), model.njoints - 2, 3))
    for k, row in enumerate(rows):
        pin.forwardKinematics(model, data, trace.q[row])
        places[k] = [data.oMi[j].translation for j in range(2, model.njoints)]
    lift = shaking(terrain, trace.time[rows])
    ground = surface.height_at(places[..., 0], places[..., 1])
    depth = ground + (0.0 if lift is None else lift[:, None]) - places[..., 2]
    worst = np.unravel_index(int(np.argmax(depth)), depth.shape)
    sunk = np.concatenate([[0], (depth > LEAST_DEPTH).any(axis=1), [0]])
    first, end = (np.flatnonzero(np.diff(sunk) == change) for change in (1, -1))
    below = np.column_stack([trace.time[rows[first]], trace.time[rows[end - 1]]]).tolist()
    if not below:
        return {"caption": "", "below": []}
    name, time = model.names[int(worst[1]) + 2], trace.time[rows[worst[0]]]
    caption = (
        f"{name} is {1e3 * depth[worst]:.0f} mm below the ground at {time:.3g} s: in a run only "
        "feet touch the ground, links pass through it"
    )
    return {"caption": caption, "below": below}


def _window(trace: Trace) -> list[float] | None:
    """Return the time that numbers are taken over [s]; None of a run without a whole cycle."""
    try:
        found = steady_window(trace)
    except HexapodError:
        return None
    return [found.start, found.end]


# Samples.


def resolution(trace: Trace, quantity: str, values: Array | None = None) -> float:
    """Return the resolution of a quantity: a tenth of the run's error, or 1, 2, 5 below it.

    Of `values`, never more than 2e-4 of the largest: robots may weigh grams.
    """
    coarsest = COARSEST[quantity]
    largest = 0.0 if values is None else float(np.max(np.abs(values), initial=0.0))
    if 0.0 < largest * LEAST_SHARE < coarsest:
        coarsest = _step_below(LEAST_SHARE * largest)
    errors = {} if trace.error is None else trace.error.arrays
    error = float(errors[quantity].max()) if quantity in errors else 0.0
    if not (error > 0.0 and math.isfinite(error)):
        return coarsest
    return min(coarsest, max(FINEST * coarsest, _step_below(ERROR_SHARE * error)))


def _step_below(value: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that is not above a value."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(
        power * max(step for step in (1.0, 2.0, 5.0) if step * power <= value * (1 + 1e-9))
    )


def channels(
    trace: Trace, feet: Sequence[Mapping[str, Any]], block: SampleBlock, margin: Array | None,
    current: Array | None = None,
) -> dict[str, int]:  # fmt: skip
    """Pack the samples of a run; return their places in the block by name.

    `place`, `turn`, `angle`, `speed`; where recorded `torque`; of contacts `force`, `foot`,
    `normal` where it is not the same always, `down`, `friction` of each foot where it differs by
    place; `com`; `margin` [m]; what the run was asked to record of `REQUESTED`; `motor_current` of
    the motor that is judged, where it takes more than the torque to know it [A].
    """
    place, joint = resolution(trace, "place"), resolution(trace, "joint")
    found = {"time": block.add(trace.time, 1e-6)}
    found["place"] = block.add(trace.q[:, :3], place)
    found["turn"] = block.add(trace.q[:, 3:7], resolution(trace, "turn"))
    found["angle"] = block.add(trace.q[:, 7:], joint)
    found["speed"] = block.add(trace.v[:, 6:], SPEED_DIGITS)
    if "torque" in trace.recorded:
        found["torque"] = block.add(trace.torque, resolution(trace, "torque", trace.torque))
    if feet:
        found["force"] = block.add(
            trace.foot_force, resolution(trace, "foot_force", trace.foot_force)
        )
        found["foot"] = block.add(trace.foot_position, FOOT_DIGITS)
        found["down"] = block.add(trace.contact, 1.0, order=1)
        normal = _standing_normals(trace)
        if np.ptp(normal.reshape(-1, 3), axis=0).max(initial=0.0) > 0.0:
            found["normal"] = block.add(normal, NORMAL_DIGITS, order=1)  # it jumps, and rests
        else:
            found["normal"] = block.add(normal[:1], 1e-6)
        factor = friction(trace)
        if factor is not None:
            constant = np.ptp(factor) == 0.0
            found["friction"] = block.add(factor[:1] if constant else factor, 1e-4)
        if margin is not None:
            found["margin"] = block.add(margin, 1e-5)
    requested = getattr(trace, "requested", None)
    for name, values in {} if requested is None else requested.arrays.items():
        found[name] = block.add(values, REQUESTED[name])
    if current is not None:
        found["motor_current"] = block.add(current, REQUESTED["current"])
    if "com" in trace.recorded:
        found["com"] = block.add(trace.com, COARSEST["place"])
    return found


def _standing_normals(trace: Trace) -> Array:
    """Return the ground's normals (T, F, 3); of a foot in the air, where it stood last."""
    index = np.where(trace.contact, np.arange(len(trace.time))[:, None], 0)
    last = np.maximum.accumulate(index, axis=0)[..., None]
    return np.take_along_axis(trace.foot_normal, last, axis=0)


def friction(trace: Trace) -> Array | None:
    """Return the largest share of the normal force that friction holds (T, F); None if unknown."""
    scene = trace.run.scene
    if scene is None:
        return None
    shares = np.full((len(trace.time), len(trace.foot_names)), scene.contact.friction.limit)
    terrain = terrain_of(trace)
    if isinstance(terrain, ShakingGround):
        terrain = terrain.ground
    if isinstance(terrain, PatchedGround):
        shares *= terrain.factors_at(*np.moveaxis(trace.foot_position[..., :2], -1, 0))[..., 0]
    return shares


# The header: verdict, gait, contact, accuracy, version.


def header(
    trace: Trace, record: MotorRecord | None, margin: float | None, slides: Collection[int] = ()
) -> dict[str, Any]:
    """Return verdict, fall, gait, ground, contact, motor, accuracy and versions, in words.

    Beside them `steady`, the numbers of the steady cycles.

    Args:
        trace: of the run.
        record: the motor that is judged; None for none.
        margin: the least one of steady walking [m]; None where it is not known.
        slides: joints that slide.
    """
    run = trace.run
    answer, verdict = _verdict(trace, record, margin)
    fall = None if answer is None else answer.verdict.fall
    facts = {"gait": _gait(run.case.controller)}
    if answer is not None and answer.verdict.cause:
        facts["reason"] = answer.verdict.reason
    if answer is not None and answer.verdict.slip is not None:
        facts["slip"] = _slip(answer.verdict.slip)
    if answer is not None and answer.verdict.push is not None:
        facts["push"] = answer.verdict.push.line  # a motor that fails takes its place in the answer
    scene = run.scene
    if scene is not None:
        facts["ground"] = scene.terrain.kind
        facts["contact"] = f"{scene.contact.normal.kind}, {scene.contact.friction.kind}"
        mu = scene.contact.friction.limit
        facts["contact"] += f" (mu {mu:g})"
        facts["motor"] = record.name if record is not None else _own_motor(scene.servo.motor)
    facts["accuracy"] = _accuracy(trace)
    facts["version"] = run.versions.get("hexapod-pin", "")
    return {
        "good": None if answer is None else answer.good,
        "verdict": verdict,
        "fall": fall and {"time": fall.time, "how": fall.how},
        "facts": [[name, text] for name, text in facts.items() if text],
        "assumed": list(run.assumed),
        "steady": []
        if answer is None
        else steady_numbers(trace, answer.budget, answer.verdict.slip, slides),
    }


def _slip(slip: Slip) -> str:
    """Return the slip of all feet over the way, and the foot that slips most."""
    if slip.per_metre is None or slip.total is None:
        return ""
    most = max(slip.per_metre, key=slip.per_metre.__getitem__)
    most_text = f"{100.0 * slip.per_metre[most]:.2g} %"
    return f"{100.0 * slip.total:.2g} % of the steady way, all feet; most {most}, {most_text}"


def _own_motor(motor: Motor | Mapping[str, Motor] | None) -> str:
    """Return the line of the run's motor, or of each kind of joint; empty without one."""
    if isinstance(motor, Mapping):
        return "; ".join(f"{kind}: {_own_motor(one)}" for kind, one in motor.items())
    if motor is None:
        return ""
    return f"stall {motor.stall_torque:.3g} N m, no load {motor.no_load_speed:.3g} rad/s"


def _verdict(
    trace: Trace, record: MotorRecord | None, margin: float | None
) -> tuple[WalkAnswer | None, str]:
    """Return the answer with its first line; else why there is none."""
    try:
        verdict, budget = walk_verdict(trace), budget_of(trace)
        motor = None if record is None or budget is None else motor_budget(trace, record)
        answer = WalkAnswer(verdict, budget, "", margin, motor, {}, 0.0)
    except HexapodError as error:
        return None, f"not judged: {error}"
    return answer, answer.headline


def _gait(controller: Mapping[str, Any]) -> str:
    gait = controller.get("gait")
    if not isinstance(gait, Mapping):
        return str(controller.get("kind", ""))
    words = [str(gait.get("name") or "gait")]
    numbers = (("stroke", 1e3, "mm"), ("cycle_time", 1.0, "s"), ("lift", 1e3, "mm"))
    for name, factor, unit in numbers:
        if isinstance(gait.get(name), int | float):
            words.append(f"{name.removesuffix('_time')} {factor * gait[name]:.4g} {unit}")
    if gait.get("turn_rate"):
        words.append(f"turning {math.degrees(gait['turn_rate']):.3g} deg/s")
    return ", ".join(words)


def _accuracy(trace: Trace) -> str:
    """Return what is known of the run's own error."""
    numerics = trace.run.numerics
    if trace.error is None:
        step = f"step {numerics.step:g} s" if numerics.step else ""
        return ", ".join(filter(None, (numerics.method or "", step, "error not estimated")))
    kept = "" if trace.accuracy_kept else f": NOT the {numerics.accuracy:g} requested"
    return f"positions within {trace.error_estimate:.1e} m or rad{kept}"
