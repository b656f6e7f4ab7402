"""All checks are registered here; those of single terms compare with MuJoCo.

Every module whose name ends in `_checks` may hold CHECKS, a sequence of `Check`; `all_checks` finds
them, so a new formulation brings its own without touching anything here.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np

from hexapod_pin.arrays import Array
from hexapod_pin.validation.case_result import CaseResult
from hexapod_pin.validation.checks.samples import rigid_robot, states, worst
from hexapod_pin.validation.hard_case import Check, ValidationCase, named_cases, run_cases


def all_checks() -> list[Check]:
    """Return the checks of every module `*_checks` of this package, module by module."""
    import hexapod_pin.validation.checks as package

    names = sorted(m.name for m in pkgutil.iter_modules(package.__path__))
    modules = [importlib.import_module(f"{package.__name__}.{name}") for name in names
               if name.endswith("_checks")]  # fmt: skip
    return [check for module in modules for check in getattr(module, "CHECKS", ())]


def run_checks(
    *, names: Sequence[str] | None = None, everything: bool = False,
    progress: Callable[[float], None] | None = None,
) -> list[CaseResult]:  # fmt: skip
    """Run the checks.

    Args:
        names: of checks; None: all.
        everything: MuJoCo, where it is installed, and the hard cases in quick form too.
        progress: called with the finished fraction (0..1).

    Raises:
        UnknownNameError: there is no such check.
    """
    cases: list[ValidationCase] = named_cases(all_checks(), names, "check")
    if everything:
        from hexapod_pin.validation.cases.registry import HARD_CASES

        cases += [MUJOCO_CHECK, *HARD_CASES]
    return run_cases(cases, quick=True, progress=progress)


# MuJoCo's mass matrix and bias beside ours, where it is installed.


def mujoco_terms() -> float:
    """Return the largest difference of M and h at random states, over their largest entries."""
    import mujoco

    model = rigid_robot("kharagpur")
    spec = mujoco.MjSpec.from_string(model.robot.urdf)
    spec.compiler.fusestatic, spec.compiler.discardvisual = True, True
    spec.worldbody.first_body().add_freejoint(name="root")
    spec.option.gravity = list(model.gravity)
    other = spec.compile()
    data = mujoco.MjData(other)
    dof = [other.joint(name).dofadr[0] for name in model.robot.joint_names]
    error = 0.0
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
        error = max(error, worst(mass, terms.mass), worst(bias, terms.bias))
    return error


def _rotation(xyzw: Array) -> Array:
    import pinocchio as pin

    matrix: Array = pin.Quaternion(xyzw).toRotationMatrix()
    return matrix


@dataclass(frozen=True)
class MujocoCheck(Check):
    """A check that is not run where MuJoCo is not installed."""

    def results(self, quick: bool = False) -> Iterator[CaseResult]:
        """Yield the one result."""
        if find_spec("mujoco") is None:
            yield CaseResult.not_run(
                self.name, self.what, self.source, "mujoco is not installed"
            )  # fmt: skip
        else:
            yield from super().results(quick)


MUJOCO_CHECK = MujocoCheck(
    "mujoco-terms", "M and h: MuJoCo against Pinocchio", mujoco_terms, 1e-9,
    source="S2 app. eq. 1",
)  # fmt: skip
