"""One writer for a store: a lock that the system takes back however its owner dies."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import stat
import threading
import weakref
from pathlib import Path

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.errors import StoreLockedError, SweepStoreError, TraceFileError
from hexapod_pin.stop_signals import unbroken
from hexapod_pin.study.runs.store_guard import is_same, refused
from hexapod_pin.user_file import kind_of

CONTENT = b"hexapod-pin: one sweep at a time writes to the store beside this file\n"
"""Content that distinguishes a lock from any other file of its name."""

FLAGS = os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC | os.O_NOCTTY

TRIES = 100
"""Attempts to make a lock whose owner removes it in the meantime."""

NO_LINKS = (errno.EPERM, errno.EOPNOTSUPP, errno.ENOSYS)
"""What a file system without hard links answers."""

_own: set[Path] = set()
_guard = threading.RLock()  # a lost lock may be given back while another is taken


class StoreLock:
    """Held by the one that writes to a store; readers need none.

    A lock of the file beside the store (`fcntl.lockf`): forked children do not inherit it, and the
    system releases it when the process ends. The file is made whole and is never written again. One
    of that name that is not such a file, a link included, is left alone. A lock that its owner
    loses, as where a signal comes right after it is taken, is given back at the latest when the
    process exits.
    """

    def __init__(self, store: Path) -> None:
        """Take the lock.

        Raises:
            StoreLockedError: this or another process writes to the store.
            StoreFullError: there is no room for a file.
            SweepStoreError: the folder is missing or cannot be written to, or something else has
                the name of the lock.
        """
        self.path = store.with_name(store.name + "-lock")
        self.store = store
        with unbroken(), _guard:
            try:
                self._key = Path(os.path.realpath(store.parent)) / store.name
            except (OSError, ValueError) as error:
                raise refused(store, error) from error
            if self._key in _own:  # a second descriptor, once closed, would end the lock
                raise self._locked("this process")
            file = self._take()
            _own.add(self._key)
            owner = os.getpid()
            self._end = weakref.finalize(self, _give_back, self.path, self._key, file, owner)

    def release(self) -> None:
        """Give the lock back; a second time nothing happens."""
        self._end()

    def _take(self) -> int:
        for _ in range(TRIES):
            try:
                self._make()
                file = os.open(self.path, FLAGS)
            except FileNotFoundError:
                continue  # its owner removed it in between
            except (OSError, ValueError) as error:
                raise self._foreign(error) from error
            try:
                self._require_own(file)
                self._lock(file)
                if is_same(self.path, os.fstat(file)):
                    return file
            except BaseException:
                os.close(file)
                raise
            os.close(file)
        raise self._locked("another process")

    def _make(self) -> None:
        """Make the file whole, unless something has its name.

        Raises:
            SweepStoreError: something else has its name, or the system refuses the file.
        """
        try:
            mode = os.lstat(self.path).st_mode
        except FileNotFoundError:
            pass
        except (OSError, ValueError) as error:
            raise refused(self.store, error) from error
        else:
            if not stat.S_ISREG(mode):
                raise self._not_ours(kind_of(mode))
            return
        try:
            write_atomically(self.path, CONTENT, replace=False)
        except FileExistsError:
            pass
        except TraceFileError as error:
            cause = error.__cause__
            if isinstance(cause, OSError) and cause.errno in NO_LINKS:
                return self._make_alone()
            raise refused(self.store, cause if isinstance(cause, OSError) else error) from error

    def _make_alone(self) -> None:
        """Make the file where a finished one cannot be given a second name."""
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
        try:
            file = os.open(self.path, flags, 0o644)
        except FileExistsError:
            return
        except OSError as error:
            raise refused(self.store, error) from error
        try:
            os.write(file, CONTENT)
        except OSError as error:
            self.path.unlink(missing_ok=True)
            raise refused(self.store, error) from error
        finally:
            os.close(file)

    def _require_own(self, file: int) -> None:
        mode = os.fstat(file).st_mode
        if not stat.S_ISREG(mode):
            raise self._not_ours(kind_of(mode))
        if os.pread(file, len(CONTENT) + 1, 0) != CONTENT:
            raise self._not_ours("a file of something else")

    def _lock(self, file: int) -> None:
        try:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno in (errno.EACCES, errno.EAGAIN):
                raise self._locked("another process") from error
            raise SweepStoreError(
                str(self.store), f"its lock {self.path} cannot be taken ({error.strerror}): put "
                "the store on a disk of this machine.",
            ) from error  # fmt: skip

    def _foreign(self, error: Exception) -> SweepStoreError:
        """Return the error of a name that cannot be opened: that of a link, or not permitted."""
        try:
            mode = os.lstat(self.path).st_mode
        except (OSError, ValueError):
            return refused(self.store, error)
        if not stat.S_ISREG(mode):
            return self._not_ours(kind_of(mode))
        return self._not_ours(f"a file that cannot be opened ({error})")

    def _not_ours(self, what: str) -> SweepStoreError:
        return SweepStoreError(
            str(self.store), f"the name of its lock, {self.path}, is that of {what}, which is left "
            "as it is: remove or rename it, or name another store.",
        )  # fmt: skip

    def _locked(self, who: str) -> StoreLockedError:
        return StoreLockedError(
            str(self.store), f"{who} writes to it; wait until that sweep has ended, or name "
            "another store. It can be read meanwhile.",
        )  # fmt: skip


def _give_back(path: Path, key: Path, file: int, owner: int) -> None:
    """Give a lock back; a forked child has none to give."""
    if os.getpid() != owner:
        return
    with unbroken(), _guard:
        _own.discard(key)
        if is_same(path, os.fstat(file)):
            with contextlib.suppress(OSError):  # one that stays is taken by the next sweep
                path.unlink()
        os.close(file)
