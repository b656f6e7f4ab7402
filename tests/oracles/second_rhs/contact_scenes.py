"""Scenes of contact laws and grounds: a body that comes down, slides and is left again."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, get_args

from hexapod_pin.control.sampled_trajectory import HoldPosture
from hexapod_pin.ground.contact import (
    AdamsCoulomb,
    AdamsImpact,
    BrownMcPhee,
    FrictionLaw,
    HuntCrossley,
    KelvinVoigt,
    NormalLaw,
    Restitution,
    SmoothStep,
    StickSlip,
    TanhCoulomb,
)
from hexapod_pin.ground.contact.restitution import Model
from hexapod_pin.ground.terrain import Flat, Patch, PatchedGround, ShakingGround, Slope
from hexapod_pin.robot.robot import Robot
from hexapod_pin.validation.cases.bodies import on_ground, state
from oracles.second_rhs.law_scene import LawScene
from oracles.second_rhs.small_robots import puck, stool

RUBBER = 3e5
"""K of a soft foot [N/m^1.5]."""

PLAIN_NORMAL = HuntCrossley(stiffness=RUBBER, dissipation=3.0)
PLAIN_FRICTION = TanhCoulomb(mu=0.5, slope=30.0)

NORMAL_LAWS: dict[str, NormalLaw] = {
    "hunt-crossley": PLAIN_NORMAL,
    "hunt-crossley n=1": HuntCrossley(stiffness=4e3, exponent=1.0, dissipation=8.0),
    "kelvin-voigt": KelvinVoigt(stiffness=4e3, damping=12.0),
    "kelvin-voigt undamped": KelvinVoigt(stiffness=4e3, damping=0.0),
    "adams-impact": AdamsImpact.from_mm(
        stiffness=100.0, exponent=2.2, damping=0.05, damping_depth=0.2
    ),
    "adams-impact s2": AdamsImpact.from_mm(
        stiffness=1e5, exponent=2.2, damping=10.0, damping_depth=0.1
    ),
    **{
        f"restitution {model}": Restitution(stiffness=RUBBER, restitution=0.5, model=model)
        for model in get_args(Model)
    },
}
"""By what is special about them."""

FRICTION_LAWS: dict[str, FrictionLaw] = {
    "none": TanhCoulomb(mu=0.0, slope=1.0),
    "tanh-coulomb": PLAIN_FRICTION,
    "adams-coulomb": AdamsCoulomb(
        mu_static=0.4, mu_dynamic=0.2, stiction_speed=0.05, transition_speed=0.15
    ),
    "smooth-step": SmoothStep(mu_static=0.5, mu_dynamic=0.3, speed=0.04),
    "brown-mcphee": BrownMcPhee(mu_static=0.5, mu_dynamic=0.3, speed=0.04),
    "stick-slip": StickSlip(mu=0.4, stiffness=4e3, damping=6.0),
    "stick-slip dynamic": StickSlip(mu=0.5, mu_dynamic=0.3, stiffness=4e3, damping=6.0),
}

GROUNDS: dict[str, Any] = {
    "slope": Slope(angle=0.2, heading=0.7, point=(0.0, 0.0, 0.003)),
    "patched": PatchedGround(
        ground=Flat(),
        patches=(
            Patch(low=(0.0103, -1.0), high=(0.0108, 1.0), friction=0.2, stiffness=1.5),
            Patch(low=(0.0105, -1.0), high=(0.5, 1.0), friction=1.5, stiffness=0.7),
        ),
    ),
    "shaken": ShakingGround(ground=Flat(), amplitude=1e-3, frequency=60.0),
    "shaken slope": ShakingGround(
        ground=Slope(angle=0.15, heading=-0.4), amplitude=5e-4, frequency=80.0
    ),
}


def landing(
    name: str, normal: NormalLaw, friction: FrictionLaw, *, robot: Robot | None = None,
    terrain: Any = None, duration: float = 0.04,
) -> LawScene:  # fmt: skip
    """Return a body that comes down at 0.2 m/s, slips by 0.15 m/s and turns."""
    robot = puck() if robot is None else robot
    ground = Flat() if terrain is None else terrain
    lift = ground.lift([foot.offset for foot in robot.feet], [foot.radius for foot in robot.feet])
    begin = state(robot, (0.0, 0.0, lift + 5e-4), (0.15, 0.05, -0.2), spin=(0.4, -0.3, 0.5))
    scene = on_ground(robot, normal, friction=friction, terrain=ground)
    return LawScene(name, scene, HoldPosture(), begin, duration, duration / 8.0)


def normal_scenes() -> dict[str, LawScene]:
    """Return a landing on one foot under every normal law."""
    laws = NORMAL_LAWS.items()
    return {name: landing(f"normal: {name}", law, PLAIN_FRICTION) for name, law in laws}


def friction_scenes() -> dict[str, LawScene]:
    """Return a landing on one foot under every friction law."""
    laws = FRICTION_LAWS.items()
    return {name: landing(f"friction: {name}", PLAIN_NORMAL, law) for name, law in laws}


def ground_scenes(friction: str = "tanh-coulomb") -> dict[str, LawScene]:
    """Return a landing on one foot under a friction law on every ground."""
    law = FRICTION_LAWS[friction]
    return {
        name: landing(f"ground: {name}, {friction}", PLAIN_NORMAL, law, terrain=ground)
        for name, ground in GROUNDS.items()
    }


def pair_scenes() -> Mapping[str, LawScene]:
    """Return a landing on three feet under every pair of a normal and a friction law."""
    return {
        f"{normal} + {friction}": landing(
            f"three feet: {normal} + {friction}", NORMAL_LAWS[normal], FRICTION_LAWS[friction],
            robot=stool(), duration=0.06,
        )
        for normal in ("hunt-crossley", "kelvin-voigt", "adams-impact", "restitution exact")
        for friction in FRICTION_LAWS
    }  # fmt: skip
