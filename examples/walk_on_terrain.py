"""Walk on a slope, up stairs, over a height field, and onto ice on a slope.

The gait is planned for level ground and does not feel the terrain: lift and stroke must leave room
for it. Prints how far and how high the robot came, and the largest femur torque.
Writes `walk_on_terrain.png`.
"""

import math
import sys
from pathlib import Path

import hexapod_pin as hp

DURATION = 8.0  # s
GROUNDS = {
    "level": hp.Flat(),
    "slope": hp.Slope(angle=math.radians(8.0)),
    "stairs": hp.Stairs(rise=0.015, run=0.25, count=3, start=0.35),  # m
    "hills": hp.HeightField.random(seed=1, amplitude=0.01, wavelength=0.5),  # m
    "ice": hp.terrain.PatchedGround(
        ground=hp.Slope(angle=math.radians(8.0)),
        patches=(
            hp.terrain.Patch(low=(0.4, -1.0), high=(2.0, 1.0), friction=0.1),
        ),  # of the law's mu
    ),
}


def main(folder: Path = Path()) -> dict[str, hp.Trace]:
    """Return one trace per ground."""
    robot = hp.load_robot("kharagpur")
    control = hp.KinematicControl(hp.Gait.tetrapod(stroke=0.12, cycle_time=1.6, lift=0.035))
    traces = {}
    print("ground     forward [m]     up [m]   peak torque [N m]")
    for name, ground in GROUNDS.items():
        scene = hp.Scene(robot, terrain=ground)
        trace = hp.simulate(scene, control, duration=DURATION, accuracy=1e-3)
        forward, _, up = trace.com[-1] - trace.com[0]
        peak = hp.torque_budget(trace).kind("femur").peak
        print(f"{name:8} {forward:12.3f} {up:12.3f} {peak.torque_peak:12.2f} ({peak.joint})")
        traces[name] = trace
    draw(traces, folder / "walk_on_terrain.png")
    return traces


def draw(traces: dict[str, hp.Trace], path: Path) -> None:
    """Draw the paths of the centre of mass, seen from the side."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    for name, trace in traces.items():
        axes.plot(trace.com[:, 0], trace.com[:, 2], label=name)
    axes.set(xlabel="forward [m]", ylabel="height of the centre of mass [m]")
    axes.legend()
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
