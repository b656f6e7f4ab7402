"""Meshes sent to a live viewer: meshcat's bytes, the viewer's codes."""

from __future__ import annotations

import re
from typing import Any

import meshcat.geometry
import numpy as np
import pytest
import umsgpack

from hexapod_pin.view.html import viewer_file
from hexapod_pin.view.live import TYPED_ARRAY, packed
from hexapod_pin.view.mesh_store import triangle_geometry

VERTICES = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 1.5]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def test_a_mesh_is_what_meshcat_itself_sends() -> None:
    """Positions equal to the byte; indices too, but for 2 bytes each where meshcat takes 4.

    meshcat sends 3 as the index's item size, which three.js does not read: it takes 1.
    """
    theirs = meshcat.geometry.TriangularMeshGeometry(VERTICES, FACES).lower({})
    ours = umsgpack.unpackb(packed(triangle_geometry(VERTICES, FACES)))
    assert ours["type"] == theirs["type"]
    assert ours["data"]["attributes"] == theirs["data"]["attributes"]
    index, expected = ours["data"]["index"], theirs["data"]["index"]
    assert set(index) == set(expected)
    assert (index["type"], expected["type"]) == ("Uint16Array", "Uint32Array")
    values = np.frombuffer(index["array"].data, dtype="<u2")
    np.testing.assert_array_equal(values, np.frombuffer(expected["array"].data, dtype="<u4"))
    vertices = np.zeros((70_000, 3))
    theirs = meshcat.geometry.TriangularMeshGeometry(vertices, FACES).lower({})["data"]["index"]
    ours = umsgpack.unpackb(packed(triangle_geometry(vertices, FACES)))["data"]["index"]
    assert {**ours, "itemSize": 3} == theirs


@pytest.mark.parametrize("kind", sorted(TYPED_ARRAY))
def test_codes_are_those_the_viewer_unpacks(kind: str) -> None:
    """The viewer's script names each code's array: `addExtUnpacker(23,[u,h(Float32Array)])`."""
    script = viewer_file("dist/main.min.js")
    array = f"{kind.capitalize()}Array"
    found = re.findall(rf"addExtUnpacker\((\d+),\[?\w*,?\w+\({array}\)", script)
    assert found == [str(TYPED_ARRAY[kind])]


def test_three_js_reads_one_number_an_index() -> None:
    """Whatever the item size: `data.index` goes to a buffer of item size 1."""
    script = viewer_file("dist/main.min.js")
    loader: Any = re.search(r"=(\w+)\.data\.index;if\(void 0!==\w+\)\{.{1,99}?\}", script)
    assert re.search(r"setIndex\(new \w+\(\w+,1\)\)", loader[0])
