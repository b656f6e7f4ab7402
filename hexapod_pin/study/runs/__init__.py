"""Durable sweeps: the cases of a study run on threads, processes or a cluster, and kept at once."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
