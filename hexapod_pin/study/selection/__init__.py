"""Which motors carry a robot: walks with each motor's mass, inertia and torque-speed line."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
