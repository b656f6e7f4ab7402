"""The campaign of odd inputs: every public name is walked, or left out with a reason."""

from __future__ import annotations

import inspect
import random
from types import ModuleType

import pytest
from fuzz import sound
from fuzz.left_out import LEFT_OUT, LONG_NUMBERS, SOUND_ONLY, walked
from fuzz.public_names import METHOD, PROPERTY, public_calls, public_classes

import hexapod_pin as hp


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
