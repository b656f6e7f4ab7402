"""Build the native core under sanitizers, and run the tests that lean on it most.

    python scripts/sanitize.py address,undefined
    python scripts/sanitize.py thread
    python scripts/sanitize.py thread tests/test_batch.py    # other tests

The core is built apart (build/sanitize-...), and a copy of the package beside it is what the tests
import. The exit status is that of the tests; a sanitizer that finds something ends them.
Leaks are not looked for: the interpreter keeps objects to its end.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

TESTS = {
    "address,undefined": (
        "test_native.py", "test_method_matrix.py", "test_fused.py", "test_ndf.py",
        "test_stick_slip.py", "test_restart.py", "test_terrain.py", "test_robust_step.py",
        "test_work_limits.py", "test_plan_parts.py", "test_foot_control_parts.py",
        "test_prismatic.py", "test_drive.py", "test_contact_events.py", "test_faces.py",
        "test_fuzz.py",
    ),
    "thread": ("test_native_batch.py", "test_batch.py", "test_threads.py", "test_work_limits.py"),
}  # fmt: skip
"""Tests by sanitizers: of every law, method and terrain; of batches and threads."""

RUNTIME = {"address,undefined": ("libasan.so", "libstdc++.so"), "thread": ("libtsan.so",)}
"""Loaded before the interpreter; the second so that the first knows how exceptions are thrown."""

OPTIONS = {
    "ASAN_OPTIONS": "detect_leaks=0:halt_on_error=1:abort_on_error=1",
    "UBSAN_OPTIONS": "print_stacktrace=1:halt_on_error=1",
    "TSAN_OPTIONS": "halt_on_error=1:abort_on_error=1:report_signal_unsafe=0",
}

SUPPRESSED = "nonnull-attribute:nanobind/eigen/dense.h\n"
"""Not ours: nanobind copies arrays of no length from a null pointer, nothing at all."""

# An editable install finds its modules before any path: it is put aside.
RUN = """
import sys
sys.meta_path[:] = [f for f in sys.meta_path if "editable" not in type(f).__module__]
import pytest
sys.exit(pytest.main(sys.argv[1:]))
"""


def main() -> int:
    """Build, run, and tell how long it took."""
    kind = sys.argv[1] if len(sys.argv) > 1 else ""
    if kind not in TESTS:
        print(f"one of {', '.join(TESTS)} needed", file=sys.stderr)
        return 2
    begin = time.monotonic()
    build = built(kind)
    tests = sys.argv[2:] or [str(ROOT / "tests" / name) for name in TESTS[kind]]
    command = [
        sys.executable,
        "-c",
        RUN,
        "-q",
        "-p",
        "no:cacheprovider",
        "-p",
        "no:xdist",
        "-o",
        "timeout=0",
        "--capture=sys",
        "-m",
        "not little_memory",
        *tests,
    ]  # what a sanitizer says goes by the descriptor
    listed = build / "suppressed.txt"
    listed.write_text(SUPPRESSED, encoding="utf-8")
    environment = {**os.environ, **OPTIONS, "LD_PRELOAD": runtime(kind)}
    environment["UBSAN_OPTIONS"] += f":suppressions={listed}"
    environment |= {"PYTHONPATH": str(build / "package"), "PYTHONMALLOC": "malloc"}
    status = subprocess.run(command, check=False, env=environment, cwd=build).returncode
    told = "no finding" if status == 0 else f"exit status {status}"
    print(f"{kind}: {told}; {time.monotonic() - begin:.0f} s with the build")
    return status


def built(kind: str) -> Path:
    """Build the core with sanitizers; return the folder, with the package to import in it."""
    build = ROOT / "build" / f"sanitize-{kind.replace(',', '-')}"
    tools = Path(sys.executable).parent
    environment = {**os.environ, "PATH": f"{tools}{os.pathsep}{os.environ['PATH']}"}
    rpath = next(ROOT.joinpath(tools.parent, "lib").glob("python*/site-packages/cmeel.prefix/lib"))
    configure = [
        "cmake", "-G", "Ninja", "-S", str(ROOT), "-B", str(build), "-DCMAKE_BUILD_TYPE=Debug",
        f"-DHEXAPOD_SANITIZE={kind}", f"-DPython_EXECUTABLE={sys.executable}",
        f"-DCMAKE_BUILD_RPATH={rpath}",
    ]  # fmt: skip
    for command in (configure, ["cmake", "--build", str(build)]):
        subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL)
    package = build / "package"
    shutil.rmtree(package, ignore_errors=True)
    unwanted = shutil.ignore_patterns("*.hpp", "*.cpp", "*.so", "__pycache__")
    shutil.copytree(ROOT / "hexapod_pin", package / "hexapod_pin", ignore=unwanted)
    shutil.copytree(ROOT / "urdf", package / "urdf")
    for module in build.glob("_core*.so"):
        shutil.copy(module, package / "hexapod_pin" / "native")
    return build


def runtime(kind: str) -> str:
    """Return the libraries that must be loaded before the interpreter."""
    return " ".join(map(_library, RUNTIME[kind]))


def _library(name: str) -> str:
    compiler = os.environ.get("CXX", "g++")
    command = [compiler, f"-print-file-name={name}"]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


if __name__ == "__main__":
    sys.exit(main())
