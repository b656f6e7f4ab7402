"""Ground, payload, pushes and lost legs of a walk, from short texts on the command line.

Every text stands for what a case file says in full; `--save-case` writes that.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from hexapod_pin.errors import ParameterError

if TYPE_CHECKING:
    from hexapod_pin.drive.servo import Servo
    from hexapod_pin.ground.terrain import AnyTerrain
    from hexapod_pin.robot.robot import Robot
    from hexapod_pin.scene.loads import Load

TERRAIN_HELP = (
    "flat; slope:DEGREES, rising ahead; stairs:RISE, three steps from 0.4 m ahead [m]; "
    "bumps:HEIGHT or bumps:HEIGHT:SEED [m]; a ground of an installed package, as "
    "NAME or NAME:KEY=NUMBER,...; or a TOML file with its numbers."
)

OWN_GROUNDS = ("flat", "slope", "stairs", "bumps")
"""Grounds that need no file or package."""

TREAD = 0.3
"""Depth of a step of `stairs` [m]."""

STEPS, FIRST_STEP = 3, 0.4
"""Steps of `stairs`, and the place of the first before the world's origin [m]."""

WAVELENGTH, FIELD = 0.3, 8.0
"""Distance between the hills of `bumps`, and the size of their field [m]."""

PUSH_TIME = 0.1
"""How long a push lasts [s]."""


def read_terrain_option(text: str | None) -> AnyTerrain | None:
    """Return the ground that a text describes; None without one.

    Raises:
        ParameterError: no such ground, or a number that it cannot have.
    """
    if text is None:
        return None
    from hexapod_pin.ground.terrain import Flat, HeightField, Slope, Stairs, read_terrain
    from hexapod_pin.plugins import TERRAINS, plugin_names
    from hexapod_pin.spec import read_toml
    from hexapod_pin.study.sweep.fields import suggestion
    from hexapod_pin.user_file import read_text, user_path

    kind, *given = text.split(":")
    if kind == "flat" and not given:
        return Flat()
    if kind == "slope" and len(given) == 1:
        return Slope(angle=math.radians(_number("--terrain", text, given[0])))
    if kind == "stairs" and len(given) == 1:
        rise = _number("--terrain", text, given[0])
        return Stairs(rise=rise, run=TREAD, count=STEPS, start=FIRST_STEP)
    if kind == "bumps" and len(given) in (1, 2):
        height, seed = _number("--terrain", text, given[0]), 1
        if len(given) == 2:
            if not given[1].isdigit():
                raise ParameterError("--terrain", text, "bumps:HEIGHT:SEED, the seed an integer")
            seed = int(given[1])
        return HeightField.random(
            seed, amplitude=height, wavelength=WAVELENGTH, size=FIELD, flat_radius=0.1
        )
    if kind in plugin_names(TERRAINS):
        return read_terrain({"kind": kind, **dict(_settings(text, ":".join(given)))})
    if ":" in text and not os.path.isfile(user_path(text)) or not Path(text).suffix:
        known = (*OWN_GROUNDS, *plugin_names(TERRAINS))
        hint = suggestion(kind, known) if kind not in known else ""
        raise ParameterError("--terrain", text, "one of: " + TERRAIN_HELP.rstrip("."), hint)
    data = read_toml(read_text(Path(text), "terrain file"))
    return read_terrain(data.get("terrain", data))


def _settings(text: str, given: str) -> Iterator[tuple[str, float]]:
    """Yield the settings of a ground of an installed package, "depth=0.02,radius=0.3".

    Raises:
        ParameterError: one is not of that form.
    """
    for part in filter(None, given.split(",")):
        name, equals, value = part.partition("=")
        if not (equals and name.strip().isidentifier()):
            raise ParameterError("--terrain", text, f"NAME:KEY=NUMBER,... instead of {part!r}")
        yield name.strip(), _number("--terrain", text, value)


