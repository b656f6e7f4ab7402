"""What several files of tests ask for by name."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from hexapod_pin.commands.app import main
from hexapod_pin.simulation.run_settings import RunSettings

Run = Callable[..., SimpleNamespace]


def pytest_configure() -> None:
    """Let Ctrl-C be KeyboardInterrupt, also where tests run in the background, as under `nohup`.

    There SIGINT is ignored, which processes that a test starts inherit.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def own_modules(tmp_path: Path) -> Iterator[None]:
    """Forget the modules that a test imports from its folder, and the folder as a place of them."""
    places = list(sys.path)
    yield
    sys.path[:] = places
    for name, module in list(sys.modules.items()):
        if str(getattr(module, "__file__", None)).startswith(str(tmp_path)):
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


RUN_FINER = {
    "test_accuracy_kept", "test_adaptive", "test_batch", "test_case", "test_cli",
    "test_file_schema", "test_hard_cases", "test_input_edges", "test_metamorphic",
    "test_missed_scenes", "test_pickle", "test_random_scenes", "test_run_ends_early",
    "test_second_rhs_bounces",
    "test_process_edges", "test_sweep_command",
    "test_sweep_dask", "test_sweep_kill", "test_sweep_runs", "test_sweep_study", "test_user_pools",
}  # fmt: skip
"""Modules whose runs are compared with finer ones, as the package does unless told otherwise."""

STUDIES = "test_studies"
"""The module where those that start worker processes do so too."""


def _module(request: pytest.FixtureRequest) -> str:
    return str(request.module.__name__).rpartition(".")[2]


@contextmanager
def _single_runs() -> Iterator[None]:
    """Run each case once in tests of other things: the comparison costs twice the time."""
    asked = RunSettings.of

    def once(*arguments: Any, **named: Any) -> RunSettings:
        return replace(asked(*arguments, **named), estimate=False)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(RunSettings, "of", staticmethod(once))
        yield


@pytest.fixture(autouse=True, scope="module")
def single_runs(request: pytest.FixtureRequest) -> Iterator[None]:
    """Run each case of most modules once."""
    with nullcontext() if _module(request) in {*RUN_FINER, STUDIES} else _single_runs():
        yield


@pytest.fixture(autouse=True)
def single_runs_of_studies(request: pytest.FixtureRequest) -> Iterator[None]:
    """Run each case of most studies once."""
    finer = _module(request) != STUDIES or "sweep" in request.node.name
    with nullcontext() if finer else _single_runs():
        yield
