"""Arguments that do not exist, and what was probably meant by them.

Users of other simulators bring their words along: `dt`, `stride`, `mu`. A call with one of these
ends in an error that names the argument of this package.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from difflib import get_close_matches

from hexapod_pin.errors import ArgumentError

SAME = {
    "step": ("dt", "timestep", "time_step", "step_size"),
    "stroke": ("stride", "step_length", "stride_length"),
    "lift": ("step_height", "swing_height", "clearance"),
    "cycle_time": ("period", "gait_period", "cycle"),
    "duty": ("duty_factor", "duty_cycle", "beta"),
    "turn_rate": ("yaw_rate", "omega", "turn"),
    "heading": ("direction", "yaw"),
    "accuracy": ("tol", "tolerance", "rtol", "atol", "precision"),
    "method": ("solver", "integrator"),
    "duration": ("time", "t_end", "tmax", "t_max", "seconds", "sim_time"),
    "sample": ("sampling", "sample_time", "sampling_time", "output_step"),
    "terrain": ("ground", "floor", "heightfield"),
    "servo": ("servos", "drive", "pd"),
    "loads": ("load", "payloads"),
    "progress": ("callback", "progress_bar"),
    "rotor_inertia": ("armature",),
    "stall_torque": ("max_torque", "effort"),
    "no_load_speed": ("max_speed", "max_velocity"),
}
"""By an argument of this package: what it is called elsewhere."""

ELSEWHERE = {
    "mu": "contact=hp.Contact.accurate().with_mu(0.5)",
    "friction": "contact=hp.Contact.accurate().with_mu(0.5)",
    "payload": "loads=[hp.Payload('base_link', mass)]",
    "push": "loads=[hp.loads.Push(...)]",
    "kp": "servo=hp.Servo.for_robot(robot, kp=240.0, kd=4.8)",
    "kd": "servo=hp.Servo.for_robot(robot, kp=240.0, kd=4.8)",
    "motor": "servo=hp.Servo(motor=...)",
    "gait": "controller=hp.KinematicControl(gait)",
    "speed": "stroke and cycle_time: the speed is stroke / (duty * cycle_time)",
    "velocity": "stroke and cycle_time: the speed is stroke / (duty * cycle_time)",
}
"""What stands elsewhere, or is made of several arguments, as the text to write."""


def unknown_argument(call: str, name: str, known: Sequence[str]) -> ArgumentError:
    """Return the error of a call with an argument that does not exist.

    Args:
        call: what was called.
        name: of the argument.
        known: names of the arguments that exist.
    """
    text = f"{call} has no argument {name!r}"
    if (meant := meant_by(name, known)) is not None:
        text += f": {meant} was probably meant"
    return ArgumentError(call, name, f"{text}. It takes {', '.join(known) or 'none'}.")


def meant_by(name: str, known: Sequence[str]) -> str | None:
    """Return which argument a name stands for, as text to write; None where nothing is like it."""
    for own, others in SAME.items():
        if own in known and name.lower() in others:
            return repr(own)
    close = get_close_matches(name, known, n=1, cutoff=0.7)
    if close:
        return repr(close[0])
    written = ELSEWHERE.get(name)
    return written if written is not None and _fits(written, known) else None


MADE_BY = {
    "contact": ("hp.Contact.preset({!r})", ("accurate", "s1", "s1-printed", "s2", "soil")),
    "gait": ("hp.Gait.{}()", ("tripod", "ripple", "tetrapod", "wave")),
    "robot": ("hp.load_robot({!r})", ()),
}
"""What a word of the command line stands for, by the argument that it was given for."""


OWN_LAW = "A law of your own is compiled into the core: docs/extending.md has the steps."


def made_by(name: str, value: object) -> str:
    """Return how to make what was meant by a word, or is no law, as a hint; else an empty text."""
    if name in ("normal", "friction") and (callable(value) or hasattr(value, "native")):
        own = not str(getattr(value, "__module__", "")).startswith("hexapod_pin.")
        return OWN_LAW if own else ""
    if not isinstance(value, str) or name not in MADE_BY:
        return ""
    text, words = MADE_BY[name]
    return f"{text.format(value)} makes one." if not words or value in words else ""


def _fits(written: str, known: Sequence[str]) -> bool:
    """Tell whether a call takes the argument that a text begins with."""
    return written.partition("=")[0].partition(" ")[0] in known


NAMESPACES = (
    "contact", "drive", "terrain", "loads", "motion", "sensors", "foot_control", "feedback",
    "results", "sizing", "simulation", "study", "robot", "interchange", "errors", "view",
)  # fmt: skip
"""In which a name is looked for, those that are imported quickly first; `rl` may not be there."""


class UnknownName(AttributeError):
    """A name that `hexapod_pin` does not have; it says which one is meant, or where it is.

    It looks for it when it is printed: most are only asked for, and looking imports much.
    """

    def __init__(self, name: str, known: Sequence[str], load: Callable[[str], object]) -> None:
        """Store the name, those that there are, and what imports one of them."""
        super().__init__(name=name)
        self.known, self.load = tuple(known), load

    def __str__(self) -> str:
        """Return the message."""
        return f"hexapod_pin has no {self.name!r}{self._where()}"

    def _where(self) -> str:
        for near in get_close_matches(str(self.name), self.known, 1, 0.8):
            return f"; did you mean hp.{near}?"
        for place in NAMESPACES:
            found = getattr(self.load(place), str(self.name), None)
            if str(getattr(found, "__module__", "")).startswith("hexapod_pin."):
                return f"; it is hp.{place}.{self.name}"
        return ""
