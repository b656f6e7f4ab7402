"""Studies: points, and the cases that come of them by the package's own functions."""

from __future__ import annotations

import hashlib
import json
import math
import pickle
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.control.feasible_gait import fit_gait
from hexapod_pin.drive.catalog import load_catalog
from hexapod_pin.errors import ParameterError
from hexapod_pin.scene.loads import MassFactor
from hexapod_pin.simulation.case_data import case_to_dict
from hexapod_pin.study import random_bumps
from hexapod_pin.study.sweep import SweepStudy, load_sweep
from hexapod_pin.study.sweep.base_case import BaseWalk
from hexapod_pin.study.sweep.design import KINDS
from hexapod_pin.study.sweep.distributions import DISTRIBUTIONS
from hexapod_pin.study.sweep.study_file import INPUTS

BASE = '[base]\nrobot = "kharagpur"\ngait = "tripod"\nduration = 1.0\n'
SAMPLED = (
    '[[vary]]\ninput = "mu"\ndistribution = "uniform"\nlow = 0.4\nhigh = 0.9\n'
    '[[vary]]\ninput = "payload"\ndistribution = "normal"\nmean = 0.3\ndeviation = 0.2\nlow = 0.0\n'
)


def study(vary: str, design: str = "", base: str = BASE) -> SweepStudy:
    """A study of tables of a file."""
    return SweepStudy.from_toml(f"schema = 1\n{base}{vary}{design}")


def one(name: str, value: Any, options: str = "", base: str = BASE) -> hp.Case:
    """The case of a single value of an input."""
    kind = "path" if "." in name else "input"
    of = study(f'[[vary]]\n{kind} = "{name}"\nvalues = [{value}]\n{options}\n', base=base)
    assert len(of) == 1
    return of.case(0)


def test_a_grid_is_full_and_in_order() -> None:
    """The last axis changes fastest, and every pair is there once."""
    of = study(
        '[[vary]]\ninput = "stroke"\nvalues = [0.06, 0.1]\n'
        '[[vary]]\ninput = "mu"\nvalues = [0.5, 0.7, 0.9]\n'
    )
    points = [(p["stroke"], p["mu"]) for p in map(of.point, range(len(of)))]
    assert points == [(s, f) for s in (0.06, 0.1) for f in (0.5, 0.7, 0.9)]
    assert of.shape == (2, 3)
    case = of.case(4)
    assert case.controller.gait.stroke == 0.1  # type: ignore[union-attr]
    assert case.scene.contact.friction.mu == 0.7  # type: ignore[union-attr]


def test_a_grid_is_crossed_with_the_same_samples() -> None:
    """Each grid point has the same rows of the design."""
    of = study(
        SAMPLED + '[[vary]]\ninput = "stroke"\nvalues = [0.06, 0.1]\n',
        '[design]\nkind = "sobol"\nsamples = 8\nseed = 1\n',
    )
    assert len(of) == 16
    for k in range(8):
        first, second = of.point(k), of.point(k + 8)
        assert (first.pop("stroke"), second.pop("stroke")) == (0.06, 0.1)
        assert first == second


def test_what_each_input_changes() -> None:
    """Every input does what the package's own function does, and nothing else."""
    base = one("stroke", 0.1)
    scene = base.scene
    expected = {
        ("mu", 0.4): replace(scene, contact=scene.contact.with_mu(0.4)),
        ("contact_stiffness", 2.0): replace(scene, contact=scene.contact.stiffer(2.0)),
        ("servo_stiffness", 0.5): replace(scene, servo=scene.servos.stiffer(0.5)),
        ("payload", 0.3): replace(scene, loads=[hp.Payload("base_link", 0.3)]),
        ("payload", 0.0): scene,
        ("mass", 1.1): replace(scene, loads=[MassFactor(1.1)]),
        ("trunk_mass", 1.1): replace(scene, loads=[MassFactor(1.1, ("base_link",))]),
        ("scene.contact.friction.damping", 30.0): replace(
            scene,
            contact=hp.Contact(
                normal=scene.contact.normal,
                friction=hp.contact.StickSlip(mu=0.7, stiffness=2e4, damping=30.0),
                assumed=scene.contact.assumed,
            ),
        ),
        ("scene.gravity.2", -3.7): replace(scene, gravity=(0.0, 0.0, -3.7)),
    }
    gait = '[base]\nrobot = "kharagpur"\nduration = 1.0\ngait = {name = "tripod", stroke = 0.1}\n'
    for (name, value), wanted in expected.items():
        assert one(name, value, base=gait) == replace(base, scene=wanted), name


