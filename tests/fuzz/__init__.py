"""Inputs that nobody would write, through every public door: each is used or refused."""

from fuzz.campaign import DOORS, SELDOM, Outcome, attempt, run_campaign

__all__ = ["DOORS", "SELDOM", "Outcome", "attempt", "run_campaign"]
