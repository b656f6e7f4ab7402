"""What `verify --all` adds: MuJoCo's mass matrix and bias, and the hard cases."""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib.util import find_spec

import numpy as np

from hexapod_pin.validation.cases.case_result import HardRow
from hexapod_pin.validation.cases.registry import run_hard
from hexapod_pin.validation.checks.check import Check, Row, run_check
from hexapod_pin.validation.checks.samples import rigid_robot, states


def more_rows(progress: Callable[[float], None] | None = None) -> list[Row]:
    """Return the rows of MuJoCo and of the hard cases, in their reduced form."""
    return [mujoco_row(), *map(_row, run_hard(quick=True, progress=progress))]


def mujoco_row() -> Row:
    """Return how far MuJoCo's equations of motion are from ours, or that it is not installed."""
    what, source = "M and h: MuJoCo against Pinocchio", "S2 app. eq. 1"
    if find_spec("mujoco") is None:
        note = "mujoco is not installed"
        return Row("mujoco-terms", what, math.nan, math.nan, "relative", source, 0.0, note)
    return run_check(Check("mujoco-terms", what, mujoco_terms, 1e-9, source=source))


def mujoco_terms() -> float:
    """Return the largest difference of M and h at random states, over their largest entries."""
    import mujoco  # type: ignore[import-untyped]

    model = rigid_robot("kharagpur")
    spec = mujoco.MjSpec.from_string(model.robot.urdf)
    spec.compiler.fusestatic, spec.compiler.discardvisual = True, True
    spec.worldbody.first_body().add_freejoint(name="root")
    spec.option.gravity = list(model.gravity)
    other = spec.compile()
    data = mujoco.MjData(other)
    dof = [other.joint(name).dofadr[0] for name in model.robot.joint_names]
    worst = 0.0
    for q, v in states(model, 20):
        turn = _rotation(q[3:7])
        data.qpos[:3], data.qpos[3:7] = q[:3], q[[6, 3, 4, 5]]
        data.qpos[[k + 1 for k in dof]] = q[7:]
        data.qvel[:3], data.qvel[3:6], data.qvel[dof] = turn @ v[:3], v[3:6], v[6:]
        mujoco.mj_forward(other, data)
        full = np.zeros((other.nv, other.nv))
        for column, unit in zip(full, np.eye(other.nv), strict=True):
            mujoco.mj_mulM(other, data, column, unit)
        order = [0, 1, 2, 3, 4, 5, *dof]
        change = np.eye(other.nv)
        change[:3, :3] = turn
        mass = change.T @ full[np.ix_(order, order)] @ change
        spin = np.zeros(other.nv)
        spin[:3] = np.cross(v[3:6], v[:3])  # its linear velocity is in world axes
        bias = change.T @ data.qfrc_bias[order] + mass @ spin
        terms = model.terms(q, v)
        for found, wanted in ((mass, terms.mass), (bias, terms.bias)):
            worst = max(worst, float(np.abs(found - wanted).max() / np.abs(wanted).max()))
    return worst


def _rotation(xyzw: np.ndarray) -> np.ndarray:
    import pinocchio as pin

    matrix: np.ndarray = pin.Quaternion(xyzw).toRotationMatrix()
    return matrix


def _row(row: HardRow) -> Row:
    """Return a hard case as a row; one shown only for comparison never fails."""
    tolerance = row.tolerance if row.required else math.nan
    note = row.note if row.required else f"shown for comparison, error {row.error:.1e}"
    what = f"{row.case} {row.what} ({row.method})"
    return Row(row.case, what, row.error, tolerance, row.unit or "relative", row.case, 0.0, note)
