"""A catalogue as a table in Markdown, one line per model."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from hexapod_pin.drive.catalog.motor_record import MotorRecord

HEAD = (
    "model", "at [V]", "stall torque [N m]", "no-load speed [rad/s]", "rated torque [N m]",
    "mass [g]", "rotor at the joint [1e-3 kg m^2]", "flags",
)  # fmt: skip


def catalog_table(records: Sequence[MotorRecord]) -> str:
    """Return the table; numbers of one model's voltages are separated by slashes.

    Rotor inertias that are estimated have a tilde before them.
    """
    models: dict[str, list[MotorRecord]] = {}
    for record in records:
        models.setdefault(record.model, []).append(record)
    rows = [HEAD, ("---",) * len(HEAD), *(_row(model, found) for model, found in models.items())]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _row(model: str, found: list[MotorRecord]) -> tuple[str, ...]:
    return (
        model,
        _each(found, lambda r: f"{r.voltage:g}"),
        _each(found, lambda r: f"{r.stall_torque:.3g}"),
        _each(found, lambda r: _known(r.no_load_speed, 1.0)),
        _each(found, lambda r: _known(r.rated_torque, 1.0)),
        _each(found, lambda r: _known(r.mass, 1e3)),
        _each(found, _rotor),
        _flags(found),
    )


def _each(found: list[MotorRecord], text: Callable[[MotorRecord], str]) -> str:
    """Return the text of each record, or that of one where all say the same."""
    texts = [text(record) for record in found]
    return texts[0] if len(set(texts)) == 1 else " / ".join(texts)


def _known(value: float | None, factor: float) -> str:
    return "" if value is None else f"{factor * value:.3g}"


def _rotor(record: MotorRecord) -> str:
    if not record.joint_armature:
        return ""
    return f"{'~' if record.armature is None else ''}{1e3 * record.joint_armature:.2g}"


def _flags(found: list[MotorRecord]) -> str:
    """Return each flag in short, with its voltages where not all have it."""
    voltages: dict[str, list[str]] = {}
    for record in found:
        for flag in record.flags:
            short = flag.partition(":")[0].removesuffix(" is known")
            voltages.setdefault(short, []).append(f"{record.voltage:g}")
    return "; ".join(
        flag if len(of) == len(found) else f"{flag} at {', '.join(of)} V"
        for flag, of in voltages.items()
    )
