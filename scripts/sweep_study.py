"""S2's sweeps and the energy of gaits against speed, into one netCDF file and figures from it.

Torque against stroke and cycle time on S2's arcs, costs of five gaits at ten speeds; about 15 s of
two cores.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import hexapod_pin as hp
from hexapod_pin.commands.progress import progress_bar
from hexapod_pin.results.gait_energy import COSTS
from hexapod_pin.sweep.gait_energy import SPEEDS
from hexapod_pin.sweep.torque_map import CYCLE_TIMES, STROKES
from hexapod_pin.view import write_gait_energy_figure, write_torque_curves, write_torque_heat_map


def main(argv: Sequence[str] | None = None) -> int:
    """Run, save, draw; print which gait is cheapest where, and the time it took."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("."), help="folder of file and figures")
    parser.add_argument("--contact", default="s2", help="preset of the contact")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--every", type=int, default=1, help="only every N-th value of each axis")
    options = parser.parse_args(argv)
    scene = hp.Scene(hp.load_robot("kharagpur"), contact=hp.Contact.preset(options.contact))
    begin, every = time.perf_counter(), options.every
    with progress_bar("torque map") as progress:
        torques = hp.torque_map(
            scene, "arc", strokes=STROKES[::-every][::-1], cycle_times=CYCLE_TIMES[::-every][::-1],
            threads=options.threads, progress=progress,
        )  # fmt: skip
    with progress_bar("gait energy") as progress:
        energy = hp.gait_energy(
            {"servo": scene}, speeds=SPEEDS[::every], threads=options.threads, progress=progress
        )
    took = time.perf_counter() - begin
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / "sweep_study.nc"
    hp.write_study(path, {"torque_map_arc": torques, "gait_energy": energy})
    draw(path, options.out)
    print(f"{path}: {torques.speed.size} + {energy.cost_of_transport.size} points in {took:.1f} s")
    report(energy)
    return 0


def draw(path: Path, folder: Path) -> None:
    """Draw the figures from the file alone."""
    study = hp.load_study(path)
    torques, energy = study["torque_map_arc"], study["gait_energy"]
    write_torque_curves(torques, folder / "torque_peak.png", cycle_times=[0.71, 1.2, 2.4, 4.8])
    write_torque_curves(
        torques, folder / "torque_rms.png", quantity="phase_rms", cycle_times=[0.71, 1.2, 2.4, 4.8]
    )
    write_torque_heat_map(torques, folder / "torque_map.png")
    write_gait_energy_figure(energy, folder / "gait_energy.png")


def report(energy: hp.GaitEnergy) -> None:
    """Print the costs, and whether low duty is cheaper at the highest common speed."""
    for scene in energy.scenes:
        for cost in COSTS:
            print(energy.table(cost, scene))
            found = energy.duty_test(cost, scene)
            if found is not None:
                word = "cheaper" if found.low_is_cheaper else "not cheaper"
                print(f"at {found.speed:.3g} m/s low duty is {word}\n")
        speed = energy.of("measured_speed", scene) / energy.speed - 1.0
        print(f"{scene}: measured speed within {np.nanmax(np.abs(speed)):.2%} of the commanded one")


if __name__ == "__main__":
    sys.exit(main())
