"""What the text of a study says of its walks: gait, drives, contact, accuracy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hexapod_pin.errors import ParameterError
from hexapod_pin.spec import read_toml


def tables(text: str) -> dict[str, Any]:
    """Return TOML as tables; nothing where it is none."""
    try:
        return read_toml(text)
    except ParameterError:
        return {}


def _table(data: Mapping[str, Any], *names: str) -> Mapping[str, Any]:
    """Return a table within tables, empty where there is none."""
    for name in names:
        found = data.get(name)
        data = found if isinstance(found, Mapping) else {}
    return data


def gait_text(gait: object) -> str:
    """Return a gait by its name and its lengths and times, as far as they are stated."""
    if not isinstance(gait, Mapping):
        return str(gait or "")
    numbers = (("stroke", "m"), ("cycle_time", "s"), ("lift", "m"))
    parts = [
        f"{name.replace('_', ' ')} {gait[name]:g} {unit}"
        for name, unit in numbers
        if isinstance(gait.get(name), int | float)
    ]
    return ", ".join(filter(None, (str(gait.get("name", "")), *parts)))


def _drive_text(servo: Mapping[str, Any]) -> str:
    """Return what drives the joints: a motor's line, or the gains of the servos."""
    motor = servo.get("motor")
    if isinstance(motor, Mapping) and "stall_torque" in motor:
        return f"stall {motor['stall_torque']:.3g} N m, no load {motor['no_load_speed']:.3g} rad/s"
    if isinstance(motor, Mapping):
        return "; ".join(f"{kind}: {_drive_text({'motor': one})}" for kind, one in motor.items())
    gains = [f"{n} {servo[n]:.4g}" for n in ("kp", "kd") if isinstance(servo.get(n), int | float)]
    return ", ".join(gains)


def scene_facts(scene: Mapping[str, Any]) -> dict[str, str]:
    """Return motor and contact of a scene's tables."""
    laws = [_table(scene, "contact", part).get("kind") for part in ("normal", "friction")]
    return {
        "motor": "prescribed motion" if scene.get("prescribed") else
        _drive_text(_table(scene, "servo")),
        "contact": " with ".join(map(str, laws)) if all(laws) else "",
    }  # fmt: skip


def base_facts(study: str, varied: Sequence[str]) -> dict[str, str]:
    """Return gait, motor, contact and accuracy of a study's base, as far as they are stated.

    Args:
        study: its file, as TOML text.
        varied: names of its inputs: what they vary has no one value.
    """
    base = _table(tables(study), "base")
    if not base:
        return {}
    case = _table(base, "case")
    facts = {
        "gait": gait_text(base.get("gait") or _table(case, "controller", "gait")),
        "motor": _drive_text(base),
        "contact": str(base.get("contact", "")),
        **{name: text for name, text in scene_facts(_table(case, "scene")).items() if text},
    }
    if "motor" in base:
        voltage = f" at {base['voltage']:g} V" if "voltage" in base else ""
        facts["motor"] = f"{base['motor']}{voltage}"
    accuracy = base.get("accuracy", case.get("accuracy"))
    facts["accuracy"] = "" if accuracy is None else f"{accuracy:g} m or rad"
    facts |= {name: "varied" for name in varied if name in facts}
    return {name: text for name, text in facts.items() if text}
