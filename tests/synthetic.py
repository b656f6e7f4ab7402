"""Traces from analytic signals: results whose every number is known without a simulator."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hexapod_pin.results.run_record import Numerics, RobotFacts, RunRecord, WalkFacts
from hexapod_pin.results.samples import ENERGIES
from hexapod_pin.results.trace import Trace

LEGS = ("lf", "lm", "lr", "rf", "rm", "rr")
JOINTS = tuple(f"{leg}_{part}_joint" for leg in LEGS for part in ("coxa", "femur", "tibia"))
FEET = tuple(f"{leg}_foot" for leg in LEGS)
WEIGHT = 30.0  # N

URDF = Path(__file__).parent.parent / "urdf" / "kharagpur.urdf"


def synthetic_trace(
    *,
    duration: float = 4.0,
    sample: float = 0.01,
    speed: float = 0.1,
    torque: np.ndarray | None = None,
    rate: np.ndarray | None = None,
    **entries: Any,
) -> Trace:
    """Return a trace that glides along +x on six still legs, each foot carrying a sixth.

    Args:
        duration: [s].
        sample: [s].
        speed: of the centre of mass along x [m/s].
        torque: (T, 18) [N m]; zero when left out.
        rate: (T, 18) [rad/s]; zero when left out.
        entries: of the record, that replace the usual ones.
    """
    known = {
        "name": "synthetic",
        "cycle_time": 1.0,
        "steady_from": 1.0,
        "steady_until": duration,
        "nominal_speed": speed,
        "foot_radius": (0.01,) * len(FEET),
        "total_mass": WEIGHT / 9.81,
        "effort_limit": (5.0,) * len(JOINTS),
        "assumed": ("everything",),
        "provenance": "analytic signals",
        "method": "none",
        "step": sample,
        "urdf": URDF.read_text(),
        **entries,
    }
    time = np.arange(round(duration / sample) + 1) * sample
    count, joints, feet = len(time), len(JOINTS), len(FEET)
    q = np.zeros((count, 7 + joints))
    q[:, 0], q[:, 2], q[:, 6] = speed * time, 0.1, 1.0
    q[:, 7:] = 0.1 * np.sin(2.0 * np.pi * time)[:, None]
    v = np.zeros((count, 6 + joints))
    v[:, 0] = speed
    if rate is not None:
        v[:, 6:] = rate
    force = np.zeros((count, feet, 3))
    force[..., 2] = WEIGHT / feet
    around = np.pi / 3.0 * np.arange(feet)
    position = np.zeros((count, feet, 3))
    position[..., 0] = q[:, :1] + 0.3 * np.cos(around)
    position[..., 1] = 0.3 * np.sin(around)
    position[..., 2] = 0.01
    return Trace(
        time=time,
        q=q,
        v=v,
        torque=np.zeros((count, joints)) if torque is None else torque,
        q_ref=q[:, 7:],
        v_ref=v[:, 6:],
        foot_position=position,
        foot_force=force,
        foot_gap=np.zeros((count, feet)),
        com=q[:, :3],
        energy={name: np.zeros(count) for name in ENERGIES},
        counters={"steps": count - 1},
        joint_names=JOINTS,
        foot_names=FEET,
        run=run_of(known),
    )


def run_of(known: Mapping[str, Any]) -> RunRecord:
    """Return a record with these entries, each in the part that has a field of its name."""
    parts: dict[str, dict[str, Any]] = {"robot": {}, "numerics": {}, "walk": {}}
    kinds = {"robot": RobotFacts, "numerics": Numerics, "walk": WalkFacts}
    rest = {}
    for name, value in known.items():
        part = next((key for key, kind in kinds.items() if name in kind.model_fields), None)
        (rest if part is None else parts[part])[name] = value
    return RunRecord(**{key: kinds[key](**parts[key]) for key in kinds}, **rest)


def with_run(trace: Any, **changes: Any) -> Any:
    """Return a trace or summary with changed entries of its record: as of `run_of`, or a part."""
    run, rest = trace.run, {}
    for name, value in changes.items():
        for part in ("robot", "numerics", "walk"):
            if name in type(getattr(run, part)).model_fields:
                own = {**dict(getattr(run, part)), name: value}
                run = run.model_copy(update={part: type(getattr(run, part))(**own)})
                break
        else:
            rest[name] = value
    return replace(trace, run=run.model_copy(update=rest))
