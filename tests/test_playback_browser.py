"""The playback in a browser: what it shows, and what keys, clicks, drags and links do.

Where neither Chromium nor Playwright is installed, only the size is tested.
"""

from __future__ import annotations

import html
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from browser import opened, settled
from page_data import PageData

import hexapod_pin as hp
from hexapod_pin.drive.catalog import load_catalog
from hexapod_pin.drive.catalog.motor_record import Derating
from hexapod_pin.results.trace import Trace
from hexapod_pin.view.html import page_text


@pytest.fixture(scope="module")
def trace() -> Trace:
    """Ten seconds of the robot of S2 from rest, pushed and losing a leg's drives at the end."""
    robot = hp.load_robot("kharagpur")
    loads = (
        hp.Payload("base_link", 0.3, (0.0, 0.0, 0.06)),
        hp.Push("base_link", force=(0.0, 6.0, 0.0), start=8.0, duration=0.2),
        hp.LostLeg("rf", 9.5),
    )
    gait = hp.Gait.tetrapod(stroke=0.14, cycle_time=2.4)
    return hp.simulate(hp.Scene(robot, loads=loads), hp.KinematicControl(gait), duration=10.0)


@pytest.fixture(scope="module")
def text(trace: Trace) -> str:
    motor = load_catalog().get("AX-12A")
    return page_text({"": trace}, motor=motor, command="hexapod-pin walk kharagpur")


def test_ten_seconds_take_at_most_700_kilobytes(text: str, trace: Trace) -> None:
    assert len(text.encode()) <= 700_000
    data = PageData(text)
    assert len(data.channel("time")) == len(trace.time) == 5001
    assert data.resolution("torque") <= max(0.1 * trace.error.torque[-1], 1e-5)


