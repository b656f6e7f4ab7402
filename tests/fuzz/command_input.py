"""Draws a command line together with the process, the folder and the files that it meets."""

from __future__ import annotations

import contextlib
import os
import random
import re
import signal
import stat
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, get_type_hints

import typer

import hexapod_pin as hp
from fuzz import material
from fuzz.values import ESCAPE, NUMBERS, WORDS, odd_text
from fuzz.watched_folder import HAZARDS, WatchedFolder
from hexapod_pin.drive.catalog.catalog import catalog_text

COMMANDS: tuple[tuple[str, ...], ...] = (
    ("walk", "robot.urdf", "--duration", "0.02", "--quick", "--no-estimate", "--no-html"),
    ("walk", "kharagpur", "--duration", "0.02", "--quick", "--no-estimate"),
    ("run", "case.toml", "--quick", "--no-html"),
    ("check", "robot.urdf"), ("check", "robot.urdf", "--write"),
    ("repair", "robot.urdf", "--out", "repaired.urdf"), ("contact", "s1"), ("contact", "s2"),
    ("budget", "walk.nc"), ("budget", "walk.nc", "--catalog-file", "motors.csv"),
    ("stability", "walk.nc"), ("compare", "case.toml", "--controllers", "conventional,slip"),
    ("compare", "case.toml", "--bumps", "0.01", "--seeds", "1"),
    ("sweep", "study.toml"), ("sweep", "study.toml", "--store", "done.db", "--resume"),
    ("sweep", "study.toml", "--processes", "2"),
    ("select", "kharagpur", "motors.toml", "--quick", "--no-html", "--catalog", "motors.csv"),
    ("bench", "kharagpur", "--quick", "--methods", "rk4", "--duration", "0.02", "--rounds", "1"),
    ("export", "kharagpur", "robot.xml", "--duration", "0.5"),
    ("export", "robot.urdf", "sound.urdf"), ("export", "case.toml", "gait.yaml"),
    ("export", "walk.nc", "walk.mcap"), ("export", "walk.nc", "walk.csv.gz"),
    ("verify", "--only", "gait-form"), ("--version",), ("--help",), ("sweep", "--help"), ("view",),
)  # fmt: skip
"""Commands that end soon, with files of `sound_files`. `view` stays until Ctrl-C."""

OUTPUTS: Mapping[str, tuple[str, ...]] = {
    "walk": ("--out", "--html", "--save-case"), "run": ("--out", "--html"), "repair": ("--out",),
    "contact": ("--out",), "sweep": ("--store", "--out", "--plot", "--report"),
    "select": ("--html", "--csv", "--store"),
    "compare": ("--html", "--figure", "--report", "--json", "--store"),
    "bench": ("--out", "--plot"), "verify": ("--out",), "export": ("OUT",),
}  # fmt: skip
"""Options that name a file to write; "OUT": the word at `OUT` does."""

OUT = 2
"""Place of the word that names the file to write, in a command without an option for it."""

DEFAULT_OUTPUTS: Mapping[str, tuple[str, ...]] = {
    "walk": ("walk.nc", "walk.html"), "run": ("run.nc", "run.html"), "contact": ("contact.png",),
    "select": ("motors.html",), "sweep": ("study.db",),
}  # fmt: skip
"""What a command writes where no option names it."""

BESIDE_INPUT: Mapping[str, tuple[str, str]] = {
    "sweep": (".toml", ".db"), "check": (".urdf", ".hints.toml"),
}  # fmt: skip
"""Endings of what a command reads and of what it writes beside that, under the same name."""

ENDINGS: Mapping[str, tuple[str, ...]] = {
    "--html": (".html",), "--save-case": (".toml",), "--store": (".db",), "--csv": (".csv",),
    "--plot": (".png", ".svg"), "--figure": (".png", ".pdf"), "--json": (".json",),
    "--report": (".html",), "repair --out": (".urdf",), "contact --out": (".png",),
    "bench --out": (".md", ".json", ".csv"), "verify --out": (".md",),
    "export OUT": (".xml", ".urdf", ".yaml", ".mcap", ".csv", ".csv.gz"),
}  # fmt: skip
"""Endings of files to write; of a trace where nothing is said here."""

TRACE_ENDINGS = (".nc", ".csv", ".h5", ".csv.gz")

BESIDE = ("-lock", "-journal", "-wal", "-shm", ".lock", ".tmp")
"""What is put after the name of a file that is written, by this package or by SQLite."""

STREAMS = ("closed", "full", "leaves", "slow", "terminal")