def test_what_inputs_change_of_a_gait() -> None:
    """Gait inputs replace fields; a speed sets the cycle, beside a cycle time the stroke."""

    def gait(name: str, value: Any) -> hp.Gait:
        found: hp.Gait = one(name, value).controller.gait  # type: ignore[union-attr]
        return found

    plain = gait("stroke", 0.14)
    for name in ("stroke", "cycle_time", "lift", "heading", "turn_rate"):
        assert gait(name, 0.05) == plain.with_changes(**{name: 0.05})
    assert gait("heading_deg", 90).heading == pytest.approx(math.pi / 2)
    assert gait("turn_rate_deg", -18).turn_rate == pytest.approx(-math.pi / 10)
    faster = gait("speed", 0.1)
    assert faster.speed == pytest.approx(0.1)
    assert faster.stroke == plain.stroke
    both = study(
        '[[vary]]\ninput = "speed"\nvalues = [0.1]\n[[vary]]\ninput = "cycle_time"\nvalues = [2]\n'
    ).case(0)
    assert both.controller.gait.stroke == pytest.approx(0.1 * 0.5 * 2.0)  # type: ignore[union-attr]
    wave = one("duty", 0.75, base='[base]\nrobot = "kharagpur"\ngait = "wave"\nduration = 1\n')
    assert wave.controller.gait.phases == hp.Gait.wave(0.75).phases  # type: ignore[union-attr]


def test_a_gait_of_another_name_is_fitted() -> None:
    """Without numbers each gait is as `hexapod-pin walk` has it; numbers of the base are kept."""
    vary = '[[vary]]\ninput = "gait"\nvalues = ["wave", "tripod"]\n'
    plain = study(vary, base='[base]\nrobot = "athena"\nduration = 1.0\n')
    robot = plain.base.scene.robot
    for k, name in enumerate(("wave", "tripod")):
        assert plain.case(k).controller.gait == fit_gait(robot, name).gait  # type: ignore[union-attr]
    kept = study(vary, base='[base]\nrobot = "athena"\nduration = 1\n[base.gait]\nstroke = 0.05\n')
    assert {kept.case(k).controller.gait.stroke for k in (0, 1)} == {0.05}  # type: ignore[union-attr]


def test_motors_at_a_voltage() -> None:
    """A motor is that of the catalogue; a supply scales the record of the nearest voltage."""
    catalog = load_catalog()
    of = study(
        '[[vary]]\ninput = "motor"\nvalues = ["AX-12A", "XL330-M288"]\n'
        '[[vary]]\ninput = "voltage"\nvalues = [5.5, 11.1, 50.0]\n'
    )
    assert of.case(1).scene.servos.motor == catalog.get("AX-12A").motor(11.1 / 12.0)
    near = min((5.0, 6.0), key=lambda v: abs(v - 5.5))
    assert of.case(3).scene.servos.motor == catalog.get("XL330-M288", near).motor(5.5 / near)
    plain = one("motor", '"AX-12A at 12 V"')
    assert plain.scene.servos.motor == catalog.get("AX-12A").motor()
    base = BASE + 'motor = "AX-12A"\n'
    held = one("voltage", 10.0, base=base)
    assert held.scene.servos.motor == catalog.get("AX-12A").motor(10.0 / 12.0)
    assert one("mu", 0.5, base=base).scene.servos.motor == plain.scene.servos.motor


def test_a_supply_that_a_motor_is_not_made_for_is_refused() -> None:
    """AX-12A takes 9 to 12 V: below as above, no scaled line is made up."""
    of = study(
        '[[vary]]\ninput = "motor"\nvalues = ["AX-12A"]\n'
        '[[vary]]\ninput = "voltage"\nvalues = [5.0, 10.0, 13.0]\n'
    )
    assert of.case(1).scene.servos.motor is not None
    for index in (0, 2):
        with refused(hp.errors.ParameterError, "voltage", allowed=(9, 12)):
            of.case(index)


