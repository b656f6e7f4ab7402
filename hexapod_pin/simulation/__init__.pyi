"""The public names of this package: `__init__.py` imports each when it is first used."""

from .amplification import Amplification as Amplification
from .amplification import amplification as amplification
from .batch import iterate_batch as iterate_batch
from .batch import simulate_batch as simulate_batch
from .case import Case as Case
from .case import load_case as load_case
from .case import simulate as simulate
from .methods import METHODS as METHODS
from .methods import Method as Method
from .run_settings import WorkLimits as WorkLimits
from .session import Session as Session
