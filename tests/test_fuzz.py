"""Odd inputs through every entry point, which all are: used, or refused with our own error."""

from __future__ import annotations

import importlib
import inspect
import os
import random
import re
import shutil
import signal
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

import pytest
from fuzz import DOORS, SELDOM, Outcome, attempt, material, run_campaign, sound
from fuzz.left_out import LEFT_OUT, LONG_NUMBERS, SOUND_ONLY, walked
from fuzz.public_names import METHOD, PROPERTY, public_calls, public_classes
from fuzz.watched_folder import WatchedFolder
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError, UrdfError
from hexapod_pin.robot.repair.finding import RepairOptions

INPUTS = 6
"""Of each entry point; `make fuzz` tries many more with seeds of the clock."""

IN_PROCESS = [door for door in DOORS if door not in SELDOM]


@pytest.mark.slow
@pytest.mark.parametrize("door", IN_PROCESS)
def test_odd_inputs_are_used_or_refused_and_files_of_others_stay(door: str):
    outcomes = [attempt(door, seed) for seed in range(INPUTS)]
    faults = [one for one in outcomes if one.kind == "FAULT"]
    assert faults == []
    assert any(one.kind == "refused" for one in outcomes)
    assert all(one.watched > 20 and one.changed == 0 for one in outcomes)


def session() -> hp.Session:
    return hp.Session(material.scene(), accuracy=1e-3)


PAST: list[tuple[Callable[[], Any], str, Any]] = [
    (lambda: hp.HeightField.from_array([[0.0, 0.0]] * 2, spacing=b"x"),
     "HeightField.from_array.spacing", b"x"),
    (lambda: session().command(v={"a": 1}), "Session.command.v", {"a": 1}),
    (lambda: session().command(ramp=[1]), "Session.command.ramp", [1]),
    (lambda: session().command(q=""), "Session.command.q", ""),
    (lambda: session().command(ramp=True), "Session.command.ramp", True),
    (lambda: session().command(ramp=2**70), "Session.command.ramp", 2**70),
    (lambda: hp.Scene.from_toml(re.sub(r"source = .*", "", material.scene().to_toml())),
     "robot.source", "None"),
    (lambda: hp.Scene(material.robot(), contact="é"), "Scene.contact", "é"),
    (lambda: hp.Gait.tripod(stroke=0.08, cycle_time=1e150), "Gait.cycle_time", 1e150),
    (lambda: hp.simulate(material.scene(), material.control(), duration=1e308), "duration", 1e308),
    (lambda: hp.Flat(height=-1e308), "Flat.height", -1e308),
    (lambda: hp.HeightField.random(-1), "seed", -1),
    (lambda: RepairOptions(mass=1e18), "RepairOptions.mass", 1e18),
    (lambda: hp.motion.JointMotion({}, cycle_time=()), "JointMotion.cycle_time", ()),
    (lambda: hp.Servo.from_effort(material.robot(), error=0.0), "error", 0.0),
    (lambda: hp.Contact.soil(radius=1e-200), "radius", 1e-200),
    (lambda: hp.sizing.MotorRecord(model="a", voltage=1e308, stall_torque=1),
     "MotorRecord.voltage", 1e308),
]  # fmt: skip
"""Inputs that once ended in an exception that is none of the package's, or in nan."""


@pytest.mark.parametrize(("call", "name", "value"), PAST)
def test_what_once_was_a_fault_is_refused(call: Callable[[], Any], name: str, value: Any):
    with refused(ParameterError, name, value):
        call()


def test_no_file_is_refused():
    """It once was a fault, too."""
    with refused(UrdfError, source="."):
        hp.load_robot("")


@pytest.mark.little_memory
def test_what_dies_is_a_fault_and_another_process_goes_on(monkeypatch: pytest.MonkeyPatch):
    from fuzz import campaign

    monkeypatch.setattr(campaign._Worker, "begin", kill_the_first(campaign._Worker.begin))
    found = run_campaign([("height_field", 1), ("height_field", 2)], processes=1)
    assert (found[0].kind, found[0].fault) == ("FAULT", "the process died")
    assert found[1].kind in ("refused", "used")


