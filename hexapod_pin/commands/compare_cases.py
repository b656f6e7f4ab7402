"""Case files as the runs of a comparison."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hexapod_pin.errors import ParameterError, UnknownNameError

if TYPE_CHECKING:
    from hexapod_pin.scene.scene import Scene
    from hexapod_pin.simulation.case import Case
    from hexapod_pin.study.compare import PlannedRun

DEFAULT_WAVELENGTH = 0.4  # m
DEFAULT_SEEDS = 8
MOST_SEEDS = 1000


def read_cases(paths: Sequence[Path]) -> dict[str, Case]:
    """Return cases by the names of their files, without folder and ending.

    Raises:
        ParameterError: a file cannot be read, two have one name, or a case has no duration.
    """
    from hexapod_pin.simulation.case import load_case

    found: dict[str, Case] = {}
    for path in paths:
        if path.stem in found:
            raise ParameterError("CASES", str(path), "files of different names",
                                 f"There are two of {path.stem!r}.")  # fmt: skip
        found[path.stem] = load_case(path)
        if found[path.stem].duration is None:
            raise ParameterError(f"{path}: duration", None, "given [s]")
    return found


def controlled(cases: dict[str, Case], names: str, *, own_scenes: bool) -> dict[str, Case]:
    """Return the first case under foot control by name.

    Raises:
        ParameterError: several cases, scenes of their own, or a case whose controller is no walk.
        UnknownNameError: a name that is none.
    """
    from hexapod_pin.control.foot_control import FootControl, named_controls

    first = next(iter(cases.values()))
    if len(cases) > 1 or own_scenes:
        raise ParameterError("--controllers", names, "given with one case, without --own-scenes")
    walk = first.controller.walk if isinstance(first.controller, FootControl) else first.controller
    chosen = [name.strip() for name in names.split(",")]
    return {
        name: replace(first, controller=controller)
        for name, controller in named_controls(walk, chosen).items()
    }


def study_scenes(
    cases: dict[str, Case], grounds: str | None, *, own_scenes: bool
) -> dict[str, list[Scene]]:
    """Return the first case's scene on the grounds for comparisons; empty for None.

    Raises:
        ParameterError: given with scenes of their own or bumps, or a gait that does not lift.
        UnknownNameError: a ground that is none.
    """
    from hexapod_pin.ground.terrain import study_grounds

    if grounds is None:
        return {}
    if own_scenes:
        raise ParameterError("--grounds", grounds, "given without --own-scenes and --bumps")
    first = next(iter(cases.values()))
    gait = getattr(first.controller, "gait", None)
    if gait is None or gait.lift <= 0.0:
        raise ParameterError("--grounds", grounds, "given with a gait that lifts its feet")
    distance = max(map(planned_way, cases.values()))
    known = study_grounds(gait.lift, seed=0, length=distance)
    found = {}
    for name in (part.strip() for part in grounds.split(",")):
        if name not in known:
            raise UnknownNameError("ground", name, list(known))
        terrain, contact = known[name]
        found[name] = [
            replace(first.scene, terrain=terrain, contact=contact or first.scene.contact)
        ]
    return found


def bumpy(
    cases: dict[str, Case],
    *,
    amplitude: float | None,
    wavelength: float | None,
    seeds: int | None,
    length: float | None,
    flat_radius: float | None,
    own_scenes: bool,
) -> dict[str, list[Scene]]:
    """Return the variants of the first case's scene by name: itself, or random bumps.

    Raises:
        ParameterError: an option of bumps without bumps, bumps with scenes of their own, or a
            number out of range.
    """
    from hexapod_pin.ground.terrain.ground import FARTHEST_M
    from hexapod_pin.study import random_bumps

    name, first = next(iter(cases.items()))
    if amplitude is None:
        options = {"--wavelength": wavelength, "--seeds": seeds, "--length": length}
        options |= {"--flat-radius": flat_radius}
        for option, value in options.items():
            if value is not None:
                raise ParameterError(option, value, "given with --bumps only")
        return {f"scene of {name}": [first.scene]}
    if own_scenes:
        raise ParameterError("--bumps", amplitude, "given without --own-scenes")
    if seeds is not None and not 1 <= seeds <= MOST_SEEDS:
        raise ParameterError("--seeds", seeds, f"from 1 to {MOST_SEEDS}")
    spacing = DEFAULT_WAVELENGTH if wavelength is None else wavelength
    distance = max(map(planned_way, cases.values())) if length is None else length
    if not 0.0 < distance <= FARTHEST_M:
        raise ParameterError("--length", distance, f"positive and at most {FARTHEST_M:g} m")
    numbers = range(DEFAULT_SEEDS if seeds is None else seeds)
    drawn = random_bumps(
        first.scene,
        numbers,
        amplitude=amplitude,
        wavelength=spacing,
        length=distance,
        flat_radius=flat_radius or 0.0,
    )
    return {f"bumps of {amplitude:g} m, {spacing:g} m apart": drawn}


def planned_way(case: Case) -> float:
    """Return how far a controller with a gait is to walk, at least 1 m [m]."""
    gait = getattr(case.controller, "gait", None)
    velocity = getattr(case.controller, "velocity", None)
    speed = 0.0 if gait is None else abs(float(gait.speed))
    if velocity is not None:
        speed = float(np.max(np.hypot(velocity.forward, velocity.lateral)))
    return max(1.0, speed * (case.duration or 0.0))


def shared_runs(cases: dict[str, Case], scenes: dict[str, list[Scene]]) -> list[PlannedRun]:
    """Return the runs of all controllers on the same scenes, in the first case's settings."""
    from hexapod_pin.study.compare import plan_runs

    first = next(iter(cases.values()))
    return plan_runs(
        scenes,
        {name: case.controller for name, case in cases.items()},
        initial=first.initial, duration=first.duration, accuracy=first.accuracy,
        method=first.method, step=first.step,
    )  # fmt: skip


def own_runs(cases: dict[str, Case]) -> list[PlannedRun]:
    """Return the runs of cases as they are."""
    from hexapod_pin.study.compare import PlannedRun

    return [PlannedRun("own scenes", 0, name, case) for name, case in cases.items()]
