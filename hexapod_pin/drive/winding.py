"""Temperature of a winding: two thermal bodies, and a resistance that grows with temperature.

    C_w T_w' = P - (T_w - T_h) / R_wh
    C_h T_h' = (T_w - T_h) / R_wh - (T_h - T_a) / R_ha
    P = i^2 R_25 (1 + a (T_w - 25)) / (1 - b (T_h - 25))^2

w winding, h housing, a surroundings; C = time constant / resistance, as maxon's data sheets state
both. i is the current of the cold motor at the torque that the joint needs; the magnets weaken with
the housing's temperature by b, and the current grows so that the torque stays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hexapod_pin.arrays import Array

COPPER = 0.0039
"""Rise of copper's resistance, over that at 25 deg C [1/K]."""

MAGNET = 0.0011
"""Fall of a torque constant with the magnets' temperature, over that at 25 deg C [1/K]: that of
neodymium; ferrite loses 0.002."""

REFERENCE = 25.0
"""Temperature at which resistances and torque constants are stated [deg C]."""

NEWTON_STEPS = 60
"""Newton steps for the lasting loss at most: quadratic convergence from below."""


@dataclass(frozen=True)
class Winding:
    """Thermal constants of a motor, as data sheets state them; or of n joints' motors, as arrays.

    Attributes:
        resistance: of the winding at 25 deg C [ohm].
        to_housing: thermal resistance from winding to housing [K/W].
        to_ambient: from housing to surroundings [K/W].
        winding_time: time constant of the winding [s].
        housing_time: of the housing [s].
        copper: rise of the resistance [1/K].
        magnet: fall of the torque constant with the housing's temperature [1/K].
    """

    resistance: float
    to_housing: float
    to_ambient: float
    winding_time: float
    housing_time: float
    copper: float = COPPER
    magnet: float = 0.0

    def of(self, joints: Array) -> Winding:
        """Return the constants of some of the joints, of arrays of all."""
        return Winding(*(np.atleast_1d(x)[joints] for x in self._arrays()))

    def _arrays(self) -> tuple[Array, ...]:
        shape = np.shape(self.resistance) or (1,)
        return tuple(np.broadcast_to(np.asarray(x, float), shape) for x in vars(self).values())

    def course(self, mean_square: float, times: Array, ambient: float = 25.0) -> Array:
        """Return the winding's temperature after starting cold [deg C].

        Args:
            mean_square: of the current [A^2].
            times: since the start [s], increasing. Shape (T,).
            ambient: temperature of the surroundings, and of the motor at first [deg C].

        Returns:
            Shape (T,).
        """
        one = Winding(*self._arrays())  # type: ignore[arg-type]
        return two_body_course(one, np.array([mean_square]), times, ambient)[:, 0, 0]

    def lasting_loss(self, mean_square: float, ambient: float = 25.0) -> float:
        """Return the winding's loss in the end [W]; infinite where it runs away."""
        cold = np.asarray(mean_square * self.resistance, dtype=float)
        total = self.to_housing + self.to_ambient
        weaker, hotter = self.magnet * self.to_ambient, self.copper * total
        full = 1.0 - self.magnet * (ambient - REFERENCE)
        warm = 1.0 + self.copper * (ambient - REFERENCE)
        loss = np.zeros(np.broadcast(cold, total).shape)
        with np.errstate(all="ignore"):
            for _ in range(NEWTON_STEPS):
                left = full - weaker * loss
                made = cold * (warm + hotter * loss) / left**2
                slope = cold * hotter / left**2 + 2.0 * weaker * made / left
                step = (made - loss) / (1.0 - slope)
                loss = np.where((slope < 1.0) & (left > 0.0), loss + step, np.inf)
                if not np.any(np.abs(step) > 1e-14 * np.abs(loss)):
                    break
        found = np.where(np.isnan(cold + total), np.nan, np.where(np.isnan(loss), np.inf, loss))
        return found if found.shape else float(found)  # type: ignore[return-value]

    def lasting(self, mean_square: float, ambient: float = 25.0) -> float:
        """Return the winding's temperature in the end [deg C]; infinite where it runs away."""
        loss = self.lasting_loss(mean_square, ambient)
        return ambient + (self.to_housing + self.to_ambient) * loss

    def hottest(self, mean_square: float, moving_square: float, ambient: float = 25.0) -> float:
        """Return the largest temperature in a lasting, repeating load [deg C].

        The housing sees the mean; the winding's own rise above it follows the load.

        Args:
            mean_square: of the current [A^2].
            moving_square: its largest mean square behind a lag of `winding_time` [A^2].
            ambient: temperature of the surroundings [deg C].
        """
        loss = self.lasting_loss(mean_square, ambient)
        lasting = ambient + (self.to_housing + self.to_ambient) * loss
        per_square = self.loss_per_square(lasting, ambient + self.to_ambient * loss)
        return lasting + self.to_housing * per_square * (moving_square - mean_square)

    def allowed_square(self, hottest: float, ambient: float = 25.0) -> float:
        """Return the lasting mean square of the current at which the winding is that hot [A^2]."""
        loss: float = np.maximum(hottest - ambient, 0.0) / (self.to_housing + self.to_ambient)
        return loss / self.loss_per_square(hottest, ambient + self.to_ambient * loss)

    def loss_per_square(self, winding: float, housing: float) -> float:
        """Return the loss over the square of the cold motor's current [ohm]."""
        warm = 1.0 + self.copper * (winding - REFERENCE)
        return self.resistance * warm / (1.0 - self.magnet * (housing - REFERENCE)) ** 2


LEAST_FLUX = 0.1
"""Least share of their flux that magnets keep, far above any use [-]."""

