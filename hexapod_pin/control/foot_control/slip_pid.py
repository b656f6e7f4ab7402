"""S1's slip correction: a PID from what feet feel along the ground to where they are put."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from pydantic import NonNegativeFloat, PositiveFloat, model_serializer

from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from pydantic import SerializerFunctionWrapHandler


class SlipPid(Spec):
    """PID on the tangential force of standing feet, or on how far they have slid [S1].

    "force": e is the part of a foot's tangential force that drives the trunk nowhere: the force
    less the share of the sum and of the moment about the normal that goes with its load. The foot
    gives way along it, dp = kp e + ki int e + kd e'.
    "slip": e is how far a foot has slid since touch-down, by joint angles and gyroscope: its
    motion less the feet's mean. The foot is put back, dp = -(kp e + ki int e + kd e').

    S1 prints neither equations nor gains. Gains that are not given follow from the bandwidth by
    internal model control [Skogestad2003]: ki = 1 / (s (1/w + d)), kp = kd = 0, w = 2 pi bandwidth,
    d the delay of the loop, s the stiffness along the ground of the stiffest foot on its servos
    [N/m], of "slip" 1: a standing foot has no lag of its own (*assumed*).

    Attributes:
        signal: what e is.
        kp: [m/N]; of "slip" [-].
        ki: [m/(N s)]; of "slip" [1/s].
        kd: [m s/N]; of "slip" [s].
        bandwidth: of the loop, for gains that are not given [Hz]. The default is *assumed*.
        derivative_time: of the low-pass filter of e' [s]. The default is *assumed*.
        limit: largest correction; at it the integral stops (anti-windup) [m]. *Assumed*.
        anticipates: whether feet are put where they have to be for their servos to give way by
            J diag(1/kp) J^T f0 under the nominal loads f0 (not in S1): without, the load itself
            pushes feet apart, and whatever the PID takes back slides again as the foot unloads.
    """

    kind: Literal["slip-pid"] = "slip-pid"
    signal: Literal["force", "slip"] = "force"
    kp: NonNegativeFloat | None = None
    ki: NonNegativeFloat | None = None
    kd: NonNegativeFloat | None = None
    bandwidth: PositiveFloat = 10.0
    derivative_time: PositiveFloat = 0.01
    limit: PositiveFloat = 0.03
    anticipates: bool = True

    @property
    def assumed(self) -> bool:
        """Whether a gain is this package's guess rather than the user's number."""
        return None in (self.kp, self.ki)

    @model_serializer(mode="wrap")
    def _without_none(self, dump: SerializerFunctionWrapHandler) -> dict[str, object]:
        return {name: value for name, value in dump(self).items() if value is not None}
