"""Sweep servo stiffness and friction in one batch, over threads.

Prints speed and peak torque of every case. Writes `sweep.csv` and `sweep.png`. The bits of a
case do not depend on the number of threads.
"""

import csv
import itertools
import sys
from pathlib import Path

import hexapod_pin as hp

STIFFNESSES = (60.0, 120.0, 240.0)  # N m/rad
FRICTIONS = (0.1, 0.7)  # -
DURATION = 7.2  # s
THREADS = 2


def main(folder: Path = Path()) -> list[tuple[float, float, float, float]]:
    """Return stiffness, friction, speed [m/s] and peak torque [N m] of every case."""
    robot = hp.load_robot("kharagpur")
    control = hp.KinematicControl(hp.Gait.tripod(stroke=0.08, cycle_time=1.2))
    numbers = list(itertools.product(STIFFNESSES, FRICTIONS))
    cases = []
    for kp, mu in numbers:
        servo = hp.Servo(kp=kp, kd=0.02 * kp)
        scene = hp.Scene(robot, servo=servo, contact=hp.Contact.accurate().with_mu(mu))
        cases.append(hp.Case(scene, control))
    results = hp.simulate_batch(
        cases, duration=DURATION, accuracy=1e-4, threads=THREADS, keep="summary"
    )

    rows = []
    for (kp, mu), result in zip(numbers, results, strict=True):
        if isinstance(result, Exception):  # a case that fails leaves the others alone
            print(f"kp {kp:g} N m/rad, mu {mu:g}: {result}")
            continue
        budget = hp.torque_budget(result)
        peak = max(joint.torque_peak for joint in budget.joints)
        rows.append((kp, mu, float(budget.measured_speed or 0.0), peak))
    head = ("kp [N m/rad]", "mu [-]", "speed [m/s]", "peak torque [N m]")
    with open(folder / "sweep.csv", "w", newline="") as file:
        csv.writer(file).writerows([head, *rows])
    print("  ".join(head))
    for kp, mu, speed, peak in rows:
        print(f"{kp:12g} {mu:7g} {speed:12.4f} {peak:18.3f}")
    draw(rows, folder / "sweep.png")
    return rows


def draw(rows: list[tuple[float, float, float, float]], path: Path) -> None:
    """Draw the peak torque over the stiffness, a curve for each friction."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    for mu in FRICTIONS:
        found = [(kp, peak) for kp, other, _, peak in rows if other == mu]
        axes.plot(*zip(*found, strict=True), "o-", label=f"mu {mu:g}")
    axes.set(xlabel="servo stiffness [N m/rad]", ylabel="peak torque [N m]")
    axes.legend()
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    main(Path(*sys.argv[1:2]))
