"""Digests of 130 runs: every method, contact preset and terrain, both robots, drops and walks.

    python scripts/run_digests.py --write docs/results/run_digests.txt
    python scripts/run_digests.py --check docs/results/run_digests.txt

A rearrangement of the code must leave every line as it is. Bits depend on the machine (SIMD width,
libm), so a table is compared only with one made on the same machine: write it before a change,
check after it. Each digest is over every sampled quantity and every counter of one run.
"""

from __future__ import annotations

import argparse
import hashlib
import platform
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import hexapod_pin as hp
from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.robot.loading.load_options import LoadOptions
from hexapod_pin.robot.loading.load_urdf import loaded_text
from hexapod_pin.robot.robot import robot_of

ADAPTIVE = {"extrapolated-euler": 1e-4, "ndf": 1e-5, "dop853": 1e-5}  # method: accuracy [m, rad]
FIXED = {"robust": 1e-3, "implicit-euler": 1e-3, "rk4": 2e-5}  # method: step [s]
SAMPLES = (
    "time q v torque q_ref v_ref foot_position foot_force foot_impulse foot_normal foot_gap com"
).split()
GAITS = {
    "kharagpur": dict(stroke=0.10, cycle_time=1.2),
    "athena": dict(stroke=0.08, cycle_time=1.6),
}


def terrains() -> dict[str, object]:
    """Return one ground of every kind."""
    x = np.linspace(-1.0, 1.0, 41)
    bumps = 0.004 * np.sin(9.0 * x)[:, None] * np.cos(7.0 * x)[None, :]
    flat, slip = hp.Flat(), hp.terrain.Patch(low=(-0.1, -0.5), high=(0.4, 0.5), friction=0.5)
    return {
        "flat": flat,
        "slope": hp.Slope(angle=0.1),
        "stairs": hp.Stairs(rise=0.01, run=0.2, count=3, start=0.15),
        "ledge": hp.terrain.Ledge(height=0.02, edge=0.1),
        "groove": hp.terrain.Groove(angle_left=0.3, angle_right=0.3, depth=0.01, bottom=0.2),
        "height-field": hp.HeightField.from_array(bumps, spacing=0.05),
        "patched": hp.terrain.PatchedGround(ground=flat, patches=(slip,)),
        "shaking": hp.terrain.ShakingGround(ground=flat, amplitude=0.002, frequency=5.0),
    }


PRESETS = ("accurate", "s1", "s1-printed", "s2")


def settings(method: str) -> dict[str, float | str]:
    """Return how to run a method."""
    if method in ADAPTIVE:
        return {"method": method, "accuracy": ADAPTIVE[method], "sample": 2e-3}
    return {"method": method, "step": FIXED[method], "sample": 2e-3}


def walk(robot: str, terrain: object, preset: str, method: str, **gait: float) -> object:
    """Walk a tripod or tetrapod for half a second."""
    scene = hp.Scene(hp.load_robot(robot), terrain=terrain, contact=hp.Contact.preset(preset))
    table = hp.Gait.tripod if robot == "athena" else hp.Gait.tetrapod
    control = hp.KinematicControl(table(**{**GAITS[robot], **gait}))
    duration = 0.1 if method in ("rk4", "dop853") else 0.5
    return hp.simulate(scene, control, duration=duration, **settings(method))


def long_walk(robot: str, method: str) -> object:
    """Walk for five cycles and a bit."""
    table = hp.Gait.tripod if robot == "athena" else hp.Gait.wave
    gait = table(stroke=0.06, cycle_time=1.3)
    return hp.simulate(
        hp.Scene(hp.load_robot(robot)), hp.KinematicControl(gait), duration=7.0, **settings(method)
    )


def drop(robot: str, terrain: object, preset: str, method: str) -> object:
    """Drop a robot, tilted and turning, from 3 cm."""
    model = hp.load_robot(robot)
    scene = hp.Scene(model, terrain=terrain, contact=hp.Contact.preset(preset))
    q, v = model.stand().q.copy(), np.zeros(model.model.nv)
    q[2] += 0.03
    q[3:7] = np.array([0.05, -0.03, 0.1, 1.0]) / np.linalg.norm([0.05, -0.03, 0.1, 1.0])
    v[:6] = [0.1, -0.05, 0.0, 0.3, 0.2, -0.4]
    duration = 0.1 if method in ("rk4", "dop853") else 0.2
    start = hp.State(q, v)
    return hp.simulate(
        scene, hp.HoldPosture(), duration=duration, initial=start, **settings(method)
    )


def set_points(robot: str, method: str) -> object:
    """Hold set-points that jump every 20 ms."""
    model = hp.load_robot(robot)
    times = np.arange(10) * 0.02
    swing = 0.05 * np.sin(np.outer(np.arange(10), 1.0 + np.arange(len(model.joint_names))))
    control = hp.motion.SampledTrajectory(times, np.array(model.posture) + swing)
    return hp.simulate(hp.Scene(model), control, duration=0.2, **settings(method))


