"""The findings as a Markdown page and as JSON."""

from __future__ import annotations

import json
from dataclasses import asdict

from accuracy import Accuracy
from findings import Findings, targets
from machine import as_text
from timing import Quartiles

ENGINES = {
    "step": "hexapod_pin",
    "sampled": "hexapod_pin, sampling every step",
    "dense": "hexapod_pin, dense solver",
    "pyramidal": "MuJoCo, pyramidal cone",
    "elliptic": "MuJoCo, elliptic cone",
    "pinocchio": "Pinocchio's crba + nonLinearEffects alone",
}
CHECKS = ("error, first 1 s [m]", "error, whole run [m]", "reference [m]", "feet down", "counts")

INTRODUCTION = """# Cost of a step, beside its error

`python benchmarks/step_cost.py{flag}`: one process, one thread unless said, {rounds} interleaved
rounds; medians with quartiles in brackets; ratios are taken inside a round.

{machine}

Robot kharagpur from one URDF in both engines, step {step:g} ms, motions of {duration:g} s from
standing: hold, and tripod and tetrapod of 0.14 m in 2.4 s. Ours: linearly implicit Euler, servos
{servo}. MuJoCo: implicitfast, default solver, loop in C
(`mujoco.rollout`), one thread, the same servos, effort limits, coefficient of friction (s1 0.7,
s2 0.3) and set-points (at the end of each step, as in ours); only feet meet the floor; joint
limits off, visual shapes dropped, fixed links fused.

**The contact laws differ**: ours is a compliant foot (s1: Hertz and tanh friction; s2: ADAMS
IMPACT and two-speed friction), MuJoCo's a soft constraint with its default parameters. So a ratio
compares the cost of walking this robot, not of solving the same equations. Each error is the
largest distance of the trunk, on a 10 ms grid, from that engine's own run of the same method at
{fine:g} s (MuJoCo's with a solver tolerance of 1e-12); "reference" is how far that run moves when
its step is doubled: an error below it is not resolved. A run begins with the feet just touching:
settling is part of every error. Sampling does not change a run, the dense solver by {dense:.0e} m.
"Counts": ours solves a step again when a servo reaches its limit, a foot lets go or its slip turns
round; MuJoCo's solver iterations are means over 10 ms samples.

Pinocchio's crba + nle: CRBA and nonLinearEffects called in C++, what mass matrix and bias cost with
it: the yardstick. A step takes both from its own fused pass (`native/fused/fused_legs.hpp`).
"""


def markdown(found: Findings) -> str:
    """Return the page."""
    head = INTRODUCTION.format(
        flag=" --quick" if found.quick else "",
        rounds=found.size.rounds,
        machine=as_text(found.machine, found.load_after),
        step=found.step * 1e3,
        duration=found.size.duration,
        servo=found.servo,
        fine=found.size.fine,
        dense=found.dense_difference,
    )
    warning = "\n**Quick run: only shows that the script works.**\n" if found.quick else ""
    parts = [head + warning, _targets_table(found), _steps_table(found), _runs(found)]
    return "\n".join(parts)


def json_text(found: Findings) -> str:
    """Return everything, with the values of every round."""
    data = {
        **{name: getattr(found, name) for name in ("quick", "step", "machine", "load_after")},
        **{name: getattr(found, name) for name in ("servo", "dense_difference", "same_bits")},
        "size": asdict(found.size),
        "targets": [
            {**asdict(Quartiles.of(x.values)), "what": x.what, "bound": x.bound, "met": x.met}
            for x in targets(found)
        ],
        "accuracy": {name: asdict(value) for name, value in found.accuracy.items()},
        "samples": {name: values.tolist() for name, values in found.samples.items()},
    }
    return json.dumps(data, indent=1) + "\n"


def _targets_table(found: Findings) -> str:
    rows = [target.row() for target in targets(found)]
    return "## Targets\n\n" + _table(["ratio", "median (quartiles)", "target", "met"], rows)


def _steps_table(found: Findings) -> str:
    """Every engine on every motion, the error in the same row as the speed."""
    head = ["motion / contact", "engine", "us per step", "of pyramidal", "times real time", *CHECKS]
    names = [name for name in found.samples if name.partition("/")[0] in ENGINES]
    cases = list(dict.fromkeys(_case(name) for name in names))
    order = [f"{engine}/{case}" for case in cases for engine in ENGINES]
    rows = [_step_row(found, name) for name in order if name in found.samples]
    return "## Steps\n\n" + _table(head, rows)


def _step_row(found: Findings, name: str) -> list[str]:
    cost = Quartiles.of(found.samples[name])
    engine, case = name.partition("/")[0], _case(name)
    share = Quartiles.of(found.samples[name] / found.samples[f"pyramidal/{case}"])
    row = [case, ENGINES[engine], cost.text(), f"{share.median:.2f}"]
    if engine == "pinocchio":
        return [*row, *["-"] * 6]
    accuracy = found.accuracy[name if name in found.accuracy else f"step/{case}"]
    return [*row, f"{found.step * 1e6 / cost.median:.0f}", *_errors(accuracy)]


def _runs(found: Findings) -> str:
    """The long walk and the batch."""
    size, x = found.size, found.samples
    many = size.cases * size.batch
    rows = []
    for name, what, simulated in (
        ("walk/call", f"walk of {size.walk:g} s, hp.simulate, whole call", size.walk),
        ("walk/rollout", "the same, rollout alone", size.walk),
        ("batch/1", f"{size.cases} walks of {size.batch:g} s, native part, 1 thread", many),
        ("batch/2", "the same, 2 threads", many),
    ):
        wall = Quartiles.of(x[name])
        speed = Quartiles.of(simulated / x[name])
        errors = _errors(found.accuracy[name.partition("/")[0]])
        rows.append([what, wall.text(".3f"), speed.text(".0f"), *errors])
    head = ["run", "wall time [s]", "times real time", *CHECKS]
    bits = "the same bits" if found.same_bits else "**DIFFERENT bits**"
    return (
        "## Runs\n\nTetrapod, contact s1, sampled every step; the batch has strokes from 0.14 down "
        f"to 0.08 m (errors and counts: its first walk).\nOne and two threads gave {bits}.\n\n"
        + _table(head, rows)
    )


def _errors(accuracy: Accuracy) -> list[str]:
    errors = [accuracy.first_second, accuracy.whole, accuracy.reference]
    counts = ", ".join(f"{name} {value:g}" for name, value in sorted(accuracy.counters.items()))
    return [*(f"{error:.1e}" for error in errors), f"{accuracy.feet_down:.1f}", counts]


def _case(name: str) -> str:
    return name.partition("/")[2]


def _table(head: list[str], rows: list[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)
