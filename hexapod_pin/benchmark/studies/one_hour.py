"""One hour of walking at 1 ms: nothing but the clock may change. Writes one_hour.md.

kharagpur walks a tetrapod gait (stroke 0.14 m, cycle 2.4 s, duty 2/3) in one run of 1500 cycles,
sampled once a cycle. The fifth cycle after that, run from the checkpoint, and the third and tenth
are sampled at 1 ms. The resident memory is read after every cycle.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import machine
import numpy as np

import hexapod_pin as hp

RESULTS = Path(__file__).resolve().parent / "results"
CYCLE, STEP = 2.4, 1e-3  # [s]
CYCLES = 1500
MOST_GROWTH, MOST_NORM, MOST_LATE = 5.0, 1e-12, 1e-9  # [MB], [-], [s]


@dataclass(frozen=True)
class Hour:
    """What an hour did.

    Attributes:
        method: fixed-step method.
        bad: numbers in the samples that are not finite.
        norm: largest | |quaternion| - 1 |.
        late: largest difference of a time stamp from k times the sample [s].
        growth: resident memory at the end less that after the first minute [MB].
        most: largest resident memory after the first minute less that after it [MB].
        base: resident memory after the first minute [MB].
        peaks: largest relative difference of the joints' torque peaks between a cycle after the
            hour and the third, and the tenth.
        distance: how far it walked [m].
        turned: how far the trunk turned [rad].
        wall: computing time [s].
    """

    method: str
    bad: int
    norm: float
    late: float
    growth: float
    most: float
    base: float
    peaks: tuple[float, float]
    distance: float
    turned: float
    wall: float


def main(argv: Sequence[str] | None = None) -> int:
    """Print the table and write it to --out. Return 1 where a limit is not kept."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of one_hour.md")
    parser.add_argument("--methods", default="implicit-euler,robust")
    parser.add_argument("--cycles", type=int, default=CYCLES, help="1500 are an hour")
    options = parser.parse_args(argv)
    hours = [walk(method, options.cycles) for method in options.methods.split(",")]
    text = report(hours, options.cycles)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "one_hour.md").write_text(text, encoding="utf-8")
    print(text)
    return 0 if all(map(kept, hours)) else 1


def walk(method: str, cycles: int) -> Hour:
    """Walk and look at what is left."""
    control = hp.KinematicControl(hp.Gait.tetrapod(stroke=0.14, cycle_time=CYCLE))
    scene = hp.Scene(hp.load_robot("kharagpur"))
    memory: list[float] = []
    begin = time.perf_counter()
    trace = hp.simulate(
        scene, control, duration=cycles * CYCLE, method=method, step=STEP, sample=CYCLE,
        progress=lambda _: memory.append(resident()),
    )  # fmt: skip
    wall = time.perf_counter() - begin
    settled = memory[round(60.0 / CYCLE) :]
    early = hp.simulate(
        scene, control, duration=11.0 * CYCLE, method=method, step=STEP, sample=STEP
    )
    last = hp.simulate(
        scene, control, duration=6.0 * CYCLE, method=method, step=STEP, sample=STEP,
        initial=trace.checkpoint,
    )  # fmt: skip
    late = _peaks(last, 5)
    return Hour(
        method=method,
        bad=int(np.sum(~np.isfinite(trace.q)) + np.sum(~np.isfinite(last.q))),
        norm=float(np.abs(np.linalg.norm(trace.q[:, 3:7], axis=1) - 1.0).max()),
        late=max(
            float(np.abs(trace.time - CYCLE * np.arange(cycles + 1)).max()),
            abs(float(last.time[-1]) - (cycles + 6) * CYCLE),
        ),
        growth=settled[-1] - settled[0],
        most=max(settled) - settled[0],
        base=settled[0],
        peaks=tuple(float(np.abs(late / _peaks(early, k) - 1.0).max()) for k in (3, 10)),  # type: ignore[arg-type]
        distance=float(np.linalg.norm(trace.q[-1, :2] - trace.q[0, :2])),
        turned=_yaw(trace.q[-1]) - _yaw(trace.q[0]),
        wall=wall,
    )


def _peaks(trace: hp.Trace, cycle: int) -> np.ndarray:
    """Return the largest torque of every joint in a cycle, counted from 1 [N m]."""
    n = round(CYCLE / STEP)
    peaks: np.ndarray = np.abs(trace.torque[(cycle - 1) * n + 1 : cycle * n + 1]).max(axis=0)
    return peaks


def resident() -> float:
    """Return the resident memory of this process [MB] (Linux)."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def _yaw(q: np.ndarray) -> float:
    x, y, z, w = q[3:7]
    return float(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


def kept(hour: Hour) -> bool:
    """Tell whether every limit was kept."""
    return (
        hour.bad == 0
        and hour.norm <= MOST_NORM
        and hour.late <= MOST_LATE
        and hour.most <= MOST_GROWTH
    )


def report(hours: Sequence[Hour], cycles: int) -> str:
    """Return the results as Markdown."""
    about = machine.describe()
    packages = ", ".join(f"{name} {number}" for name, number in about["packages"].items())
    lines = [
        "# An hour of walking",
        "",
        f"{about['date']}. {about['cpu']}, {about['cores']} cores, {about['system']}; "
        f"Python {about['python']}; {packages}.",
        "",
        f"`python benchmarks/one_hour.py`: kharagpur, default contact, tetrapod gait, stroke "
        f"0.14 m, cycle {CYCLE:g} s; {cycles} cycles, {cycles * CYCLE:g} s, in steps of 1 ms; one "
        "sample a cycle.",
        "",
    ]
    head = ("", *(hour.method for hour in hours), "limit")
    rows = [
        ("numbers not finite", *(f"{h.bad}" for h in hours), "0"),
        ("quaternion norm less 1", *(f"{h.norm:.1e}" for h in hours), f"{MOST_NORM:g}"),
        ("time stamps off by [s]", *(f"{h.late:.1e}" for h in hours), f"{MOST_LATE:g}"),
        ("memory at the end, over that after 60 s [MB]", *(f"{h.growth:.2f}" for h in hours), "5"),
        ("memory at most, over that after 60 s [MB]", *(f"{h.most:.2f}" for h in hours), "5"),
        ("memory after 60 s [MB]", *(f"{h.base:.0f}" for h in hours), "-"),
        ("torque peaks, a later cycle to third", *(f"{h.peaks[0]:.1e}" for h in hours), "-"),
        ("torque peaks, a later cycle to tenth", *(f"{h.peaks[1]:.1e}" for h in hours), "-"),
        ("walked [m]", *(f"{h.distance:.3f}" for h in hours), "-"),
        ("turned [rad]", *(f"{h.turned:.4f}" for h in hours), "-"),
        ("computing [s]", *(f"{h.wall:.1f}" for h in hours), "-"),
    ]
    table = [head, ["---"] * len(head), *rows]
    lines += [f"| {' | '.join(row)} |" for row in table]
    plan = cycles * CYCLE / 0.01 * 37 * 8 / 1e6
    lines += [
        "",
        f"The planned set-points of the hour (knots every 10 ms, {plan:.0f} MB, held twice) are "
        "there before the first step. A sample takes "
        "about 1.5 kB, so that samples at 1 ms would be 5 GB.",
        "",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