@pytest.fixture(scope="module")
def page(browser: Any, text: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    path = tmp_path_factory.mktemp("page") / "walk.html"
    path.write_text(text)
    found = opened(browser, path, "#t=5.554&joint=rr_femur")
    yield found
    assert not found.faults
    assert [url for url in found.asked if not url.startswith(("file:", "data:", "blob:"))] == []
    found.close()


def test_values_shown_are_those_of_the_trace(page: Any, trace: Trace) -> None:
    state = settled(page)
    assert state["time"] == pytest.approx(5.554) and not state["playing"]
    motor, share, j = load_catalog().get("AX-12A"), Derating(), trace.joint("rr_femur_joint")
    for k in (2777, 0, 4999, 1):
        page.evaluate("(t) => playback.seek(t)", float(trace.time[k]))
        shown = page.evaluate("playback.values()")
        assert shown["sample"] == k and shown["joint"] == "rr_femur_joint"
        assert shown["torque"] == pytest.approx(trace.torque[k, j], abs=5.1e-4)
        assert shown["angle"] == pytest.approx(trace.q[k, 7 + j], abs=5.1e-5)
        assert shown["speed"] == pytest.approx(trace.v[k, 6 + j], abs=1.01e-3)
        assert shown["press"] == pytest.approx(trace.normal_force[k], abs=0.02)
        assert shown["down"] == trace.contact[k].tolist()
        line = share.voltage - np.sign(shown["torque"]) * shown["speed"] / motor.no_load_speed
        assert shown["limit"] == pytest.approx(share.peak * motor.stall_torque * line, abs=1e-9)
    margins = hp.stability(trace, whole=True).static_margin
    assert shown["margin"] == pytest.approx(margins[1], abs=5.1e-6)
    loads = "playback.overlays[0].loads.find(({load}) => load.kind === 'payload')"
    assert page.evaluate(f"{loads}.object.material.depthTest") is False  # seen through the trunk


def test_every_number_of_the_table_stands_at_its_instant(page: Any, trace: Trace) -> None:
    """A click goes to the state kept of a torque's peak, else to the nearest sample."""
    summary, kept, rows = trace.summary, trace.peaks, page.evaluate("playback.worst")
    found = page.evaluate(
        """() => [...document.querySelectorAll("#worst button")].map((button) => {
        button.click();
        playback.draw();
        return {state: {...playback.state}, values: playback.values(), card: card.innerText};
        })"""
    )
    assert len(rows) == len(found) >= 13
    beside = 0
    for k, (row, shown) in enumerate(zip(rows, found, strict=True)):
        state, values, card = shown["state"], shown["values"], shown["card"]
        assert state["time"] == row["time"] and state["peak"] == k
        assert row["what"] in card and f"{row['time']:.4f} s" in card
        if row["key"].endswith("torque") and "during" not in row:
            j = row["joint"]
            assert state["joint"] == j
            assert row["value"] == pytest.approx(abs(summary.torque_peak[j]))
            assert row["time"] == values["sampleTime"] == summary.torque_peak_time[j]
            expected = {"torque": kept.torque[j, j], "speed": kept.v[j, 6 + j],
                        "angle": kept.q[j, 7 + j], "place": kept.q[j, :3]}  # fmt: skip
            for name, value in expected.items():  # ten digits are written
                assert values[name] == pytest.approx(value, rel=1e-9, abs=1e-12), name
            assert "sample at" not in card
        else:  # of samples, or of an accepted step at most 1 ms from a sample
            assert abs(values["sampleTime"] - row["time"]) <= 1.01e-3
            between = abs(values["sampleTime"] - row["time"]) > 1e-6
            assert between == ("sample at" in card)
            beside += between
            # half of the resolutions; between samples what 1 ms may change of forces and speeds
            least = 0.1 * abs(row["value"]) if between else 5e-5 + 2e-3 * abs(row["value"])
            size = abs if row["unit"] in ("rad/s", "rad", "N m") else float
            assert size(values["row"]["shown"]) == pytest.approx(size(row["value"]), abs=least)
    assert beside  # else the test shows nothing


def test_what_a_push_and_a_lost_leg_did_stands_at_its_instant(page: Any, trace: Trace) -> None:
    """The push of 8.0 to 8.2 s counts for a cycle more at least, thus to the end."""
    assert page.evaluate("playback.bar.flags") == [[8.0, "push 6 N"], [9.5, "rf lost"]]
    page.evaluate("playback.seek(9.6), playback.draw()")
    assert "rf lost" in page.locator("#labels span").all_text_contents()
    rows = {row["key"]: row for row in page.evaluate("playback.worst")}
    margin = hp.stability(trace, whole=True).static_margin
    for name, start in (("push", 8.0), ("rf lost", 9.5)):
        inside = np.flatnonzero(trace.time >= start - 1e-9)
        sizes = np.abs(trace.torque[inside])
        at, joint = np.unravel_index(int(np.argmax(sizes)), sizes.shape)
        low, least = (inside[np.argmin(v[inside])] for v in (trace.q[:, 2], margin))
        expected = {"torque": (sizes.max(), inside[at]), "margin": (margin[least], least),
                    "height": (trace.q[low, 2], low)}  # fmt: skip
        for key, (value, sample) in expected.items():
            row = rows[f"{name} {key}"]
            assert row["during"] == pytest.approx([start, trace.time[-1]])
            assert row["value"] == pytest.approx(value, rel=1e-12)
            assert row["time"] == trace.time[sample]
        assert rows[f"{name} torque"]["joint"] == joint


def test_the_robot_stands_where_the_trace_has_it(page: Any, trace: Trace) -> None:
    """At a sample within the rounding of angles over 0.3 m, at a peak to single precision."""
    page.evaluate("playback.seek(4.0)")
    settled(page)
    np.testing.assert_allclose(page.evaluate(FEET), trace.foot_position[2000], atol=1e-4)
    rows = page.evaluate("playback.worst")
    k = next(k for k, row in enumerate(rows) if row["key"] == "femur torque")
    q = trace.peaks.q[rows[k]["joint"]]
    model = pin.buildModelFromXML(trace.run.robot.urdf, pin.JointModelFreeFlyer())
    order, state = [trace.joint_names.index(n) for n in model.names[2:]], model.createData()
    pin.framesForwardKinematics(model, state, np.concatenate([q[:7], q[7:][order]]))
    expected = [state.oMf[model.getFrameId(n)].translation for n in trace.foot_names]
    page.evaluate("(k) => { playback.jump(k); playback.draw(); }", k)
    np.testing.assert_allclose(page.evaluate(FEET), expected, atol=1e-6)


FEET = """() => playback.runs[0].data.feet.map((foot) => {
    const actor = playback.actors[0], tip = actor.bodies[foot.body].parts.at(-1).mesh;
    return actor.lane.worldToLocal(tip.getWorldPosition(new MeshCat.THREE.Vector3())).toArray();
    })"""


def test_keys_move_through_time(page: Any) -> None:
    page.evaluate("playback.seek(3.0)")
    press = page.locator("body").press
    for key, time in (("ArrowRight", 3.002), ("Shift+ArrowLeft", 2.902), ("End", 10), ("Home", 0)):
        press(key)
        assert settled(page)["time"] == pytest.approx(time)
    press("+")
    assert page.evaluate("playback.state.rate") == 2
    press("Space")
    page.wait_for_function("playback.state.time > 0.05")
    press("Space")
    assert not settled(page)["playing"]


def test_a_click_on_a_link_or_a_leg_selects_its_joint(page: Any, trace: Trace) -> None:
    """The link's centre on the screen is where the picture has it."""
    page.evaluate("playback.camera('above'); playback.seek(0.0)")
    settled(page)
    page.evaluate("playback.viewer.camera.updateMatrixWorld()")
    j = trace.joint("lm_tibia_joint")
    x, y = page.evaluate(
        """(j) => {
        const body = playback.actors[0].bodies.find((b) => b.joint === j);
        const place = body.parts[0].mesh.getWorldPosition(new MeshCat.THREE.Vector3());
        const {x, y} = place.project(playback.viewer.camera);
        const box = document.getElementById("view").getBoundingClientRect();
        return [box.left + (0.5 + 0.5 * x) * box.width, box.top + (0.5 - 0.5 * y) * box.height];
        }""", j,
    )  # fmt: skip
    page.mouse.click(x, y)
    assert trace.joint_names[settled(page)["joint"]].startswith("lm_")
    page.locator(".panel", has_text="Torque").locator(".keys span", has_text="rf ").first.click()
    assert trace.joint_names[settled(page)["joint"]].startswith("rf_")
    page.wait_for_function("location.hash.includes('joint=rf_')")
    page.evaluate("playback.camera('follow')")


def test_a_drag_zooms_all_plots_and_a_double_click_shows_all(page: Any) -> None:
    settled(page)
    canvas = page.locator(".panel canvas").first
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    page.mouse.move(box["x"] + 150, box["y"] + 40)
    page.mouse.down()
    page.mouse.move(box["x"] + 250, box["y"] + 40, steps=4)
    page.mouse.up()
    state = settled(page)
    wide = box["width"] - 48  # left of the axis, right of the curves
    assert state["from"] == pytest.approx(10.0 * 106 / wide, abs=0.05)
    assert state["to"] == pytest.approx(10.0 * 206 / wide, abs=0.05)
    canvas.dblclick()
    state = settled(page)
    assert (state["from"], state["to"]) == (0.0, 10.0)
    bar = page.locator("#bar").bounding_box()
    page.mouse.click(bar["x"] + 0.5 * bar["width"], bar["y"] + 0.5 * bar["height"])
    assert settled(page)["time"] == pytest.approx(5.0, abs=0.2)


def test_two_fingers_zoom_all_plots(browser: Any, text: str, tmp_path: Path) -> None:
    """The times under the fingers stay there; a tap seeks."""
    path = tmp_path / "walk.html"
    path.write_text(text)
    context = browser.new_context(
        viewport={"width": 390, "height": 640}, has_touch=True, is_mobile=True
    )
    page = opened(context, path, "#t=1", size=None)
    settled(page)
    canvas = page.locator(".panel canvas").first
    canvas.evaluate("(one) => scrollBy(0, one.getBoundingClientRect().top - 480)")
    box, touch = canvas.bounding_box(), context.new_cdp_session(page).send
    left, y, wide = box["x"] + 44, box["y"] + 30, box["width"] - 48

    def fingers(kind: str, *shares: float) -> None:
        """Put, move or lift fingers at shares of the axis."""
        places = [{"x": left + share * wide, "y": y, "id": k} for k, share in enumerate(shares)]
        touch("Input.dispatchTouchEvent", {"type": f"touch{kind}", "touchPoints": places})

    fingers("Start", 0.4)
    fingers("Start", 0.4, 0.6)
    for step in (0.05, 0.1, 0.15, 0.2):
        fingers("Move", 0.4 - step, 0.6 + step)
    fingers("End")
    state = settled(page)  # 4 s and 6 s stand at 0.2 and 0.8 of the axis
    assert (state["from"], state["to"]) == pytest.approx((10 / 3, 20 / 3), abs=0.05)
    assert state["time"] == 1.0
    for step in (0.1, 0.2):  # back again
        fingers("Start" if step == 0.1 else "Move", 0.1 + step, 0.9 - step)
    fingers("End")
    state = settled(page)
    assert state["to"] - state["from"] > 5.0
    page.evaluate("playback.zoom(0, 10)")
    fingers("Start", 0.5)
    fingers("End")
    assert settled(page)["time"] == pytest.approx(5.0, abs=0.05)
    assert not page.faults
    context.close()


def test_a_telephone_and_a_notebook_show_it(browser, text, trace, tmp_path) -> None:
    """In a frame without an address, 370 pixels wide, two runs; nothing is cut off sideways."""
    scene = hp.Scene(hp.load_robot("kharagpur"))
    short = hp.simulate(scene, hp.HoldPosture(), duration=0.2, estimate=False)
    pair = page_text({"walk": trace, "stand": short})
    path = tmp_path / "frame.html"
    path.write_text(
        f'<iframe style="width:370px;height:400px" srcdoc="{html.escape(pair)}"></iframe>'
    )
    frame = browser.new_page(viewport={"width": 390, "height": 480})
    frame.goto(f"file://{path}")
    inner = frame.frames[-1]
    inner.wait_for_function("window.playback || window.playbackError", timeout=60_000)
    inner.evaluate("playback.jump(0)")
    assert inner.evaluate("playback.runs.length") == 2
    changes = (
        "[...document.querySelectorAll('#worst tr')].slice(1).map((r) => r.lastChild.innerText)"
    )
    worst, others = (inner.evaluate(f"playback.runs[{k}].data.worst") for k in (0, 1))
    values, found = {one["key"]: one["value"] for one in others}, 0
    for row, change in zip(worst, inner.evaluate(changes), strict=False):
        if (other := values.get(row["key"])) and row["value"]:
            # of sizes: the sign of a tilt or a power is a direction
            share = f"{100 * (abs(other / row['value']) - 1):+.1f}".replace("-", "\u2212")
            assert change == f"{share} %", row["key"]
            found += other / row["value"] < 0.0
    assert found  # else the test shows nothing
    assert inner.evaluate("document.documentElement.scrollWidth <= innerWidth")
    frame.close()
