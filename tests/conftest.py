"""What several files of tests ask for by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from hexapod_pin.commands.app import main

Run = Callable[..., SimpleNamespace]


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Run a command in an empty folder; give its status, stdout, stderr and what it left."""
    monkeypatch.chdir(tmp_path)

    def command(*words: str) -> SimpleNamespace:
        with pytest.raises(SystemExit) as exit_:
            main(words)
        out, err = capsys.readouterr()
        left = sorted(path.name for path in tmp_path.iterdir())
        return SimpleNamespace(status=exit_.value.code, out=out, err=err, left=left)

    return command
