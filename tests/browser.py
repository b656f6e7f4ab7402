"""A browser without a window, for tests that look at pages; they are skipped where none is."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

QUIET = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--no-pdf-header-footer",
)  # fmt: skip


def browse(page: Path, *options: str) -> bytes:
    """Open a page with options of Chromium and return what it prints."""
    browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
    if browser is None:
        pytest.skip("no browser is installed")
    profile = f"--user-data-dir={page.parent / 'profile'}"
    done = subprocess.run(
        [browser, *QUIET, profile, *options, page.as_uri()],
        check=True, capture_output=True, timeout=120,
    )  # fmt: skip
    return done.stdout


# Driven by Playwright: one browser for a module's tests, pages that stand still.

OPTIONS = (
    "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update",
)  # fmt: skip
"""Of Chromium without a display or a graphics card, with no traffic of its own."""


def started() -> Iterator[Any]:
    """Give one browser, driven, and close it; skip where Chromium or Playwright is missing."""
    driver = pytest.importorskip("playwright.sync_api")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        pytest.skip("no chromium is installed")
    with driver.sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=chromium, args=list(OPTIONS))
        yield opened
        opened.close()


def opened(
    browser: Any, path: Path, link: str = "", size: tuple[int, int] | None = (1024, 360)
) -> Any:
    """Return a page that shows a file, still, with the addresses that it asked for."""
    viewport = {"viewport": {"width": size[0], "height": size[1]}} if size else {}
    page = browser.new_page(**viewport)
    page.asked, page.faults = [], []
    page.on("request", lambda request: page.asked.append(request.url))
    page.on("pageerror", lambda error: page.faults.append(str(error)))
    page.set_default_timeout(120_000)  # of a busy machine
    page.goto(f"file://{path}{link}", wait_until="commit")
    page.wait_for_function("window.playback || window.playbackError")
    page.evaluate("window.playback.play(false)")
    return page


def settled(page: Any) -> Any:
    """Return the state once everything but the rasteriser's part is drawn."""
    page.evaluate("playback.draw()")
    return page.evaluate("playback.state")