def two_joint_legs(folder: Path) -> hp.Robot:
    """Return a trunk on four legs of two joints: no closed form, no fused dynamics."""
    inertia = '<inertia ixx="{0}" iyy="{0}" izz="{0}" ixy="0" ixz="0" iyz="0"/>'
    text = [
        '<robot name="table"><link name="base_link"><inertial><mass value="2"/>'
        + inertia.format(0.02) + "</inertial></link>"
    ]  # fmt: skip
    places = {"a": (0.1, 0.1), "b": (0.1, -0.1), "c": (-0.1, 0.1), "d": (-0.1, -0.1)}
    for leg, (x, y) in places.items():
        parent, origin = "base_link", f"{x} {y} 0"
        for part, axis in (("upper", "1 0 0"), ("lower", "0 1 0")):
            text.append(
                f'<link name="{leg}_{part}"><inertial><origin xyz="0 0 -0.05"/><mass value="0.1"/>'
                + inertia.format(1e-4) + "</inertial></link>"
                f'<joint name="{leg}_{part}_joint" type="revolute"><parent link="{parent}"/>'
                f'<child link="{leg}_{part}"/><origin xyz="{origin}"/><axis xyz="{axis}"/>'
                '<limit lower="-1" upper="1" effort="5" velocity="5"/></joint>'
            )  # fmt: skip
            parent, origin = f"{leg}_{part}", "0 0 -0.1"
        text.append(
            f'<link name="{leg}_foot"/><joint name="{leg}_tip" type="fixed">'
            f'<parent link="{parent}"/><child link="{leg}_foot"/><origin xyz="0 0 -0.1"/></joint>'
        )
    path = folder / "table.urdf"
    path.write_text("".join([*text, "</robot>"]))
    feet = [f"{leg}_foot" for leg in places]  # in this order: legs are not looked for
    options = LoadOptions(feet=tuple(feet), foot_radius=0.01)
    return robot_of(loaded_text(path.read_text(), str(path), options), "table")


def drop_other(method: str, preset: str) -> object:
    """Drop the table, tilted."""
    with tempfile.TemporaryDirectory() as folder:
        model = two_joint_legs(Path(folder))
        scene = hp.Scene(model, contact=hp.Contact.preset(preset))
        q = model.stand().q.copy()
        q[2] += 0.02
        q[3:7] = np.array([0.06, -0.04, 0.0, 1.0]) / np.linalg.norm([0.06, -0.04, 0.0, 1.0])
        start = hp.State(q, np.zeros(model.model.nv))
        duration = 0.05 if method in ("rk4", "dop853") else 0.2
        return hp.simulate(
            scene, hp.HoldPosture(), duration=duration, initial=start, **settings(method)
        )


def cases() -> Iterator[tuple[str, Callable[[], object]]]:
    """Yield every run with its name."""
    grounds = terrains()
    for robot in ("kharagpur", "athena"):
        for method in (*ADAPTIVE, *FIXED):
            for preset in PRESETS:
                yield (
                    f"walk {robot} flat {preset} {method}",
                    lambda a=(robot, grounds["flat"], preset, method): walk(*a),
                )
            if method != "dop853":
                yield f"set-points {robot} {method}", lambda a=(robot, method): set_points(*a)
        for name, ground in grounds.items():
            if name == "flat":
                continue
            for method in ("extrapolated-euler", "robust"):
                yield (
                    f"walk {robot} {name} accurate {method}",
                    lambda a=(robot, ground, "accurate", method): walk(*a),
                )
            yield (
                f"drop {robot} {name} s1 implicit-euler",
                lambda a=(robot, ground, "s1", "implicit-euler"): drop(*a),
            )
            yield f"drop {robot} {name} s2 ndf", lambda a=(robot, ground, "s2", "ndf"): drop(*a)
        for method in ("extrapolated-euler", "implicit-euler"):
            yield f"long walk {robot} {method}", lambda a=(robot, method): long_walk(*a)
        yield (
            f"walk {robot} turning accurate extrapolated-euler",
            lambda a=(robot, grounds["flat"], "accurate", "extrapolated-euler"): walk(
                *a, turn_rate=0.1, heading=0.5, stroke=0.05
            ),
        )
    for method in ("extrapolated-euler", "ndf", "dop853", "implicit-euler", "rk4"):
        for preset in ("accurate", "s2"):
            yield (
                f"drop two-joint-legs flat {preset} {method}",
                lambda a=(method, preset): drop_other(*a),
            )


def digest(trace: object) -> str:
    """Return the first 16 hexadecimal digits of the SHA-256 of a trace's samples and counters."""
    bits = hashlib.sha256()
    for name in SAMPLES:
        bits.update(np.ascontiguousarray(getattr(trace, name)).tobytes())
    for name in sorted(trace.energy):
        bits.update(np.ascontiguousarray(trace.energy[name]).tobytes())
    counters = sorted((name, float(count)) for name, count in trace.counters.items())
    bits.update(repr([count for _, count in counters]).encode())
    return bits.hexdigest()[:16]


def main(argv: list[str] | None = None) -> int:
    """Write the table, or compare with one."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", type=Path, help="write the table here")
    parser.add_argument("--check", type=Path, help="compare with this table")
    parser.add_argument("--only", default="", help="runs whose name contains this")
    options = parser.parse_args(argv)
    found, diverged = {}, []
    for name, run in cases():
        if options.only not in name:
            continue
        try:
            found[name] = digest(run())
        except hp.errors.DivergenceError as error:  # what was good is compared too
            found[name] = digest(error.trace)
            diverged.append(name)
        print(f"{found[name]:<18} {name}", flush=True)
    lines = [f"{value:<18} {name}" for name, value in found.items()]
    print(f"{len(found)} runs, {len(diverged)} of them diverged (ndf on S2's stiff contact)")
    if options.write:
        head = f"# {platform.machine()}, Python {platform.python_version()}, NumPy {np.__version__}"
        write_atomically(options.write, "\n".join([head, *lines]) + "\n")
    if options.check:
        known = [line for line in options.check.read_text().splitlines() if line[0] != "#"]
        known = [line for line in known if options.only in line]
        changed = sorted(set(lines) ^ set(known))
        print(f"{len(set(lines) & set(known))} of {len(known)} digests unchanged")
        print("\n".join(changed))
        return 1 if changed else 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
