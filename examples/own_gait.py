"""Walk a gait of your own table: placements as fractions of the cycle, legs lf lm lr rf rm rr.

Here one leg after the other swings, down the left side from front to rear, then down the right.
Prints the schedule, why a smaller duty is refused, and how far the robot walks. Writes
`own_gait.html`, the playback with its gait diagram.
"""

import sys
from pathlib import Path

import numpy as np

import hexapod_pin as hp

PHASES = (0 / 6, 1 / 6, 2 / 6, 3 / 6, 4 / 6, 5 / 6)
CYCLE_TIME = 2.4  # s
DURATION = 9.6  # s


def main(folder: Path = Path()) -> hp.results.TorqueBudget:
    """Return the torque budget of the walk."""
    gait = hp.Gait.custom(PHASES, 5 / 6, name="front-to-rear", stroke=0.1, cycle_time=CYCLE_TIME)
    down = gait.feet_down(np.arange(24) / 24)
    for leg, row in zip("lf lm lr rf rm rr".split(), down.T, strict=True):
        print(f"{leg}  {''.join('#' if on else '.' for on in row)}")
    print(f"fewest feet down: {gait.minimum_feet_down}, speed {gait.speed:.4f} m/s")
    try:
        hp.Gait.custom(PHASES, 0.3, name="too quick")
    except hp.errors.GaitError as error:
        print(f"refused: {error}")

    scene = hp.Scene(hp.load_robot("kharagpur"))
    trace = hp.simulate(scene, hp.KinematicControl(gait), duration=DURATION)
    budget = hp.torque_budget(trace)
    print(f"walked at {budget.measured_speed:.4f} m/s")
    hp.view.write_html(trace, folder / "own_gait.html")
    return budget


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
