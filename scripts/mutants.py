"""Deliberate single faults in a checkout, to find out whether the tests notice them.

Each mutant is one realistic programming error: a wrong sign, factor, index, frame or unit. All of
them are placed in one checkout at once and are compiled in one build; the environment variable
HEXAPOD_PIN_MUTANT, read once when the package is loaded, selects the one that acts. Number 0, or
no variable, selects none: every expression then has the value, to the bit, that it has in the
unchanged source.

    git clone -q CHECKOUT FOLDER
    python mutants.py check FOLDER      # every text to be replaced occurs exactly once
    python mutants.py place FOLDER      # edits FOLDER; before it is built, because an editable
                                        # installation knows its modules by name
    make -C FOLDER .venv/.test          # one build for all mutants
    python mutants.py run FOLDER        # a table beside FOLDER; can be interrupted and resumed

Only the standard library is used, so that any Python from 3.11 on runs it. The faults stand in
`mutants.toml`. Never place mutants in a checkout that is used for anything else.

Without a mutant the bits stay because the compiler may not reorder or contract sums there: x86-64
without FMA. The units of the fused pass that are compiled for AVX2 with FMA hold no mutant. Where
a choice between two expressions could change how Eigen or NumPy sums, whole statements are chosen
between, or the result is multiplied by 1.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import tomllib

VARIABLE = "HEXAPOD_PIN_MUTANT"

CPP_HEADER = "hexapod_pin/native/mutant.hpp"
CPP_HEADER_TEXT = f"""\
// Which deliberate fault acts in this process; see mutants.py. 0: none.
#pragma once

#include <cstdlib>

namespace hexapod_pin {{

// Read once, when the module is loaded.
inline const int kMutant = [] {{
  const char* text = std::getenv("{VARIABLE}");
  return text == nullptr ? 0 : std::atoi(text);
}}();

inline bool mutant(int number) {{ return number == kMutant; }}

}}  // namespace hexapod_pin
"""
CPP_INCLUDE = '#include "mutant.hpp"\n'

PYTHON_MODULE = "hexapod_pin/mutant.py"
PYTHON_MODULE_TEXT = f'''\
"""Which deliberate fault acts in this process; see mutants.py. 0: none."""

from __future__ import annotations

import os

NUMBER = int(os.environ.get("{VARIABLE}") or 0)
"""Read once, when the package is loaded."""


def mutant(number: int) -> bool:
    """Return whether the fault of that number acts."""
    return number == NUMBER
'''
PYTHON_FUTURE = "from __future__ import annotations\n"
PYTHON_IMPORT = "from hexapod_pin.mutant import mutant\n"


@dataclass(frozen=True)
class Mutant:
    """One deliberate fault.

    Attributes:
        number: that selects it.
        kind: "sign", "factor", "index", "frame" or "unit".
        area: of the package, for the table.
        path: of the file, relative to the checkout.
        old: text that occurs exactly once in the file.
        new: what replaces it; without a selected mutant of the same value, to the bit.
        what: the fault in one line.
        why: why numbers change on ordinary inputs, in one line.
        tests: files of `tests/` that are likely to notice it, the quickest first.
    """

    number: int
    kind: str
    area: str
    path: str
    old: str
    new: str
    what: str
    why: str
    tests: tuple[str, ...]


def _read_table() -> tuple[Mutant, ...]:
    rows = tomllib.loads(TABLE.read_text(encoding="utf-8"))["mutant"]
    return tuple(Mutant(**{**row, "tests": tuple(row["tests"])}) for row in rows)


TABLE = Path(__file__).with_suffix(".toml")
MUTANTS = _read_table()

NOTHING = "survives"


def faults_of_table(folder: Path) -> list[str]:
    """Return what is wrong with the table, or with its edits of a checkout, one line each."""
    found = []
    if [m.number for m in MUTANTS] != list(range(1, len(MUTANTS) + 1)):
        found.append("numbers are not 1, 2, 3, ...")
    if (folder / PYTHON_MODULE).exists() or (folder / CPP_HEADER).exists():
        return [*found, f"{folder}: mutants are placed there already"]
    for m in MUTANTS:
        selected = {int(n) for n in re.findall(r"\bmutant\((\d+)\)", m.new)}
        if selected != {m.number}:
            found.append(f"{m.number}: the new text selects by {sorted(selected)}")
        for test in m.tests:
            if not (folder / "tests" / test).is_file():
                found.append(f"{m.number}: there is no tests/{test}")
        path = folder / m.path
        if not path.is_file():
            found.append(f"{m.number}: there is no {m.path}")
            continue
        count = path.read_text(encoding="utf-8").count(m.old)
        if count != 1:
            found.append(f"{m.number}: {m.path}: the old text occurs {count} times")
    return found


def place(folder: Path) -> list[str]:
    """Edit a checkout in place and return the paths of what has changed.

    Nothing is written unless every edit fits.
    """
    if wrong := faults_of_table(folder):
        raise SystemExit("\n".join(wrong))
    texts = {m.path: (folder / m.path).read_text(encoding="utf-8") for m in MUTANTS}
    for m in MUTANTS:
        if texts[m.path].count(m.old) != 1:
            raise SystemExit(f"{m.number}: {m.path}: another mutant has changed the old text")
        texts[m.path] = texts[m.path].replace(m.old, m.new)
    edited = {path: _with_helper(path, text) for path, text in texts.items()}
    edited |= {CPP_HEADER: CPP_HEADER_TEXT, PYTHON_MODULE: PYTHON_MODULE_TEXT}
    for path, text in edited.items():
        (folder / path).write_text(text, encoding="utf-8")
    return sorted(edited)


def _with_helper(path: str, text: str) -> str:
    """Return the text of a file that includes, or imports, what selects a mutant."""
    if path.endswith(".py"):
        mark, added = PYTHON_FUTURE, f"{PYTHON_FUTURE}\n{PYTHON_IMPORT}"
    else:
        first = re.search(r"^#include .*\n", text, re.MULTILINE)
        if first is None:
            raise SystemExit(f"{path}: no #include")
        mark, added = first.group(), CPP_INCLUDE + first.group()
    if mark not in text:
        raise SystemExit(f"{path}: no line {mark!r}")
    return text.replace(mark, added, 1)


FAILED = re.compile(
    r"^(?:FAILED|ERROR) (\S+?\.py(?:::[^\[\s]+)*(?:\[.*?\])?)(?= - |$)", re.MULTILINE
)
"""A line of pytest's short summary: the node id, then perhaps the message."""


