"""The case that a trace or summary keeps, as one text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import read_toml

ORDER = ("schema", "run", "controller", "scene", "initial")


def case_toml(meta: Mapping[str, Any]) -> str:
    """Return the case of a run's `meta` as TOML text, as `Case.to_toml` wrote it.

    Raises:
        ParameterError: what was run was no case, or a release that kept none ran it.
    """
    import tomli_w

    if "run" not in meta:
        hint = "A session is led from outside; older files hold no case."
        raise ParameterError("meta", sorted(meta), "that of a case's run", hint)
    parts = read_toml(meta["run"])
    for name in ("controller", "scene"):
        parts[name] = read_toml(meta[name])
    return tomli_w.dumps({name: parts[name] for name in ORDER if name in parts})
