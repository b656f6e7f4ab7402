"""Several runs in one page: each whole, by name, with one robot's meshes once."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from page_data import Loads, PageData
from refusals import refused
from synthetic import URDF, synthetic_trace

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, TraceFileError, ViewerError
from hexapod_pin.results.run_record import RunCase
from hexapod_pin.results.trace import Trace
from hexapod_pin.view import write_html, write_side_by_side


@pytest.fixture(scope="module")
def traces() -> dict[str, Trace]:
    """Three glides along x: one slower, one that ends early."""
    return {
        "plain": synthetic_trace(duration=1.0, speed=0.4),
        "slow": synthetic_trace(duration=1.0, speed=0.1),
        "short": synthetic_trace(duration=0.5, speed=0.4),
    }


def test_every_run_is_whole_in_the_page(traces: Any, tmp_path: Path) -> None:
    """With its own samples, to its own end, and its own worst instants."""
    data = PageData(write_side_by_side(traces, tmp_path / "runs.html").read_text())
    assert [run["name"] for run in data.runs] == list(traces)
    for k, trace in enumerate(traces.values()):
        np.testing.assert_allclose(data.channel("place", k), trace.q[:, :3], atol=5.1e-6)
        np.testing.assert_allclose(data.channel("time", k)[:, 0], trace.time, atol=5.1e-7)
        keys = [row["key"] for row in data.runs[k]["worst"]]
        assert keys == [row["key"] for row in data.runs[0]["worst"]]


def test_the_page_is_as_closed_as_that_of_one_run(traces: Any, tmp_path: Path) -> None:
    odd = "</script><img src=x>"
    path = write_side_by_side({odd: traces["plain"], "b": traces["short"]}, tmp_path / "r.html")
    page = path.read_text(encoding="utf-8")
    one = write_html(traces["plain"], tmp_path / "one.html").read_text(encoding="utf-8")
    assert Loads(page).policy == Loads(one).policy and "<img" not in page
    assert len(list(tmp_path.iterdir())) == 2  # nothing else left


def test_refusals(traces: Any, tmp_path: Path) -> None:
    path = tmp_path / "runs.html"
    with refused(ParameterError, "traces"):
        write_side_by_side({}, path)
    with refused(ParameterError, "force_scale", -1.0, allowed=(1e-9, 1e3)):
        write_side_by_side(traces, path, force_scale=-1.0)
    q = np.array(traces["slow"].q)
    q[50] = np.nan
    with refused(ViewerError, about=("run 'slow': q", "finite", "50", "0.5")):
        write_side_by_side({**traces, "slow": replace(traces["slow"], q=q)}, path)
    with pytest.raises(TraceFileError):
        write_side_by_side(traces, tmp_path / "none" / "runs.html")
    assert not path.exists()


def test_runs_share_the_meshes_of_their_robot(tmp_path: Path) -> None:
    """The box of each run is drawn, and its arrays are in the file once."""
    trimesh.creation.box((0.1, 0.2, 0.3)).export(tmp_path / "box.stl")
    shape = '<visual><geometry><mesh filename="box.stl"/></geometry></visual>'
    text = re.sub(r'(<link name="[^"]*">)', rf"\1{shape}", URDF.read_text(), count=1)
    settings = hp.Scene(hp.load_robot("kharagpur")).settings
    case = RunCase(settings, controller_data={}, robot={"source": (tmp_path / "r.urdf").as_posix()})
    runs = {name: synthetic_trace(duration=0.1, urdf=text, case=case) for name in ("a", "b")}
    data = PageData(write_side_by_side(runs, tmp_path / "runs.html").read_text())
    first, second = (
        [shape for body in run["tree"] for shape in body["shapes"] if shape["type"] == "mesh"]
        for run in data.runs
    )
    assert first == second and len(first) == 1
    places = data.arrays[first[0]["arrays"][0]]
    np.testing.assert_allclose(np.ptp(places, axis=0), (0.1, 0.2, 0.3), atol=2e-5)
