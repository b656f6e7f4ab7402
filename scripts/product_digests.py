"""Digests of what a user reads: numbers, texts, studies, maps and robots, a line for each.

    python scripts/product_digests.py --write docs/results/product_digests.txt
    python scripts/product_digests.py --check docs/results/product_digests.txt
    python scripts/product_digests.py --check TABLE --robots FOLDER    # URDF files besides

`run_digests.py` covers the samples and counters of runs, this table what is made of them. A
rearrangement of the code must leave every line as it is. Bits depend on the machine (SIMD width,
libm), so a table is compared only with one that was made on the same machine. A line is one
quantity or text of one walk, study or robot: a line that differs says what has changed.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import platform
import re
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

import hexapod_pin as hp
from hexapod_pin.atomic_file import write_atomically

Lines = Iterator[tuple[str, Any]]
"""Names, and values that are digested."""

CHANGING = {"wall_time", "versions", "case_time"}
"""What differs from run to run or from version to version."""

_PLACE = re.compile(r"(/[\w.+-]+){2,}/")
"""Folders, which differ from checkout to checkout."""

BASE = """
schema = 1
name = "digests"
[base]
robot = "kharagpur"
gait = { name = "tripod", stroke = 0.06, cycle_time = 0.8 }
duration = 1.7
accuracy = 1e-3
"""

SWEEP = """
[[vary]]
input = "payload"
values = [0.0, 0.5]
[[vary]]
input = "mu"
distribution = "uniform"
low = 0.4
high = 0.8
[design]
kind = "latin-hypercube"
samples = 4
seed = 3
"""

MOTORS = """
[motors]
voltage = 12.0
models = ["XM430-W350", "XM540-W270", "AX-12A"]
"""


def plain(value: Any) -> Any:
    """Return a value as JSON holds it, floats and arrays by their bits, folders left out."""
    if isinstance(value, np.ndarray) and value.dtype != object:
        bits = hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()
        return [str(value.dtype), list(value.shape), bits]
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, float):
        return value.hex()
    if isinstance(value, str | Path):
        return _PLACE.sub("", str(value))
    if value is None or isinstance(value, bool | int):
        return value
    if isinstance(value, Mapping):
        return {str(key): plain(value[key]) for key in value if key not in CHANGING}
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    if is_dataclass(value):
        names = [one.name for one in fields(value) if one.name not in CHANGING]
        return {name: plain(getattr(value, name)) for name in names}
    if isinstance(value, BaseModel):
        return plain(dict(value))
    raise TypeError(f"a {type(value).__name__} has no digest")


def digest(value: Any) -> str:
    """Return the first 16 hexadecimal digits of the SHA-256 of a value."""
    text = json.dumps(plain(value), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def walks() -> Iterator[tuple[str, Callable[[], hp.Case]]]:
    """Yield six cases: robots, gaits, contacts, drives, terrains, loads and controllers differ."""
    kharagpur, athena = hp.load_robot("kharagpur"), hp.load_robot("athena")
    tetrapod = hp.KinematicControl(hp.Gait.tetrapod(stroke=0.07, cycle_time=0.9))
    tripod = hp.Gait.tripod(stroke=0.06, cycle_time=0.8)
    record = hp.load_catalog().get("XM540-W270", 12.0)
    servo = hp.Scene(kharagpur).servos
    yield "tetrapod", lambda: hp.Case(hp.Scene(kharagpur), tetrapod, duration=2.7)
    yield (
        "motors",
        lambda: hp.Case(
            hp.Scene(kharagpur, servo=hp.Servo(kp=servo.kp, kd=servo.kd, motor=record.motor())),
            hp.KinematicControl(tripod), duration=2.4, accuracy=1e-3,
        ),
    )  # fmt: skip
    yield (
        "stairs",
        lambda: hp.Case(
            hp.Scene(
                kharagpur, terrain=hp.Stairs(rise=0.01, run=0.2, count=2, start=0.15),
                contact=hp.Contact.preset("s1"), body_contact=True,
                loads=[
                    hp.Payload("base_link", mass=0.4, position=(0.0, 0.02, 0.03)),
                    hp.Push("base_link", force=(5.0, 3.0, 0.0), start=0.5, duration=0.2),
                ],
            ),
            hp.KinematicControl(tripod), duration=2.4, accuracy=1e-3,
        ),
    )  # fmt: skip
    yield (
        "feedback",
        lambda: hp.Case(
            hp.Scene(athena, terrain=hp.Slope(angle=0.05)),
            hp.FootControl(
                hp.Gait.tripod(stroke=0.05, cycle_time=0.9),
                slip=hp.foot_control.SlipPid(),
                suspension=hp.foot_control.VirtualSuspension(),
                levelling=hp.foot_control.Levelling(),
                sensors=hp.sensors.Sensors(q=hp.sensors.Sensor(noise=1e-4)),
            ),
            duration=2.7,
            accuracy=1e-3,
        ),
    )
    yield (
        "arc",
        lambda: hp.Case(
            hp.Scene(kharagpur, contact=hp.Contact.preset("s2"), prescribed=True),
            hp.motion.ArcWalk(hp.Gait.wave(cycle_time=1.6), amplitude=0.1),
            duration=4.8,
            accuracy=1e-3,
        ),
    )
    yield (
        "turning, a leg lost",
        lambda: hp.Case(
            hp.Scene(athena, loads=[hp.LostLeg(athena.legs[0].name, start=4.0)]),
            hp.KinematicControl(hp.Gait.wave(stroke=0.04, cycle_time=1.7, turn_rate=0.1)),
            duration=5.1, method="robust", step=1e-3,
        ),
    )  # fmt: skip


def of_walk(case: hp.Case, folder: Path) -> Lines:
    """Yield what a user reads of a walk, also from its file."""
    trace = case.run()
    yield "case digest", hp.load_case(trace).digest
    yield "case text", case.to_toml()
    yield from of_trace(trace)
    path = trace.save(folder / "walk.nc")
    for name, value in of_trace(hp.load_trace(path)):
        yield f"read again: {name}", value
    yield "csv", trace.save(folder / "walk.csv").read_text(encoding="utf-8")
    demand = hp.sizing.joint_demand(trace)
    for one in fields(demand):
        yield f"demand {one.name}", getattr(demand, one.name)
    budget = hp.motor_budget(demand, hp.load_catalog().get("XM430-W350", 12.0))
    yield "motor budget", budget.to_dict()
    yield "motor budget table", budget.table()
    ranking = hp.sizing.motor_ranking(demand, hp.load_catalog().records[:6])
    yield "motor ranking", ranking.table()
    moments = hp.results.joint_moments(trace)
    yield "moments", moments
    verdicts = hp.study.judge_peaks(trace)
    yield "peaks", verdicts.to_dict()
    yield "peak table", verdicts.table()


def of_trace(trace: hp.Trace) -> Lines:
    """Yield what is read of a trace."""
    for name in ("time", "q", "v", "torque", "foot_force", "foot_gap", "com"):
        yield name, getattr(trace, name)
    yield "energy residual", trace.energy_residual
    yield "error estimate", [trace.error_estimate, trace.step_error, trace.accuracy_kept]
    yield "counters", trace.counters
    yield "events", list(trace.events)
    yield "limits", list(trace.limits)
    yield from of_summary(trace.summary)
    yield "columns", sorted(trace.to_dataset().variables)
    budget = hp.torque_budget(trace)
    yield "budget", budget.to_dict()
    yield "budget table", budget.table()
    verdict = hp.walk_verdict(trace)
    yield "verdict", verdict.to_dict()
    yield "verdict line", verdict.line
    stability = hp.stability(trace)
    yield "stability", stability.to_dict()
    yield "stability table", stability.table()
    yield "phase torques", hp.results.phase_torques(trace).table() if _has_phases(trace) else None
    yield "metrics", hp.study.WalkMetrics.of(trace.summary)


def _has_phases(trace: hp.Trace) -> bool:
    try:
        hp.results.phase_torques(trace)
    except hp.errors.HexapodError:
        return False
    return True


def of_summary(summary: hp.Summary) -> Lines:
    """Yield each number of a summary, and its error where that is known."""
    for one in fields(summary):
        if one.name not in ("meta", "counters"):
            yield f"summary {one.name}", getattr(summary, one.name)
            yield f"error of {one.name}", _error(summary, one.name)
    yield "summary distance", [summary.distance, summary.measured_speed, summary.measured_turn_rate]
    yield "summary window", [summary.start, summary.end, summary.torque_margin]


def _error(summary: hp.Summary, name: str) -> Any:
    try:
        return summary.error_of(name)
    except (hp.errors.HexapodError, KeyError):
        return None


def studies(folder: Path) -> Iterator[tuple[str, Callable[[], Lines]]]:
    """Yield seven studies."""
    robot = hp.load_robot("kharagpur")
    flat = hp.Scene(robot)
    tripod = hp.Gait.tripod(stroke=0.06, cycle_time=0.8)
    walk = hp.KinematicControl(tripod)

    def sweep() -> Lines:
        study = hp.study.SweepStudy.from_toml(BASE + SWEEP)
        yield "digest", study.digest
        yield "points", [study.point(k) for k in range(len(study))]
        yield "cases", [study.case(k).digest for k in range(len(study))]
        result = hp.run_sweep(study, folder / "study.db")
        for name, values in sorted(result.dataset.variables.items()):
            yield str(name), values.values
        yield "attributes", {key: text for key, text in result.dataset.attrs.items()}

    def comparison() -> Lines:
        grounds = {"flat": flat, "slope": hp.Scene(robot, terrain=hp.Slope(angle=0.05))}
        control = hp.FootControl(tripod, slip=hp.foot_control.SlipPid())
        found = hp.compare(grounds, {"plain": walk, "slip": control}, duration=1.7, accuracy=1e-3)
        yield "table", found.table()
        yield "JSON", found.to_json()
        yield "Markdown", found.to_markdown()

    def tuning() -> Lines:
        found = hp.tune(
            lambda values: hp.HoldPosture(np.array(robot.posture) + values["angle"]),
            start={"angle": 0.0}, bounds={"angle": (-0.05, 0.05)}, scenes={"flat": flat},
            objective=lambda runs, baseline: runs[0].height_mean, seed=3, budget=16,
            held_out={"slope": hp.Scene(robot, terrain=hp.Slope(angle=0.02))}, duration=0.1,
        )  # fmt: skip
        yield "data", found.data
        yield "table", found.table()

    def torque_map() -> Lines:
        found = hp.torque_map(flat, strokes=[0.04, 0.06], cycle_times=[0.8, 1.2], check=1)
        yield from of_grid(found, hp.study.load_torque_map(found.save(folder / "map.nc")))

    def energy() -> Lines:
        gaits = {"tripod": hp.Gait.tripod(), "wave": hp.Gait.wave()}
        found = hp.study.gait_energy(flat, gaits, [0.05, 0.08], stroke=0.05, accuracy=1e-3, check=1)
        yield from of_grid(found, hp.study.load_gait_energy(found.save(folder / "energy.nc")))
        yield "table", found.table()

    def selection() -> Lines:
        found = hp.select_motors(BASE + MOTORS, samples=0)
        yield "data", found.to_dict()
        yield "table", found.table()

    def uncertainty() -> Lines:
        study = hp.study.SweepStudy.from_toml(
            BASE
            + SWEEP.replace("latin-hypercube", "sobol-indices")
            .replace("values = [0.0, 0.5]", 'distribution = "uniform"\nlow = 0.0\nhigh = 1.0')
            .replace("samples = 4", "samples = 64")
        )
        numbers = [study.point(k)["payload"] + math.sin(k) for k in range(len(study))]
        found = hp.study.uncertainty(study, {"y": np.array(numbers)}, "y", limit=0.8)
        yield "data", found.to_dict()
        yield "table", found.table()

    yield "sweep", sweep
    yield "compare", comparison
    yield "tune", tuning
    yield "torque map", torque_map
    yield "gait energy", energy
    yield "select", selection
    yield "uncertainty", uncertainty


def of_grid(found: Any, again: Any) -> Lines:
    """Yield the quantities of a grid of walks, and whether its file gives them back."""
    for one in fields(found):
        value = getattr(found, one.name)
        yield one.name, value
        yield f"read again: {one.name}", getattr(again, one.name)


def of_robot(robot: hp.Robot) -> Lines:
    """Yield what was recognised of a robot."""
    yield "digest", robot.digest
    yield "posture", np.array(robot.posture)
    yield "legs", [[leg.name, *map(str, leg.joints)] for leg in robot.legs]
    yield "feet", [[foot.name, plain(foot.radius)] for foot in robot.feet]
    yield "joints", [robot.joint_names, robot.held, robot.turning]
    yield "limits", [robot.lower, robot.upper, robot.effort_limit, robot.velocity_limit]
    yield "said", [robot.total_mass, robot.provenance, robot.assumed, robot.inferred, robot.notes]
    yield "stand", robot.stand().q


def groups(robots: Path | None) -> Iterator[tuple[str, Callable[[], Lines]]]:
    """Yield the groups of lines with their names."""
    folder = Path(tempfile.mkdtemp(prefix="product-digests-"))
    for name, case in walks():
        yield f"walk {name}", lambda case=case: of_walk(case(), folder)
    for name, study in studies(folder):
        yield name, study
    for name in ("kharagpur", "athena"):
        yield f"robot {name}", lambda name=name: of_robot(hp.load_robot(name))
    for path in sorted(robots.glob("*.urdf")) if robots else ():
        yield f"robot {path.stem}", lambda path=path: of_robot(hp.load_robot(path, repair=True))


def _group(row: str) -> str:
    """Return what a line of the table belongs to: what was not run is not compared."""
    return row.partition("  ")[2].partition(":")[0]


def main(argv: list[str] | None = None) -> int:
    """Write the table, or compare with one."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", type=Path, help="write the table here")
    parser.add_argument("--check", type=Path, help="compare with this table")
    parser.add_argument("--only", default="", help="groups whose names contain this")
    parser.add_argument("--robots", type=Path, help="folder of URDF files besides the packaged")
    options = parser.parse_args(argv)
    found = dict[str, str]()
    for group, lines in groups(options.robots):
        if options.only not in group:
            continue
        begin = len(found)
        try:
            found |= {f"{group}: {name}": digest(value) for name, value in lines()}
        except hp.errors.HexapodError as error:
            found[f"{group}: refused"] = digest(str(error))
            print(f"{group}: refused: {str(error)[:200]}", file=sys.stderr)
        print(f"{group}: {len(found) - begin} lines", flush=True)
    rows = [f"{value}  {name}" for name, value in found.items()]
    if options.write:
        head = f"# {platform.machine()}, Python {platform.python_version()}, NumPy {np.__version__}"
        write_atomically(options.write, "\n".join([head, *rows]) + "\n")
    if options.check:
        known = options.check.read_text(encoding="utf-8").splitlines()[1:]
        known = [row for row in known if _group(row) in {_group(own) for own in rows}]
        changed = sorted(set(rows) ^ set(known), key=lambda row: row[18:])
        print(f"{len(set(rows) & set(known))} of {len(known)} digests unchanged")
        print("\n".join(changed))
        return int(bool(changed))
    return 0


if __name__ == "__main__":
    sys.exit(main())