@dataclass(frozen=True)
class Outcome:
    """How a pytest process ended.

    Attributes:
        passed: whether all tests passed.
        failed: node ids of the tests that failed, as printed.
        ended: how it ended otherwise, in words; empty where pytest itself came to its end.
    """

    passed: bool
    failed: tuple[str, ...] = ()
    ended: str = ""


class Processes:
    """The pytest processes of a checkout, which end with this one."""

    def __init__(self, folder: Path, logs: Path, limit: float) -> None:
        """Take the checkout, a folder for the output, and the longest time of a process [s]."""
        self.folder, self.logs, self.limit = folder, logs, limit
        self._running: set[subprocess.Popen[bytes]] = set()
        self._lock = threading.Lock()
        self._stopped = False

    def pytest(self, number: int, name: str, arguments: Sequence[str]) -> Outcome:
        """Run pytest with a mutant; the output goes to the file NUMBER-NAME.txt."""
        command = [
            str(self.folder / ".venv" / "bin" / "python"), "-m", "pytest", "-q", "-rfE",
            "--tb=short", "--color=no", "-p", "no:cacheprovider",
            "-o", "addopts=--strict-markers", *arguments,
        ]  # fmt: skip
        environment = {**os.environ, VARIABLE: str(number)}
        self.logs.mkdir(parents=True, exist_ok=True)
        log = self.logs / f"{number:02d}-{name}.txt"
        with log.open("wb") as output:
            with self._lock:
                if self._stopped:
                    raise KeyboardInterrupt
                process = subprocess.Popen(
                    command, cwd=self.folder, env=environment, stdout=output,
                    stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, start_new_session=True,
                )  # fmt: skip
                self._running.add(process)
            try:
                status: int | None = process.wait(timeout=self.limit)
            except subprocess.TimeoutExpired:
                status = None
            finally:
                self._end(process)
        if self._stopped:
            raise KeyboardInterrupt
        text = log.read_text(encoding="utf-8", errors="replace")
        return outcome_of(status, text, self.limit)

    def stop(self) -> None:
        """End all of them."""
        with self._lock:
            self._stopped = True
            running = list(self._running)
        for process in running:
            self._end(process)

    def _end(self, process: subprocess.Popen[bytes]) -> None:
        """End a process, and those that its tests have left behind."""
        try:
            os.killpg(process.pid, signal.SIGKILL)
        except (ProcessLookupError, PermissionError):
            pass
        process.wait()
        with self._lock:
            self._running.discard(process)


