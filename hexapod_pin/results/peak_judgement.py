"""Recomputed peaks are judged: which hold, which are ranges, and what moved them.

A change moves a peak by its difference from the peak of the same run without that change. Peaks
below 1 % of the robot's largest size no motor: they are compared with 5 % of that 1 %. The largest
peak of a kind of joint holds only where that of the joint which sets it does too: another joint
that happens to reach as far is a coincidence.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from hexapod_pin.errors import ParameterError
from hexapod_pin.results.joint_budget import LIMITED_TORQUE_SHARE, JointBudget
from hexapod_pin.results.peak_verdict import (
    ACCURACY,
    AT_LIMIT,
    HOLDS_WITHIN,
    NEGLIGIBLE_SHARE,
    PEAK,
    RANGE,
    RUN,
    UNKNOWN,
    FootImpulse,
    PeakVerdict,
    PeakVerdicts,
    Recomputation,
    Spread,
)
from hexapod_pin.results.run_facts import events_text
from hexapod_pin.results.summary import Summary
from hexapod_pin.results.torque_budget import TorqueBudget, torque_budget

Rows = Mapping[str, Sequence[JointBudget]]
"""The same joints in every computation that ran."""


def judge_summaries(
    summaries: Mapping[str, Summary],
    recomputations: Sequence[Recomputation],
    *,
    limited: bool = True,
    notes: Sequence[str] = (),
) -> PeakVerdicts:
    """Return the verdict on the peaks of a run from what it and its recomputations came to.

    Args:
        summaries: by "run" and the names of recomputations; one that failed has none.
        recomputations: what was changed; each without a summary has its reason.
        limited: whether drives cut torques at their limits.
        notes: lines to print with the verdict.

    Raises:
        ParameterError: the run holds no whole cycle, or a recomputation has neither a summary nor
            a reason for having none.
    """
    for row in recomputations:
        if row.name not in summaries and not (row.failure or row.unneeded):
            raise ParameterError("summaries", sorted(summaries), f"given of {row.name!r}")
    budgets = {name: torque_budget(summary) for name, summary in summaries.items()}
    run = budgets[RUN]
    floors = {
        name: NEGLIGIBLE_SHARE * max(row.torque_peak for row in budget.joints)
        for name, budget in budgets.items()
    }

    def judged(name: str, rows: Rows) -> PeakVerdict:
        return _verdict(name, rows, recomputations, floors, limited)

    return PeakVerdicts(
        robot_name=run.robot_name,
        window=run.window,
        recomputations=tuple(recomputations),
        joints=tuple(
            judged(row.joint, {name: [b.joints[k]] for name, b in budgets.items()})
            for k, row in enumerate(run.joints)
        ),
        kinds=tuple(judged(row.kind, _of_kind(budgets, row.kind)) for row in run.kinds),
        feet=foot_impulses(summaries),
        sources=run.sources,
        notes=(*notes, *outside_notes(summaries, budgets), *fall_notes(summaries, recomputations)),
        assumed=run.assumed,
    )


def _of_kind(budgets: Mapping[str, TorqueBudget], kind: str) -> Rows:
    return {
        name: [row for row in budget.joints if row.kind == kind] for name, budget in budgets.items()
    }


def _verdict(
    name: str,
    rows: Rows,
    recomputations: Sequence[Recomputation],
    floors: Mapping[str, float],
    limited: bool,
) -> PeakVerdict:
    """Return the verdict on the largest peak of some joints."""
    peaks = _largest(rows, lambda row: row.torque_peak)
    compared = [row for row in recomputations if row.name in peaks and row.baseline in peaks]
    led = {row.name: _peak_of_leader(rows[row.baseline], rows[row.name]) for row in compared}
    changes = {
        row.name: max(
            _change(peaks[row.baseline], peaks[row.name], floors[row.baseline]),
            _change(peaks[row.baseline], led[row.name], floors[row.baseline]),
            key=abs,
        )
        for row in compared
    }
    moved = tuple(key for key, change in changes.items() if not abs(change) <= HOLDS_WITHIN)
    worst = max(rows[ACCURACY if ACCURACY in rows else RUN], key=lambda row: row.torque_peak)
    failed = [row for row in recomputations if row.failure]
    cut = limited and any(
        row.at_limit > 0.0 or row.torque_peak >= LIMITED_TORQUE_SHARE * row.effort_limit
        for each in rows.values()
        for row in each
    )
    verdict = UNKNOWN if failed else AT_LIMIT if cut else RANGE if moved else PEAK
    spread = Spread.of(peaks)
    torque = replace(spread, low=min(spread.low, *led.values())) if led else spread
    titles = {row.name: row.title for row in recomputations}
    reasons = [f"{row.title} {row.failure.split(':')[0]}" for row in failed]
    reasons += [f"{titles[key]} {100.0 * changes[key]:+.3g} %" for key in moved]
    return PeakVerdict(
        name=name,
        kind=worst.kind,
        verdict=verdict,
        torque_peak=torque,
        computed=peaks,
        changes=changes,
        moved_by=moved,
        effort_limit=worst.effort_limit,
        at_limit=max(row.at_limit for each in rows.values() for row in each) if limited else 0.0,
        torque_p99=Spread.of(_largest(rows, lambda row: row.torque_p99)),
        torque_rms=Spread.of(_largest(rows, lambda row: row.torque_rms)),
        text=_sentence(verdict, torque, reasons, worst.effort_limit),
    )


def _largest(rows: Rows, number: Callable[[JointBudget], float]) -> dict[str, float]:
    return {name: max(number(row) for row in each) for name, each in rows.items()}


def _peak_of_leader(before: Sequence[JointBudget], after: Sequence[JointBudget]) -> float:
    """Return what has become of the largest peak: that of the same joint [N m]."""
    leader = max(range(len(before)), key=lambda k: before[k].torque_peak)
    return after[leader].torque_peak


def _change(before: float, after: float, floor: float) -> float:
    """Return the share by which a peak has moved [-]; of one too small to matter, of the floor."""
    size = max(before, floor)
    if size > 0.0:
        return (after - before) / size
    return 0.0 if after == 0.0 else float("inf")


def _sentence(verdict: str, torque: Spread, reasons: Sequence[str], limit: float) -> str:
    """Return a verdict as a sentence."""
    span = f"{torque.low:.4g} to {torque.high:.4g} N m"
    why = f": {'; '.join(reasons)}" if reasons else ""
    if verdict == UNKNOWN:
        return f"range unknown{why} ({span} of what ran)"
    if verdict == AT_LIMIT:
        return f"at the limit, {span}{why}"
    beyond = f"; beyond the limit of {limit:.4g} N m" if torque.high > limit else ""
    number = f"{torque.value:.4g} N m" if verdict == PEAK else span
    return f"{verdict} {number}{why}{beyond}"


# What a verdict on peaks reports beside the peaks: impulses of the feet, start-up, falls.


def foot_impulses(summaries: Mapping[str, Summary]) -> tuple[FootImpulse, ...]:
    """Return the normal impulse of every foot."""
    return tuple(
        FootImpulse(
            foot, Spread.of({name: float(s.normal_impulse[k]) for name, s in summaries.items()})
        )
        for k, foot in enumerate(summaries[RUN].foot_names)
    )


def outside_notes(
    summaries: Mapping[str, Summary], budgets: Mapping[str, TorqueBudget]
) -> tuple[str, ...]:
    """Return a line on torques outside the window that are larger than those within."""
    within = max(row.torque_peak for budget in budgets.values() for row in budget.joints)
    outside = [float(abs(summary.outside_torque).max()) for summary in summaries.values()]
    if not max(outside) > within:
        return ()
    span = f"{min(outside):.4g} to {max(outside):.4g} N m"
    return (f"Not judged: outside the window (start-up or stop) a joint reaches {span}.",)


def fall_notes(
    summaries: Mapping[str, Summary], recomputations: Sequence[Recomputation]
) -> tuple[str, ...]:
    """Return a line for each computation in which the trunk touched the ground."""
    titles = {RUN: "the run itself", **{row.name: row.title for row in recomputations}}
    return tuple(
        f"With {titles[name]} {line}."
        for name, summary in summaries.items()
        for line in events_text(summary.events, ())
    )
