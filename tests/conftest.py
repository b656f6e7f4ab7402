"""What several files of tests ask for by name."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import browser as browsers
import pytest

from hexapod_pin.commands.app import main

Run = Callable[..., SimpleNamespace]


def pytest_configure(config: pytest.Config) -> None:
    """Prepare what processes that tests start inherit.

    Ctrl-C is KeyboardInterrupt, also where tests run in the background, as under `nohup`: there
    SIGINT is ignored. Byte code is kept, with pytest's cache, also where Python is set to write
    none: each of a thousand processes would compile all that it imports, and each run of the tests
    all their files. Linear algebra has one thread, as in a command: each worker of pytest-xdist has
    a core.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.pop("COLUMNS", None)  # lines of outputs are as long as they are
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if os.environ.pop("PYTHONDONTWRITEBYTECODE", None):
        sys.pycache_prefix = str(config.rootpath / ".pytest_cache" / "bytecode")
        sys.dont_write_bytecode = False
        os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix


def pytest_collection_finish() -> None:
    """Exempt what is there from garbage collections, which come more rarely.

    They would walk all tests over and over, and what tests make is freed without them as a rule.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 100)


def pytest_unconfigure() -> None:
    """Let the interpreter clear what was exempt, before libraries look for what is left."""
    gc.unfreeze()


@pytest.fixture
def own_modules(tmp_path: Path) -> Iterator[None]:
    """Forget the modules that a test imports from its folder, and the folder as a place of them."""
    places, known = list(sys.path), set(sys.modules)
    yield
    sys.path[:] = places
    for name in set(sys.modules) - known:
        if str(getattr(sys.modules[name], "__file__", None)).startswith(str(tmp_path)):
            del sys.modules[name]


@pytest.fixture
def run(
    own_modules: None,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> Run:
    """Run a command in an empty folder; give its status, stdout, stderr and what it left."""
    monkeypatch.chdir(tmp_path)

    def command(*words: str) -> SimpleNamespace:
        with pytest.raises(SystemExit) as exit_:
            main(words)
        out, err = capsys.readouterr()
        left = sorted(path.name for path in tmp_path.iterdir())
        return SimpleNamespace(status=exit_.value.code, out=out, err=err, left=left)

    return command


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Give one browser for all tests of a module."""
    yield from browsers.started()
