"""The true motion of a scene: two methods far tighter than what is judged, and their distance.

DOP853 shares no Jacobian and no linear solver with NDF. Where it would take too long, for it is
explicit and contact is stiff, NDF's run is the truth and extrapolated Euler its check; they share
the Jacobian, which costs accuracy and not truth where it is wrong.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from random_scenes import PromiseScene

from hexapod_pin.errors import HexapodError, SimulationInterrupted
from hexapod_pin.validation.position_error import PositionError
from hexapod_pin.validation.solver_setting import SolverSetting

if TYPE_CHECKING:
    from hexapod_pin.arrays import Array

PAIRS = (
    (SolverSetting("dop853", 1e-10), SolverSetting("ndf", 1e-10)),
    (SolverSetting("dop853", 1e-12), SolverSetting("ndf", 1e-12)),
    (SolverSetting("ndf", 1e-12), SolverSetting("extrapolated-euler", 1e-8)),
    (SolverSetting("ndf", 1e-10), SolverSetting("extrapolated-euler", 1e-8)),
)
"""Truth and check, the next where the last disagree or one does not end. Those without DOP853 are
asked only where it gave nothing."""

LONG_RUN_PAIRS = PAIRS[2:]
"""Where DOP853 would take too long anyway."""

CLOSED_FORM_UNCERTAINTY = 1e-14
"""Of answers in closed form [m, rad]: round-off of metres."""

MAX_SECONDS = 15.0
"""CPU time after which, or once it is foreseen, a run of DOP853 is given up [s]."""

FORECAST_AFTER = 1.0
"""CPU time after which it is foreseen [s]."""


@dataclass(frozen=True)
class Truth:
    """The true positions of a scene, as far as they are known.

    Attributes:
        q: (T, 7 + n) positions at the samples [m, -, rad]; None where no two methods ended.
        method, check: the runs compared.
        uncertainty: how far apart they are [m, rad]; inf without two.
        seconds: wall time of all attempts.
        notes: what did not end or agree, in words.
    """

    q: Array | None
    method: str
    check: str
    uncertainty: float
    seconds: float
    notes: tuple[str, ...] = ()

    def judges(self, accuracy: float) -> bool:
        """Tell whether errors can be held against an accuracy: uncertain by a tenth at most."""
        return self.uncertainty <= 0.1 * accuracy


class _TooSlowError(Exception):
    """A run takes too long."""


TOO_SLOW = "more than"

Pairs = Sequence[tuple[SolverSetting, SolverSetting]]


def find_truth(
    scene: PromiseScene, tightest: float, *, max_seconds: float = MAX_SECONDS, pairs: Pairs = PAIRS
) -> Truth:
    """Return the truth of a scene, tightened until it can judge the tightest accuracy.

    Args:
        scene: the scene.
        tightest: accuracy that it must judge [m, rad].
        max_seconds: CPU time of one run of DOP853 [s].
        pairs: truths with their checks, asked one after the other.
    """
    if scene.answer is not None:
        return Truth(scene.answer, "closed form", "-", CLOSED_FORM_UNCERTAINTY, 0.0)
    begin = time.perf_counter()
    best = Truth(None, "-", "-", float("inf"), 0.0)
    notes: list[str] = []
    for found in _found(scene, pairs, max_seconds, notes):
        if found.uncertainty < best.uncertainty:
            best = found
        if best.judges(tightest):
            break
        notes.append(f"{found.method} and {found.check}: {found.uncertainty:.1e} apart")
    seconds = time.perf_counter() - begin
    return Truth(best.q, best.method, best.check, best.uncertainty, seconds, tuple(notes))


def _found(
    scene: PromiseScene, pairs: Pairs, max_seconds: float, notes: list[str]
) -> Iterator[Truth]:
    """Yield what each pair that ends gives."""
    explicit_found = False
    for setting, check in pairs:
        explicit = setting.method == "dop853"
        if (not explicit and explicit_found) or (explicit and any(TOO_SLOW in x for x in notes)):
            continue
        q = _positions(scene, setting, max_seconds, notes)
        if q is None and explicit:
            continue
        other = None if q is None else _positions(scene, check, max_seconds, notes)
        if q is not None and other is not None:
            explicit_found |= explicit
            apart = PositionError.between(other, q).q
            yield Truth(q, str(setting), str(check), apart, 0.0)


def _positions(
    scene: PromiseScene, setting: SolverSetting, max_seconds: float, notes: list[str]
) -> Array | None:
    watch = _deadline(max_seconds) if setting.method == "dop853" else None
    try:
        return scene.run(watch, **setting.arguments).q
    except SimulationInterrupted:
        raise
    except HexapodError as error:
        if isinstance(error.__cause__, _TooSlowError):
            notes.append(f"{setting}: {TOO_SLOW} {max_seconds:g} s")
            return None
        notes.append(f"{setting}: {type(error).__name__}")
    return None


def _deadline(max_seconds: float) -> Callable[[float], None]:
    """Return a progress callback that gives a run up once it is foreseen to last too long."""
    begin = time.process_time()

    def look(done: float) -> None:
        spent = time.process_time() - begin
        if spent > max_seconds or (spent > FORECAST_AFTER and spent > max_seconds * done):
            raise _TooSlowError

    return look
