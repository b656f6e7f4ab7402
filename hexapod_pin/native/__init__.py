"""The C++17 inner loop: plant, contact, integrators, rollouts; compiled into `_core`.

One header per concept: `control/`, `kinematics/`, `laws/`, `plant/`, `methods/`, `robust/`,
`fused/`, `run/`; `bindings/` is the border.
"""

from hexapod_pin.native._core import Batch as Batch
from hexapod_pin.native._core import Checkpoint as Checkpoint
from hexapod_pin.native._core import DriveLaw as DriveLaw
from hexapod_pin.native._core import DriveMode as DriveMode
from hexapod_pin.native._core import FootControlLaw as FootControlLaw
from hexapod_pin.native._core import FootControlSettings as FootControlSettings
from hexapod_pin.native._core import ForceSource as ForceSource
from hexapod_pin.native._core import FrictionKind as FrictionKind
from hexapod_pin.native._core import FrictionLaw as FrictionLaw
from hexapod_pin.native._core import FrictionMode as FrictionMode
from hexapod_pin.native._core import GearFriction as GearFriction
from hexapod_pin.native._core import LeastTorque as LeastTorque
from hexapod_pin.native._core import LegChain as LegChain
from hexapod_pin.native._core import LegSearch as LegSearch
from hexapod_pin.native._core import LegsInverse as LegsInverse
from hexapod_pin.native._core import LimitMode as LimitMode
from hexapod_pin.native._core import NormalKind as NormalKind
from hexapod_pin.native._core import NormalLaw as NormalLaw
from hexapod_pin.native._core import PlantSettings as PlantSettings
from hexapod_pin.native._core import Rollout as Rollout
from hexapod_pin.native._core import RunSummary as RunSummary
from hexapod_pin.native._core import SlipGains as SlipGains
from hexapod_pin.native._core import SlipSignal as SlipSignal
from hexapod_pin.native._core import StopMode as StopMode
from hexapod_pin.native._core import SuspensionGains as SuspensionGains
from hexapod_pin.native._core import Terrain as Terrain
from hexapod_pin.native._core import TouchDownSettings as TouchDownSettings
from hexapod_pin.native._core import TreeModel as TreeModel
from hexapod_pin.native._core import WalkTable as WalkTable
from hexapod_pin.native._core import advance_together as advance_together
from hexapod_pin.native._core import checkpoint as checkpoint
from hexapod_pin.native._core import command_together as command_together
from hexapod_pin.native._core import drive_law as drive_law
from hexapod_pin.native._core import evaluate as evaluate
from hexapod_pin.native._core import first_outside as first_outside
from hexapod_pin.native._core import force_targets as force_targets
from hexapod_pin.native._core import height_field as height_field
from hexapod_pin.native._core import plane as plane
from hexapod_pin.native._core import plant_settings as plant_settings
from hexapod_pin.native._core import profile as profile
from hexapod_pin.native._core import read_together as read_together
from hexapod_pin.native._core import repeat_compute as repeat_compute
from hexapod_pin.native._core import repeat_dynamics as repeat_dynamics
from hexapod_pin.native._core import set_points_at as set_points_at
from hexapod_pin.native._core import start as start
from hexapod_pin.native._core import tree_model as tree_model
from hexapod_pin.native._core import with_patches as with_patches
from hexapod_pin.native._core import with_shaking as with_shaking
