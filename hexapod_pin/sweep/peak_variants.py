"""The cases in which the peaks of a run are computed again."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from hexapod_pin.errors import ParameterError
from hexapod_pin.results.recomputation import ACCURACY, CONTACT, RUN, SERVO, Recomputation
from hexapod_pin.simulation.case import Case
from hexapod_pin.simulation.methods import METHODS, MethodSettings
from hexapod_pin.simulation.scene import Scene

FINER = 10
"""By which factor accuracy or step are finer."""

DENSER = 3
"""By which factor samples are denser where steps end at them: the errors of an adaptive run that
takes a step per sample are then at most a tenth (3^3 > 10, order 3), whatever its accuracy."""

STIFFER = 2.0
"""By which factor contact and servos are stiffer."""

TIGHT_METHOD = "ndf"
"""What computes accuracies that the run's own method does not reach."""

Variant = tuple[Recomputation, Case | None]
"""A change, and the case with it; None where it does not apply or cannot be had."""


def peak_variants(case: Case) -> tuple[Variant, Variant, Variant]:
    """Return the case at ten times the accuracy, and that with stiffer contact and servos.

    Stiffness is changed at ten times the accuracy too: errors of the run are then not taken for
    an effect of stiffness.

    Raises:
        ParameterError: the case has no duration.
    """
    finer = _finer(case)
    base, baseline = (case, RUN) if finer[1] is None else (finer[1], ACCURACY)
    at = _numerics(base.settings.choice)
    return finer, _stiffer_contact(base, baseline, at), _stiffer_servo(base, baseline, at)


def cuts_torque(scene: Scene) -> bool:
    """Return whether the drives cut torques at their limits."""
    servo = scene.servos
    return not scene.prescribed and (servo.limited or servo.motor is not None)


def with_servos(case: Case, factor: float) -> Case:
    """Return the case with servos of `factor` times the stiffness; see `Servo.stiffer`."""
    return replace(case, scene=replace(case.scene, servo=case.scene.servos.stiffer(factor)))


def _finer(case: Case) -> Variant:
    """Return the case at a tenth of its accuracy, or of its step.

    A tenth of the step for every method: behind a touch-down each is of first order only.
    """
    settings = case.settings
    choice, sample = settings.choice, settings.grid.sample
    title = "ten times the accuracy"
    if not choice.method.adaptive:
        step = choice.step / FINER
        finer = replace(case, method=choice.method.name, step=step, sample=sample)
        text = f"step {choice.step / FINER:g} instead of {choice.step:g} s"
        return Recomputation(ACCURACY, title, text, RUN), finer
    tight = choice.accuracy / FINER
    method = choice.method
    if tight < method.tightest:
        method = METHODS[TIGHT_METHOD]
    text = f"accuracy {tight:g} instead of {choice.accuracy:g} m and rad"
    text += f", {method.name} instead of {choice.method.name}" * (method is not choice.method)
    change: dict[str, Any] = {"method": method.name, "accuracy": tight, "sample": sample / DENSER}
    try:
        return Recomputation(ACCURACY, title, text, RUN), replace(case, **change)
    except ParameterError as error:
        failure = f"is out of reach: {error.name} must be {error.allowed}"
        return Recomputation(ACCURACY, title, text, RUN, failure=failure), None


def _numerics(choice: MethodSettings) -> str:
    return f"accuracy {choice.accuracy:g}" if choice.method.adaptive else f"step {choice.step:g} s"


def _stiffer_contact(case: Case, baseline: str, at: str) -> Variant:
    before = case.scene.contact
    after = before.stiffer(STIFFER)
    unit = f"N/m^{before.normal.exponent:g}"
    text = f"normal {after.normal.stiffness:.4g} instead of {before.normal.stiffness:.4g} {unit}"
    if before.friction.kind == "stick-slip" and after.friction.kind == "stick-slip":
        springs = (after.friction.stiffness, before.friction.stiffness)
        text += f", tangential {springs[0]:.4g} instead of {springs[1]:.4g} N/m"
    text += f", restitution and damping ratio kept; at {at}"
    changed = Recomputation(CONTACT, "doubled contact stiffness", text, baseline)
    return changed, replace(case, scene=replace(case.scene, contact=after))


def _stiffer_servo(case: Case, baseline: str, at: str) -> Variant:
    title, scene = "doubled servo stiffness", case.scene
    before = scene.servos
    if scene.prescribed:
        reason = "no servo: prescribed motion"
    elif not before.gains(scene.robot)[0].any():
        reason = "no servo stiffness: kp = 0"
    else:
        changed = with_servos(case, STIFFER)
        after = changed.scene.servos
        text = f"{after.describe()} instead of {before.describe()}, kd/kp kept; at {at}"
        return Recomputation(SERVO, title, text, baseline), changed
    return Recomputation(SERVO, title, "", baseline, unneeded=reason), None
