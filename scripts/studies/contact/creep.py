"""How fast a standing robot creeps under a side load, ours beside MuJoCo's on the same URDF."""

from __future__ import annotations

from typing import Any

import numpy as np

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.benchmark.engines.mujoco_engine import CONES
from hexapod_pin.interchange.mjcf_text import MjcfOptions
from hexapod_pin.text_table import Table
from studies.cost.mujoco_twin import SAMPLE, MujocoTwin
from studies.cost.step_entries import STEP
from studies.study import StudyReport

MU = 0.7
LOAD_RATIOS = {"20 %": 0.2, "just below mu": 0.98 * MU, "just above mu": 1.02 * MU}
"""Side load over normal load."""

LAWS: dict[str, Any] = {
    "stick-slip": hp.contact.StickSlip(mu=MU, stiffness=2e4, damping=60.0),
    "tanh, kt 1000 s/m": hp.contact.TanhCoulomb(mu=MU, slope=1e3),
    "smooth step, vs 1 mm/s": hp.contact.SmoothStep(mu_static=MU, mu_dynamic=MU, speed=1e-3),
    "ADAMS, vs 1 mm/s": hp.contact.AdamsCoulomb(
        mu_static=MU, mu_dynamic=MU, stiction_speed=1e-3, transition_speed=1e-2
    ),
}
SETTLED_TIME = 4.0
"""The creep is the mean speed from this time to the end [s]."""

SERVO = hp.Servo(kp=1000.0, kd=20.0, limited=False)


def creep(*, duration: float = 6.0) -> StudyReport:
    """Creep of standing kharagpur, gravity tilted; below and above the friction angle."""
    head = ["friction", *(f"{load} [m/s]" for load in LOAD_RATIOS)]
    rows = []
    for name, law in LAWS.items():
        found = [own_creep(law, ratio, duration) for ratio in LOAD_RATIOS.values()]
        rows.append([name, *map("{:.3g}".format, found), f"{law.creep_speed(0.2):.3g}"])
    for cone in CONES:
        found = [mujoco_creep(cone, ratio, duration) for ratio in LOAD_RATIOS.values()]
        rows.append([f"MuJoCo, {cone} cone", *map("{:.3g}".format, found), "-"])
    return StudyReport(
        "Creep of a standing robot",
        [
            f"kharagpur, mu {MU}, 1 ms steps, {SERVO}; mean side speed from {SETTLED_TIME:g} to "
            f"{duration:g} s. Sliding free of friction would give about 1e1 m/s.",
            Table("", [*head, "the law's formula at 20 % [m/s]"], rows),
        ],
    )


def tilted_scene(law: Any, ratio: float) -> hp.Scene:
    """Return kharagpur under gravity tilted towards +y by a ratio of side load to normal load."""
    cosine = 9.81 / np.hypot(1.0, ratio)
    contact = hp.Contact(normal=hp.Contact.s1().normal, friction=law)
    robot = hp.load_robot("kharagpur")
    return hp.Scene(robot, contact=contact, servo=SERVO, gravity=(0.0, ratio * cosine, -cosine))


def own_creep(law: Any, ratio: float, duration: float) -> float:
    """Return the mean side speed of the trunk [m/s]."""
    scene = tilted_scene(law, ratio)
    return _mean_speed(
        hp.simulate(scene, hp.HoldPosture(), duration=duration, step=STEP, sample=SAMPLE).q[:, 1]
    )


def mujoco_creep(cone: str, ratio: float, duration: float) -> float:
    """Return the same of MuJoCo at 1 ms, implicitfast, default solver parameters [m/s]."""
    scene = tilted_scene(LAWS["tanh, kt 1000 s/m"], ratio)
    posture = scene.robot.posture[None]

    def hold(t: Array) -> tuple[Array, Array]:
        return np.repeat(posture, len(t), 0), np.zeros((len(t), posture.shape[1]))

    twin = MujocoTwin(scene, MjcfOptions(STEP, cone=cone))
    return _mean_speed(twin.path(scene.robot.stand(), hold, duration).positions[:, 1])


def _mean_speed(path: Array) -> float:
    first = min(round(SETTLED_TIME / SAMPLE), len(path) - 2)
    return float((path[-1] - path[first]) / (SAMPLE * (len(path) - 1 - first)))
