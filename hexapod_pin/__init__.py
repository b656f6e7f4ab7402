"""Walk a hexapod's URDF on compliant feet; torque of every joint, and how far to trust it.

Names are imported when they are first used, so that `import hexapod_pin` stays quick.

Example:
    >>> import hexapod_pin as hp
    >>> robot = hp.load_robot("kharagpur")
    >>> gait = hp.Gait.tetrapod(stroke=0.14, cycle_time=2.4)
    >>> trace = hp.simulate(hp.Scene(robot), hp.KinematicControl(gait), duration=10.0)
    >>> print(hp.torque_budget(trace).table())
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hexapod_pin import errors as errors
    from hexapod_pin import playback as playback
    from hexapod_pin.actuator import Servo as Servo
    from hexapod_pin.bench.advice import Advice as Advice
    from hexapod_pin.bench.advice import advise as advise
    from hexapod_pin.budget import TorqueBudget as TorqueBudget
    from hexapod_pin.budget import torque_budget as torque_budget
    from hexapod_pin.checkpoint import Checkpoint as Checkpoint
    from hexapod_pin.contact import AdamsCoulomb as AdamsCoulomb
    from hexapod_pin.contact import AdamsImpact as AdamsImpact
    from hexapod_pin.contact import BrownMcPhee as BrownMcPhee
    from hexapod_pin.contact import Contact as Contact
    from hexapod_pin.contact import HuntCrossley as HuntCrossley
    from hexapod_pin.contact import KelvinVoigt as KelvinVoigt
    from hexapod_pin.contact import Restitution as Restitution
    from hexapod_pin.contact import SmoothStep as SmoothStep
    from hexapod_pin.contact import StickSlip as StickSlip
    from hexapod_pin.contact import TanhCoulomb as TanhCoulomb
    from hexapod_pin.control.held import Held as Held
    from hexapod_pin.control.hold import Hold as Hold
    from hexapod_pin.control.kinematic import KinematicControl as KinematicControl
    from hexapod_pin.description.blueprint import Blueprint as Blueprint
    from hexapod_pin.gait import Gait as Gait
    from hexapod_pin.robot import Robot as Robot
    from hexapod_pin.robot import load_robot as load_robot
    from hexapod_pin.robot import urdf_path as urdf_path
    from hexapod_pin.scene import Scene as Scene
    from hexapod_pin.simulation import Case as Case
    from hexapod_pin.simulation import simulate as simulate
    from hexapod_pin.simulation import simulate_batch as simulate_batch
    from hexapod_pin.state import State as State
    from hexapod_pin.stops import JointStops as JointStops
    from hexapod_pin.terrain import Flat as Flat
    from hexapod_pin.terrain import Groove as Groove
    from hexapod_pin.terrain import HeightField as HeightField
    from hexapod_pin.terrain import Ledge as Ledge
    from hexapod_pin.terrain import Patch as Patch
    from hexapod_pin.terrain import Patched as Patched
    from hexapod_pin.terrain import Shaken as Shaken
    from hexapod_pin.terrain import Slope as Slope
    from hexapod_pin.terrain import Stairs as Stairs
    from hexapod_pin.trace import Trace as Trace
    from hexapod_pin.trace import load_trace as load_trace

    __version__: str

_MODULES = {
    "AdamsCoulomb": "contact",
    "AdamsImpact": "contact",
    "Advice": "bench.advice",
    "Blueprint": "description.blueprint",
    "BrownMcPhee": "contact",
    "Case": "simulation",
    "Checkpoint": "checkpoint",
    "Contact": "contact",
    "Flat": "terrain",
    "Gait": "gait",
    "Groove": "terrain",
    "HeightField": "terrain",
    "Held": "control.held",
    "Hold": "control.hold",
    "HuntCrossley": "contact",
    "JointStops": "stops",
    "KelvinVoigt": "contact",
    "KinematicControl": "control.kinematic",
    "Ledge": "terrain",
    "Patch": "terrain",
    "Patched": "terrain",
    "Restitution": "contact",
    "Robot": "robot",
    "Scene": "scene",
    "Servo": "actuator",
    "Shaken": "terrain",
    "Slope": "terrain",
    "SmoothStep": "contact",
    "Stairs": "terrain",
    "State": "state",
    "StickSlip": "contact",
    "TanhCoulomb": "contact",
    "TorqueBudget": "budget",
    "Trace": "trace",
    "advise": "bench.advice",
    "load_robot": "robot",
    "load_trace": "trace",
    "simulate": "simulation",
    "simulate_batch": "simulation",
    "torque_budget": "budget",
    "urdf_path": "robot",
}

__all__ = ["__version__", "errors", "playback", *_MODULES]  # noqa: PLE0604


if not TYPE_CHECKING:  # with it, a type checker would take any name for granted

    def __getattr__(name: str) -> Any:
        """Import a public name on first use (PEP 562)."""
        if name == "__version__":
            from importlib.metadata import version

            value: Any = version("hexapod-pin")
        elif name in ("errors", "playback"):
            value = import_module(f"hexapod_pin.{name}")
        elif name in _MODULES:
            value = getattr(import_module(f"hexapod_pin.{_MODULES[name]}"), name)
        else:
            raise AttributeError(f"module 'hexapod_pin' has no attribute {name!r}")
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)
