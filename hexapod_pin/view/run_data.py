"""What a playback shows of a run: its samples at its error's resolution, limits, worst instants.

Everything is plain data for the page, and arrays of a `SampleBlock`. SI units; the page converts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from hexapod_pin.arrays import Array
from hexapod_pin.drive.catalog import MotorRecord
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.drive.motor import Motor
from hexapod_pin.errors import HexapodError
from hexapod_pin.ground.terrain import PatchedGround, ShakingGround
from hexapod_pin.results.joint_budget import joint_kinds
from hexapod_pin.results.sizing.motor_budget import motor_budget
from hexapod_pin.results.stability import stability
from hexapod_pin.results.steady_window import steady_window
from hexapod_pin.results.torque_budget import TorqueBudget, torque_budget
from hexapod_pin.results.trace import Trace
from hexapod_pin.results.walk_answer import WalkAnswer
from hexapod_pin.results.walk_verdict import walk_verdict
from hexapod_pin.view.ground_shapes import Sizes, eye_level, ground_data, middle, terrain_of
from hexapod_pin.view.robot_shapes import RobotShapes
from hexapod_pin.view.sample_block import SampleBlock
from hexapod_pin.view.scene_graph import DrawnMeshes, feet_of, loads_of, robot_tree

Indices = npt.NDArray[np.intp]

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


@dataclass(frozen=True)
class Limits:
    """What torques are held against: a torque that falls with speed, or is constant.

    Attributes:
        name: in words, such as "AX-12A, derated".
        stall: of every joint at rest [N m]; infinite where there is none. Shape (n,).
        slope: loss of torque with speed in the torque's direction [N m s/rad]. Shape (n,).
        per_torque: current of a motor over its torque [A/(N m)]; None where it is not known.
    """

    name: str
    stall: Array
    slope: Array
    per_torque: float | None = None

    def use(self, torque: Array, speed: Array) -> Array:
        """Return |torque| over what is allowed [-], as `MotorUse.peak_use`; shape (T, n)."""
        allowed = self.stall - self.slope * np.sign(torque) * speed
        size = np.abs(torque)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(allowed > 0.0, size / allowed, np.inf)
        return np.where(size > 0.0, share, 0.0)


def limits_of(trace: Trace, record: MotorRecord | None, derating: Derating | None = None) -> Limits:
    """Return the derated line of a motor thought of, else of the run's own motor, else limits.

    Args:
        trace: of the run.
        record: a row of the catalogue; None: the run's motor, or its joints' torque limits.
        derating: what of `record` may be used; None: the defaults.
    """
    count = len(trace.joint_names)
    scene = trace.run.scene
    if record is not None and record.no_load_speed is not None:
        share = derating or Derating()
        stall = share.peak * share.voltage * record.stall_torque
        slope = share.peak * record.stall_torque / record.no_load_speed
        current = record.stall_current
        per_torque = None if current is None else current / record.stall_torque
        name = f"{record.name}, derated ({share.peak:g} of its line, {share.voltage:g} U)"
        return Limits(name, np.full(count, stall), np.full(count, slope), per_torque)
    motor = None if scene is None else scene.servo.motor
    if isinstance(motor, Motor):
        slope = motor.stall_torque / motor.no_load_speed
        top = motor.stall_torque * motor.voltage_ratio
        return Limits("the motor's line, as simulated", np.full(count, top), np.full(count, slope))
    return Limits("torque limit", trace.run.robot.effort(count), np.zeros(count))


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
    sizes, limits = Sizes.of(trace, force_scale), limits_of(trace, record)
    feet = feet_of(trace, shapes)
    window = _window(trace)
    start = middle(trace, np.zeros(1, dtype=np.intp))[0] - trace.q[0, :2]
    return {
        "name": name or trace.run.robot.name,
        "robot": trace.run.robot.name,
        "joints": list(trace.joint_names),
        "kinds": list(kinds_of(trace)),
        "feet": feet,
        "tree": robot_tree(shapes, trace.joint_names, meshes),
        "ground": ground_data(trace, sizes, block),
        "loads": loads_of(trace, shapes),
        "events": [event.to_dict() for event in trace.events],
        "reach": sizes.reach, "eye": eye_level(trace), "aside": start.tolist(),
        "force_scale": sizes.force_scale,
        "up": (-np.array(trace.run.gravity) / (np.linalg.norm(trace.run.gravity) or 1.0)).tolist(),
        "travel": list(trace.run.walk.travel_direction),
        "window": window,
        "limits": {
            "name": limits.name,
            "stall": [None if math.isinf(x) else float(x) for x in limits.stall],
            "slope": limits.slope.tolist(), "per_torque": limits.per_torque,
        },
        "channels": channels(trace, feet, block),
        "worst": worst_instants(trace, limits, feet, window),
        **header(trace, record),
    }  # fmt: skip


def kinds_of(trace: Trace) -> tuple[str, ...]:
    """Return the kind of every joint."""
    return joint_kinds(trace.joint_names, len(trace.foot_names), trace.run.robot.joint_kinds)


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


def channels(trace: Trace, feet: Sequence[Mapping[str, Any]], block: SampleBlock) -> dict[str, int]:
    """Pack the samples of a run; return their places in the block by name.

    `place`, `turn`, `angle`, `speed`; where recorded `torque`; of contacts `force`, `foot`,
    `normal` where it is not the same always, `down`, `friction` of each foot where it differs by
    place; `com`; `margin` [m]; and what the run was asked to record of `REQUESTED`.
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
        found["down"] = block.add(trace.contact, 1.0)
        normal = _standing_normals(trace)
        if np.ptp(normal.reshape(-1, 3), axis=0).max(initial=0.0) > 0.0:
            found["normal"] = block.add(normal, NORMAL_DIGITS)
        else:
            found["normal"] = block.add(normal[:1], 1e-6)
        factor = friction(trace)
        if factor is not None:
            constant = np.ptp(factor) == 0.0
            found["friction"] = block.add(factor[:1] if constant else factor, 1e-4)
        margin = _margins(trace)
        if margin is not None:
            found["margin"] = block.add(margin, 1e-5)
    requested = getattr(trace, "requested", None)
    for name, values in {} if requested is None else requested.arrays.items():
        found[name] = block.add(values, REQUESTED[name])
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


