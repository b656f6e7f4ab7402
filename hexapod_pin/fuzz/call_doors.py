"""Doors of calls: each draws odd arguments from a seeded generator and calls with them."""

from __future__ import annotations

import inspect
import random
from typing import Any

import hexapod_pin as hp
from hexapod_pin.fuzz import material
from hexapod_pin.fuzz.shown import require_finite_data
from hexapod_pin.fuzz.values import odd_value
from hexapod_pin.spec import Spec


def parameters(dice: random.Random) -> None:
    """A parameter set with odd fields."""
    kinds = [getattr(hp, name) for name in hp.__all__ if name != "__version__"]
    specs = [kind for kind in kinds if inspect.isclass(kind) and issubclass(kind, Spec)]
    kind = dice.choice(specs)
    names = [name for name in kind.model_fields if name != "kind"]
    fields = {name: odd_value(dice) for name in names if dice.random() < 0.7}
    str(kind(**fields))


SIMULATED = ("duration", "accuracy", "torque_accuracy", "estimate", "method", "step", "sample",
             "record", "initial", "progress", "limits", "allow")  # fmt: skip


def settings(dice: random.Random) -> None:
    """A run with odd settings."""
    given = {"duration": 2e-3, **{name: odd_value(dice) for name in dice.sample(SIMULATED, 2)}}
    given.setdefault("limits", hp.WorkLimits(evaluations=3e4, steps=1e4, memory=1e8))
    if given["limits"] is None or given.get("allow"):
        given |= {"limits": hp.WorkLimits(evaluations=3e4, steps=1e4, memory=1e8)}
    hp.simulate(material.scene(), material.control(), **given)


GRIDS = ("run_sweep", "select_motors", "torque_map", "gait_energy", "tune")
"""Calls that run many walks, for minutes where nothing is wrong."""


def arguments(dice: random.Random) -> None:
    """A public call with odd arguments."""
    names = [name for name in hp.__all__ if inspect.isroutine(getattr(hp, name, None))]
    names += ["State", "Checkpoint", "HoldPosture", "KinematicControl", "SampledTrajectory",
              "Scene", "Case", "Session", "FootControl", "JointMotion", "ArcWalk"]  # fmt: skip
    name = dice.choice([one for one in names if one not in GRIDS])
    public = getattr(hp, name)
    given = {}
    for parameter in inspect.signature(public).parameters.values():
        needed = parameter.default is parameter.empty
        if needed or dice.random() < 0.3:
            given[parameter.name] = _sound(parameter.name) if dice.random() < 0.6 else None
            if given[parameter.name] is None:
                given[parameter.name] = odd_value(dice)
    found = public(**given)
    if inspect.isgenerator(found):
        next(found, None)


def _sound(name: str) -> Any:
    """Return something that arguments of this name take; None where nothing is known."""
    return {
        "scene": material.scene(), "robot": material.robot(), "trace": material.trace(),
        "run": material.trace(), "controller": material.control(), "duration": 2e-3,
        "gait": material.control().gait, "cases": [], "scenes": {"a": material.scene()},
    }.get(name)  # fmt: skip


def height_field(dice: random.Random) -> None:
    """Heights of ground, and a step on them."""
    given = {"spacing": 0.05} if dice.random() < 0.7 else {"spacing": odd_value(dice)}
    rows = [
        [dice.choice((0.0,) * 20 + (0.001, -0.002, 1e9, float("nan"))) for _ in range(4)]
        for _ in "abcd"
    ]
    heights = rows if dice.random() < 0.7 else odd_value(dice)
    ground = hp.HeightField.from_array(heights, **given)
    material.used(hp.Scene(material.robot(), terrain=ground))


def session(dice: random.Random) -> None:
    """Commands to a session."""
    led = hp.Session(material.scene(), accuracy=1e-3, limits=hp.WorkLimits(evaluations=3e4))
    given = {name: odd_value(dice) for name in ("q", "v", "torque", "ramp") if dice.random() < 0.4}
    led.command(**given)
    led.advance(dice.choice((1e-3, odd_value(dice))))
    led.measure()


def extremes(dice: random.Random) -> None:
    """A sound scene with one or two allowed quantities at their ends, run for a moment."""
    size = dice.choice((1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9, 1e15))
    contact = dice.choice((hp.Contact.accurate, hp.Contact.s1, hp.Contact.s2))()
    normal, friction = contact.normal, contact.friction
    if hasattr(normal, "stiffness") and dice.random() < 0.5:
        normal = normal.model_copy(update={"stiffness": normal.stiffness * size})
    if hasattr(friction, "mu") and dice.random() < 0.5:
        friction = friction.model_copy(update={"mu": friction.mu * size})
    scene = hp.Scene(
        material.robot(),
        contact=hp.Contact(normal=normal, friction=friction),
        servo=hp.Servo(kp=dice.choice((100.0, 100.0 * size)), kd=dice.choice((1.0, size))),
        gravity=(0.0, 0.0, -dice.choice((9.81, 9.81 * size))),
        loads=[hp.Payload("base_link", mass=dice.choice((0.1, size)), position=(0.0, 0.0, 0.1))],
    )
    adaptive: dict[str, Any] = {
        "accuracy": dice.choice((1e-3, 1e-6)),
        "method": dice.choice(METHODS[:3]),
    }
    fixed: dict[str, Any] = {"step": dice.choice((1e-3, 1e-5)), "method": dice.choice(METHODS[3:])}
    trace = hp.simulate(
        scene, material.control(), duration=0.01, estimate=False,
        limits=hp.WorkLimits(evaluations=3e4, steps=1e4, memory=1e8),
        **dice.choice((adaptive, fixed)),
    )  # fmt: skip
    require_finite_data(trace)


METHODS = ("extrapolated-euler", "ndf", "dop853", "robust", "implicit-euler", "rk4")