class PlayedWorker:
    """In the place of a process: input 1 takes too long twice, input 2 always, input 4 crashes."""

    tried: ClassVar[list[int]] = []
    lost = False
    task: tuple[str, int] | None = None

    def __init__(self, *given: object) -> None:
        """It needs nothing."""

    def begin(self, task: tuple[str, int]) -> None:
        """Take an input."""
        self.task = task
        self.tried.append(task[1])

    def outcome(self) -> Outcome:
        """Be done with it at once."""
        assert self.task is not None
        (door, seed), self.task = self.task, None
        slow = seed == 2 or (seed == 1 and self.tried.count(1) <= 2)
        return Outcome(door, seed, "FAULT" if slow or seed == 4 else "used", "so", slow=slow)

    def end(self) -> None:
        """There is nothing to end."""


def test_what_takes_too_long_is_tried_again_after_all_others(monkeypatch: pytest.MonkeyPatch):
    from fuzz import campaign

    monkeypatch.setattr(campaign, "_Worker", PlayedWorker)
    monkeypatch.setattr(PlayedWorker, "tried", [])
    reported = list[Outcome]()
    found = run_campaign([("a", k) for k in (1, 2, 3, 4)], processes=1, report=reported.append)
    kinds = {outcome.seed: outcome.kind for outcome in found}
    assert kinds == {1: "used", 2: "FAULT", 3: "used", 4: "FAULT"} and reported == found
    assert PlayedWorker.tried == [1, 2, 3, 4, 1, 2, 1, 2, 2, 2]


def kill_the_first(begin: Any) -> Any:
    """Return `begin` of a worker that dies of its first input."""
    killed = []

    def killing(worker: Any, task: tuple[str, int]) -> None:
        first = not killed
        if first:  # it must not be done before it is killed
            os.kill(worker._process.pid, signal.SIGSTOP)
        begin(worker, task)
        if first:
            worker._process.kill()
            worker._process.join()
        killed.append(task)

    return killing


def replaced(path: Path) -> None:
    """Put a file in the place of a link."""
    path.unlink()
    path.write_text("mine", encoding="utf-8")


@pytest.mark.parametrize(
    ("fault", "path"),
    [
        (lambda tree: (tree.foreign / "precious").write_text("lost"), "foreign/precious"),
        (lambda tree: (tree.work / "linked.nc").write_text("lost"), "foreign/precious.nc"),
        (lambda tree: (tree.home / ".profile").chmod(0o777), "home/.profile (mode)"),
        (lambda tree: (tree.work / "notes.txt").unlink(), "work/notes.txt (is gone)"),
        (lambda tree: replaced(tree.work / "loop.nc"), "work/loop.nc"),
        (lambda tree: (tree.work / "hard.csv").write_text("lost"), "foreign/keys.txt"),
    ],
)
def test_a_changed_file_of_others_is_a_fault_once(fault, path, tmp_path, monkeypatch):
    tree = WatchedFolder(tmp_path)
    monkeypatch.setattr(material, "watched", lambda: tree)
    doors = {"bad": lambda rng: fault(tree), "good": lambda rng: None}
    monkeypatch.setattr("fuzz.campaign.DOORS", doors)
    bad, good = attempt("bad", 1), attempt("good", 1)
    assert bad.kind == "FAULT" and bad.changed >= 1 and path in bad.fault
    assert (good.kind, good.changed) == ("used", 0)


def campaign_script() -> Any:
    """Return the module of the command."""
    return importlib.import_module("fuzz.__main__")


