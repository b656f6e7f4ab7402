"""Files are written wholly or not at all, and what killed writers leave is swept."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from refusals import refused

from hexapod_pin import atomic_file
from hexapod_pin.atomic_file import sweep, write_atomically
from hexapod_pin.errors import TraceFileError

WRITER = """
import os, sys, time
from hexapod_pin import atomic_file
def stop(stream, content):
    os.write(stream, b"part")
    print("writing", flush=True)
    time.sleep(60)
atomic_file._write = stop
atomic_file.write_atomically(sys.argv[1], b"whole")
"""


def left(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def writer(path: Path) -> subprocess.Popen[str]:
    """Return a process that stays in the middle of writing."""
    process = subprocess.Popen(
        [sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE, text=True,
        cwd=Path(atomic_file.__file__).parents[1],
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stdout.readline() == "writing\n"
    return process


@pytest.mark.parametrize("content", [b"new", "new", memoryview(b"new")], ids=["b", "s", "m"])
def test_a_file_is_replaced_and_keeps_its_permissions(tmp_path: Path, content) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    path.chmod(0o640)
    assert write_atomically(path, content) == path
    assert (path.read_text(), path.stat().st_mode & 0o777, left(tmp_path)) == (
        "new", 0o640, ["a.txt"],
    )  # fmt: skip


def test_a_new_file_has_the_usual_permissions(tmp_path: Path) -> None:
    """One that must be new replaces none."""
    path = write_atomically(tmp_path / "a.txt", "new")
    (tmp_path / "plain").touch()
    assert path.stat().st_mode == (tmp_path / "plain").stat().st_mode
    path = tmp_path / "b.txt"
    write_atomically(path, "first", replace=False)
    with pytest.raises(FileExistsError):
        write_atomically(path, "second", replace=False)
    assert (path.read_text(), left(tmp_path)) == ("first", ["a.txt", "b.txt", "plain"])


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EIO])
def test_a_full_disk_leaves_the_earlier_file(tmp_path: Path, monkeypatch, number: int) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    real = os.write

    def write(stream: int, content: bytes) -> int:
        if len(content) > 4:
            return real(stream, content[:4])
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(atomic_file.os, "write", write)
    with refused(TraceFileError, about=(str(path), os.strerror(number), "8")) as caught:
        write_atomically(path, b"12345678")
    assert caught.value.__cause__.errno == number
    assert (path.read_text(), left(tmp_path)) == ("old", ["a.txt"])


@pytest.mark.parametrize("call", ["replace", "fsync"])
def test_a_disk_full_at_the_last_step_leaves_the_earlier_file(tmp_path, monkeypatch, call):
    path = tmp_path / "a.txt"
    path.write_text("old")

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, call, full)
    with refused(TraceFileError, about=(str(path), "8")) as caught:
        write_atomically(path, b"12345678")
    assert caught.value.__cause__.errno == errno.ENOSPC
    assert (path.read_text(), left(tmp_path)) == ("old", ["a.txt"])


def test_a_limit_on_file_sizes_is_reported(tmp_path: Path) -> None:
    code = (
        "import resource, signal, sys; from hexapod_pin.atomic_file import write_atomically\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
        "write_atomically(sys.argv[1], bytes(5000))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "a")], capture_output=True, text=True,
        cwd=Path(atomic_file.__file__).parents[1], check=False,
    )  # fmt: skip
    assert "TraceFileError" in done.stderr
    assert "ulimit -f" in done.stderr
    assert left(tmp_path) == []


def test_a_folder_that_cannot_be_written_to(tmp_path: Path) -> None:
    """As another user than root, who may write anywhere."""
    folder = tmp_path / "locked"
    folder.mkdir(mode=0o555)
    code = (
        "import os, sys; from hexapod_pin.atomic_file import _system, write_atomically\n"
        "_system()\n"
        "os.geteuid() or os.setuid(65534)\n"
        "write_atomically(sys.argv[1], b'x')"
    )
    for path in (tmp_path, *tmp_path.parents[:2]):
        path.chmod(0o755)
    done = subprocess.run(
        [sys.executable, "-c", code, str(folder / "a")], capture_output=True, text=True,
        cwd=Path(atomic_file.__file__).parents[1], check=False,
    )  # fmt: skip
    assert "TraceFileError" in done.stderr
    assert "Permission denied" in done.stderr
    assert left(folder) == []


@pytest.mark.parametrize(
    ("name", "number", "about"),
    [
        ("gone/a", errno.ENOENT, ("/gone ",)),  # the folder that is not there
        ("file/a", errno.ENOTDIR, ()),
        ("x" * 300, errno.ENAMETOOLONG, ()),
        ("a\0b", None, ("NUL",)),
        (".", errno.EISDIR, ()),
        ("..", errno.EISDIR, ()),
        ("/dev/null", errno.EINVAL, ()),
        ("circle", errno.ELOOP, (" circle",)),  # where it leads to
    ],
)
def test_names_that_cannot_be_written(tmp_path, name, number, about):
    """The file is named, and the system's error is the cause."""
    (tmp_path / "circle").symlink_to("circle")
    (tmp_path / "file").touch()
    shown = os.path.normpath(tmp_path / name.replace("\0", r"\x00"))
    with refused(TraceFileError, about=(shown, *about)) as caught:
        write_atomically(tmp_path / name, b"x")
    assert getattr(caught.value.__cause__, "errno", None) == number
    assert left(tmp_path) == ["circle", "file"]