ENVIRONMENTS: tuple[Mapping[str, str | None], ...] = (
    {"LC_ALL": "POSIX", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}, {"PATH": None},
    {"HOME": None}, {"HOME": "/dev/null/home"}, {"COLUMNS": "x", "LINES": "-1"}, {"COLUMNS": "1"},
    {"FORCE_COLOR": "1"}, {"TERM": "dumb"}, {"PYTHONIOENCODING": "ascii"}, {"TZ": "nowhere"},
    {"TMPDIR": "/dev/null/tmp"}, {"PYTHONWARNINGS": "error"}, {"PYTHONOPTIMIZE": "2"},
    {"OMP_NUM_THREADS": "x"}, {"ROS_PACKAGE_PATH": "/dev/zero:/proc"}, {"MPLBACKEND": "nonsense"},
)  # fmt: skip
"""Changes of the environment; None takes a variable away."""

LIMITS: tuple[tuple[str, int], ...] = (
    ("FSIZE", 0), ("FSIZE", 512), ("FSIZE", 30_000), ("FSIZE", 200_000), ("NOFILE", 8),
    ("NOFILE", 16), ("NOFILE", 32), ("AS", 300 << 20), ("AS", 500 << 20), ("AS", 1 << 30),
    ("AS", 2 << 30), ("CORE", 0), ("STACK", 1 << 20),
)  # fmt: skip
"""Limits of the process, by their names in `resource` without RLIMIT_."""

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

FIRST_SIGNAL = 0.2
"""Processor time before which a signal meets Python itself, not yet the package [s]."""

TRAPS = ("struct.py", "json.py", "random.py", "numpy.py", "sitecustomize.py", "hexapod_pin.py")
"""Modules in the working folder that nothing may import."""

LEFT_OUT = {"--help", "--force", "--show", "--hard", "--all", "--engines", "--peers", "--rounds"}
"""Options that ask for long work, or say what is said anyway."""

STIFF = {"--kp", "--kd", "--duration", "--advise", "--contact", "--cycle-time"}
"""Options of `bench` that make its references long work; what it is given of them stays."""


@dataclass
class CommandInput:
    """A command as a process, and what it meets.

    It may write files that are `named`, and must where they are `promised`; where it is `exact`,
    nothing else may be new. `plants` lay things down in its folder. `streams` are kinds of stdin,
    stdout and stderr; a reader leaves `after` some bytes. Signals come at a processor time [s],
    some to all of its processes.
    """

    words: list[str]
    script: bool = False
    named: set[Path] = field(default_factory=set)
    promised: set[Path] = field(default_factory=set)
    plants: list[Callable[[Path], object]] = field(default_factory=list)
    streams: list[str] = field(default_factory=lambda: ["", "", ""])
    after: int = 0
    environment: Mapping[str, str | None] = field(default_factory=dict)
    umask: int | None = None
    gone: bool = False
    limits: list[tuple[str, int]] = field(default_factory=list)
    ignored: bool = False
    signals: list[tuple[float, int, bool]] = field(default_factory=list)
    exact: bool = True


@cache
def sound_files() -> Mapping[str, bytes]:
    slow = hp.KinematicControl(hp.Gait.tripod(stroke=0.08, cycle_time=1.2))
    case = hp.Case(material.scene(), slow, duration=3.9, method="robust", step=2e-3)
    records = [one for one in hp.load_catalog().records if one.model in ("AX-12A", "MX-106")]
    texts = {
        "robot.urdf": material.urdf_text(), "case.toml": case.to_toml(),
        "study.toml": material.SHORT_STUDY, "motors.toml": material.MOTORS_TEXT,
        "motors.csv": catalog_text(tuple(records)), "controllers.py": "A = 1\n",
    }  # fmt: skip
    sound = {name: text.encode() for name, text in texts.items()}
    walk = case.run().save(material.new_file("nc")).read_bytes()
    return {**sound, "walk.nc": walk, "done.db": material.store_bytes()}


@cache
def options(kind: str = "") -> dict[str, list[str]]:
    """Return the options of each command, those whose type is called so."""
    from hexapod_pin.commands.app import app

    callbacks = [one.callback for one in app.registered_commands if one.callback]
    hints = {one.__name__: get_type_hints(one) for one in callbacks}
    group: Any = typer.main.get_command(app)
    return {
        name: [
            option for one in command.params for option in one.opts
            if option.startswith("--") and kind in str(hints[name].get(one.name))
        ]
        for name, command in group.commands.items()
    }  # fmt: skip


def odd_options(command: Sequence[str], rng: random.Random) -> list[str]:
    name, *words = command
    left_out = LEFT_OUT | STIFF if name == "bench" else LEFT_OUT
    known = [one for one in options().get(name, ()) if one not in left_out]
    for option in rng.sample(known, min(len(known), rng.choice((1, 1, 2, 3)))):
        words.append(option)
        if rng.random() < 0.8:
            words.append(str(rng.choice(rng.choice((NUMBERS, WORDS, HAZARDS)))))
    if words and rng.random() < 0.2:
        k = rng.randrange(len(words))
        if k == 0 or words[k - 1] not in left_out:
            words[k] = odd_text(words[k], rng)
    return [name, *words]


