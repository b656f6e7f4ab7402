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
        from hexapod_pin.meant import UnknownName

        raise UnknownName(name, _names(), _load)
    from importlib.metadata import version

    globals()[name] = version("hexapod-pin")
    return globals()[name]


def __dir__() -> list[str]:
    """List the public names."""
    return [*_names(), "__version__"]
