"""A study of your own: the steepest slope that a walk climbs, by bisection.

Prints the slope and the largest torque on it, and writes `own_study.html`, the walk up that slope.
`python examples/own_study.py . slopes.db` keeps every finished walk and goes on after a crash;
`scheduler="tcp://..."` would run it on a Dask cluster.
"""

import math
import sys
from pathlib import Path

import hexapod_pin as hp
from hexapod_pin.study import Measure, Runner, run_study

STEEPEST = math.radians(30.0)  # rad
STEPS = 3  # of the search; each leaves a fifth of the range


def climbed(case: hp.Case, summary: hp.Summary) -> dict[str, float]:
    """Return what is kept of a walk: its speed over the planned one, and its largest torque."""
    share = (summary.measured_speed or 0.0) / summary.run.walk.speed
    return {"share": share, "torque": float(abs(summary.torque_peak).max())}


# Workers import it by its name; another version where `climbed` computes something else.
CLIMB = Measure(name="own_study:CLIMB", version=1, keep="summary", row=dict, of=climbed)


def steepest(run: Runner, robot: hp.Robot, walk: hp.KinematicControl) -> tuple[float, float]:
    """Return the steepest slope [rad] on which the walk keeps 80 % of its speed, and its torque.

    The slopes of a step depend on the rows of those before; four of them run at a time.
    """
    low, high, torque = 0.0, STEEPEST, math.nan
    for step in range(STEPS):
        angles = [low + k * (high - low) / 5 for k in range(1, 5)]
        scenes = [hp.Scene(robot, terrain=hp.Slope(angle=angle)) for angle in angles]
        cases = [hp.Case(scene, walk, duration=1.6, accuracy=1e-3) for scene in scenes]
        span = (step / STEPS, (step + 1) / STEPS)  # of the progress
        rows = run.rows(cases, CLIMB, span=span).require_complete()
        for angle, row in zip(angles, rows, strict=True):
            if isinstance(row, Exception) or row["share"] < 0.8:
                high = angle
                break
            low, torque = angle, row["torque"]
    return low, torque


def main(folder: Path = Path(), store: Path | None = None) -> tuple[float, float]:
    """Print and return the steepest slope [rad] and the largest torque on it [N m]."""
    robot = hp.load_robot("kharagpur")
    walk = hp.KinematicControl(hp.Gait.tripod(stroke=0.08, cycle_time=0.4))
    how = {"store": store, "resume": store is not None}
    angle, torque = run_study(steepest, robot, walk, **how)
    print(f"climbs {math.degrees(angle):.2f} degrees with at most {torque:.3g} N m")
    scene = hp.Scene(robot, terrain=hp.Slope(angle=angle))
    trace = hp.simulate(scene, walk, duration=1.6, accuracy=1e-3)
    hp.view.write_html(trace, folder / "own_study.html")
    return angle, torque


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:3]))
