"""Commands that are killed, or asked to stop, at random moments: is anything broken or lost?"""

from __future__ import annotations

import random
import signal
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from hexapod_pin.text_table import Table
from studies.kills.killed_process import (
    Ending,
    KilledProcess,
    broken_file,
    left_over,
)
from studies.kills.sweep_kills import TEXT, finished
from studies.study import StudyReport, verdict

WALK = ("--gait", "tripod", "--stroke", "0.04", "--cycle-time", "0.3", "--quick")

SIGNALS = (signal.SIGKILL, signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

LATER = 1.1
"""Latest moment over the time that the command takes undisturbed [-]."""


@dataclass(frozen=True)
class KilledCommand:
    """A command that is killed.

    Attributes:
        name: of the command.
        words: of its command line.
        count: how many finished parts its files hold, which must never fall; None: not counted.
    """

    name: str
    words: tuple[str, ...]
    count: Callable[[Path], int] | None = None


@dataclass
class Tally:
    """What the stops of one command by one signal came to.

    Attributes:
        stops: how many met the command at work.
        late: how many came after its end.
        saved: how many left a trace of what was done.
        broken: files that cannot be read.
        lost: finished cases that are gone.
        status: other statuses than 128 + n.
        lines: times that stderr was not one line.
        alive: processes left.
        orphans: temporary files left by kills.
        swept: whether none is left after the next run.
        findings: what is wrong, in words.
    """

    stops: int = 0
    late: int = 0
    saved: int = 0
    broken: int = 0
    lost: int = 0
    status: int = 0
    lines: int = 0
    alive: int = 0
    orphans: int = 0
    swept: bool = True
    findings: list[str] = field(default_factory=list)

    @property
    def good(self) -> bool:
        """Whether nothing is wrong."""
        wrong = self.broken + self.lost + self.status + self.lines + self.alive
        return wrong == 0 and self.swept

    def row(self, command: str, number: signal.Signals) -> list[str]:
        """Return the row of a table."""
        counts = (self.stops, self.late, self.saved, self.broken, self.lost, self.status,
                  self.lines, self.alive, self.orphans)  # fmt: skip
        after = "none" if self.swept else "SOME"
        return [command, number.name, *map(str, counts), after, verdict(self.good)]


def command_kills(
    *,
    kills: int = 200,
    signals: int = 100,
    seed: int = -1,
    cases: int = 60,
    duration: float = 6.0,
    only: str = "walk,run,sweep,bench,compare",
) -> StudyReport:
    """Stop walk, run, sweep, bench and compare at random moments; -1: a seed drawn anew.

    `kills` and `signals` (each of SIGINT, SIGTERM, SIGHUP) are shared by the commands in `only`.
    """
    seed = random.SystemRandom().randrange(10**6) if seed < 0 else seed
    print(f"seed {seed}", file=sys.stderr, flush=True)
    rng = random.Random(seed)
    rows, findings, taken = [], [], {}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        chosen = only.split(",")
        commands = _commands(folder, duration, cases, seed, chosen)
        for k, command in enumerate(commands):
            taken[command.name] = _undisturbed(command, folder)
            for number in SIGNALS:
                total = kills if number == signal.SIGKILL else signals
                share = total // len(commands) + (k < total % len(commands))
                if not share:
                    continue
                tally = _stopped(command, folder, number, share, taken[command.name], rng)
                rows.append(tally.row(command.name, number))
                findings += [f"{command.name}, {number.name}: {text}" for text in tally.findings]
                told = [" ".join(rows[-1]), *tally.findings]
                print(*told, sep="\n  ", file=sys.stderr, flush=True)
    heads = ["command", "signal", "stopped at work", "after its end", "part of a trace saved",
             "broken files", "finished cases lost", "other status", "not one line",
             "processes left", "temporary files left", "after the next run", "result"]  # fmt: skip
    times = ", ".join(f"{name} {seconds:.1f} s" for name, seconds in taken.items())
    parts: list[str | Table] = [
        f"Commands as processes of their own, stopped at moments drawn evenly from the time that "
        f"their signal handlers are there to {LATER:g} times the time they take undisturbed "
        f"({times}); seed {seed}. After every stop each file is read, and no process may be left; "
        "after the last one the command runs to its end, and no temporary file may be left. A "
        "sweep goes on with its store, whose finished cases never become fewer. A signal must end "
        "in status 128 + n and one line on stderr.",
        Table("", heads, rows),
    ]
    if findings:
        parts.append("\n".join(f"- {text}" for text in findings))
    return StudyReport("Commands that are killed", parts)


def _commands(
    folder: Path, duration: float, cases: int, seed: int, chosen: Sequence[str]
) -> list[KilledCommand]:
    """Return the chosen commands, with the files that they read in the folder."""
    walk = ("walk", "kharagpur", *WALK, "--duration", f"{duration:g}")
    if {"run", "compare"} & set(chosen):  # they read the case of a walk
        ending = KilledProcess((*walk, "--save-case", "case.toml"), folder).wait()
        if ending.status != 0:
            raise RuntimeError(f"the walk of the study failed: {ending.err}")
    study = TEXT.format(duration=0.9, cases=cases, seed=seed)
    (folder / "study.toml").write_text(study, encoding="utf-8")
    bench = ("bench", "kharagpur", "--quick", "--methods", "rk4,implicit-euler", "--rounds", "1",
             "--duration", "0.3", "--gait", "tripod", "--stroke", "0.04", "--cycle-time", "0.3",
             "--out", "bench.md")  # fmt: skip
    sweep = ("sweep", "study.toml", "--resume", "--processes", "2", "--out", "study.nc")
    compare = ("compare", "case.toml", "--controllers", "conventional,slip", "--json",
               "compare.json", "--html", "compare.html")  # fmt: skip
    commands = [
        KilledCommand("walk", walk),
        KilledCommand("run", ("run", "case.toml", "--quick", "--out", "run.nc")),
        KilledCommand("sweep", sweep, lambda place: finished(place / "study.db")),
        KilledCommand("bench", bench),
        KilledCommand("compare", compare),
    ]
    return [command for command in commands if command.name in chosen]


def _undisturbed(command: KilledCommand, folder: Path) -> float:
    """Return the time that a command takes, from when its handlers are there [s]."""
    process = KilledProcess(command.words, folder)
    process.wait_for_handlers()
    ending = process.wait()
    if ending.status != 0:
        raise RuntimeError(f"{command.name} failed undisturbed: {ending.err}")
    return ending.time


def _stopped(
    command: KilledCommand,
    folder: Path,
    number: signal.Signals,
    count: int,
    taken: float,
    rng: random.Random,
) -> Tally:
    """Stop a command so many times, and run it to its end after that."""
    tally, kept = Tally(), 0
    for _ in range(count):
        if command.count is not None and rng.random() < 1.0 / 3.0:
            (folder / "study.db").unlink(missing_ok=True)
            kept = 0
        process = KilledProcess(command.words, folder)
        process.wait_for_handlers()
        process.wait(rng.uniform(0.0, LATER * taken))
        if process.running:
            process.send(number)
            _judge(tally, process.wait(), number)
        else:
            process.wait()
            tally.late += 1
        tally.alive += process.left_alive()
        for path in sorted(folder.iterdir()):
            if (why := broken_file(path)) is not None:
                tally.broken += 1
                tally.findings.append(why)
        if command.count is not None:
            now = command.count(folder)
            tally.lost += max(0, kept - now)
            kept = now
    tally.orphans = len(left_over(folder))
    last = KilledProcess(command.words, folder).wait()
    tally.swept = not left_over(folder) and last.status == 0
    if not tally.swept:
        tally.findings.append(f"after the last run: {last.err} {left_over(folder)}")
    return tally


def _judge(tally: Tally, ending: Ending, number: signal.Signals) -> None:
    """Judge how a process ended that was sent a signal at work."""
    if ending.status == 0:
        tally.late += 1  # it was ending, or had ended, when the signal came
        return
    tally.stops += 1
    wanted = -number if number == signal.SIGKILL else 128 + number
    if ending.status != wanted:
        tally.status += 1
        tally.findings.append(f"status {ending.status}: {ending.err[-300:]!r}")
    lines = ending.err.splitlines()
    if number != signal.SIGKILL and len(lines) != 1:
        tally.lines += 1
        tally.findings.append(f"stderr {ending.err[-600:]!r}")
    tally.saved += "done so far are in" in ending.err
