"""Inputs that nobody would write, through every public door: each is used or refused."""

from fuzz.campaign import Outcome, attempt, run_campaign
from fuzz.doors import DOORS, SELDOM

__all__ = ["DOORS", "SELDOM", "Outcome", "attempt", "run_campaign"]
