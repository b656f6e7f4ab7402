"""Walk a hexapod's URDF on compliant feet; torque of every joint, and how far to trust it.

Names are imported when they are first used, so that `import hexapod_pin` stays quick. They are
listed in `__init__.pyi` alone.

Example:
    >>> import hexapod_pin as hp
    >>> robot = hp.load_robot("kharagpur")
    >>> gait = hp.Gait.tetrapod(stroke=0.14, cycle_time=2.4)
    >>> trace = hp.simulate(hp.Scene(robot), hp.KinematicControl(gait), duration=10.0)
    >>> print(hp.torque_budget(trace).table())
"""

from __future__ import annotations

import lazy_loader

from hexapod_pin.shown import draw_with

_load, _names, __all__ = lazy_loader.attach_stub(__name__, __file__)
__all__ += ["__version__"]  # noqa: PLE0605


draw_with(lambda: _load("view"))


def __getattr__(name: str) -> object:
    """Import a public name on first use (PEP 562)."""
    if name != "__version__":
        if name in _names() or name.startswith("_"):
            return _load(name)
        raise _UnknownName(name=name)
    from importlib.metadata import version

    globals()[name] = version("hexapod-pin")
    return globals()[name]


_NAMESPACES = (
    "contact", "drive", "terrain", "loads", "motion", "sensors", "foot_control", "feedback",
    "results", "sizing", "simulation", "study", "robot", "interchange", "errors", "view",
)  # fmt: skip
"""In which a name is looked for, those that are imported quickly first; `rl` may not be there."""


class _UnknownName(AttributeError):
    """Says where the name is. Modules are asked for it when it is printed: most are never."""

    def __str__(self) -> str:
        return f"hexapod_pin has no {self.name!r}{_elsewhere(str(self.name))}"


def _elsewhere(name: str) -> str:
    """Return where a name is, or which one is spelt nearly so; empty where neither is known."""
    from difflib import get_close_matches

    for near in get_close_matches(name, _names(), 1, 0.8):
        return f"; did you mean hp.{near}?"
    for place in _NAMESPACES:
        module = str(getattr(getattr(_load(place), name, None), "__module__", ""))
        if module.startswith("hexapod_pin."):
            return f"; it is hp.{place}.{name}"
    return ""


def __dir__() -> list[str]:
    """List the public names."""
    return [*_names(), "__version__"]
