"""A study file as checked data: what it is called, its base, what varies, and its design."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import read_toml
from hexapod_pin.sweep.study.design import Design
from hexapod_pin.sweep.study.fields import read_spec, refuse_unknown, table_at
from hexapod_pin.sweep.study.read_inputs import HINT, read_inputs
from hexapod_pin.sweep.study.study_input import StudyInput

SCHEMA = 1
KEYS = ("schema", "name", "base", "vary", "design")


@dataclass(frozen=True)
class StudyFile:
    """The tables of a study file, checked one by one.

    Attributes:
        name: of the study.
        base: the table of what does not vary, as it stands.
        inputs: what varies.
        design: of the uncertain inputs; None without any.
    """

    name: str
    base: Mapping[str, Any]
    inputs: tuple[StudyInput, ...]
    design: Design | None


def read_study_file(text: str) -> StudyFile:
    """Return the tables of a study file.

    Raises:
        ParameterError: bad syntax, an unknown or missing key, a value out of range, an input
            varied twice, each by its path in the file.
    """
    data = read_toml(text)
    refuse_unknown(data, "", KEYS)
    for key in ("schema", "base", "vary"):
        if key not in data:
            raise ParameterError(key, None, "given: it has no default", _EXAMPLE[key])
    if data["schema"] != SCHEMA or isinstance(data["schema"], bool):
        raise ParameterError("schema", data["schema"], f"{SCHEMA}, which this release reads")
    name = data.get("name", "study")
    if not isinstance(name, str) or not name.strip():
        raise ParameterError("name", name, "text that is not empty")
    inputs = read_inputs(data["vary"])
    design = _read_design(data, inputs)
    return StudyFile(name, table_at(data["base"], "base"), inputs, design)


_EXAMPLE = {
    "schema": f"Write schema = {SCHEMA} at the top.",
    "base": 'Write [base] with robot = "..." or case = "case.toml".',
    "vary": HINT,
}


def _read_design(data: Mapping[str, Any], inputs: tuple[StudyInput, ...]) -> Design | None:
    """Return the design, which stands there where an input has a distribution, and only there."""
    uncertain = [item for item in inputs if item.distribution is not None]
    if "design" not in data:
        if uncertain:
            raise ParameterError(
                "design", None, f"given: {uncertain[0].where} has a distribution",
                'Write [design] with kind = "sobol" and samples = 256.',
            )  # fmt: skip
        return None
    table = table_at(data["design"], "design")
    if not uncertain:
        allowed = "left out: no input has a distribution"
        raise ParameterError("design", dict(table), allowed, "A grid needs no design.")
    return read_spec(Design, table, "design")