def _margins(trace: Trace) -> Array | None:
    """Return the static margin at every sample (T,) [m]; None where it is not known."""
    try:
        return stability(trace, whole=True).static_margin
    except HexapodError:
        return None


# Worst instants: the numbers of the budget, and when.


def worst_instants(
    trace: Trace, limits: Limits, feet: Sequence[Mapping[str, Any]],
    window: Sequence[float] | None,
) -> list[dict[str, Any]]:  # fmt: skip
    """Return what was largest when: of each kind of joint, feet, stability and trunk.

    Peaks of torque, speed, power and force are those of the budget, at integration steps, which
    may lie between samples; the others are of samples. All are of the window, else of the run.

    Each has `key`, `what`, `value`, `error` (None where it is not known), `unit`, `digits`, `time`
    [s], and where they apply `joint`, `foot` and `use` [-].
    """
    inside = np.ones(len(trace.time), dtype=bool)
    if window is not None:
        inside = (trace.time >= window[0]) & (trace.time <= window[1])
    found = _joint_rows(trace, limits, inside)
    if feet:
        found.append(_force_row(trace, feet, inside))
        margin = _margins(trace)
        if margin is not None:
            k = _arg(margin, inside, least=True)
            found.append(_row("margin", "stability margin", margin[k], "m", trace.time[k]))
    roll, pitch = _roll_pitch(trace)
    for key, values in (("roll", roll), ("pitch", pitch)):
        k = _arg(np.abs(values), inside)
        found.append(_row(key, f"trunk {key}", values[k], "rad", trace.time[k]))
    return [row for row in found if math.isfinite(row["time"])]


def _row(
    key: str, what: str, value: float, unit: str, time: float, **more: Any
) -> dict[str, Any]:  # fmt: skip
    number = float(value) if math.isfinite(value) else None
    return {"key": key, "what": what, "value": number, "unit": unit, "time": float(time), **more}


def _arg(values: Array, inside: Array, least: bool = False) -> int:
    """Return the sample of the largest, or least, value among those inside."""
    shown = np.where(inside, values, np.inf if least else -np.inf)
    return int(np.argmin(shown) if least else np.argmax(shown))


