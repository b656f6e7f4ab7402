"""Learning: gymnasium environments in which a robot walks as it is commanded.

Importing this package registers "hexapod_pin/Walk-v0" where gymnasium is installed.
"""

from contextlib import suppress

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

with suppress(ImportError):
    import gymnasium

    gymnasium.register(
        "hexapod_pin/Walk-v0",
        entry_point="hexapod_pin.rl:WalkEnv",
        vector_entry_point="hexapod_pin.rl:WalkVectorEnv",
    )
