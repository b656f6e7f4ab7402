"""A worker process of a sweep: tasks come on stdin, answers go to stdout, both in frames.

It ends with its parent, however that ends.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import struct
import sys
import threading
from typing import IO

PR_SET_PDEATHSIG = 1
"""Of prctl(2)."""

HEAD = struct.Struct("<Q")
"""Length of a frame."""


def write_frame(stream: IO[bytes], content: bytes) -> None:
    """Write a frame."""
    stream.write(HEAD.pack(len(content)) + content)
    stream.flush()


def read_frame(stream: IO[bytes]) -> bytes | None:
    """Return the next frame; None where the other side has gone."""
    head = stream.read(HEAD.size)
    if len(head) < HEAD.size:
        return None
    (size,) = HEAD.unpack(head)
    content = stream.read(size)
    return content if len(content) == size else None


def _listen(stream: IO[bytes], tasks: queue.SimpleQueue[bytes]) -> None:
    """Take tasks in; end the process at once where the parent has gone."""
    while (frame := read_frame(stream)) is not None:
        tasks.put(frame)
    os._exit(0)


def end_with_parent() -> None:
    """Let the system kill this process when its parent dies, even in the middle of a run (Linux).

    Elsewhere, and where the parent has ended already, the end of its pipe ends this process later.
    """
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def main() -> None:
    """Run tasks until the parent goes."""
    end_with_parent()
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print must not mix with answers
    tasks: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(sys.stdin.buffer, tasks), daemon=True).start()
    from hexapod_pin.study.runs.task import run_task

    while True:
        write_frame(answers, run_task(*json.loads(tasks.get())))
