"""One hour of walking at 1 ms: nothing but the clock may change.

kharagpur walks a tetrapod gait (stroke 0.14 m, cycle 2.4 s, duty 2/3) in one run of 1500 cycles,
sampled once a cycle. The fifth cycle after that, run from the checkpoint, and the third and tenth
are sampled at 1 ms. The resident memory is read after every cycle.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import hexapod_pin as hp
from hexapod_pin.arrays import Array
from hexapod_pin.text_table import Table
from studies.study import StudyReport, verdict

CYCLE, STEP = 2.4, 1e-3  # [s]
CYCLES = 1500
MAX_MEMORY_GROWTH, MAX_NORM_ERROR, MAX_TIME_ERROR = 5.0, 1e-12, 1e-9  # [MB], [-], [s]


@dataclass(frozen=True)
class Hour:
    """What an hour did.

    Attributes:
        method: fixed-step method.
        bad: numbers in the samples that are not finite.
        norm: largest | |quaternion| - 1 |.
        late: largest difference of a time stamp from k times the sample [s].
        kept: memory of the samples after the first minute [MB].
        growth: resident memory at the end less that after the first minute and `kept` [MB].
        most: largest resident memory after the first minute, less the same [MB].
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
    kept: float
    growth: float
    most: float
    base: float
    peaks: tuple[float, float]
    distance: float
    turned: float
    wall: float


def one_hour(*, methods: str = "implicit-euler,robust", cycles: int = CYCLES) -> StudyReport:
    """Walking at 1 ms for long; 1500 cycles are an hour, 36000 a day."""
    hours = [walk(method, cycles) for method in methods.split(",")]
    about = (
        "kharagpur, default contact, tetrapod gait, stroke 0.14 m, cycle "
        f"{CYCLE:g} s; {cycles} cycles, {cycles * CYCLE:g} s, in steps of 1 ms; one sample a cycle."
    )
    rows = [
        (name, *(form.format(number(hour)) for hour in hours), limit, _result(number, limit, hours))
        for name, number, form, limit in ROWS
    ]
    head = ("", *(hour.method for hour in hours), "limit", "result")
    title = f"{cycles * CYCLE / 3600.0:g} h of walking"
    return StudyReport(title, [about, Table("", head, rows)])


def _result(number: Callable[[Hour], float], limit: str, hours: Sequence[Hour]) -> str:
    """Return what became of a limit; "-" where there is none."""
    if limit == "-":
        return limit
    return verdict(all(number(hour) <= float(limit) for hour in hours))


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
    minute = min(round(60.0 / CYCLE), cycles - 1)
    settled = memory[minute:]
    arrays = (array for array in vars(trace).values() if isinstance(array, np.ndarray))
    kept = sum(array.nbytes for array in arrays) / 1e6 * (1.0 - minute / cycles)
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
        kept=kept,
        growth=settled[-1] - settled[0] - kept,
        most=max(settled) - settled[0] - kept,
        base=settled[0],
        peaks=tuple(float(np.abs(late / _peaks(early, k) - 1.0).max()) for k in (3, 10)),  # type: ignore[arg-type]
        distance=float(np.linalg.norm(trace.q[-1, :2] - trace.q[0, :2])),
        turned=_yaw(trace.q[-1]) - _yaw(trace.q[0]),
        wall=wall,
    )


def _peaks(trace: hp.Trace, cycle: int) -> Array:
    """Return the largest torque of every joint in a cycle, counted from 1 [N m]."""
    n = round(CYCLE / STEP)
    peaks: Array = np.abs(trace.torque[(cycle - 1) * n + 1 : cycle * n + 1]).max(axis=0)
    return peaks


def resident() -> float:
    """Return the resident memory of this process [MB] (Linux)."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def _yaw(q: Array) -> float:
    x, y, z, w = q[3:7]
    return float(np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


ROWS: tuple[tuple[str, Callable[[Hour], float], str, str], ...] = (
    ("numbers not finite", lambda h: h.bad, "{}", "0"),
    ("quaternion norm less 1", lambda h: h.norm, "{:.1e}", f"{MAX_NORM_ERROR:g}"),
    ("time stamps off by [s]", lambda h: h.late, "{:.1e}", f"{MAX_TIME_ERROR:g}"),
    ("memory of the samples [MB]", lambda h: h.kept, "{:.2f}", "-"),
    (
        "memory at the end, over that after 60 s and of samples [MB]",
        lambda h: h.growth,
        "{:.2f}",
        "5",
    ),
    ("memory at most, over the same [MB]", lambda h: h.most, "{:.2f}", "5"),
    ("memory after 60 s [MB]", lambda h: h.base, "{:.0f}", "-"),
    ("torque peaks, a later cycle to third", lambda h: h.peaks[0], "{:.1e}", "-"),
    ("torque peaks, a later cycle to tenth", lambda h: h.peaks[1], "{:.1e}", "-"),
    ("walked [m]", lambda h: h.distance, "{:.3f}", "-"),
    ("turned [rad]", lambda h: h.turned, "{:.4f}", "-"),
    ("computing [s]", lambda h: h.wall, "{:.1f}", "-"),
)
"""Name, number, format and limit of every row."""
