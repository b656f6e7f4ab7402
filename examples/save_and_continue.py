"""Save a run, load it, and go on where it stopped, to the same bits as a run in one piece.

A trace carries a checkpoint of its end: state, contact memories, and what the method needs for its
next step. Prints the largest difference of the two. Writes `first_half.nc` and
`save_and_continue.png`.

`KinematicControl` plans a walk to the same knots however long it is, so it may be cut anywhere.
"""

import sys
from pathlib import Path

import numpy as np

import hexapod_pin as hp

CYCLE_TIME = 1.6  # s
HALF = CYCLE_TIME  # s
METHOD = {"step": 1e-3}  # s; an adaptive method may take each part at a resolution of its own


def main(folder: Path = Path()) -> float:
    """Return the largest difference in q between the run in parts and the run in one."""
    scene = hp.Scene(hp.load_robot("kharagpur"))
    control = hp.KinematicControl(hp.Gait.tetrapod(stroke=0.1, cycle_time=CYCLE_TIME))
    path = hp.simulate(scene, control, duration=HALF, **METHOD).save(folder / "first_half.nc")

    first = hp.load_trace(path)
    second = hp.simulate(scene, control, duration=HALF, initial=first.checkpoint, **METHOD)
    whole = hp.simulate(scene, control, duration=2.0 * HALF, **METHOD)

    joined = np.concatenate([first.q, second.q[1:]])
    apart = float(np.abs(joined - whole.q).max())
    print(f"{path.name}: to {first.time[-1]:g} s; then to {second.time[-1]:g} s")
    print(f"largest difference to the run in one: {apart:g} m and rad")
    draw(first, second, folder / "save_and_continue.png")
    return apart


def draw(first: hp.Trace, second: hp.Trace, path: Path) -> None:
    """Draw the torques of one leg over both parts."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    for part, style in ((first, "-"), (second, "--")):
        axes.set_prop_cycle(None)
        for k, name in enumerate(part.joint_names[:3]):
            axes.plot(part.time, part.torque[:, k], style, label=name if style == "-" else None)
    axes.set(xlabel="time [s]", ylabel="torque [N m]; dashed: after loading")
    axes.legend()
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