def draw(rng: random.Random, tree: WatchedFolder) -> CommandInput:
    """Draw an input for a tree, whose working folder holds `sound_files`."""
    command = list(rng.choice(COMMANDS))
    found = CommandInput(command, script=rng.random() < 0.6)
    if rng.random() < 0.35:
        found.exact, found.words = False, odd_options(command, rng)
    if command[0] in OUTPUTS and rng.random() < 0.5:
        _odd_output(found, rng)
    if rng.random() < 0.4:
        _odd_input(found, rng)
    names = DEFAULT_OUTPUTS.get(command[0], ())
    if names and rng.random() < 0.25:
        found.plants.append(_taken(f"{rng.choice(names)}{rng.choice(('', *BESIDE))}", rng))
    if found.script and rng.random() < 0.2:
        found.plants += [_file(name, b'open("RUN", "w")\n') for name in rng.sample(TRAPS, 2)]
    _odd_process(found, rng)
    _name_outputs(found, tree)
    return found


_HOME = re.compile(r"(^|=)~")
"""A word that names the home folder, also as the value of an option: `--out=~/x.md`."""


def _odd_process(found: CommandInput, rng: random.Random) -> None:
    if rng.random() < 0.35:
        for k in rng.sample((1, 2), rng.choice((1, 1, 2))):
            found.streams[k] = rng.choice(STREAMS)
        found.after = rng.choice((0, 1, 10, 100, 1000))
    if rng.random() < 0.15:
        found.streams[0] = rng.choice(("closed", "endless"))
    if rng.random() < 0.25:
        found.environment = rng.choice(ENVIRONMENTS)
    if "HOME" in found.environment and any(_HOME.search(word) for word in found.words):
        found.environment = {}  # else it would be written to another home than that of the tree
    if rng.random() < 0.1:
        found.umask = rng.choice((0o777, 0, 0o077))
    if rng.random() < 0.15:
        found.limits = [rng.choice(LIMITS)]
    found.gone = rng.random() < 0.08
    if not found.gone and rng.random() < 0.08:
        found.plants.append(lambda work: work.chmod(0o555))
    found.ignored = rng.random() < 0.1
    if rng.random() < 0.2:
        for _ in range(rng.choice((1, 1, 1, 2))):
            at, number = rng.uniform(FIRST_SIGNAL, 1.5), rng.choice(SIGNALS)
            found.signals.append((at, number, rng.random() < 0.3))
        found.signals.sort()


def _odd_output(found: CommandInput, rng: random.Random) -> None:
    name = found.words[0]
    option = rng.choice(OUTPUTS[name])
    endings = ENDINGS.get(f"{name} {option}", ENDINGS.get(option, TRACE_ENDINGS))
    ending = rng.choice(endings) if rng.random() < 0.9 else rng.choice(("", ".txt", "."))
    path = f"out{ending}"
    if rng.random() < 0.4:
        path = rng.choice((*_odd_names(ending), *sound_files()))
    else:
        found.plants.append(_taken(path, rng))
    found.words = _with_option(found.words, option, path, rng)


def _odd_names(ending: str) -> tuple[str, ...]:
    return (
        f"{ESCAPE}{ending}", f"a\nb{ending}", f"\udcff\udc80{ending}",
        f"-x{ending}", f"--help{ending}", f"=HYPERLINK(1){ending}", f"{'é' * 100}{ending}",
        f"{'x' * 250}{ending}", f"{'x/' * 3000}x{ending}", f"linked_folder/x{ending}", f" {ending}",
        f"no/such/x{ending}", f"~/x{ending}", f"~nobody-here/x{ending}", "", ".", "..", "/", "~",
        f"x{ending}/", f"data/../x{ending}", f"%s%n{ending}", f"x\r{ending}", f"\u202ex{ending}",
        f"/dev/fd/1{ending}", f"/proc/self/x{ending}", f"$(touch RUN){ending}", ending,
        f"\x9bx{ending}",
    )  # fmt: skip


def _file(name: str, content: bytes, mode: int = 0o644) -> Callable[[Path], object]:
    def write(work: Path) -> None:
        (work / name).write_bytes(content)
        (work / name).chmod(mode)

    return write