def read_loads(
    robot: Robot, payload: str | None, push: str | None, lost_leg: str | None
) -> list[Load]:
    """Return the loads that texts describe.

    Args:
        robot: that carries them.
        payload: "1kg", "0.5@link": its mass [kg], and the link at whose origin it is fixed; without
            a link on the trunk.
        push: "20N@1s": a force to the left on the trunk [N], for 0.1 s from a time on [s].
        lost_leg: a leg or several, "rf" or "rf,lm@2s": their drives give no torque from a time on
            [s], or at all.

    Raises:
        ParameterError: a text is none of these.
    """
    from hexapod_pin.scene.loads import LostLeg, Payload, Push

    trunk = trunk_link(robot)
    found: list[Load] = []
    if payload is not None:
        mass, _, link = payload.partition("@")
        found.append(Payload(link or trunk, _number("--payload", payload, mass, "kg")))
    if push is not None:
        force, separator, start = push.partition("@")
        if not separator:
            raise ParameterError("--push", push, "FORCE@TIME, such as 20N@1s")
        size = _number("--push", push, force, "N")
        begin = _number("--push", push, start, "s")
        found.append(Push(trunk, force=(0.0, size, 0.0), start=begin, duration=PUSH_TIME))
    if lost_leg is not None:
        legs, _, start = lost_leg.partition("@")
        since = _number("--lost-leg", lost_leg, start or "0", "s")
        found += [LostLeg(leg.strip(), since) for leg in legs.split(",")]
    return found


@contextmanager
def loads_as_options() -> Iterator[None]:
    """Name the option in the refusal of a payload that a robot cannot carry.

    Raises:
        ParameterError: what was raised, of `--payload` instead of `Scene.loads[0].mass`.
    """
    try:
        yield
    except ParameterError as error:
        if not error.name.startswith("Scene.loads[") or not error.name.endswith(".mass"):
            raise
        raise ParameterError("--payload", error.value, error.allowed, error.hint) from None


def require_early(loads: Sequence[Load], end: float) -> None:
    """Refuse pushes and lost legs that begin when a run is over, at `end` [s].

    Raises:
        ParameterError: one does.
    """
    from hexapod_pin.scene.loads import LostLeg, Push

    late = [x for x in loads if isinstance(x, Push | LostLeg) and x.start >= end]
    if late:
        raise ParameterError(
            "--push, --lost-leg", late[0].start, f"before the run ends at {end:g} s",
            "Begin earlier, or give a longer --duration.",
        )  # fmt: skip


LONGEST_CYCLE = 200.0
"""Cycle that is given, above which milliseconds are suspected [s] (*assumed*): the slowest of
16 public robots takes 19 s. Walking one takes minutes."""

LONGEST_STEP = 0.1
"""Integration step above which milliseconds are suspected [s] (*assumed*): feet land in less."""


def require_seconds(
    cycle_time: float | None, step: float | None, duration: float | None, force: bool
) -> None:
    """Refuse a cycle time or step [s] that is none that robots walk with, unless it is forced.

    A step that is forced must still divide the cycle. A duration [s] must be above 0: at once no
    robot walks.

    Raises:
        ParameterError: one is above `LONGEST_CYCLE` or `LONGEST_STEP`, or the duration is 0.
    """
    if duration == 0.0:
        hint = "Left out, it is as long as a steady walk needs."
        raise ParameterError("--duration", duration, "above 0 s", hint)
    for option, value, most in (
        ("--cycle-time", cycle_time, LONGEST_CYCLE),
        ("--step", step, LONGEST_STEP),
    ):
        if value is not None and value > most and not force:
            hint = f"ms? {value:g} ms are {1e-3 * value:g} s. --force walks it all the same."
            raise ParameterError(option, value, f"at most {most:g} s", hint)


STIFFEST, LEAST_DAMPING = 1e4, 0.005
"""Stiffness over the one assumed for a robot from which, and damping over stiffness [s] below
which, a servo swings so fast that a walk takes minutes (*assumed*)."""


def chosen_servo(robot: Robot, kp: float | None, kd: float | None, force: bool) -> Servo:
    """Return the servos of a robot with the gains that are given.

    Raises:
        ParameterError: the stiffness is far beyond what the damping damps, and it is not forced.
    """
    from hexapod_pin.drive.servo import EFFORT_TIME, Servo, assumed_gains

    found = Servo.for_robot(robot, kp=kp, kd=kd)
    if kp is None or force:
        return found
    usual = assumed_gains(robot)
    most = STIFFEST * _least(usual.kp)
    damping = _least(usual.kd) if kd is None else kd
    if kp <= most or damping >= LEAST_DAMPING * kp:
        return found
    allowed = f"at most {most:.3g} N m/rad where kd is {damping:.3g} N m s/rad"
    hint = (
        f"Its time constant kd / kp is {damping / kp:.2g} s, so hardly damped it swings so fast "
        f"that a walk takes minutes: --kd {EFFORT_TIME * kp:.3g} damps it. --force walks it all "
        "the same."
    )
    raise ParameterError("--kp", kp, allowed, hint)


