"""A second right-hand side in Python, integrated by SciPy: an oracle for the native core."""

from hexapod_pin.validation.second_rhs.integrate import integrate

__all__ = ["integrate"]
