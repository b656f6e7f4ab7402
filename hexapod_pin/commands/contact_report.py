"""The job of `hexapod-pin contact`: laws by name, and their numbers as text."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Union

from hexapod_pin.errors import MissingPackageError, ParameterError, UnknownNameError
from hexapod_pin.ground.contact import (
    BrownMcPhee,
    Contact,
    FrictionLaw,
    KelvinVoigt,
    NormalLaw,
    Restitution,
    SmoothStep,
)
from hexapod_pin.ground.contact.contact import preset_names
from hexapod_pin.ground.contact.restitution import DAMPING_RATIO, bounce, delivered_restitution
from hexapod_pin.text_table import Cell, Table, folded, indented, labelled

Law = Union[NormalLaw, FrictionLaw, Contact]  # noqa: UP007 (evaluated on Python 3.10)

REQUESTED_RESTITUTIONS = (0.1, 0.2, 0.3, 0.5, 0.7, 0.8, 0.9, 0.95)
APPROACH_SPEEDS_M_S = (0.01, 0.03, 0.1, 0.3, 1.0)
"""Approach speeds of the printed table [m/s]."""

FRICTION_LIMIT_SHARES = (0.1, 0.3, 0.5, 0.7, 0.9, 0.99)
"""Shares of the friction limit of the printed creep table."""

NO_FIGURE = "no figure: matplotlib is not installed; pip install 'hexapod-pin[plot]' brings it"


def examples() -> dict[str, NormalLaw | FrictionLaw]:
    """Return one law of each kind; its numbers stand where a command gives none (*assumed*)."""
    accurate, s1, s2 = Contact.accurate(), Contact.s1(), Contact.s2()
    laws: list[NormalLaw | FrictionLaw] = [
        s1.normal,
        accurate.normal,
        KelvinVoigt(stiffness=2.75e4, damping=80.0),
        s2.normal,
        s1.friction,
        s2.friction,
        SmoothStep(mu_static=0.7, mu_dynamic=0.5, speed=1e-3),
        BrownMcPhee(mu_static=0.7, mu_dynamic=0.5, speed=1e-2),
        accurate.friction,
    ]
    return {str(law.model_dump()["kind"]): law for law in laws}


def named_law(name: str, settings: Sequence[str] = ()) -> Law:
    """Return a preset, or a law of a kind with the given parameters.

    Args:
        name: a preset or a kind, such as "s1" or "kelvin-voigt".
        settings: "parameter=value", SI; the rest is taken from `examples`.

    Raises:
        UnknownNameError: there is no such preset or kind.
        ParameterError: a parameter is unknown or out of range, or a preset is given any.
    """
    known = examples()
    presets = [] if name in known else preset_names(name)
    if name not in known and name not in presets:
        raise UnknownNameError("contact law or preset", name, [*presets, *known])
    given = dict(map(_split, settings))
    if name in presets:
        if given:
            raise ParameterError(name, " ".join(settings), "named alone: a preset has its numbers")
        return Contact.preset(name)
    law = known[name]
    names = type(law).model_fields  # a model of restitution is a name, all others are numbers
    values = {key: x if key == "model" or key not in names else _number(key, x)
              for key, x in given.items()}  # fmt: skip
    static = values.get("mu", values.get("mu_static"))
    if isinstance(law, FrictionLaw) and isinstance(static, float):
        law = law.with_mu(static)
    return type(law)(**{**law.model_dump(), **values})


def _split(word: str) -> tuple[str, str]:
    name, equals, value = word.partition("=")
    if not (name and equals and value):
        raise ParameterError("parameter", word, "of the form name=value")
    return name, value


def _number(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ParameterError(name, text, "a float") from None


def restitution_table() -> str:
    """Return requested against delivered restitution of every law, as a Markdown table."""
    head = ("law", *(f"e = {e:g}" for e in REQUESTED_RESTITUTIONS))
    rows = [
        (name, *(f"{delivered_restitution(eta(e)):.4f}" for e in REQUESTED_RESTITUTIONS))
        for name, eta in DAMPING_RATIO.items()
    ]
    return Table("", head, rows, "<>").markdown().rstrip("\n")


def answer(name: str, law: Law, *, mass: float, speed: float) -> str:
    """Return in a sentence how a contact bounces and holds, and from what that is computed.

    Args:
        name: that the user gave.
        law: a normal law, a friction law, or a pair.
        mass: of the free impact [kg].
        speed: of the free impact [m/s].

    Raises:
        ParameterError: mass or speed is not positive.
    """
    parts = (law.normal, law.friction) if isinstance(law, Contact) else (law,)
    says, bases = [], []
    for part in parts:
        if isinstance(part, NormalLaw):
            hit = bounce(part, mass=mass, speed=speed)
            says.append(f"a foot rebounds with {hit.restitution:.2g} of its speed")
            bases.append(f"the law integrated over an impact of {mass:g} kg at {speed:g} m/s")
        else:
            creep = 1e3 * part.creep_speed(0.5 * part.limit)
            slow = f"creeping {creep:.2g} mm/s at half of that" if creep else "without creep"
            says.append(f"it holds {part.limit:.2g} of the load on it sideways, {slow}")
            bases.append("the speed at which friction balances a load")
    said = "; ".join(says)
    lines = folded(f"{name}: {said}")
    return "\n".join([*lines, *folded(f"(by {' and by '.join(bases)})")])


def _parameters(law: NormalLaw | FrictionLaw) -> str:
    """Return the kind of a law and its parameters, SI, with few digits."""
    values = {key: value for key, value in law.model_dump().items() if key != "kind"}
    texts = (f"{key} {x:.4g}" if isinstance(x, float) else f"{key} {x}"
             for key, x in values.items())  # fmt: skip
    return "\n".join(folded(f"{law.model_dump()['kind']}: {', '.join(texts)}"))


def report(law: Law, *, mass: float, speed: float) -> str:
    """Return the numbers of a law: a bounce for a normal law, creep for a friction law.

    Args:
        law: a normal law, a friction law, or a pair.
        mass: of the free impact [kg].
        speed: of the free impact [m/s].

    Raises:
        ParameterError: mass or speed is not positive.
    """
    if isinstance(law, Contact):
        parts = [report(part, mass=mass, speed=speed) for part in (law.normal, law.friction)]
        note = folded(f"assumed: {law.assumed}") if law.assumed else []
        return "\n\n".join([*parts, *(["\n".join(note)] if note else [])])
    if isinstance(law, NormalLaw):
        return _normal_report(law, mass, speed)
    return _friction_report(law)


def _normal_report(law: NormalLaw, mass: float, speed: float) -> str:
    hit = bounce(law, mass=mass, speed=speed)
    numbers = (
        ("restitution", f"{hit.restitution:.4f}", ""),
        ("largest depth", hit.depth.max() * 1e3, "mm"),
        ("largest force", hit.force.max(), "N"),
        ("contact time", hit.time[-1] * 1e3, "ms"),
    )
    title = f"a free impact of {mass:g} kg at {speed:g} m/s:"
    lines = [_parameters(law), title, *indented(labelled(numbers))]
    if isinstance(law, Restitution):
        lines += folded(
            f"requested {law.restitution:g}; eta {law.eta:.4g} delivers {law.delivered:.4f} "
            f"at any mass and any speed above {law.speed_floor:g} m/s"
        )
    found = [bounce(law, mass=mass, speed=v).restitution for v in APPROACH_SPEEDS_M_S]
    rows = (
        ("speed [m/s]", *APPROACH_SPEEDS_M_S), ("restitution", *(f"{e:.4f}" for e in found))
    )  # fmt: skip
    return "\n".join([*lines, *_across(rows)])


def _friction_report(law: FrictionLaw) -> str:
    loads = [share * law.limit for share in FRICTION_LIMIT_SHARES]
    rows: list[tuple[Cell, ...]] = [
        ("share of limit", *FRICTION_LIMIT_SHARES),
        ("load / normal", *loads),
        ("creep [mm/s]", *(law.creep_speed(load) * 1e3 for load in loads)),
    ]
    title = f"holds up to {law.limit:.4g} N per N of normal force; creep under a load:"
    return "\n".join([_parameters(law), title, *_across(rows)])


def _across(rows: Sequence[Sequence[Cell]]) -> list[str]:
    return indented(Table("", (), rows, "<>", least=7).lines())


def figure(law: Law, path: Path, *, mass: float, speed: float) -> bool:
    """Draw a law into a file; False, and no file, where matplotlib is not installed.

    Raises:
        ParameterError: the file's ending names no format, or mass or speed is not positive.
        TraceFileError: the file cannot be written.
    """
    from hexapod_pin.view.contact_figure import write_figure

    try:
        write_figure(law, path, mass=mass, speed=speed)
    except MissingPackageError:
        return False
    return True
