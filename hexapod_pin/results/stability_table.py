"""The margins of a walk as plain text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def stability_lines(data: Mapping[str, Any], meanings: Mapping[str, str]) -> list[str]:
    """Return the lines of a table, lengths in millimetres.

    Args:
        data: as of `Stability.to_dict`.
        meanings: of its margins, in the order of the table.
    """
    window, width = data["window"], max(map(len, meanings.values()))
    cycles = "" if window["cycles"] is None else f", {window['cycles']} whole gait cycle(s)"
    lines = [
        f"Stability of {data['robot']}",
        f"window: {window['start']:.4g} to {window['end']:.4g} s{cycles}",
        "",
        f"{'[mm]':{width}}  {'least':>8}  {'at [s]':>8}  {'mean':>8}  {'largest':>8}",
    ]
    for name, meaning in meanings.items():
        row = data["margins"][name]
        sizes = "  ".join(_millimetres(row[key]) for key in ("mean", "largest"))
        least = _millimetres(row["least"])
        lines.append(f"{meaning:{width}}  {least}  {row['time']:8.3f}  {sizes}")
    lines += ["", "Centre of mass about its mean straight line [mm]"]
    for name, size in data["excursion"].items():
        peak, rms = 1e3 * size["peak_to_peak"], 1e3 * size["rms"]
        lines.append(f"{name:{width}}  {peak:8.3f} peak to peak, {rms:8.3f} RMS")
    energy = data["energy_margin"]
    least = "none" if energy is None else f"{energy:.4g} J"
    lines += ["", f"feet down, at least: {data['least_feet_down']}"]
    return [*lines, f"energy stability margin, least: {least}", data["grounded"]]


def _millimetres(length: float | None) -> str:
    return f"{'none':>8}" if length is None else f"{1e3 * length:8.2f}"
