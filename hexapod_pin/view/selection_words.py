"""The verdict of a motor selection in words, and what decides it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from hexapod_pin.results.motor_selection import USES
from hexapod_pin.view.report_blocks import UNKNOWN, margin_text, number, use_text

if TYPE_CHECKING:
    from hexapod_pin.results.motor_selection import KindUse, MotorCandidate, MotorSelection

WORDS = {
    "peak_use": "peak torque",
    "continuous_use": "RMS torque",
    "holding_use": "holding torque",
    "speed_use": "speed",
}
"""What each use is of."""


HIGH_CONFIDENCE = 0.95
"""Share of sampled walks from which on a result is taken to be certain [-]."""


class Deciding(NamedTuple):
    """The largest use of a set of motors: what decides whether it passes.

    Attributes:
        use: need over what is allowed [-]; NaN where nothing is known.
        kind: of joint.
        name: of `results.motor_selection.USES`; empty where nothing is known.
        walk: in which it is reached; empty where that is not known.
    """

    use: float
    kind: str
    name: str
    walk: str

    @property
    def text(self) -> str:
        """What decides, in words."""
        if not self.name:
            return UNKNOWN
        return f"{WORDS[self.name]} of the {self.kind} joints" + (
            f" ({self.walk})" if self.walk else ""
        )


def deciding(uses: tuple[KindUse, ...]) -> Deciding:
    """Return the largest of the known uses of some kinds of joints."""
    found = [
        Deciding(getattr(use, name), use.kind, name, use.walk.get(name, ""))
        for use in uses
        for name in USES
        if not math.isnan(getattr(use, name))
    ]
    return max(found, key=lambda item: item.use, default=Deciding(math.nan, "", "", ""))


def unknown_uses(candidate: MotorCandidate) -> list[str]:
    """Return which uses are unknown for some kind of joint, in words."""
    return [
        f"{WORDS[name]} ({', '.join(kinds)})"
        for name in USES
        if (kinds := [u.kind for u in candidate.uses if math.isnan(getattr(u, name))])
    ]


def verdict_word(s: MotorSelection) -> str:
    """Return the result in a word or two."""
    if not s.best.passes:
        word = "NO MOTOR PASSES"
    else:
        word = "PASSES WHAT COULD BE JUDGED" if unknown_uses(s.best) else "PASSES"
        if _doubtful(s):
            word += f", WITH {_share(s)} CONFIDENCE"
    return f"INTERRUPTED, {word} SO FAR" if s.interrupted else word


def verdict_level(s: MotorSelection) -> str:
    """Return how good the result is: "good", "open" where something is not known, or "bad"."""
    if not s.best.passes:
        return "bad"
    doubts = (s.interrupted, unknown_uses(s.best), voltages(s.best)[1:], _doubtful(s))
    return "open" if any(doubts) else "good"


def _share(s: MotorSelection) -> str:
    share = math.nan if s.confidence is None else s.confidence.share
    return UNKNOWN if math.isnan(share) else f"{100.0 * share:.0f} %"


def _doubtful(s: MotorSelection) -> bool:
    """Tell whether it was computed that the confidence is not high."""
    return s.confidence is not None and not s.confidence.share >= HIGH_CONFIDENCE


def voltages(candidate: MotorCandidate) -> list[float]:
    """Return the voltages that a set of motors needs, each once, rising [V]."""
    return sorted({record.voltage for record in candidate.motors.values()})


def verdict_texts(s: MotorSelection) -> tuple[str, ...]:
    """Return the verdict: the choice with its margin, how sure it is, and what is missing."""
    best, most = s.best, deciding(s.best.uses)
    walks = "the walk" if len(s.walks) == 1 else f"all {len(s.walks)} walks"
    if best.passes:
        texts = [
            f"{_subject(s)}: {best.name}. They carry every joint on {walks}. The largest use of "
            f"what the derated motors may give is {use_text(most.use)}, a margin of "
            f"{margin_text(most.use)}; what decides is the {most.text}."
        ]
    else:
        texts = [
            f"No set of motors that was looked at carries every joint on {walks}. The nearest is "
            f"{best.name}: its largest use of what the derated motors may give is "
            f"{use_text(most.use)} (at most 1.00 is allowed), set by the {most.text}."
        ]
        texts += [f"Why it does not pass: {best.reasons[0]}."] if best.reasons else []
    texts.append(_certainty(s))
    if len(volts := voltages(best)) > 1:
        listed = " and ".join(f"{volt:g} V" for volt in volts)
        texts.append(f"These motors need {listed}: one battery alone does not serve them.")
    if missing := unknown_uses(best):
        texts.append(f"Not judged, because unknown: {'; '.join(missing)}.")
    if s.interrupted:
        texts.append("The run was interrupted: only what was done until then is reported.")
    return tuple(texts)


def _subject(s: MotorSelection) -> str:
    if s.choice is None:
        return "No choice for each kind of joint was reached; first in rank on all joints"
    return "Choice"


def _certainty(s: MotorSelection) -> str:
    if s.confidence is None:
        return "How uncertain inputs change this was not computed: no confidence is stated."
    return s.confidence.sentence


def mass_change(s: MotorSelection, candidate: MotorCandidate) -> str:
    """Return the robot's mass with motors, and by how much that differs from its file."""
    change = candidate.total_mass - s.total_mass
    return f"{number(candidate.total_mass)} kg ({change:+.2f} kg against its file)"


def price_text(candidate: MotorCandidate) -> str:
    """Return the price of all motors, where it is known in one currency."""
    currencies = {record.currency for record in candidate.motors.values()}
    if candidate.price is None or math.isnan(candidate.price):
        return UNKNOWN
    return f"{candidate.price:.0f} {currencies.pop()}" if len(currencies) == 1 else UNKNOWN
