"""What every function of time answers: value, rate, acceleration, and where a derivative jumps."""

from __future__ import annotations

from abc import abstractmethod

from hexapod_pin.arrays import Array
from hexapod_pin.spec import Spec


class MotionFunction(Spec):
    """A continuously differentiable function of time, with its exact derivatives.

    Values have the unit of what the function describes. Where the acceleration jumps it has two
    values: `inside` tells which one is meant, by a time between this kink and the next.
    """

    @abstractmethod
    def value_and_rate(self, time: Array) -> tuple[Array, Array]:
        """Return the value and its derivative at times [s], of their shape."""

    @abstractmethod
    def acceleration(self, time: Array, inside: Array | None = None) -> Array:
        """Return the second derivative.

        Args:
            time: [s]. Any shape.
            inside: times [s] of the same shape, each within the piece between two kinks whose
                value is wanted where `time` is a kink; None: of the piece that begins there.

        Returns:
            Shape of `time`.
        """

    @abstractmethod
    def kinks_until(self, end: float) -> tuple[float, ...]:
        """Return the times not after `end` at which a derivative jumps, or more of them [s]."""

    @property
    @abstractmethod
    def shortest_time(self) -> float:
        """Time in which it is close to a polynomial between kinks; infinite where it is one [s]."""

    def derivatives(self, time: Array, inside: Array | None = None) -> tuple[Array, Array, Array]:
        """Return value, rate and acceleration; arguments as of `acceleration`."""
        return (*self.value_and_rate(time), self.acceleration(time, inside))
