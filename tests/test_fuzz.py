"""Odd inputs through every entry point, which all are: used, or refused with our own error."""

from __future__ import annotations

import importlib
import random
import re
import shutil
from collections.abc import Callable
from typing import Any, ClassVar

import pytest
from fuzz import DOORS, SELDOM, Outcome, attempt, campaign, material, run_campaign, sound
from fuzz.public_names import (
    COPIES,
    LEFT_OUT,
    LONG_NUMBERS,
    METHOD,
    PROPERTY,
    SOUND_ONLY,
    public_calls,
    public_classes,
    walked,
)
from fuzz.watched_folder import WatchedFolder
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.repair.finding import RepairOptions

INPUTS = 15
"""Of each entry point; `make fuzz` tries many more with seeds of the clock."""


@pytest.mark.slow
@pytest.mark.parametrize("door", [door for door in DOORS if door not in SELDOM])
def test_odd_inputs_are_used_or_refused_and_files_of_others_stay(door: str):
    outcomes = [attempt(door, seed) for seed in range(INPUTS)]
    assert [one for one in outcomes if one.kind == "FAULT"] == []
    assert any(one.kind == "refused" for one in outcomes)


PAST: list[tuple[Callable[[], Any], str, Any]] = [
    (lambda: sound.session().command(v={"a": 1}), "Session.command.v", {"a": 1}),
    (lambda: sound.session().command(ramp=2**70), "Session.command.ramp", 2**70),
    (lambda: hp.Scene.from_toml(re.sub(r"source = .*", "", material.scene().to_toml())),
     "robot.source", "None"),
    (lambda: hp.Scene(material.robot(), contact="é"), "Scene.contact", "é"),
    (lambda: hp.Gait.tripod(stroke=0.08, cycle_time=1e150), "Gait.cycle_time", 1e150),
    (lambda: hp.simulate(material.scene(), material.walk(), duration=1e308), "duration", 1e308),
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


@pytest.mark.little_memory
def test_what_dies_is_a_fault_and_another_process_goes_on(monkeypatch: pytest.MonkeyPatch):
    begin, killed = campaign._Worker.begin, list[int]()

    def kill_the_first(worker: Any, task: tuple[str, int]) -> None:
        if not killed:
            worker._process.kill()
            worker._process.join()
        killed.append(task[1])
        begin(worker, task)

    monkeypatch.setattr(campaign._Worker, "begin", kill_the_first)
    found = run_campaign([("height_field", 1), ("height_field", 2)], processes=1)
    assert (found[0].kind, found[0].fault) == ("FAULT", "the process died")
    assert found[1].kind in ("refused", "used")


class PlayedWorker:
    """In the place of a process: input 1 takes too long twice, input 2 always, input 4 crashes."""

    tried: ClassVar[list[int]] = []
    lost = False
    task: tuple[str, int] | None = None
    end = __init__ = lambda *_: None

    def begin(self, task: tuple[str, int]) -> None:
        self.task = task
        self.tried.append(task[1])

    def outcome(self) -> Outcome:
        (door, seed), self.task = self.task or ("", 0), None
        slow = seed == 2 or (seed == 1 and self.tried.count(1) <= 2)
        return Outcome(door, seed, "FAULT" if slow or seed == 4 else "used", "so", slow=slow)


def test_what_takes_too_long_is_tried_again_after_all_others(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(campaign, "_Worker", PlayedWorker)
    monkeypatch.setattr(PlayedWorker, "tried", [])
    reported = list[Outcome]()
    found = run_campaign([("a", k) for k in (1, 2, 3, 4)], processes=1, report=reported.append)
    kinds = {outcome.seed: outcome.kind for outcome in found}
    assert kinds == {1: "used", 2: "FAULT", 3: "used", 4: "FAULT"} and reported == found
    assert PlayedWorker.tried == [1, 2, 3, 4, 1, 2, 1, 2, 2, 2]


@pytest.mark.parametrize(
    ("fault", "path"),
    [
        (lambda tree: (tree.foreign / "precious").write_text("lost"), "foreign/precious"),
        (lambda tree: (tree.work / "linked.nc").write_text("lost"), "foreign/precious.nc"),
        (lambda tree: (tree.work / "notes.txt").unlink(), "work/notes.txt (is gone)"),
        (lambda tree: (tree.foreign / "new").rename(tree.work / "loop.nc"), "work/loop.nc"),
        (lambda tree: (tree.work / "hard.csv").write_text("lost"), "foreign/keys.txt"),
    ],
)
def test_a_changed_file_of_others_is_a_fault_once(fault, path, tmp_path, monkeypatch):
    tree = WatchedFolder(tmp_path)
    (tree.foreign / "new").touch()
    monkeypatch.setattr(material, "watched", lambda: tree)
    doors = {"bad": lambda rng: fault(tree), "good": lambda rng: None}
    monkeypatch.setattr(campaign, "DOORS", doors)
    bad, good = attempt("bad", 1), attempt("good", 1)
    assert bad.kind == "FAULT" and path in bad.fault
    assert good.kind == "used"


script: Any = importlib.import_module("fuzz.__main__")


def test_the_script_counts_by_door_and_groups_faults_by_cause(monkeypatch, capsys):
    def run(inputs: Any, processes: int, report: Any) -> list[Outcome]:
        kinds = {1: "used", 2: "refused"}
        found = [Outcome(door, k, kinds.get(k, "FAULT"), f"lost '{k}'", 0.5) for door, k in inputs]
        list(map(report, found))
        return found

    monkeypatch.setattr(script, "run_campaign", run)
    monkeypatch.setattr(script, "write_byte_code", lambda processes: None)
    given = ["--doors", "session,command_process", "--inputs", "4", "--commands", "1"]
    assert script.main([*given, "--seed", "1"]) == 1
    text, err = capsys.readouterr()
    assert "| session | 4 | 1 | 1 | 2 | 0.500 | 0.50 |" in text
    assert "| command_process | 1 | 1 | 0 | 0 |" in text
    assert text.count("lost") == 1  # two of one cause
    assert "5 of 5 inputs, seeds from 1" in text and err.count("lost") == 2
    assert script.main(["--doors", "session", "--inputs", "2", "--seed", "1"]) == 0


def test_one_input_can_be_tried_again(capsys: pytest.CaptureFixture[str]):
    assert script.main(["--again", "height_field", "3"]) == 0
    assert script.main(["--again", "command_process", "6"]) == 0
    shown = capsys.readouterr().out
    assert "CommandInput(words=" in shown and "Ending(status=" in shown
    folder = re.search(r"^in (.*)$", shown, re.MULTILINE)
    assert folder is not None
    shutil.rmtree(folder[1])


def test_every_public_callable_is_walked_or_left_out_with_a_reason():
    """Constructors, methods and properties of classes too, each of which has a sound instance."""
    calls = set(public_calls())
    assert set(walked()) | set(LEFT_OUT) == calls
    assert all(len(reason) > 10 for reason in (*LEFT_OUT.values(), *SOUND_ONLY.values()))
    wanted = {
        "run_sweep",
        "Gait()",
        "Gait.tripod",
        "Gait.speed",
        "Gait (copies)",
        "view.write_html",
    }
    assert wanted <= set(walked()) and len(calls) > 900
    assert [owner for owner in public_classes() if not sound.instances(owner)] == []
    for entry in (*SOUND_ONLY, *LONG_NUMBERS):
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
            elif call.kind != COPIES:
                call.target(*([instance] if call.kind == METHOD else []), **given)
        except Exception as error:
            refused.append(f"{name}: {type(error).__name__}: {error}")
    assert len(refused) <= 0.03 * len(walked()), refused
