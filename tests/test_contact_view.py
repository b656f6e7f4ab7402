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
from hexapod_pin.commands.contact_report import (
    answer,
    examples,
    named_law,
    report,
    restitution_table,
)
from hexapod_pin.errors import ParameterError
from hexapod_pin.ground.contact.contact import PRESETS
from hexapod_pin.ground.contact.restitution import DAMPING_RATIO

ROOT = Path(__file__).parent.parent


@pytest.fixture
def contact(run: Run) -> Callable[..., tuple[int, str, str]]:
    """Run `hexapod-pin contact` in an empty folder; give its status, stdout and stderr."""
    return lambda *options: tuple(vars(run("contact", *options)).values())[:3]


def test_the_table_of_restitution(contact) -> None:
    """In the documents and from the command, with the closed form; the script: test_studies.py."""
    status, out, err = contact("--restitution")
    assert (status, err) == (0, "")
    assert out == restitution_table() + "\n"
    for name in DAMPING_RATIO:
        assert name in out
    assert restitution_table() in (ROOT / "docs" / "contact_laws.md").read_text(encoding="utf-8")
    row = next(line for line in restitution_table().splitlines() if "flores" in line)
    cells = [float(cell) for cell in re.findall(r"\d\.\d{4}", row)]
    assert cells == [0.0694, 0.1555, 0.2562, 0.4704, 0.6832, 0.7885, 0.8939, 0.9468]


@pytest.mark.parametrize("name", [*PRESETS, *examples()])
def test_every_preset_and_kind_reports(name: str) -> None:
    """Each prints its own parameters and no number that is not finite."""
    law = named_law(name)
    text = report(law, mass=0.5, speed=0.1)
    assert "nan" not in text
    assert "inf" not in text.replace("infin", "")
    for part in (law.normal, law.friction) if isinstance(law, hp.Contact) else (law,):
        for name, value in part.model_dump().items():
            shown = f"{value:.4g}" if isinstance(value, float) else str(value)
            assert (value if name == "kind" else f"{name} {shown}") in " ".join(text.split())


def test_the_first_line_says_in_words_what_a_contact_does(contact) -> None:
    """Rebound and hold are those that the laws are made for, with two digits at most."""
    status, out, err = contact("accurate")
    assert (status, err) == (0, "")
    first = " ".join(out.split("\n\n")[0].split())
    assert first.startswith("accurate: a foot rebounds with 0.3 of its speed; it holds 0.7 of the")
    assert "without creep (by the law integrated over an impact of 0.5 kg at 0.1 m/s" in first
    assert max(map(len, re.findall(r"\d+", first))) <= 2
    tanh = named_law("tanh-coulomb", ("mu=0.5", "slope=100"))
    said = answer("tanh-coulomb", tanh, mass=0.5, speed=0.1)
    creep = 1e3 * math.atanh(0.5) / 100.0
    assert f"it holds 0.5 of the load on it sideways, creeping {creep:.2g} mm/s" in said


def test_parameters_reach_the_law() -> None:
    law = named_law("kelvin-voigt", ["stiffness=1e4", "damping=7", "exponent=1.5"])
    assert law == hp.contact.KelvinVoigt(stiffness=1e4, damping=7.0, exponent=1.5)
    law = named_law("stick-slip", ["mu=0.4"])  # the dynamic coefficient follows
    assert (law.mu, law.mu_dynamic) == (0.4, 0.4)
    law = named_law("smooth-step", ["mu_static=0.4", "mu_dynamic=0.1"])
    assert (law.mu_static, law.mu_dynamic) == (0.4, 0.1)
    law = named_law("restitution", ["restitution=0.2", "model=flores"])
    text = report(law, mass=0.5, speed=0.1)
    assert "requested 0.2" in text
    assert text.count("0.1555") == 7  # this impact, the closed form, and five speeds
    with refused(ParameterError, "accurate", "mu=1"):
        named_law("accurate", ["mu=1"])


