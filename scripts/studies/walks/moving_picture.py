"""A walk as a moving picture: one cycle of the playback, drawn by Chromium without a window.

    python scripts/studies moving_picture [docs/walk.gif]

It needs Chromium on the PATH, and playwright (both are those of the tests).
"""

from __future__ import annotations

import io
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

import hexapod_pin as hp

OPTIONS = (
    "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update",
)  # fmt: skip
"""Of Chromium without a display or a graphics card, with no traffic of its own."""
SIZE = (960, 600)
"""Of the page [pixels]."""
FRAMES = 24
COLORS = 256
LARGEST = 2_000_000
"""Size of the file at most [bytes]."""


def main(argv: Sequence[str] | None = None) -> int:
    """Walk the robot of S2 until a cycle repeats, and write that cycle as a GIF that loops."""
    words = sys.argv[1:] if argv is None else argv
    target = Path(words[0] if words else "docs/walk.gif")
    gait = hp.Gait.tetrapod(stroke=0.14, cycle_time=2.4)
    scene = hp.Scene(hp.load_robot("kharagpur"))
    trace = hp.simulate(scene, hp.KinematicControl(gait), duration=12.0, until="steady")
    end = float(trace.time[-1])
    times = end - gait.cycle_time + gait.cycle_time * np.arange(FRAMES) / FRAMES
    with tempfile.TemporaryDirectory() as folder:
        page = hp.view.write_html(trace, Path(folder) / "walk.html")
        pictures = photographs(page, [float(time) for time in times])
    palette = pictures[0].quantize(COLORS)
    frames = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    milliseconds = round(1e3 * gait.cycle_time / FRAMES)
    whole = io.BytesIO()
    frames[0].save(
        whole, "GIF", save_all=True, append_images=frames[1:], duration=milliseconds, loop=0,
        optimize=True,
    )  # fmt: skip
    if len(whole.getvalue()) > LARGEST:
        raise SystemExit(f"{len(whole.getvalue())} bytes are more than {LARGEST}")
    target.write_bytes(whole.getvalue())
    print(f"{target}: {len(frames)} frames, {len(whole.getvalue())} bytes")
    return 0


def photographs(page: Path, times: Sequence[float]) -> list[Image.Image]:
    """Return a picture of a playback at each of these times [s]."""
    from playwright.sync_api import sync_playwright

    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    found = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=list(OPTIONS))
        tab = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
        tab.goto(page.as_uri(), wait_until="commit")
        tab.wait_for_function("window.playback || window.playbackError", timeout=120_000)
        tab.evaluate("playback.play(false)")
        for time in times:
            tab.evaluate("(t) => { playback.seek(t); playback.draw(); }", time)
            tab.wait_for_timeout(150)
            found.append(Image.open(io.BytesIO(tab.screenshot())).convert("RGB"))
        browser.close()
    return found


if __name__ == "__main__":
    sys.exit(main())