def outcome_of(status: int | None, text: str, limit: float) -> Outcome:
    """Return what an exit status and the output say."""
    failed = tuple(dict.fromkeys(FAILED.findall(text)))
    if status is None:
        return Outcome(False, failed, f"no end within {limit:g} s")
    if status < 0:
        return Outcome(False, failed, f"the process ended by {signal.Signals(-status).name}")
    if status in (0, 5):  # 5: nothing was collected, as where all is deselected
        return Outcome(status == 0, (), "" if status == 0 else "pytest found no tests")
    if status in (1, 2) and failed:
        return Outcome(False, failed)
    return Outcome(False, failed, f"pytest ended with status {status}")


class Campaign:
    """Mutants against the tests of a checkout, and the table of what came of it."""

    def __init__(
        self, processes: Processes, table: Path, tests: Sequence[str], known: Sequence[str]
    ) -> None:
        """Take processes and a table, which is continued.

        Args:
            processes: of the checkout.
            table: a Markdown file.
            tests: files of tests to run first, for every mutant; empty: those of each mutant.
            known: tests that fail without a mutant, or not every time: they are left out.
        """
        self.processes, self.table, self.tests = processes, table, tuple(tests)
        self.left_out = list(known)
        self.rows: dict[int, tuple[str, float]] = read_table(table)
        self._lock = threading.Lock()

    def run(self, mutants: Iterable[Mutant], jobs: int) -> None:
        """Run those mutants that are not in the table, some at a time."""
        waiting = [m for m in mutants if m.number not in self.rows]
        with ThreadPoolExecutor(jobs) as pool:
            futures = [pool.submit(self._run_one, m) for m in waiting]
            try:
                for future in futures:
                    future.result()
            except BaseException:
                for future in futures:
                    future.cancel()
                self.processes.stop()
                raise

    def _run_one(self, mutant: Mutant) -> None:
        begin = time.monotonic()
        first = self.tests or mutant.tests
        killer = self._killer(mutant.number, "first", [f"tests/{Path(t).name}" for t in first])
        if killer == NOTHING:
            passed = [f"--ignore=tests/{Path(t).name}" for t in first]
            killer = self._killer(mutant.number, "all", ["tests", *passed])
        seconds = time.monotonic() - begin
        with self._lock:
            self.rows[mutant.number] = killer, seconds
            write_table(self.table, self.rows)
        print(f"{mutant.number:2d} {killer} ({seconds:.0f} s)", flush=True)

    def _killer(self, number: int, name: str, targets: Sequence[str]) -> str:
        """Return the test that notices a mutant, or how else it is noticed, or NOTHING.

        A test counts if it fails again with the mutant and passes without: on a busy machine tests
        of times may fail by themselves, and are left out from then on.
        """
        while True:
            left_out = [f"--deselect={node}" for node in self.left_out]
            found = self.processes.pytest(number, name, ["-x", *targets, *left_out])
            if found.passed or found.ended == "pytest found no tests":
                return NOTHING
            if found.ended:
                return f"{found.ended}{_near(found.failed)}"
            node = found.failed[0]
            again = self.processes.pytest(number, f"{name}-again", ["-x", node])
            without = self.processes.pytest(0, f"{name}-without-{number}", ["-x", node])
            if not again.passed and without.passed:
                return node
            with self._lock:
                if node not in self.left_out:
                    self.left_out.append(node)
            print(f"{number:2d} left out: {node} does not depend on the mutant alone", flush=True)


def _near(nodes: Sequence[str]) -> str:
    return f", after {nodes[0]}" if nodes else ""


def fails_without(processes: Processes, kept: Path, jobs: int) -> list[str]:
    """Return the tests that fail without any mutant, found once and kept in a file.

    Placing alone may make a test fail that reads the sources; such tests say nothing.
    """
    if kept.is_file():
        nodes: list[str] = json.loads(kept.read_text(encoding="utf-8"))
        return nodes
    print("whole suite without a mutant", flush=True)
    found = processes.pytest(0, "baseline", ["tests", "-n", str(jobs)])
    if found.ended:
        raise SystemExit(f"without a mutant: {found.ended}; see {processes.logs}")
    once_more = [n for n in found.failed if not processes.pytest(0, "baseline-again", [n]).passed]
    _write(kept, json.dumps(once_more, indent=1))
    print(f"{len(once_more)} tests fail without a mutant and are left out", flush=True)
    return once_more


