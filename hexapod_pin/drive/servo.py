"""Joint servos: what turns a set-point into a torque."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from pydantic import NonNegativeFloat

from hexapod_pin.spec import Spec

if TYPE_CHECKING:
    from hexapod_pin.robot.robot import Robot


class Servo(Spec):
    """PD position servo at every joint: tau = kp (q_ref - q) + kd (v_ref - v), limited.

    Attributes:
        kp: stiffness [N m/rad].
        kd: damping [N m s/rad].
        limited: whether |tau| is limited to the joint's URDF effort.
        assumed: whether the gains are this package's guess rather than the user's numbers.
    """

    kind: Literal["pd"] = "pd"
    kp: NonNegativeFloat
    kd: NonNegativeFloat
    limited: bool = True
    assumed: bool = False

    @classmethod
    def from_effort(
        cls,
        robot: Robot,
        *,
        kp: float | None = None,
        kd: float | None = None,
        error: float = 0.025,
        time: float = 0.02,
    ) -> Servo:
        """Return servos with *assumed* gains where none are given.

        Neither paper gives gains. A hobby servo reaches its full torque within a few degrees of
        error; 0.025 rad is 1.4 degrees.

        Args:
            robot: whose joints they drive.
            kp: stiffness [N m/rad]; None: the largest effort at `error`.
            kd: damping [N m s/rad]; None: the assumed stiffness times `time`.
            error: joint error of full effort [rad].
            time: kd / kp of the assumed gains [s].

        Raises:
            ParameterError: a gain is negative or not finite.
        """
        effort = float(robot.effort.max()) if robot.effort.size else 0.0
        stiffness = effort / error
        return cls(
            kp=stiffness if kp is None else kp,
            kd=stiffness * time if kd is None else kd,
            assumed=kp is None or kd is None,
        )
