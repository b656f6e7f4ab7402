"""A cache that holds a bounded amount of meshes, the least lately used going first."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import Generic, TypeVar

Value = TypeVar("Value")


class MeshCache(Generic[Value]):
    """Values by key, up to a number of bytes; safe between threads."""

    def __init__(self, max_bytes: int) -> None:
        """Hold at most so many bytes."""
        self.max_bytes = max_bytes
        self._held: OrderedDict[Hashable, tuple[Value, int]] = OrderedDict()
        self._bytes = 0
        self._lock = Lock()

    @property
    def bytes(self) -> int:
        """Bytes held now."""
        return self._bytes

    def get(self, key: Hashable, make: Callable[[], Value], size: Callable[[Value], int]) -> Value:
        """Return the value of a key, made where it is not held; an exception is not kept."""
        with self._lock:
            if key in self._held:
                self._held.move_to_end(key)
                return self._held[key][0]
        value = make()
        number = size(value)
        with self._lock:
            if key not in self._held and number <= self.max_bytes:
                self._held[key] = value, number
                self._bytes += number
            while self._bytes > self.max_bytes:
                self._bytes -= self._held.popitem(last=False)[1][1]
        return value