def _least(gain: float | dict[str, float]) -> float:
    return min(gain.values()) if isinstance(gain, dict) else gain


MUCH_SLOWER = 3.0
"""Median velocity limit over the least from which one joint is slow, not all (*assumed*)."""


def named_slowness(robot: Robot, slowness: str) -> str:
    """Return that slow joints stretch a cycle, with the name of the joint where one is slow alone.

    Args:
        robot: that walks.
        slowness: that its joints are slow, in a few words; empty where they are not.
    """
    names = [name for leg in robot.legs for name in leg.joints]
    limits = [float(robot.velocity_limit[robot.joint_index(name)]) for name in names]
    if not slowness or MUCH_SLOWER * min(limits) > (usual := median(limits)):
        return slowness
    name = names[limits.index(min(limits))]
    what = f"{name} is slow ({min(limits):.3g} rad/s, {usual:.3g} in others)"
    return slowness.replace("its joints are slow", what)


# Angles are degrees on the command line, radians in Python: one is easily given for the other.

ROUNDED = 5.5e-3
"""How far a multiple of 15 degrees, written in radians with two digits, may be off [rad]."""

SLOWEST_TURN = 1.0
"""Yaw rate below which radians are suspected [degrees/s] (*assumed*): robots turn by 5 to 60."""

STEEPEST_IN_RADIANS = 0.8
"""Slope below which radians are suspected, 46 degrees [rad]."""


def _in_degrees(what: str, value: float, unit: str) -> str:
    return f"{what} {value:g} {unit} ({math.degrees(value):.3g} if radians are meant)"


def heading_doubt(heading: float) -> str:
    """Return that a heading [degrees] may be meant in radians, in a few words; mostly nothing.

    A multiple of 15 degrees in radians, with two digits, or a part of a degree is suspected.
    """
    part = math.pi / 12.0
    near = abs(heading - part * round(heading / part)) <= ROUNDED
    small = abs(heading) < 1.0 or (near and abs(heading) <= 2.0 * math.pi + ROUNDED)
    return _in_degrees("heading", heading, "degrees") if heading and small else ""


def posture_doubt(posture: str | None) -> str:
    """Return that the angles of --posture [degrees] may be meant in radians; mostly nothing.

    None of them is above pi, one at least is no whole number.
    """
    angles = [part.partition("=")[2] for part in (posture or "").split(",") if "=" in part]
    try:
        sizes = [abs(float(text)) for text in angles]
    except ValueError:
        return ""
    largest = max(sizes, default=0.0)
    if largest > math.pi + ROUNDED or all(size.is_integer() for size in sizes):
        return ""
    return _in_degrees("posture of", largest, "degrees")


def turn_doubt(turn_rate: float) -> str:
    """Return that a yaw rate [degrees/s] may be meant in radians/s; mostly nothing."""
    slow = 0.0 < abs(turn_rate) < SLOWEST_TURN
    return _in_degrees("turn rate", turn_rate, "degrees/s") if slow else ""


def slope_doubt(terrain: str | None) -> str:
    """Return that the angle of `slope:DEGREES` may be meant in radians; mostly nothing."""
    kind, _, angle = (terrain or "").partition(":")
    if kind != "slope":
        return ""
    value = _number("--terrain", terrain or "", angle)
    slight = 0.0 < abs(value) < STEEPEST_IN_RADIANS
    return _in_degrees("slope", value, "degrees") if slight else ""


LEAST_PLAY = 0.06
"""Backlash below which radians are suspected [degrees] (*assumed*): servos have 0.1 to 3."""


def backlash_doubt(backlash: str | None) -> str:
    """Return that a backlash [degrees] may be meant in radians; mostly nothing."""
    part = (backlash or "").partition(",")[0]
    value = _number("--backlash", backlash or "", part.rpartition("=")[2] or part) if part else 0.0
    return _in_degrees("backlash", value, "degrees") if 0.0 < value < LEAST_PLAY else ""


def trunk_link(robot: Robot) -> str:
    """Return the link that floats: the one that no joint moves."""
    from hexapod_pin.robot.description.urdf_file import parse_urdf

    return parse_urdf(robot.urdf.encode(), robot.source).roots[0]


def _number(option: str, text: str, part: str, unit: str = "") -> float:
    """Return a number, with its unit or without.

    Raises:
        ParameterError: it is none.
    """
    try:
        return float(part.strip().removesuffix(unit))
    except ValueError:
        raise ParameterError(option, text, f"with a number instead of {part!r}") from None
