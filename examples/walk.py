"""Walk a robot: torque table, trace file, playback.

Prints what every joint must deliver. Writes `walk.nc` (the trace) and `walk.html` (opens in any
browser, offline).
"""

import sys
from pathlib import Path

import hexapod_pin as hp

DURATION = 10.0  # s


def main(folder: Path = Path()) -> hp.Trace:
    """Return the trace of the walk."""
    robot = hp.load_robot("kharagpur")  # or "athena", or the path of a URDF
    gait = hp.Gait.tetrapod(stroke=0.14, cycle_time=2.4, lift=0.02)  # m, s, m
    scene = hp.Scene(robot, servo=hp.Servo(kp=240.0, kd=4.8))  # N m/rad, N m s/rad
    trace = hp.simulate(scene, hp.KinematicControl(gait), duration=DURATION, accuracy=1e-4)
    print(hp.torque_budget(trace).table())
    trace.save(folder / "walk.nc")
    hp.view.write_html(trace, folder / "walk.html")
    return trace


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
