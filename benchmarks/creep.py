"""How fast a standing robot creeps under a side load, ours beside MuJoCo's on the same URDF.

kharagpur stands on flat ground, gravity tilted so that the side load is 20 % of the load on the
feet; then on slopes just below and just above the friction angle. Writes creep.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import machine
import numpy as np
from mujoco_scene import CONES, MujocoScene

import hexapod_pin as hp

RESULTS = Path(__file__).resolve().parent / "results"
MU = 0.7
LOADS = {"20 %": 0.2, "just below mu": 0.98 * MU, "just above mu": 1.02 * MU}
LAWS: dict[str, Any] = {
    "stick-slip": hp.StickSlip(mu=MU, stiffness=2e4, damping=60.0),
    "tanh, kt 1000 s/m": hp.TanhCoulomb(mu=MU, slope=1e3),
    "smooth step, vs 1 mm/s": hp.SmoothStep(mu_static=MU, mu_dynamic=MU, speed=1e-3),
    "ADAMS, vs 1 mm/s": hp.AdamsCoulomb(
        mu_static=MU, mu_dynamic=MU, stiction_speed=1e-3, transition_speed=1e-2
    ),
}
SETTLED, END = 4.0, 6.0
"""The creep is the mean speed between these times [s]."""
SERVO = hp.Servo(kp=1000.0, kd=20.0, limited=False)


def main(argv: Sequence[str] | None = None) -> int:
    """Print the table and write it to --out. Return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of creep.md")
    options = parser.parse_args(argv)
    text = report()
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "creep.md").write_text(text, encoding="utf-8")
    print(text)
    return 0


def scene(law: Any, ratio: float) -> hp.Scene:
    """Kharagpur under gravity tilted towards +y; `ratio` is the side load over the normal load."""
    cosine = 9.81 / np.hypot(1.0, ratio)
    contact = hp.Contact(normal=hp.Contact.s1().normal, friction=law)
    robot = hp.load_robot("kharagpur")
    return hp.Scene(robot, contact=contact, servo=SERVO, gravity=(0.0, ratio * cosine, -cosine))


def ours(law: Any, ratio: float) -> float:
    """Return the mean side speed of the trunk at 1 ms [m/s]."""
    trace = hp.simulate(scene(law, ratio), hp.HoldPosture(), duration=END, sample=0.01)
    return mean_speed(trace.q[:, 1])


def mujoco(cone: str, ratio: float) -> float:
    """Return the same of MuJoCo at 1 ms, implicitfast, default solver parameters [m/s]."""
    here = scene(LAWS["tanh, kt 1000 s/m"], ratio)
    twin = MujocoScene(here, cone=cone)
    posture = here.robot.posture[None]
    path, _, _ = twin.positions(
        here.robot.stand(),
        lambda t: (np.repeat(posture, len(t), 0), np.zeros((len(t), posture.shape[1]))),
        END,
    )
    return mean_speed(path[:, 1])


def mean_speed(path: np.ndarray) -> float:
    """Return the mean speed over the last seconds, samples every 10 ms [m/s]."""
    first = round(SETTLED / 0.01)
    return float((path[-1] - path[first]) / (END - SETTLED))


def rows() -> Iterator[list[str]]:
    """One row per law or cone: creep under every load, and the law's own creep under 20 %."""
    for name, law in LAWS.items():
        found = [ours(law, ratio) for ratio in LOADS.values()]
        yield [name, *map("{:.3g}".format, found), f"{law.creep_speed(0.2):.3g}"]
    for cone in CONES:
        found = [mujoco(cone, ratio) for ratio in LOADS.values()]
        yield [f"MuJoCo, {cone} cone", *map("{:.3g}".format, found), "-"]


def report() -> str:
    """Return the table as Markdown."""
    before = machine.describe()
    head = ["friction", *(f"{load} [m/s]" for load in LOADS), "the law's formula at 20 % [m/s]"]
    table = [head, ["---"] * len(head), *rows()]
    lines = ["| " + " | ".join(row) + " |" for row in table]
    return "\n".join(
        [
            "# Creep of a standing robot",
            "",
            machine.as_text(before, machine.load()),
            "",
            f"kharagpur, mu {MU}, 1 ms steps, {SERVO}; mean side speed from {SETTLED:g} to "
            f"{END:g} s. Sliding free of friction for {END:g} s would give about 1e1 m/s.",
            "",
            *lines,
            "",
        ]
    )


if __name__ == "__main__":
    sys.exit(main())
