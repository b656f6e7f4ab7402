"""Reference end states of HC40 by other software: SciPy's DOP853 over Pinocchio's ABA.

Shares with the package the robot's file and the formulas of the laws, which are written out again
here; no integrator, no contact code, no chart. Writes validation/data/hc40_references.json;
takes some ten minutes (stiff: 670 000 calls in Python).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.integrate import solve_ivp

from hexapod_pin.arrays import Array
from hexapod_pin.validation.cases.robots import DATA, references

VARIANTS = {"soft": (1e5, 1e2), "mid": (1e6, 1e3), "stiff": (1e8, 1e4)}
"""K [N/m^1.5], kt [s/m]."""
TOLERANCES = {"soft": (1e-10, 1e-12), "mid": (1e-10, 1e-12), "stiff": (1e-8, 1e-10)}
"""rtol of the check and of the reference; atol is a hundredth."""


def first_state(model: Any, numbers: dict[str, Any]) -> tuple[Array, Array]:
    """Return q and v at t = 0."""
    q, v = pin.neutral(model), np.zeros(model.nv)
    turn = pin.rpy.rpyToMatrix(numbers["roll"], numbers["pitch"], 0.0)
    q[2] = 0.09879 - 0.11934 * np.sin(0.3) + numbers["clear"]
    q[3:7] = pin.Quaternion(turn).coeffs()
    q[7:] = np.tile([0.0, -0.3, 0.3], 6)
    v[:3] = turn.T @ np.array(numbers["vel"])
    return q, v


def point_feet(model: Any) -> list[tuple[int, Array]]:
    """Return joint and place of every foot frame."""
    frames = [f for f in model.frames if f.type == pin.FrameType.BODY and "foot" in f.name]
    return [(frame.parentJoint, frame.placement.translation.copy()) for frame in frames]


def rates(
    model: Any, numbers: dict[str, Any], stiffness: float, slope: float
) -> Callable[[float, Array], Array]:
    """Return y' of y = (q, v), the quaternion as four plain numbers."""
    data, feet = model.createData(), point_feet(model)
    posture = np.tile([0.0, -0.3, 0.3], 6)

    def rate(_: float, y: Array) -> Array:
        q, v = y[: model.nq].copy(), y[model.nq :]
        q[3:7] /= np.linalg.norm(q[3:7])
        pin.forwardKinematics(model, data, q, v)
        forces = [pin.Force.Zero() for _ in range(model.njoints)]
        for joint, place in feet:
            here, twist = data.oMi[joint], data.v[joint]
            depth = -here.act(place)[2]
            u = here.rotation @ (twist.linear + np.cross(twist.angular, place))
            load = stiffness * max(depth, 0.0) ** 1.5 * (1.0 - 1.5 * numbers["a"] * u[2])
            if load > 0.0:
                slip = np.hypot(u[0], u[1])
                ratio = np.tanh(slope * slip) / slip if slip > 0.0 else slope
                shear = -numbers["mu"] * load * ratio * u[:2]
                force = here.rotation.T @ np.array([*shear, load])
                forces[joint] += pin.Force(force, np.cross(place, force))
        torque = np.zeros(model.nv)
        torque[6:] = numbers["kp"] * (posture - q[7:]) - numbers["kd"] * v[6:]
        outer = pin.StdVec_Force()
        outer.extend(forces)
        acceleration = pin.aba(model, data, q, v, torque, outer)
        x, y_, z, w = q[3:7]
        a, b, c = v[3:6]
        turning = 0.5 * np.array(
            [w * a + y_ * c - z * b, w * b + z * a - x * c, w * c + x * b - y_ * a,
             -x * a - y_ * b - z * c]
        )  # fmt: skip
        return np.concatenate([data.oMi[1].rotation @ v[:3], turning, v[6:], acceleration])

    return rate


def solve(model: Any, numbers: dict[str, Any], variant: str, rtol: float) -> Array:
    """Return (q, v) at the end."""
    start = np.concatenate(first_state(model, numbers))
    function = rates(model, numbers, *VARIANTS[variant])
    found = solve_ivp(
        function, (0.0, numbers["T"]), start, method="DOP853", rtol=rtol, atol=1e-2 * rtol
    )
    end: Array = found.y[:, -1]
    end[3:7] /= np.linalg.norm(end[3:7])
    return end


def write_references() -> Iterator[str]:
    """Compute and write; yield one line per variant: how far check and reference are apart."""
    numbers = references()["HC40_hexapod_drop_soft"]["params"]
    model = pin.buildModelFromUrdf(str(DATA / "hexa_ref.urdf"), pin.JointModelFreeFlyer())
    out: dict[str, Any] = {
        "source": "HC40 of hardcases.json; SciPy DOP853 over Pinocchio's ABA, "
        "python scripts/studies hc40_references",
        "order": "q: base place [m], quaternion x y z w, joints [rad]; v: base twist in base axes "
        "[m/s, rad/s], joints [rad/s]",
        "joint_order": list(model.names)[2:],
    }
    for variant, (loose, tight) in TOLERANCES.items():
        check, end = (solve(model, numbers, variant, rtol) for rtol in (loose, tight))
        apart = np.abs(check - end)
        out[variant] = {
            "rtol": tight, "apart_from_rtol": loose,
            "apart_q": float(apart[: model.nq].max()), "apart_v": float(apart[model.nq :].max()),
            "q": end[: model.nq].tolist(), "v": end[model.nq :].tolist(),
        }  # fmt: skip
        yield f"{variant} {out[variant]['apart_q']} {out[variant]['apart_v']}"
    (DATA / "hc40_references.json").write_text(json.dumps(out, indent=1) + "\n", encoding="utf-8")


def main(argv: Sequence[str] | None = None) -> int:
    """Compute and write; takes some ten minutes. Return the exit status."""
    argparse.ArgumentParser(description=__doc__).parse_args(argv)
    for line in write_references():
        print(line)
    return 0