def _taken(name: str, rng: random.Random) -> Callable[[Path], object]:
    """Return what puts something that is no plain file of the user's at a path."""
    targets = ("../foreign/precious", "../foreign/not_there", "../foreign/below", "/dev/full", name)
    device = rng.choice((3, 7))
    return rng.choice((
        *(lambda work, to=to: (work / name).symlink_to(to) for to in targets),
        lambda work: os.mkfifo(work / name), lambda work: (work / name).mkdir(),
        lambda work: (work / name).hardlink_to(work.parent / "foreign/keys.txt"),
        lambda work: os.mknod(work / name, stat.S_IFCHR | 0o666, os.makedev(1, device)),
        _file(name, b"mine\n"), _file(name, b"mine\n", 0o400),
    ))  # fmt: skip


def _with_option(words: list[str], option: str, value: str, rng: random.Random) -> list[str]:
    """Return words with an option, in one word or two; where it is given twice the last counts."""
    if option == "OUT":
        return [*words[:OUT], value, *words[OUT + 1 :]]
    return [*words, *([f"{option}={value}"] if rng.random() < 0.3 else [option, value])]


def _odd_input(found: CommandInput, rng: random.Random) -> None:
    """Put something else where a file is read, change it, or read it under an odd name."""
    name, sound = found.words[0], [k for k, word in enumerate(found.words) if word in sound_files()]
    named = [one for one in options("Path").get(name, ()) if one not in OUTPUTS.get(name, ())]
    if named and (not sound or rng.random() < 0.2):
        path = rng.choice(("controllers.py", "motors.csv", *_ENDLESS))
        found.words = _with_option(found.words, rng.choice(named), path, rng)
    elif sound:
        k = rng.choice(sound)
        word, content = found.words[k], sound_files()[found.words[k]]
        how = rng.choice(("other", "odd name", "content"))
        if how == "other":
            found.words[k] = rng.choice((*_ENDLESS, *sound_files()))
        elif how == "odd name":
            names = [one for one in _odd_names(Path(word).suffix) if 5 < len(one) < 200]
            found.words[k] = rng.choice([one for one in names if "/" not in one])
            found.plants.append(_file(found.words[k], content))
        else:
            text = odd_text(content.decode("latin-1"), rng)
            found.plants.append(_file(word, text.encode("latin-1", "replace")))
            found.exact = False


_ENDLESS = (
    "/dev/zero", "/dev/random", "/dev/stdin", "/proc/self/mem", "/proc/kmsg", "pipe.nc",
    "folder.nc", "loop.nc", "huge.nc", "null.nc", "zero.toml", "/", "/proc/self/environ",
    "nothing_there", "linked.nc", "linked.csv",
)  # fmt: skip
"""What no command can read; `huge.nc` is laid down as a sparse file of a terabyte."""


def _name_outputs(found: CommandInput, tree: WatchedFolder) -> None:
    """Note which files the command is told to write; what it reads it may not write."""
    name, words = found.words[0], found.words
    writing, values, others = (*OUTPUTS.get(name, ()), "-o"), list[str](), list[str]()
    for k, (before, word) in enumerate(zip(["", *words], words, strict=False)):
        option, equals, value = word.partition("=")
        if before in writing or (k == OUT and "OUT" in writing):
            values.append(word)
        elif equals and option in writing:
            values.append(value)
        else:
            others.append(word)
    read = {tree.work / word for word in others if word in sound_files()}
    old, new = BESIDE_INPUT.get(name, ("", ""))
    beside = [word.removesuffix(old) + new for word in others if old and word.endswith(old)]
    for value in (*values, *DEFAULT_OUTPUTS.get(name, ()), *beside):
        found.named |= _paths(value, tree) - read
    if name == "sweep" and {"--resume", "--retry-failed"} & set(words):
        found.named |= _paths("done.db", tree)
    if found.exact and "--no-html" not in words:
        for value in values:
            found.promised |= _paths(value, tree) & found.named


def _paths(value: str, tree: WatchedFolder) -> set[Path]:
    """Return the absolute paths of what a word names, its folder's links followed or not."""
    if not value or "\0" in value:
        return set()
    path = os.path.join(tree.work, f"{tree.home}/{value[2:]}" if value[:2] == "~/" else value)
    folder = str(tree.work)
    with contextlib.suppress(OSError):
        folder = os.path.realpath(os.path.dirname(path))
    return {Path(os.path.normpath(path)), Path(folder, os.path.basename(path))}


def lay_down(found: CommandInput, tree: WatchedFolder) -> None:
    write_sound_files(tree.work)
    with (tree.work / "huge.nc").open("wb") as stream:
        stream.truncate(1 << 40)
    for plant in found.plants:
        with contextlib.suppress(OSError, ValueError):  # taken, too long, a node for root
            plant(tree.work)
    tree.watch()


def write_sound_files(folder: Path) -> None:
    for name, content in sound_files().items():
        (folder / name).write_bytes(content)
