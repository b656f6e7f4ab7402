"""One writer for a store: a lock that the system takes back however its owner dies."""

from __future__ import annotations

import fcntl
import os
import threading
from pathlib import Path

from hexapod_pin.errors import StoreLockedError, SweepStoreError

_own: set[str] = set()
_guard = threading.Lock()


class StoreLock:
    """Held by the one that writes to a store; readers need none.

    A lock of the file beside the store (`fcntl.lockf`): forked children do not inherit it, and the
    system releases it when the process ends.
    """

    def __init__(self, store: Path) -> None:
        """Take the lock.

        Raises:
            StoreLockedError: this or another process writes to the store.
            SweepStoreError: the folder is missing or cannot be written to.
        """
        self.path = store.with_name(store.name + "-lock")
        self.store = store
        with _guard:
            if str(self.path) in _own:
                raise _locked(store, "this process")
            self.file = self._take()
            _own.add(str(self.path))

    def _take(self) -> int:
        while True:
            try:
                file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
            except OSError as error:
                reason = error.strerror or str(error)
                raise SweepStoreError(
                    str(self.store), f"cannot be written in {self.store.parent} ({reason}); "
                    "name a file in a folder that exists and can be written to."
                ) from error  # fmt: skip
            try:
                fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                os.close(file)
                raise _locked(self.store, "another process") from error
            if self._is_still_there(file):
                os.ftruncate(file, 0)
                os.write(file, f"{os.getpid()}\n".encode())
                return file
            os.close(file)  # its owner removed it in between

    def _is_still_there(self, file: int) -> bool:
        try:
            return os.stat(self.path).st_ino == os.fstat(file).st_ino
        except OSError:
            return False

    def release(self) -> None:
        """Give the lock back."""
        with _guard:
            if str(self.path) in _own:
                _own.discard(str(self.path))
                self.path.unlink(missing_ok=True)
                os.close(self.file)


def _locked(store: Path, who: str) -> StoreLockedError:
    return StoreLockedError(
        str(store),
        f"{who} writes to it; wait until that sweep has ended, or name another store. It can be "
        "read meanwhile.",
    )
