"""Further runs of a case in a playback: bands of its plots, against numpy on the traces."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import opened, settled
from page_data import PageData
from refusals import refused
from synthetic import synthetic_trace

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, ViewerError
from hexapod_pin.results.trace import Trace
from hexapod_pin.view import write_html, write_side_by_side
from hexapod_pin.view.html import live_viewer

MUS = (0.7, 0.05, 0.3, 0.12)


@pytest.fixture(scope="module")
def traces() -> list[Trace]:
    """A walk of 1.6 s on four frictions, on two of which feet slide; the first is played."""
    scene, gait = hp.Scene(hp.load_robot("kharagpur")), hp.Gait.tripod(stroke=0.06, cycle_time=0.8)
    found = []
    for mu in MUS:
        friction = hp.contact.StickSlip(mu=mu, mu_dynamic=mu, stiffness=2e4, damping=60.0)
        contact = hp.Contact(normal=scene.contact.normal, friction=friction)
        one, control = replace(scene, contact=contact), hp.KinematicControl(gait)
        found.append(hp.simulate(one, control, duration=1.6, estimate=False))
    return found


@pytest.fixture(scope="module")
def path(traces: list[Trace], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Their page."""
    return write_html(traces[0], tmp_path_factory.mktemp("spread") / "walk.html", spread=traces[1:])


def band(traces: list[Trace], values: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return least and largest over the runs at each sample."""
    rows = np.stack([values(trace) for trace in traces])
    return rows.min(axis=0), rows.max(axis=0)


def test_the_page_holds_the_samples_of_every_run(path: Path, traces: list[Trace]) -> None:
    """Each within half of its own resolution, so that a band is; and what differs in words."""
    data = PageData(path.read_text(encoding="utf-8"))
    spread = data.runs[0]["spread"]
    assert len(spread["runs"]) == len(MUS) - 1
    for run, trace in zip(spread["runs"], traces[1:], strict=True):
        for name, values in (("torque", trace.torque), ("speed", trace.v[:, 6:])):
            place = run["channels"][name]
            bound = 0.501 * data.plain["table"][place]["resolution"]
            np.testing.assert_allclose(data.arrays[place], values, atol=bound, rtol=0.0)
    listed = ", ".join(f"{mu:g}" for mu in MUS)
    assert f"contact friction mu ({listed})" in spread["differ"]
    assert spread["differ"].startswith("they differ in ") and "digest" not in spread["differ"]


def test_bands_are_drawn_and_read_at_the_cursor(
    browser: Any, path: Path, traces: list[Trace]
) -> None:
    """Over the whole run, in numbers, in pixels and in the legend; a jump is that of one run."""
    page = opened(browser, path, "#t=0.5&joint=lf_femur")
    settled(page)
    opening = "playback.plots.forEach((plot) => { plot.box.open = plot.stale = true; })"
    page.evaluate(f"{opening}, playback.draw()")
    j = traces[0].joint("lf_femur_joint")
    expected = {
        "Torque": ("lf", lambda t: t.torque[:, j], 5.1e-4),
        "Static stability margin":
            ("margin", lambda t: 1e3 * hp.stability(t, whole=True).static_margin, 6e-3),
        "Power": ("lf_femur", lambda t: t.torque[:, j] * t.v[:, 6 + j], 1e-2),
    }  # fmt: skip
    found = page.evaluate(
        """() => Object.fromEntries(playback.plots.filter((plot) => plot.series).map((plot) => {
        const of = ({name, shown}) => [name, shown && [...shown.low, ...shown.high]];
        return [plot.title, Object.fromEntries(plot.values.map(of))];
        }))"""
    )
    count = len(traces[0].time)
    assert all(any(title.values()) for title in found.values())  # every plot over time has a band
    for title, (name, values, bound) in expected.items():
        total = len(found[title][name]) // 2  # samples, and states kept of peaks
        low, high = found[title][name][:count], found[title][name][total:][:count]
        least, most = band(traces, values)
        np.testing.assert_allclose(low, least, atol=bound, rtol=1e-3, err_msg=title)
        np.testing.assert_allclose(high, most, atol=bound, rtol=1e-3, err_msg=title)
    # The readout, at the sample of the widest band.
    least, most = band(traces, lambda t: t.torque[:, j])
    at = int(np.argmax(most - least))
    page.evaluate("(t) => playback.seek(t)", float(traces[0].time[at]))
    settled(page)
    keys = page.locator(".panel", has_text="Torque").locator(".keys span.on").first
    value, low, _, high = keys.inner_text().split()[1:]
    shown = [float(text.strip("()")) for text in (value, low, high)]
    assert shown == pytest.approx([traces[0].torque[at, j], least[at], most[at]], abs=1.01e-3)
    assert page.evaluate("playback.values().band") == pytest.approx([least[at], most[at]], abs=6e-4)
    assert not page.faults
    page.close()


def test_runs_that_cannot_be_compared_are_refused(traces: list[Trace], tmp_path: Path) -> None:
    """Other times, joints or feet, and samples that are not finite; nothing is written."""
    path, plain = tmp_path / "page.html", synthetic_trace(duration=1.0)
    with refused(ParameterError, "spread[1].time"):
        write_html(plain, path, spread=[plain, synthetic_trace(duration=0.5)])
    shifted = replace(plain, time=plain.time * 1.001)
    with refused(ParameterError, "spread[0].time"), live_viewer(plain, spread=[shifted]):
        pass
    other = replace(plain, joint_names=tuple(f"x_{name}" for name in plain.joint_names))
    with refused(ParameterError, "spread['a'][0].joint_names"):
        write_side_by_side({"a": plain}, path, spread={"a": [other]})
    with refused(ParameterError, "spread", "b"):
        write_side_by_side({"a": plain}, path, spread={"b": [plain]})
    q = np.array(plain.q)
    q[50] = np.nan
    with refused(ViewerError, about=("spread[0]", "finite")):
        write_html(plain, path, spread=[replace(plain, q=q)])
    assert not path.exists()


def test_each_run_side_by_side_has_a_band_of_its_own(traces: list[Trace], tmp_path: Path) -> None:
    path = write_side_by_side({"a": traces[0], "b": traces[1]}, tmp_path / "runs.html",
                              spread={"b": traces[2:]})  # fmt: skip
    first, second = PageData(path.read_text(encoding="utf-8")).runs
    assert "spread" not in first and len(second["spread"]["runs"]) == 2
