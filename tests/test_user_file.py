"""Paths that a user gave: `~`, names that no file can have, folders where a file is meant."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.user_file import user_path

Run = Callable[..., SimpleNamespace]


def test_a_tilde_is_the_users_home_and_that_of_nobody_stays(monkeypatch: pytest.MonkeyPatch):
    """`Path.expanduser` ends in a RuntimeError for a user who is not known."""
    monkeypatch.setenv("HOME", "/home/of-a-user")
    assert user_path("~/walk.nc") == Path("/home/of-a-user/walk.nc")
    assert user_path("a/~") == Path("a/~")
    for name in ("~unknown/x", "~a\0b/x"):
        assert user_path(name) == Path(name)


READERS = (
    hp.load_robot, hp.load_trace, hp.load_case, hp.study.load_study, hp.load_summary,
    hp.load_catalog, hp.load_sweep, hp.study.open_sweep, hp.study.load_gait_energy,
    hp.study.load_torque_map, lambda name: hp.HeightField.from_csv(name, 0.1),
    lambda name: hp.HeightField.from_image(name, 0.1, 0.1),
)  # fmt: skip


def test_no_file_is_a_typed_error_of_every_reader(tmp_path, monkeypatch):
    """Python 3.11 raises an OSError for a name that is too long, also by `Path.exists`."""
    monkeypatch.chdir(tmp_path)
    for read in READERS:
        for name in ("é" * 300, "~unknown/x", "."):
            with pytest.raises(hp.errors.HexapodError):
                read(name)
    assert not list(tmp_path.iterdir())


def test_what_is_written_at_home_is_read_there(tmp_path, monkeypatch):
    """Reading and writing expand `~`."""
    monkeypatch.setenv("HOME", str(tmp_path))
    trace = hp.simulate(hp.Scene(hp.load_robot("athena")), hp.HoldPosture(), duration=0.02)
    trace.save("~/walk.nc")
    assert (tmp_path / "walk.nc").is_file()
    assert (hp.load_trace("~/walk.nc").q == trace.q).all()
    hp.load_catalog().save("~/motors.csv")
    assert hp.load_catalog("~/motors.csv").models == hp.load_catalog().models


def test_no_file_ends_a_command_in_one_line(run: Run, tmp_path: Path) -> None:
    """`sweep .` had no name for its store; a scene that is no UTF-8 was a UnicodeDecodeError."""
    (tmp_path / "latin.toml").write_bytes("name = 'é'".encode("latin-1"))
    for line, message in (
        (("sweep", "."), "study file"),
        (("check", "~unknown/x.urdf"), "no such file"),
        (("bench", "latin.toml"), "latin.toml"),
    ):
        done = run(*line)
        assert done.status == 2 and message in done.err and done.err.count("\n") == 1, done.err
        assert done.left == ["latin.toml"]


def test_a_folder_is_no_store(tmp_path: Path) -> None:
    """Nor is a lock left beside it."""
    study = hp.load_sweep(Path(__file__).parents[1] / "examples/friction_and_payload.toml")
    with refused(hp.errors.SweepStoreError, path=str(tmp_path), kept=None) as caught:
        hp.run_sweep(study, tmp_path)
    # neither one that is there, nor one that is locked; and it was not tried to open it
    assert type(caught.value) is hp.errors.SweepStoreError and caught.value.__cause__ is None
    assert not list(tmp_path.parent.glob("*-lock"))
