"""Interchange: runs and gaits as files of other programs, and for the servos of a robot."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
