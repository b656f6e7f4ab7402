"""The public names of this package: `__init__.py` imports each when it is first used."""

from .environment import WalkEnv as WalkEnv
from .environment import WalkVectorEnv as WalkVectorEnv
from .task import RewardWeights as RewardWeights
from .task import WalkTask as WalkTask