def test_the_script_counts_by_door_and_groups_faults_by_cause(tmp_path, monkeypatch, capsys):
    script = campaign_script()

    def run(inputs: Any, processes: int, report: Any) -> list[Outcome]:
        kinds = {1: "used", 2: "refused"}
        found = [
            Outcome(door, seed, kinds.get(seed, "FAULT"), "" if seed in kinds else f"lost '{seed}'",
                    seconds=0.5, watched=40, changed=seed > 2)
            for door, seed in inputs
        ]  # fmt: skip
        for outcome in found:
            report(outcome)
        return found

    monkeypatch.setattr(script, "run_campaign", run)
    monkeypatch.setattr(script, "write_byte_code", lambda processes: None)
    page = tmp_path / "page.md"
    given = ["--doors", "session,command_process", "--inputs", "4", "--commands", "1"]
    assert script.main([*given, "--seed", "1", "--page", str(page)]) == 1
    text = page.read_text(encoding="utf-8")
    assert "| session | 4 | 1 | 1 | 2 | 0.500 | 0.50 | 160 | 2 |" in text
    assert "| command_process | 1 | 1 | 0 | 0 |" in text
    assert text.count("lost") == 1  # two of one cause
    assert "5 of 5 inputs, 2 faults" in capsys.readouterr().err
    assert script.main(["--doors", "session", "--inputs", "2", "--seed", "1"]) == 0


def test_one_input_can_be_tried_again(capsys: pytest.CaptureFixture[str]):
    assert campaign_script().main(["--again", "height_field", "3"]) == 0
    assert campaign_script().main(["--again", "command_process", "6"]) == 0
    shown = capsys.readouterr().out
    assert "hexapod" in shown and "Ending(status=" in shown
    folder = re.search(r"^in (.*)$", shown, re.MULTILINE)
    assert folder is not None
    shutil.rmtree(folder[1])


# names ----------------------------------------------------------------------------------------


def public_names(room: ModuleType, prefix: str = "") -> set[str]:
    """Names of a room found another way: by `dir`."""
    listed = getattr(room, "__all__", None) or [
        name for name, value in inspect.getmembers(room)
        if not name.startswith("_") and getattr(value, "__module__", "") == room.__name__
    ]  # fmt: skip
    found = set()
    for name in listed:
        value = getattr(room, name)
        if isinstance(value, ModuleType):
            if value in (hp.errors, hp.view):  # of other rooms, what `public_surface` lists
                found |= public_names(value, f"{prefix}{name}.")
        elif inspect.isclass(value):
            found.add(f"{prefix}{name}()")
        elif callable(value):
            found.add(f"{prefix}{name}")
    return found


def test_every_public_callable_is_walked_or_left_out_with_a_reason():
    """Constructors, methods and properties of classes too, each of which has a sound instance."""
    calls = set(public_calls())
    assert public_names(hp) <= calls
    assert set(walked()) | set(LEFT_OUT) == calls
    assert not set(walked()) & set(LEFT_OUT)
    assert all(len(reason) > 10 for reason in (*LEFT_OUT.values(), *SOUND_ONLY.values()))
    wanted = {
        "run_sweep", "select_motors", "torque_map", "gait_energy", "tune", "judge_peaks", "compare",
        "Gait()", "Gait.tripod", "Gait.by_name", "Gait.feet_down", "Gait.speed", "Gait (copies)",
        "Trace.save", "Trace.summary", "SweepResult.dataset", "view.write_html",
        "errors.ParameterError()", "errors.ParameterError (copies)",
    }  # fmt: skip
    assert wanted <= set(walked())
    assert [owner for owner in public_classes() if not sound.instances(owner)] == []


@pytest.mark.parametrize("table", [SOUND_ONLY, LONG_NUMBERS])
def test_parameters_that_are_left_out_exist(table: dict[str, str]):
    for entry in table:
        name, _, parameter = entry.rpartition(".")
        assert parameter in public_calls()[name].parameters()


@pytest.mark.slow
def test_arguments_meant_to_be_sound_are_used():
    """Else odd arguments are refused for another reason than their own."""
    refused = []
    for name in walked():
        call, rng = public_calls()[name], random.Random(1)
        instance = sound.instances(call.owner)[0] if isinstance(call.owner, type) else None
        try:
            given = sound.arguments(call, rng, instance)
            if call.kind == PROPERTY:
                getattr(instance, call.attribute)
            elif call.attribute or call.kind not in (METHOD, "copies"):
                call.target(*([instance] if call.kind == METHOD else []), **given)
        except Exception as error:
            refused.append(f"{name}: {type(error).__name__}: {error}")
    assert len(refused) <= 0.03 * len(walked()), refused
