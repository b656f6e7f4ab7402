"""A Dask scheduler and its workers, each a process of this machine."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any, NamedTuple

PATIENCE = 60.0
"""Longest wait for the workers [s]."""


class Cluster(NamedTuple):
    """A scheduler with its workers."""

    address: str
    scheduler: int  # process id


@contextmanager
def loopback_cluster(workers: int = 2) -> Iterator[str]:
    """Give the address of a scheduler with some workers of one thread each; ends them after."""
    with cluster_processes(workers, 1) as cluster:
        yield cluster.address


@contextmanager
def cluster_processes(workers: int, threads: int) -> Iterator[Cluster]:
    """Give a scheduler with some workers of so many threads each; ends them after."""
    import distributed

    address = f"tcp://127.0.0.1:{free_port()}"
    port = address.rpartition(":")[2]
    with ExitStack() as ends:
        scheduler = _start(ends, "scheduler", "--host", "127.0.0.1", "--port", port, "--no-show")
        for _ in range(workers):
            _start(ends, "worker", address, "--nthreads", str(threads), "--no-nanny")
        connect: Any = distributed.Client
        with connect(address, timeout=PATIENCE, set_as_default=False) as client:
            client.wait_for_workers(workers, timeout=PATIENCE)
        yield Cluster(address, scheduler)


def _start(ends: ExitStack, what: str, *words: str) -> int:
    """Start a process and return its id."""
    paths = os.pathsep.join(path for path in sys.path if path)  # tasks are found by name
    process = subprocess.Popen(
        [sys.executable, "-m", f"distributed.cli.dask_{what}", *words, "--no-dashboard"],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": paths},
    )  # fmt: skip
    ends.callback(process.wait)
    ends.callback(process.kill)
    return process.pid


def free_port() -> int:
    """Return a port of the loopback that nothing uses."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
