"""The public names of this package: `__init__.py` imports each when it is first used."""

from .controller import FootControl as FootControl
from .controller import named_controls as named_controls
from .parameters import FootForceSensing as FootForceSensing
from .parameters import ForceTargets as ForceTargets
from .parameters import Levelling as Levelling
from .parameters import SlipPid as SlipPid
from .parameters import Sole as Sole
from .parameters import TouchDown as TouchDown
from .parameters import VirtualSuspension as VirtualSuspension
from .stability import spectral_radius as spectral_radius
from .stability import stable_range as stable_range