MELTED = 1000.0
"""Temperature from which a motor has run away [deg C]: copper melts at 1085."""

STEPS_OF_HOUSING = 20
"""Steps within a time constant of the housing: the magnets' temperature is constant in each."""


def two_body_course(
    winding: Winding, mean_square: Array, times: Array, ambient: float = 25.0
) -> Array:
    """Return the temperatures of n windings and housings after starting cold [deg C].

    The two equations are linear while the magnets keep their temperature. Steps of a twentieth of
    the housing's time constant are solved exactly, with the housing's mean temperature of the step:
    of second order, and exact without magnets.

    Args:
        winding: constants of n motors, arrays (n,).
        mean_square: of the cold motors' currents (n,) [A^2].
        times: since the start [s], increasing. Shape (T,).
        ambient: temperature of the surroundings, and of the motors at first [deg C].

    Returns:
        Winding and housing; infinite above 1000 deg C. Shape (T, 2, n).
    """
    state = np.full((len(mean_square), 2), float(ambient))
    found, now = np.empty((len(times), 2, len(mean_square))), 0.0
    longest = float(np.min(winding.housing_time)) / STEPS_OF_HOUSING
    for k, time in enumerate(times):
        steps = max(1, int(np.ceil((time - now) / longest))) if np.any(winding.magnet) else 1
        for _ in range(steps if time > now else 0):
            state = warmed(winding, mean_square, state, (time - now) / steps, ambient)
        found[k], now = state.T, time
    return np.where(found < MELTED, found, np.inf)


def warmed(
    winding: Winding, mean_square: Array, state: Array, step: float, ambient: Array | float
) -> Array:
    """Return the temperatures of n windings and housings a step later, at most 1000 deg C.

    Args:
        winding: constants of n motors, arrays (n,).
        mean_square: of the cold motors' currents in the step (..., n) [A^2].
        state: temperatures of winding and housing (..., n, 2) [deg C].
        step: small beside the housing's time constant [s].
        ambient: temperature of the surroundings, one or (n,) [deg C].
    """
    ahead = _step(winding, mean_square, state, state[..., 1], step, ambient)
    middle = 0.5 * (state[..., 1] + ahead[..., 1])
    return np.minimum(_step(winding, mean_square, state, middle, step, ambient), MELTED)


def flux(winding: Winding, housing: Array) -> Array:
    """Return the torque constant over that at 25 deg C, by the housing's temperature [-]."""
    found: Array = np.maximum(1.0 - winding.magnet * (housing - REFERENCE), LEAST_FLUX)
    return found


def _step(
    w: Winding, square: Array, state: Array, magnets: Array, step: float, ambient: Array | float
) -> Array:
    """Return (..., n, 2) temperatures a step later, the magnets' being constant in it."""
    loss = square * w.resistance / flux(w, magnets) ** 2
    heat, mass = w.winding_time / w.to_housing, w.housing_time / w.to_ambient
    a, b = (w.copper * loss - 1.0 / w.to_housing) / heat, 1.0 / w.winding_time
    c, d = 1.0 / (w.to_housing * mass), -(1.0 / w.to_housing + 1.0 / w.to_ambient) / mass
    slope = np.empty_like(state)  # d/dt of both temperatures; of the system [[a, b], [c, d]]
    slope[..., 0] = (
        a * state[..., 0] + b * state[..., 1] + loss * (1.0 - w.copper * REFERENCE) / heat
    )
    slope[..., 1] = c * state[..., 0] + d * state[..., 1] + ambient / w.housing_time
    middle, half = 0.5 * (a + d), np.sqrt(0.25 * (a - d) ** 2 + b * c)  # its rates: real, distinct
    high, low = _grown(middle + half, step), _grown(middle - half, step)
    lean, even = 0.5 * (high - low) / half, 0.5 * (high + low)
    found = np.empty_like(state)
    found[..., 0] = even * slope[..., 0] + lean * ((a - middle) * slope[..., 0] + b * slope[..., 1])
    found[..., 1] = even * slope[..., 1] + lean * (c * slope[..., 0] + (d - middle) * slope[..., 1])
    return np.asarray(state + found)


def _grown(rate: Array, step: float) -> Array:
    """Return (exp(rate step) - 1) / rate, step where the rate is 0 [s]."""
    with np.errstate(all="ignore"):
        return np.where(rate == 0.0, step, np.expm1(rate * step) / rate)


# Thermal constants assumed by the motor's mass, where none are published.

HOUSING_RESISTANCE = 2.0
"""Housing to surroundings, times mass^(2/3) [K/W kg^(2/3)] (*assumed*, docs/motors.md)."""

WINDING_RESISTANCE = 1.5
"""Winding to housing, likewise [K/W kg^(2/3)] (*assumed*)."""

HEAT_CAPACITY = 800.0
"""Of the whole motor over its mass [J/(K kg)] (*assumed*)."""

WINDING_CAPACITY = 15.0
"""Of its winding over the motor's mass [J/(K kg)]: 4 % of it is copper (*assumed*)."""


def assumed_constants(mass: float, factor: float = 1.0) -> tuple[float, float, float, float]:
    """Return thermal constants *assumed* of a motor by its mass, as `Winding` has them.

    Args:
        mass: of the motor with gear and electronics [kg].
        factor: on both thermal resistances, and so on the time constants.

    Returns:
        Winding to housing and housing to surroundings [K/W], time constants of both [s].
    """
    size = factor * mass ** (-2.0 / 3.0)
    to_housing, to_ambient = WINDING_RESISTANCE * size, HOUSING_RESISTANCE * size
    times = to_housing * WINDING_CAPACITY * mass, to_ambient * HEAT_CAPACITY * mass
    return to_housing, to_ambient, *times
