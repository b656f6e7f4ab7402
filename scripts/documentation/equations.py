"""Equations of the pages: LaTeX in blocks named `math` becomes MathML, which needs no script."""

from __future__ import annotations

from typing import Any

from latex2mathml.converter import convert


def math_fence(source: str, *_: Any, **__: Any) -> str:
    """Return an equation as MathML, for the custom fences of `pymdownx.superfences`."""
    equation = convert(source.strip(), display="block")
    return f'<div class="equations" tabindex="0">{equation}</div>'