def test_a_slope_rises_ahead() -> None:
    """On a slope that rises along +x gravity pulls back, with its full size."""
    gravity = one("slope_deg", 30).scene.gravity
    np.testing.assert_allclose(gravity, [-9.81 / 2, 0.0, -9.81 * math.sqrt(0.75)], rtol=1e-12)
    assert one("slope", math.pi / 6).scene.gravity == gravity
    assert one("slope", 0.0).scene.gravity[2] == -9.81


def test_bumps() -> None:
    """Bumps are those of `random_bumps`, by height and seed; level under the standing robot."""
    options = "wavelength = 0.3\nlength = 0.5\nflat_radius = 0.2"
    case = one("bumps", 0.01, options)
    wanted = random_bumps(
        case.scene, [0], amplitude=0.01, wavelength=0.3, length=0.5, flat_radius=0.2
    )[0]
    assert case.scene.terrain == wanted.terrain
    assert isinstance(one("bumps", 0.0).scene.terrain, hp.Flat)
    seeds = study(
        '[[vary]]\ninput = "bumps"\nvalues = [0.01]\n[[vary]]\ninput = "bumps_seed"\n'
        "values = [0, 1]\n"
    )
    first, second = (seeds.case(k).scene.terrain for k in (0, 1))
    assert first != second
    assert isinstance(first, hp.HeightField)
    middle = tuple(n // 2 for n in first.shape)
    assert first.z[middle] == 0.0
    assert np.abs(first.z).max() == pytest.approx(0.01)


def test_a_base_from_a_file(tmp_path: Path) -> None:
    """A case's file is the base, found from the folder of the study; and a case at hand."""
    case = hp.Case(hp.Scene(hp.load_robot("athena")), hp.HoldPosture(), duration=0.5, accuracy=1e-5)
    case.save(tmp_path / "stand.toml")
    vary = '[[vary]]\ninput = "mu"\nvalues = [0.7, 0.3]\n'
    (tmp_path / "s.toml").write_text(f'schema = 1\n[base]\ncase = "stand.toml"\n{vary}')
    of = load_sweep(tmp_path / "s.toml")
    assert of.case(1).accuracy == 1e-5
    assert of.case(1) != case
    held = SweepStudy.of_case(case, [{"input": "mu", "values": [0.7, 0.3]}])
    assert held.case(1) == of.case(1)
    assert held.digest == of.digest
    assert pickle.loads(pickle.dumps(of)).case(1) == of.case(1)


def test_digest_of_a_study(tmp_path: Path) -> None:
    """It is of what the study means: not of its name or spelling, but of base, inputs, design."""
    design = '[design]\nkind = "sobol"\nsamples = 8\n'
    plain = study(SAMPLED, design)
    same = SweepStudy.from_toml(
        f'name = "other"\nschema = 1\n{BASE.replace("1.0", "1")}{SAMPLED}{design}seed = 0\n'
    )
    assert same.digest == plain.digest
    others = [
        study(SAMPLED, design + "seed = 1\n"),
        study(SAMPLED, design.replace("8", "16")),
        study(SAMPLED.replace("0.9", "0.8"), design),
        study(SAMPLED, design, BASE.replace("tripod", "wave")),
        study(SAMPLED, design, BASE.replace("kharagpur", "athena")),
    ]
    assert len({plain.digest, *(other.digest for other in others)}) == 6


def test_cases_share_what_does_not_vary() -> None:
    """Robot, controller and servos are the same objects, so that plans and models are shared."""
    of = study(SAMPLED, '[design]\nkind = "random"\nsamples = 5\n')
    cases = [of.case(k) for k in range(5)]
    assert len({id(case.scene.robot) for case in cases}) == 1
    assert len({id(case.controller) for case in cases}) == 1
    assert len({id(case.scene.servo) for case in cases}) == 1
    assert of.case(3) == cases[3]


def test_a_case_that_cannot_be_is_refused_by_itself() -> None:
    """A study is made all the same: only the case raises, with its typed error."""
    of = study('[[vary]]\ninput = "duty"\nvalues = [0.5, 0.3]\n')
    assert of.case(0).duration == 1.0
    with refused(hp.errors.GaitError, quantity="duty"):
        of.case(1)
    for index, name in ((2, "index"), (-1, "index"), (True, "SweepStudy.case.index")):
        with refused(hp.errors.ParameterError, name, index):
            of.case(index)


def test_the_studies_of_the_page_and_of_the_examples_load() -> None:
    """What docs/sweeps.md shows is a study, and all inputs and distributions are in it."""
    root = Path(__file__).parents[1]
    page = (root / "docs/sweeps.md").read_text(encoding="utf-8")
    block = page.split("```toml\n")[1].split("```")[0]
    assert len(SweepStudy.from_toml(block)) == 3 * 256
    for name in (*INPUTS, *DISTRIBUTIONS, *KINDS, *BaseWalk.model_fields):
        assert f"`{name}`" in page, name
    for path in (root / "examples").glob("*.toml"):
        assert len(load_sweep(path)) > 0


def canonical(value: Any) -> Any:
    """Plain data in which equal numbers are spelt alike."""
    if isinstance(value, Mapping):
        return {str(key): canonical(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [canonical(item) for item in value]
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    return float(value).hex()


def test_digests_of_cases_are_those_of_their_data() -> None:
    """The digest is that of the case's data as a whole, however its parts are put together."""
    of = study(
        SAMPLED + '[[vary]]\ninput = "bumps"\nvalues = [0.0, 0.005]\n',
        '[design]\nkind = "halton"\nsamples = 3\n',
    )
    for k in range(len(of)):
        case = of.case(k)
        data = case_to_dict(case)
        for key in ("source", "options"):
            data["scene"]["robot"].pop(key, None)
        how = case.settings
        data["run"] = {
            "duration": case.duration,
            "method": how.method_settings.method.name,
            "accuracy": how.method_settings.accuracy,
            "step": how.grid.step,
            "sample": how.grid.sample,
            **how.method_settings.torque_request,
        }
        text = json.dumps(canonical(data), sort_keys=True)
        assert case.digest == hashlib.sha256(text.encode()).hexdigest()


def test_samples_are_sparse_where_only_a_summary_is_kept():
    """5 ms where steps adapt; a fixed step keeps its own samples, and what is given stays.

    Without a duration, cycles are sampled: what does not divide them is left open.
    """
    text = (
        'schema = 1\n[base]\nrobot = "kharagpur"\n{}\n[[vary]]\ninput = "payload"\nvalues = [0.1]'
    )
    for given, sample in {"": 5e-3, 'method = "ndf"': 5e-3, "sample = 1e-3": 1e-3}.items():
        base = SweepStudy.from_toml(text.format(f"duration = 5.0\n{given}")).base
        assert base.sample == sample and base.until is None
    assert SweepStudy.from_toml(text.format("")).base.until == "steady"
    for given in ("", "step = 1e-3", 'method = "rk4"\nstep = 1e-4'):
        assert SweepStudy.from_toml(text.format(given)).base.sample is None


def test_a_text_that_no_file_can_hold_is_refused() -> None:
    """An unpaired surrogate: SQLite and every file would refuse it in the middle of a sweep."""
    with pytest.raises(ParameterError) as caught:
        SweepStudy.from_toml(f'schema = 1\nname = "a\ud800"\n{BASE}{SAMPLED}')
    assert caught.value.name == "TOML text"


def test_numbers_of_numpy_are_numbers() -> None:
    case = hp.Case(hp.Scene(hp.load_robot("kharagpur")), hp.HoldPosture(), duration=1.0)
    tables = [{"input": "mu", "values": np.array([0.5, 0.7])}]
    random = {"input": "payload", "distribution": "uniform", "low": np.float64(0.1), "high": 1}
    design = {"kind": "random", "samples": np.int8(2), "seed": np.uint16(3)}
    of = SweepStudy.of_case(case, [*tables, random], design)
    plain = [{"input": "mu", "values": [0.5, 0.7]}, {**random, "low": 0.1}]
    same = SweepStudy.of_case(case, plain, {"kind": "random", "samples": 2, "seed": 3})
    assert of.digest == same.digest and len(of) == 4
