"""A second right-hand side in Python, integrated by SciPy: an oracle for the native core.

It shares with the package the parameters of scenes, plans of controllers and the robots' Pinocchio
models; every formula of a law is written again. Dynamics are Pinocchio's algorithms.
"""

from oracles.second_rhs.integrate import integrate
from oracles.second_rhs.law_scene import GivenSetPoints, LawScene, difference
from oracles.second_rhs.switch import SecondRun, Switch

__all__ = ["GivenSetPoints", "LawScene", "SecondRun", "Switch", "difference", "integrate"]