def test_nothing_is_written_through_a_link(tmp_path: Path) -> None:
    """What a link leads to may be anybody's: it, and what it leads to, stay as they are."""
    for name in ("there", "dangling"):
        (tmp_path / f"link_{name}").symlink_to(tmp_path / name)
    (tmp_path / "there").write_text("old")
    for name in ("there", "dangling"):
        link = tmp_path / f"link_{name}"
        with refused(TraceFileError, about=(str(link), str(tmp_path / name))) as caught:
            write_atomically(link, "new")
        assert caught.value.__cause__.errno == errno.ELOOP
        assert link.is_symlink()
    assert (tmp_path / "there").read_text() == "old"
    assert left(tmp_path) == ["link_dangling", "link_there", "there"]


def test_folders_may_be_links_and_pipes_are_not_waited_for(tmp_path: Path) -> None:
    """What only looks like a temporary file of a killed writer stays where it is."""
    (tmp_path / "real").mkdir()
    (tmp_path / "folder").symlink_to("real")
    write_atomically(tmp_path / "folder" / "a", "x")
    assert (tmp_path / "real" / "a").read_text() == "x"
    name = atomic_file._prefix(tmp_path / "a") + "1-0.tmp"
    os.mkfifo(tmp_path / name)
    (tmp_path / name.replace("1-0", "1-1")).symlink_to(tmp_path / "precious")
    (tmp_path / "precious").write_text("keys")
    write_atomically(tmp_path / "a", "x")
    assert name in left(tmp_path) and (tmp_path / "precious").read_text() == "keys"


@pytest.mark.parametrize("kind", ["link", "hard link", "pipe"])
def test_what_takes_the_name_in_between_is_not_written_through(kind, tmp_path, monkeypatch):
    """The finished file takes the name; what stood there in between keeps its content."""
    precious, target = tmp_path / "precious", tmp_path / "a"
    precious.write_text("keys")
    synchronize = os.fsync

    def put(stream: int) -> None:
        synchronize(stream)
        if kind == "pipe":
            os.mkfifo(target)
        else:
            (os.symlink if kind == "link" else os.link)(precious, target)

    monkeypatch.setattr(atomic_file.os, "fsync", put)
    write_atomically(target, "new")
    assert precious.read_text() == "keys"
    assert target.read_text() == "new" and not target.is_symlink()
    assert precious.stat().st_nlink == 1


def test_odd_names_and_texts(tmp_path: Path) -> None:
    """The longest name of a file, 254 bytes; text that is no Unicode is refused."""
    with refused(TraceFileError, about=(str(tmp_path / "a"), "UTF-8")):
        write_atomically(tmp_path / "a", "\udcff")
    assert left(tmp_path) == []
    path = tmp_path / ("\u00e9" * 127)  # 254 bytes
    write_atomically(path, "x")
    assert left(tmp_path) == [path.name]


def test_writers_of_one_name_leave_one_whole_file(tmp_path: Path) -> None:
    path, contents = tmp_path / "a", [bytes([k]) * 200_000 for k in range(8)]
    threads = [threading.Thread(target=write_atomically, args=(path, c)) for c in contents]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert path.read_bytes() in contents
    assert left(tmp_path) == ["a"]


def test_what_a_killed_writer_left_is_swept_and_a_living_one_is_not(tmp_path: Path) -> None:
    path = tmp_path / "a"
    with writer(path) as dead, writer(path) as living:
        assert len(left(tmp_path)) == 2
        dead.send_signal(signal.SIGKILL)
        dead.wait()
        write_atomically(path, "new")
        assert path.read_text() == "new"
        assert [f"-{living.pid}-" in name for name in left(tmp_path) if name != "a"] == [True]
        living.kill()
    assert len(sweep(path)) == 1
    assert left(tmp_path) == ["a"]


def test_files_of_other_machines_and_of_other_names_stay(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(atomic_file, "_system", lambda: "00000000")
    other = atomic_file._prefix(tmp_path / "a") + "1-0.tmp"
    monkeypatch.undo()
    same = atomic_file._prefix(tmp_path / "b") + "1-0.tmp"
    for name in (other, same):
        (tmp_path / name).touch()
    write_atomically(tmp_path / "a", "x")
    assert left(tmp_path) == sorted([other, same, "a"])
