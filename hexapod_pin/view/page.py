"""One offline HTML page that plays commands of meshcat: the viewer, the scene and its motion."""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import ViewerError
from hexapod_pin.foreign_text import encoded
from hexapod_pin.view.meshcat_commands import Command

_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; "
    "img-src data: blob:; connect-src data: blob:; worker-src blob:; font-src data:"
)

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<title>{title}</title>
<!-- The viewer below is MeshCat:
{license}
-->
<style>
body {{ margin: 0; font: 14px/1.4 sans-serif; }}
#view {{ width: 100vw; height: 100vh; overflow: hidden; }}
#caption {{ position: absolute; left: 12px; top: 8px; max-width: 60vw; color: #223; }}
</style>
</head>
<body>
<div id="view"></div>
<div id="caption">{caption}</div>
<script id="embedded-json"></script>
<script>
{viewer}
</script>
<script id="trace" type="application/json">{data}</script>
<script>
const data = JSON.parse(document.getElementById("trace").textContent);
{unpack}const viewer = new MeshCat.Viewer(document.getElementById("view"));
for (const clip of data.animation.animations)
  for (const track of clip.clip.tracks) track.times = data.times;
for (const command of [...data.scene, data.animation]) viewer.handle_command(command);
</script>
</body>
</html>
"""


_UNPACK = """const KINDS = {Float32Array, Uint16Array, Uint32Array};
function unpack(part) {
  const bytes = Uint8Array.from(atob(data.arrays[part.array]), (c) => c.charCodeAt(0));
  part.array = new KINDS[part.type](bytes.buffer);
}
for (const command of data.scene)
  for (const geometry of command.object?.geometries ?? [])
    if (Number.isInteger(geometry.data?.index?.array))
      [geometry.data.attributes.position, geometry.data.index].forEach(unpack);
"""  # arrays of meshes are bytes, least significant first, as in every browser


_TITLE_BYTES = 5000  # room for a title, the animation's options and the licence's marks


def write_page(
    path: str | Path, *, title: str, caption: str, scene: Sequence[Command], animation: Command
) -> Path:
    """Write a page, wholly or not at all, and return its path.

    Args:
        path: the file; an old one is replaced, or left alone where anything fails.
        title: plain text.
        caption: HTML, its texts escaped.
        scene: the still picture.
        animation: its motion; all tracks have the same times, which the page holds once.

    Raises:
        ViewerError: meshcat's files are missing.
        TraceFileError: the file cannot be written.
    """
    times = [clip["clip"]["tracks"][0]["times"] for clip in animation["animations"]][0]
    for clip in animation["animations"]:
        for track in clip["clip"]["tracks"]:
            del track["times"]
    data = {"scene": list(scene), "times": times, "animation": animation}
    text, arrays = _script_text(data)
    page = _PAGE.format(
        policy=_POLICY,
        title=html.escape(title),
        caption=caption,
        license=viewer_file("LICENSE").replace("--", "- -"),
        viewer=viewer_file("dist/main.min.js"),
        data=text,
        unpack=_UNPACK if arrays else "",
    )
    return write_atomically(path, encoded(page))


def still_bytes(scene: Sequence[Command], caption: str) -> int:
    """Return the size of a page without its motion [bytes].

    Raises:
        ViewerError: meshcat's files are missing.
    """
    viewer = sum(len(viewer_file(name).encode()) for name in ("LICENSE", "dist/main.min.js"))
    frame = len((_PAGE + _POLICY + _UNPACK + caption).encode()) + _TITLE_BYTES
    return viewer + frame + len(_script_text({"scene": list(scene)})[0].encode())


def folded_list(title: str, texts: Sequence[str]) -> str:
    """Return, as HTML, texts that unfold under a title; nothing of no texts."""
    items = "".join(f"<li>{html.escape(text)}</li>" for text in texts)
    return f"<details><summary>{title}</summary><ul>{items}</ul></details>" if items else ""


def _script_text(data: Mapping[str, Any]) -> tuple[str, bool]:
    """Return JSON that cannot end the script element it stands in, and whether it has arrays.

    An array is replaced by its number in a list "arrays" of texts in base64, each stored once.
    """
    numbers: dict[bytes, int] = {}

    def number(value: Any) -> int:
        if not isinstance(value, np.ndarray):
            raise TypeError(f"{type(value).__name__} in a page")
        plain = value.astype(value.dtype.newbyteorder("<"), copy=False).tobytes()
        return numbers.setdefault(plain, len(numbers))

    text = json.dumps(data, separators=(",", ":"), allow_nan=False, default=number)
    if numbers:
        arrays = [base64.b64encode(plain).decode("ascii") for plain in numbers]
        text = f'{text[:-1]},"arrays":{json.dumps(arrays, separators=(",", ":"))}}}'
    return text.replace("<", "\\u003c"), bool(numbers)


def viewer_file(name: str) -> str:
    """Return the text of a file of meshcat's viewer, without importing meshcat.

    Raises:
        ViewerError: meshcat is not installed, or is of another make.
    """
    spec = find_spec("meshcat")
    folders: Sequence[str] = (spec.submodule_search_locations or []) if spec else []
    for folder in folders:
        file = Path(folder) / "viewer" / name
        if file.is_file():
            return file.read_text(encoding="utf-8")
    raise ViewerError(f"meshcat's viewer/{name} is not installed: `pip install meshcat`.")