@pytest.mark.parametrize(
    ("name", "ending"), [("accurate", "png"), ("adams-impact", "svg"), ("stick-slip", "pdf")]
)
def test_figure_is_written(contact, tmp_path: Path, name: str, ending: str) -> None:
    pytest.importorskip("matplotlib")
    status, out, err = contact(name, "--out", f"law.{ending}")
    assert (status, err) == (0, "")
    assert f"wrote {tmp_path / 'law'}.{ending}" in out
    start = (tmp_path / f"law.{ending}").read_bytes()[:200]
    assert {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}[ending] in start


def test_figure_shows_what_the_law_has() -> None:
    """Two panels for a normal law, one for a friction law, three for a pair; axes with units."""
    pytest.importorskip("matplotlib")
    from hexapod_pin.view.contact_figure import draw

    for name, panels in [("hunt-crossley", 2), ("restitution", 2), ("tanh-coulomb", 1), ("s2", 3)]:
        axes = draw(named_law(name), mass=0.5, speed=0.1).axes
        assert len(axes) == panels
        for panel in axes:
            assert panel.get_xlabel()
            assert panel.get_ylabel()
            assert panel.lines
    figure = draw(named_law("restitution"), mass=0.5, speed=0.1)
    assert len(figure.axes[1].lines) == len(DAMPING_RATIO) + 1  # all laws and the point requested


def test_without_matplotlib_the_numbers_are_still_printed(contact, tmp_path, monkeypatch):
    """The default figure is left out with one message; one requested by name is refused at once."""
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    status, out, err = contact("s1")
    assert (status, list(tmp_path.iterdir())) == (0, [])
    assert "restitution    " in out
    assert "hexapod-pin[plot]" in err
    status, out, err = contact("s1", "--out", "law.png")
    assert (status, out, list(tmp_path.iterdir())) == (2, "", [])
    assert "hexapod-pin[plot]" in err


REFUSALS = {
    "nothing requested": ((), "LAW"), "unknown law": (("glue",), "glue"),
    "unknown parameter": (("tanh-coulomb", "kt=3"), "kt"),
    "no number": (("kelvin-voigt", "stiffness=stiff"), "stiffness"),
    "no number for mu": (("stick-slip", "mu=much"), "mu"),
    "no value": (("kelvin-voigt", "stiffness"), "name=value"),
    "negative": (("kelvin-voigt", "stiffness=-1"), "stiffness"),
    "dead": (("restitution", "restitution=0"), "stops a mass dead"),
    "unknown model": (("restitution", "model=zhang"), "model"),
    "preset with parameters": (("s1", "mu=0.3"), "s1"),
    "unknown ending": (("s1", "--out", "law.txt"), "law.txt"),
    "missing folder": (("s1", "--out", "gone/law.png"), "--out"),
    "no mass": (("s1", "--mass", "0"), "mass"), "no speed": (("s1", "--speed", "nan"), "speed"),
}  # fmt: skip


@pytest.mark.parametrize(("options", "culprit"), REFUSALS.values(), ids=REFUSALS.keys())
def test_refusal_is_one_message_with_status_2(contact, tmp_path, options, culprit):
    status, out, err = contact(*options)
    assert (status, out) == (2, "")
    assert culprit in err
    assert "Traceback" not in err
    assert not list(tmp_path.iterdir())


def test_every_law_is_in_the_command_and_in_the_documents() -> None:
    """A new law must be added to `examples` and to docs/contact_laws.md."""
    laws = {type(law) for law in (*NORMAL.values(), *FRICTION.values())} | {hp.contact.StickSlip}
    assert {type(law) for law in examples().values()} == laws
    text = (ROOT / "docs" / "contact_laws.md").read_text(encoding="utf-8")
    for law in laws:
        assert f"`{law.__name__}`" in text
    for name in (*PRESETS, *DAMPING_RATIO):
        assert name in text
