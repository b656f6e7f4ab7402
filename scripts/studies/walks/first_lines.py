"""Situations that a user meets: does the first line name the true cause?"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from hexapod_pin.robot.robot_source import urdf_path
from hexapod_pin.text_table import Table
from studies.study import StudyReport, verdict

LEAST = 62
"""Of 65 first lines that must name the cause."""

Change = Callable[[str], str]


@dataclass(frozen=True)
class Situation:
    """A robot, options of `walk`, and what the first line must say.

    Attributes:
        what: the situation, in words.
        named: pattern of the first line.
        status: of the command's exit: 0 walks, 2 refused, 3 does not walk, or not to be trusted.
        options: of `walk`.
        change: of the text of kharagpur's URDF.
        file: of a public robot, instead; in the folder that the study is given.
    """

    what: str
    named: str
    status: int
    options: str = ""
    change: Change | None = None
    file: str = ""


def times(part: str, attribute: str, factor: float) -> Change:
    """Multiply the numbers of an attribute of all elements of a name."""

    def scaled(found: re.Match[str]) -> str:
        numbers = " ".join(f"{factor * float(text)!r}" for text in found[2].split())
        return f'{found[1]}"{numbers}"'

    def change(text: str) -> str:
        return re.sub(rf'(<{part}\b[^>]*?\b{attribute}=)"([^"]*)"', scaled, text)

    return change


def each(*changes: Change) -> Change:
    """Make several changes, one after the other."""

    def change(text: str) -> str:
        for one in changes:
            text = one(text)
        return text

    return change


def put(pattern: str, new: str) -> Change:
    """Replace a pattern."""
    return lambda text: re.sub(pattern, new, text, flags=re.DOTALL)


MOMENTS = [f"i{pair}" for pair in ("xx", "xy", "xz", "yy", "yz", "zz")]
TRIPOD = "--gait tripod --cycle-time 0.8 --stroke 0.05"


def inertias(factor: float) -> Change:
    """Multiply all inertias."""
    return each(*(times("inertia", name, factor) for name in MOMENTS))


PACKAGED = [
    Situation("a sound robot", r"kharagpur walks .*nothing at a limit", 0),
    Situation("inertias in g m^2", r"NOT to be trusted: inertias look like g m\^2", 3,
              change=inertias(1e3)),
    Situation("inertias in kg mm^2", r"NOT to be trusted: inertias look like kg mm\^2", 3,
              change=inertias(1e6)),
    Situation("masses in g", "masses look like g", 3,
              change=each(times("mass", "value", 1e3), inertias(1e3))),
    Situation("lengths of joints in mm", "lengths look like mm", 3,
              change=each(times("origin", "xyz", 1e3), times("sphere", "radius", 1e3))),
    Situation("13.6 kg for 3.1 kg", "NOT to be trusted: mass 13.6 kg", 3,
              change=times("mass", "value", 4.4)),
    Situation("0.12 kg for 3.1 kg", "NOT to be trusted: mass 0.12", 3,
              change=times("mass", "value", 0.04)),
    Situation("no inertial anywhere", "refused: no inertial", 2,
              change=put(r"<inertial>.*?</inertial>", "")),
    Situation("velocity limits of 0", r"refused: zero velocity \(18\)", 2,
              change=put('velocity="[^"]*"', 'velocity="0"')),
    Situation("efforts of 0.3 N m", "too weak to stand", 3,
              change=put('effort="[^"]*"', 'effort="0.3"')),
    Situation("efforts of 0.7 N m", r"walks .*femur_joint at its torque limit \d+ %", 0,
              change=put('effort="[^"]*"', 'effort="0.7"')),
    Situation("coxae that turn by 0.25 rad", r"stroke \d+.* of 140 mm \(\w+coxa_joint is at its",
              0, change=put(r'lower="-1.0471975511965976" upper="1.0471975511965976"',
                            'lower="-0.25" upper="0.25"')),
    Situation("endless joints", "refused: continuous joint", 2,
              change=put('type="revolute"', 'type="continuous"')),
    Situation("a stair of 3 cm, lift 2 cm", "the ground is (29|30) mm high, its lift 20 mm", 3,
              "--terrain stairs:0.03 --duration 10"),
    Situation("a slope of 40 degrees", "40 degrees are too steep for friction of 0.7", 3,
              "--terrain slope:40 --duration 4 --gait tripod --cycle-time 1"),
    Situation("slippery ground uphill", "too steep for friction of 0.1", 3,
              "--mu 0.1 --terrain slope:8 --duration 4 --gait tripod --cycle-time 1"),
    Situation("a payload of 25 kg", "too weak to stand|torque limit", 3,
              "--payload 25kg --duration 5 --gait tripod"),
    Situation("a motor that is too weak", r"AX-12A at 12 V FAILS \(femur", 3, "--motor AX-12A"),
    Situation("a leg without torque", "leg rf has no drive torque", 3,
              f"{TRIPOD} --lost-leg rf --duration 5"),
    Situation("a push of 500 N", "a push of 500 N", 3, f"{TRIPOD} --push 500N@1s --duration 4"),
    Situation("servos that are too soft", "rad from its set-point|trunk lies", 3,
              f"{TRIPOD} --kp 3 --kd 0.1 --duration 4"),
    Situation("a stroke that is too long", "--stroke can be at most", 2, "--stroke 0.5"),
    Situation("a cycle that is too short", "--cycle-time must be at least", 2, "--cycle-time 0.2"),
    Situation("half a second", "so far: kharagpur", 0, "--duration 0.5"),
]  # fmt: skip
"""Twenty-four on the packaged robot: its file with the faults of public ones, and options."""

FURTHER = [
    Situation("lengths in inches", "lengths look like inches", 3,
              change=each(times("origin", "xyz", 1 / 0.0254), times("sphere", "radius", 1 / 0.0254),
                          times("box", "size", 1 / 0.0254))),
    Situation("3 kg on a tibia", r"lf_tibia: mass 3 kg, 0\.11 kg in other legs", 3,
              change=put(r'(<link name="lf_tibia">.*?<mass value=)"[^"]*"', r'\1"3"')),
    Situation("a tibia's axis reversed", "rf_tibia_joint: axis reversed", 2,
              change=put(r'(<joint name="rf_tibia_joint".*?<axis xyz=)"0 1 0"', r'\1"0 -1 0"')),
    Situation("a femur without effort", "rm_femur_joint: effort 0 N m, 6 in other legs", 3,
              change=put(r'(<joint name="rm_femur_joint".*?effort=)"6"', r'\1"0"')),
    Situation("damping 100 times too large", "damping 2 N m s/rad takes 12 N m", 3,
              change=put('damping="[^"]*"', 'damping="2"')),
    Situation("friction of 20 N m", "friction 20 N m, standing", 3,
              change=put('friction="[^"]*"', 'friction="20"')),
    Situation("a leg on the wrong side", "rf_coxa_joint: its leg points into the trunk", 3,
              change=put(r'(<joint name="rf_coxa_joint".*?rpy="0 0 )-1.57', r'\g<1>1.57')),
    Situation("a heading in radians", r"heading 1\.57 degrees \(90 if radians", 0,
              "--heading 1.57 --quick"),
    Situation("friction in percent", r"friction of 70 \(0\.7 if percent", 0, "--mu 70 --quick"),
    Situation("crab walk, a leg lost", "does not walk: leg rf has no drive torque", 3,
              "--heading 90 --lost-leg rf --quick"),
    Situation("bumps above the lift", r"walks .*ground \d+ mm high, lift 20 mm", 0,
              "--terrain bumps:0.06 --duration 10 --quick"),
    Situation("3 kg outside the feet", r"centre of mass up to \d+ mm outside its feet", 0,
              "--payload 3kg@lf_tibia --quick"),
    Situation("two legs lost", "legs rf and lf have no drive torque", 3,
              "--lost-leg rf,lf --quick"),
    Situation("a tibia 16 mm longer", r"rf_tibia: ends 0\.115 m from its joint, 0\.0988 m in", 2,
              change=put(r'(<joint name="rf_foot_joint".*?xyz=)"0.09879 0 0"', r'\1"0.115 0 0"')),
    Situation("no foot on a leg", "lm_tibia: ends at its joint, 0.0988 m in other legs", 2,
              change=put(r'(<joint name="lm_foot_joint".*?xyz=)"0.09879 0 0"', r'\1"0 0 0"')),
    Situation("a leg turned to the rear", "rr_coxa_joint: its leg points elsewhere", 3,
              change=put(r'(<joint name="rr_coxa_joint".*?rpy="0 0 )-1.57\d*', r"\g<1>3.1415927")),
    Situation("a digit lost in a hip", "rf_coxa_joint: starts where no leg mirrors it", 3,
              change=put(r'(<joint name="rf_coxa_joint".*?xyz=)"0.2 ', r'\1"0.02 ')),
    Situation("legs of 1 g a link", r"legs weigh 0\.018 kg, 0\.06 kg is least with 12 motors", 3,
              change=put(r'<mass value="0\.[^"]*"', '<mass value="0.001"')),
    Situation("damping of one knee", r"lm_tibia_joint: damping 0\.2 N m s/rad, 0 in other", 3,
              change=put(r'(<joint name="lm_tibia_joint".*?damping=)"0"', r'\1"0.2"')),
    Situation("front legs exchanged in name", "walks .*legs rf, lf stand on the other side", 0,
              change=each(put(r'"lf_', '"xf_'), put(r'"rf_', '"lf_'), put(r'"xf_', '"rf_'))),
    Situation("efforts in N mm", r"no motor's \(6000 N m, 6 if N mm are meant\)", 0,
              "--quick", change=put('effort="6"', 'effort="6000"')),
    Situation("velocities in degrees/s", r"no motor's \(344 rad/s, 6 if degrees/s are meant\)", 0,
              "--quick", change=put('velocity="6"', 'velocity="344"')),
    Situation("servos without damping", r"servos hardly damped \(kd 0 for kp 240\)", 0,
              "--kp 240 --kd 0 --quick"),
    Situation("a cycle in ms", "ms\\? 2400 ms are 2.4 s", 2, "--cycle-time 2400"),
    Situation("a height in mm", "mm\\? 150 mm are 0.15 m", 2, "--height 150"),
]  # fmt: skip
"""Twenty-five more, tried later: what is wrong with one leg, one unit or one option alone."""

PUBLIC = [
    Situation("no inertial", "refused: no inertial", 2, file="akrobat"),
    Situation("velocities of 0", "refused: zero velocity", 2, file="arrg"),
    Situation("sound", "crab walks", 0, file="crab_pyrobolearn"),
    Situation("foot springs", "elkapod walks", 0, file="elkapod"),
    Situation("narrow coxae", r"walks .*stroke \d+.* of 111 mm \(\w+ is at its limit", 0,
              file="enjoykin"),
    Situation("masses of 1e-5 kg", "NOT to be trusted: absurd mass", 3, file="golem"),
    Situation("sound", "walks", 0, file="grasp"),
    Situation("joint limits end the stroke", r"walks .*stroke \d+.* of 65.3 mm \(\w+", 0,
              file="harika"),
    Situation("tibiae meet", r"walks .*stroke 80 of 112 mm \(\w+ meets \w+", 0, file="hexapod_34"),
    Situation("velocities of 0", "refused: zero velocity", 2, file="huaibovip"),
    Situation("six inertias that change no torque by 10 %", "hexapod walks", 0, file="kraby"),
    Situation("impossible inertias", "refused: impossible inertia", 2, file="phantomx"),
    Situation("0.31 g in all", "NOT to be trusted: absurd mass", 3, file="phantomx_ochs"),
    Situation("0.26 g in all", "NOT to be trusted: absurd mass", 3, file="razbot"),
    Situation("wheel-legs", "refused: continuous joint", 2, file="rhex_ros2"),
    Situation("79 kg", "walks", 0, file="worms"),
]  # fmt: skip
"""Sixteen public robots as they were downloaded."""


def first_lines(folder: Path = Path("urdfs"), most: int = 0, threads: int = 1) -> StudyReport:
    """Walk robots by the command line; the public ones are files of a folder.

    Args:
        folder: of the public robots' files, which are not part of this repository.
        most: situations to try; 0: all. The first 49 need no folder.
        threads: situations at a time.
    """
    rows, good = [], 0
    tried = [*PACKAGED, *FURTHER, *PUBLIC][: most or None]
    with ThreadPoolExecutor(threads) as pool:
        answers = pool.map(lambda situation: said(situation, folder), tried)
        for situation, (line, status) in zip(tried, answers, strict=True):
            right = bool(re.search(situation.named, line)) and status == situation.status
            good += right
            where = situation.file or "kharagpur"
            shown = line if len(line) <= WIDEST else line[: WIDEST - 3] + "..."
            rows.append([situation.what, where, shown, verdict(right)])
            print(f"{verdict(right)} {status} {situation.what}: {line}", file=sys.stderr)
    count = f"{good} of {len(rows)} first lines name the cause; at least {LEAST} must."
    how = (
        "Each is the first paragraph of `hexapod-pin walk FILE OPTIONS`, on stdout, or on stderr "
        "where a file or a walk is refused; the exit status is judged, too (0 walks, 2 refused, 3 "
        "does not walk or is not to be trusted). Sources: [robots' sources](robot_sources.md)."
    )
    table = Table("", ("situation", "robot", "first line", ""), rows)
    return StudyReport(
        title="First lines", parts=[count, how, table], met=good >= min(LEAST, len(rows))
    )


WIDEST = 160
"""Characters of a first line in the page."""


def said(situation: Situation, folder: Path) -> tuple[str, int]:
    """Return the first paragraph that the command prints, in one line, and its exit status."""
    with tempfile.TemporaryDirectory() as place:
        return _said(situation, folder, Path(place))


def _said(situation: Situation, folder: Path, place: Path) -> tuple[str, int]:
    path = urdf_path("kharagpur")
    if situation.file:
        path = folder / f"{situation.file}.urdf"
    elif situation.change is not None:
        text = path.read_text(encoding="utf-8")
        changed = situation.change(text)
        if changed == text:
            raise ValueError(f"{situation.what}: nothing was changed")
        path = place / "kharagpur.urdf"
        path.write_text(changed, encoding="utf-8")
    command = [
        sys.executable, "-m", "hexapod_pin", "walk", str(path.absolute()), "--no-html",
        "--out", str(place / "walk.nc"), *situation.options.split(),
    ]  # fmt: skip
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=1800, cwd=place, check=False
    )
    lines = done.stdout.splitlines() or done.stderr.splitlines() or [""]
    end = next((k for k, line in enumerate(lines) if line.startswith(ENDS)), len(lines))
    line = " ".join(lines[: max(1, min(end, MOST_LINES))])
    for parent in (place, folder.absolute()):
        line = line.replace(f"{parent}/", "")
    return line.removeprefix("hexapod-pin: "), done.returncode


ENDS = (" ", "it walks", "it does not", "need over", "No cycle")
"""How the line after the first paragraph begins."""

MOST_LINES = 2
"""Lines of a first paragraph."""
