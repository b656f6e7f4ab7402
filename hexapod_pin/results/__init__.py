"""Results: traces, checkpoints, torque budgets; pure data and what is read from it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
