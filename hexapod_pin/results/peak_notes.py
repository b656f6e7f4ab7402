"""What a verdict on peaks tells beside the peaks: impulses of the feet, start-up, falls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hexapod_pin.results.joint_limits import events_text
from hexapod_pin.results.peak_verdict import FootImpulse
from hexapod_pin.results.recomputation import RUN, Recomputation, Spread
from hexapod_pin.results.robot_budget import TorqueBudget
from hexapod_pin.results.summary import Summary


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
    within = max(row.peak_torque for budget in budgets.values() for row in budget.joints)
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