def read_table(path: Path) -> dict[int, tuple[str, float]]:
    """Return what a table holds: number -> what killed it, and the seconds."""
    if not path.is_file():
        return {}
    rows = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        cells = [c.strip().replace(r"\|", "|") for c in re.split(r"(?<!\\)\|", line)[1:-1]]
        if len(cells) == 7 and cells[0].isdigit():
            rows[int(cells[0])] = cells[5].strip("`"), float(cells[6])
    return rows


def write_table(path: Path, rows: dict[int, tuple[str, float]]) -> None:
    """Write the table, as a whole or not at all."""
    known = {m.number: m for m in MUTANTS}
    killed = sum(killer != NOTHING for killer, _ in rows.values())
    lines = [
        f"Mutants that the tests notice: {killed} of {len(rows)} run, of {len(MUTANTS)}.",
        "",
        "| number | kind | area | file | what | killed by | seconds |",
        "| ---: | --- | --- | --- | --- | --- | ---: |",
    ]
    for number in sorted(rows):
        m, (killer, seconds) = known[number], rows[number]
        cells = [str(number), m.kind, m.area, f"`{m.path}`", m.what]
        cells += [killer if killer == NOTHING else f"`{killer}`", f"{seconds:.0f}"]
        lines.append("| " + " | ".join(c.replace("|", r"\|") for c in cells) + " |")
    survivors = [known[n] for n in sorted(rows) if rows[n][0] == NOTHING]
    if survivors:
        lines += ["", "Survivors, and why they change numbers:", ""]
        lines += [f"- {m.number}: {m.what}; {m.why}." for m in survivors]
    _write(path, "\n".join(lines) + "\n")


def _write(path: Path, text: str) -> None:
    fresh = path.with_name(path.name + ".new")
    fresh.write_text(text, encoding="utf-8")
    fresh.replace(path)


def _parsed(words: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Deliberate faults, for tests to notice.")
    parts = parser.add_subparsers(dest="part", required=True)
    for name, told in (
        ("check", "whether every edit fits a checkout; nothing is written"),
        ("place", "edit a checkout in place"),
        ("run", "run the tests of a placed and built checkout with each mutant"),
    ):
        part = parts.add_parser(name, help=told)
        part.add_argument("folder", type=Path, help="the checkout")
    run = parts.choices["run"]
    run.add_argument("--only", type=int, nargs="+", default=[], metavar="N", help="these numbers")
    run.add_argument("--tests", nargs="+", default=[], metavar="FILE",
                     help="files of tests that run first, for every mutant")  # fmt: skip
    run.add_argument("--out", type=Path, help="the table; default: beside the checkout")
    run.add_argument("--jobs", type=int, default=2, help="mutants at a time")
    run.add_argument("--limit", type=float, default=7200.0, help="of one pytest process [s]")
    return parser.parse_args(words)


def _run(given: argparse.Namespace) -> None:
    folder = given.folder.resolve()
    if not (folder / PYTHON_MODULE).is_file():
        raise SystemExit(f"{folder}: no mutants are placed there")
    if not (folder / ".venv" / "bin" / "python").exists():
        raise SystemExit(f"{folder}: not built; make -C {folder} .venv/.test")
    table = (given.out or folder.with_name(f"{folder.name}_mutants.md")).resolve()
    if table.is_relative_to(folder):
        raise SystemExit(f"{table}: tests read the pages of a checkout; take a place outside of it")
    unknown = set(given.only) - {m.number for m in MUTANTS}
    if unknown:
        raise SystemExit(f"no such mutants: {sorted(unknown)}")
    processes = Processes(folder, table.with_suffix(".logs"), given.limit)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        known = fails_without(processes, table.with_suffix(".baseline.json"), given.jobs)
        campaign = Campaign(processes, table, given.tests, known)
        chosen = [m for m in MUTANTS if not given.only or m.number in given.only]
        campaign.run(chosen, given.jobs)
    except KeyboardInterrupt:
        processes.stop()
        raise SystemExit(f"interrupted; {table} holds what is done") from None
    print(table)


def main(words: Sequence[str] | None = None) -> None:
    """Run the command line."""
    given = _parsed(words)
    if given.part == "check":
        wrong = faults_of_table(given.folder)
        if wrong:
            raise SystemExit("\n".join(wrong))
        print(f"{len(MUTANTS)} mutants fit {given.folder}")
    elif given.part == "place":
        changed = place(given.folder)
        print("\n".join(changed))
        print(f"{len(MUTANTS)} mutants in {len(changed) - 2} files; build: "
              f"make -C {given.folder} .venv/.test")  # fmt: skip
    else:
        _run(given)


if __name__ == "__main__":
    main(sys.argv[1:])
