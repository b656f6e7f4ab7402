"""S2's study: its simulation, both sweeps and the energy of gaits, into one netCDF file.

About five minutes of two slow cores. The figures and the page are drawn from the file alone:
s2_motion, s2_mass_center, s2_torques, s2_sweeps, s2_energy, s2_page.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

import hexapod_pin as hp
from hexapod_pin.commands.progress import progress_bar
from studies.s2.runs import PartsInterrupted, study_parts


def main(argv: Sequence[str] | None = None) -> int:
    """Run and save; of a study that is interrupted, what there is."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("s2_study.nc"), help="file to write")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--every", type=int, default=1, help="only every N-th value of each axis")
    options = parser.parse_args(argv)
    begin, status = time.perf_counter(), 0
    try:
        parts = study_parts(progress_bar, threads=options.threads, every=options.every)
    except PartsInterrupted as stop:
        parts, status = stop.parts, 130
    if parts:
        hp.study.write_study(options.out, parts)
    took = time.perf_counter() - begin
    print(f"{options.out}: {', '.join(parts) or 'nothing'} in {took:.1f} s")
    return status
