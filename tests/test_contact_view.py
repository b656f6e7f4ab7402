"""`hexapod-pin contact`: what it prints and draws, how it refuses; the table in the documents."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from conftest import Run
from contact_formulas import FRICTION, NORMAL
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.commands.contact_report import answer, examples, named_law, report
from hexapod_pin.commands.contact_report import restitution_table as restitutions
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.contact.contact import PRESETS
from hexapod_pin.ground.contact.restitution import DAMPING_RATIO

ROOT = Path(__file__).parent.parent


@pytest.fixture
def contact(run: Run) -> Callable[..., tuple[int, str, str]]:
    return lambda *options: tuple(vars(run("contact", *options)).values())[:3]


def test_the_table_of_restitution(contact) -> None:
    """In the documents and from the command, with the closed form; the script: test_studies.py."""
    status, out, err = contact("--restitution")
    assert (status, err) == (0, "")
    assert out == restitutions() + "\n"
    assert all(name in out for name in DAMPING_RATIO)
    assert restitutions() in (ROOT / "docs" / "contact_laws.md").read_text(encoding="utf-8")
    row = next(line for line in restitutions().splitlines() if "flores" in line)
    cells = [float(cell) for cell in re.findall(r"\d\.\d{4}", row)]
    assert cells == [0.0694, 0.1555, 0.2562, 0.4704, 0.6832, 0.7885, 0.8939, 0.9468]


def test_every_preset_and_kind_reports() -> None:
    for name in (*PRESETS, *examples()):
        law = named_law(name)
        text = report(law, mass=0.5, speed=0.1)
        assert not re.search(r"nan|inf(?!in)", text)
        for part in (law.normal, law.friction) if isinstance(law, hp.Contact) else (law,):
            for field, value in part.model_dump().items():
                shown = f"{value:.4g}" if isinstance(value, float) else str(value)
                wanted = value if field == "kind" else f"{field} {shown}"
                assert wanted in " ".join(text.split()), name


def test_parameters_reach_the_law() -> None:
    law = named_law("kelvin-voigt", ["stiffness=1e4", "damping=7", "exponent=1.5"])
    assert law == hp.contact.KelvinVoigt(stiffness=1e4, damping=7.0, exponent=1.5)
    law = named_law("stick-slip", ["mu=0.4"])  # the dynamic coefficient follows
    assert (law.mu, law.mu_dynamic) == (0.4, 0.4)
    law = named_law("restitution", ["restitution=0.2", "model=flores"])
    text = report(law, mass=0.5, speed=0.1)
    assert "requested 0.2" in text
    assert text.count("0.1555") == 7  # this impact, the closed form, and five speeds
    said = answer("tanh", named_law("tanh-coulomb", ["mu=0.5", "slope=100"]), mass=0.5, speed=0.1)
    creep = 1e3 * math.atanh(0.5) / 100.0
    assert f"it holds 0.5 of the load on it sideways, creeping {creep:.2g} mm/s" in said
    with refused(ParameterError, "accurate", "mu=1"):
        named_law("accurate", ["mu=1"])


def test_figure_shows_what_the_law_has(contact, tmp_path: Path) -> None:
    figure = pytest.importorskip("hexapod_pin.view.contact_figure")
    for name, panels in [("restitution", 2), ("tanh-coulomb", 1), ("s2", 3)]:
        axes = figure.draw(named_law(name), mass=0.5, speed=0.1).axes
        assert len(axes) == panels
        assert all(one.get_xlabel() and one.get_ylabel() and one.lines for one in axes)
    status, out, err = contact("adams-impact", "--out", "law.svg")
    assert (status, err) == (0, "") and f"wrote {tmp_path / 'law'}.svg" in out
    assert b"<?xml" in (tmp_path / "law.svg").read_bytes()[:200]


def test_without_matplotlib_the_numbers_are_still_printed(contact, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    status, out, err = contact("s1")
    assert status == 0 and "restitution    " in out and "hexapod-pin[plot]" in err
    status, out, err = contact("s1", "--out", "law.png")
    assert (status, out, list(tmp_path.iterdir())) == (2, "", []) and "hexapod-pin[plot]" in err


def test_refusal_is_one_message_with_status_2(contact, tmp_path):
    for options, culprit in (
        ((), "LAW"), (("glue",), "glue"), (("tanh-coulomb", "kt=3"), "kt"),
        (("kelvin-voigt", "stiffness=stiff"), "stiffness"), (("stick-slip", "mu=much"), "mu"),
        (("kelvin-voigt", "stiffness"), "name=value"),
        (("restitution", "restitution=0"), "stops a mass dead"), (("s1", "--mass", "0"), "mass"),
    ):  # fmt: skip
        status, out, err = contact(*options)
        assert (status, out) == (2, "") and culprit in err and not list(tmp_path.iterdir())


def test_every_law_is_in_the_command_and_in_the_documents() -> None:
    laws = {type(law) for law in (*NORMAL.values(), *FRICTION.values())} | {hp.contact.StickSlip}
    assert {type(law) for law in examples().values()} == laws
    text = (ROOT / "docs" / "contact_laws.md").read_text(encoding="utf-8")
    for name in (*(f"`{law.__name__}`" for law in laws), *PRESETS, *DAMPING_RATIO):
        assert name in text, name
