"""What a step, a walk and a batch cost, beside MuJoCo and Pinocchio, and how accurate they are.

One process, interleaved rounds, ratios taken inside a round. Writes step_cost.md and .json.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import accuracy
import machine
from findings import Findings
from motions import Motion
from mujoco_scene import CONES
from report import json_text, markdown
from subjects import QUICK, STEP, Size, all_subjects, batch_motions, same_bits, standing_and_walking
from timing import interleaved

import hexapod_pin as hp

RESULTS = Path(__file__).resolve().parent / "results"


def main(argv: Sequence[str] | None = None) -> int:
    """Measure, print the report and write it to --out. Return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="half a minute, rough figures")
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of the two files")
    options = parser.parse_args(argv)
    found = measure(QUICK if options.quick else Size(), quick=options.quick)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "step_cost.md").write_text(markdown(found), encoding="utf-8")
    (options.out / "step_cost.json").write_text(json_text(found), encoding="utf-8")
    print(markdown(found))
    return 0


def measure(size: Size, *, quick: bool) -> Findings:
    """Time everything, then find the errors that belong to it."""
    before = machine.describe()
    motions = standing_and_walking(size.duration)
    samples = interleaved(all_subjects(motions, size), size.rounds)
    load_after = machine.load()
    return Findings(
        quick=quick,
        step=STEP,
        size=size,
        machine=before,
        load_after=load_after,
        servo=servo_in_words(motions["stand/s1"].scene.servos),
        samples=samples,
        accuracy=accuracies(motions, size),
        dense_difference=accuracy.dense_difference(motions["tetrapod/s1"], size.duration, STEP),
        same_bits=same_bits(size),
    )


def servo_in_words(servo: hp.Servo) -> str:
    """Return the gains."""
    return f"kp {servo.kp:g} N m/rad, kd {servo.kd:g} N m s/rad"


def accuracies(motions: Mapping[str, Motion], size: Size) -> dict[str, accuracy.Accuracy]:
    """Return the accuracy of every timed engine and motion, of the long walk and of a batch's."""
    found = {}
    for name, motion in motions.items():
        found[f"step/{name}"] = accuracy.ours(motion, size.duration, STEP, size.fine)
        for cone in CONES:
            found[f"{cone}/{name}"] = accuracy.mujoco(motion, cone, size.duration, STEP, size.fine)
    walk = hp.KinematicControl(hp.Gait.tetrapod())
    long = Motion.of(motions["tetrapod/s1"].scene, walk, size.walk)
    found["walk"] = accuracy.ours(long, size.walk, STEP, size.fine)
    found["batch"] = accuracy.ours(batch_motions(size)[0], size.batch, STEP, size.fine)
    return found


if __name__ == "__main__":
    sys.exit(main())