def _joint_rows(trace: Trace, limits: Limits, inside: Array) -> list[dict[str, Any]]:
    if "torque" not in trace.recorded or not trace.joint_names:
        return []
    speed, names = trace.v[:, 6:], list(trace.joint_names)
    budget = _budget(trace)
    gathered = budget is not None and trace.has_summary
    use = limits.use(trace.torque, speed)
    rows, kinds = [], kinds_of(trace)
    for kind in dict.fromkeys(kinds):
        own = np.array([k for k, name in enumerate(kinds) if name == kind])
        if budget is not None:
            worst = next(row for row in budget.kinds if row.kind == kind).peak
            joint, value = names.index(worst.joint), worst.torque_peak
            time, error = worst.torque_peak_time, worst.torque_peak_error
        else:
            k, joint = _largest(np.abs(trace.torque), own, inside)
            value, time, error = abs(trace.torque[k, joint]), trace.time[k], None
        more = {} if limits.slope[joint] or math.isinf(limits.stall[joint]) else {
            "use": float(value / limits.stall[joint]) if limits.stall[joint] > 0.0 else None
        }  # fmt: skip
        rows.append(_row(f"{kind} torque", f"{kind} torque", value, "N m", time, error=error,
                         joint=joint, **more))  # fmt: skip
        if limits.slope[own].any():
            k, joint = _largest(use, own, inside)
            share = float(use[k, joint])
            rows.append(_row(f"{kind} use", f"{kind} use of limit", share, "1", trace.time[k],
                             joint=joint))  # fmt: skip
        k, joint = _largest(np.abs(speed), own, inside)
        value, time = abs(speed[k, joint]), trace.time[k]
        if gathered:
            joint = int(own[np.argmax(np.abs(trace.summary.speed_peak[own]))])
            value = abs(trace.summary.speed_peak[joint])
            time = trace.summary.speed_peak_time[joint]
        rows.append(_row(f"{kind} speed", f"{kind} speed", value, "rad/s", time, joint=joint))
    joint, value = 0, 0.0
    if gathered:
        joint = int(np.argmax(np.abs(trace.summary.power_peak)))
        value, time = trace.summary.power_peak[joint], trace.summary.power_peak_time[joint]
    else:
        power = trace.torque * speed
        k, joint = _largest(np.abs(power), np.arange(len(names)), inside)
        value, time = power[k, joint], trace.time[k]
    rows.append(_row("power", "joint power", value, "W", time, joint=joint))
    return rows


def _largest(values: Array, own: Indices, inside: Array) -> tuple[int, int]:
    """Return sample and joint of the largest value among some joints."""
    shown = np.where(inside[:, None], values[:, own], -np.inf)
    k, column = np.unravel_index(int(np.argmax(shown)), shown.shape)
    return int(k), int(own[column])


def _force_row(
    trace: Trace, feet: Sequence[Mapping[str, Any]], inside: Array
) -> dict[str, Any]:  # fmt: skip
    if _budget(trace) is not None and trace.has_summary and len(trace.summary.force_peak):
        foot = int(np.argmax(trace.summary.force_peak))
        value, time = trace.summary.force_peak[foot], trace.summary.force_peak_time[foot]
        error = float(trace.summary.error_of("force_peak")[foot])
    else:
        k, foot = _largest(trace.normal_force, np.arange(len(feet)), inside)
        value, time, error = trace.normal_force[k, foot], trace.time[k], math.nan
    known = None if math.isnan(error) else error
    return _row("force", "normal force of a foot", value, "N", time, foot=foot, error=known)


def _roll_pitch(trace: Trace) -> tuple[Array, Array]:
    """Return roll and pitch of the trunk (T,), of Rz(yaw) Ry(pitch) Rx(roll) [rad]."""
    x, y, z, w = (trace.q[:, 3:7] / np.linalg.norm(trace.q[:, 3:7], axis=1, keepdims=True)).T
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    return roll, np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))


# The header: verdict, gait, contact, accuracy, version.


def header(trace: Trace, record: MotorRecord | None) -> dict[str, Any]:
    """Return verdict, gait, ground, contact, motor, accuracy and versions, in words."""
    run = trace.run
    good, verdict = _verdict(trace, record)
    facts = {"gait": _gait(run.case.controller)}
    scene = run.scene
    if scene is not None:
        facts["ground"] = scene.terrain.kind
        facts["contact"] = f"{scene.contact.normal.kind}, {scene.contact.friction.kind}"
        mu = scene.contact.friction.limit
        facts["contact"] += f" (mu {mu:g})"
        own = "set" if scene.servo.motor is not None else ""
        facts["motor"] = record.name if record is not None else own
    facts["accuracy"] = _accuracy(trace)
    facts["version"] = run.versions.get("hexapod-pin", "")
    return {
        "good": good,
        "verdict": verdict,
        "facts": [[name, text] for name, text in facts.items() if text],
        "assumed": list(run.assumed),
    }


def _verdict(trace: Trace, record: MotorRecord | None) -> tuple[bool | None, str]:
    try:
        margin: float | None = stability(trace).least("static_margin")[0]
    except HexapodError:
        margin = None
    try:
        verdict, budget = walk_verdict(trace), _budget(trace)
        motor = None if record is None or budget is None else motor_budget(trace, record)
        answer = WalkAnswer(verdict, budget, "", margin, motor, {}, 0.0)
    except HexapodError as error:
        return None, f"not judged: {error}"
    return answer.good, answer.headline


def _budget(trace: Trace) -> TorqueBudget | None:
    try:
        return torque_budget(trace)
    except HexapodError:
        return None


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
