"""Studies: points, the cases that come of them by the package's own functions, bad files."""

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
    return SweepStudy.from_toml(f"schema = 1\n{base}{vary}{design}")


def one(name: str, value: Any, options: str = "", base: str = BASE) -> hp.Case:
    kind = "path" if "." in name else "input"
    of = study(f'[[vary]]\n{kind} = "{name}"\nvalues = [{value}]\n{options}\n', base=base)
    assert len(of) == 1
    return of.case(0)


def test_a_grid_is_full_and_in_order() -> None:
    of = study(
        '[[vary]]\ninput = "stroke"\nvalues = [0.06, 0.1]\n'
        '[[vary]]\ninput = "mu"\nvalues = [0.5, 0.7, 0.9]\n'
    )
    points = [(p["stroke"], p["mu"]) for p in map(of.point, range(len(of)))]
    assert points == [(s, f) for s in (0.06, 0.1) for f in (0.5, 0.7, 0.9)]
    case = of.case(4)
    assert (case.controller.gait.stroke, case.scene.contact.friction.mu) == (0.1, 0.7)
    crossed = study(
        SAMPLED + '[[vary]]\ninput = "stroke"\nvalues = [0.06, 0.1]\n',
        '[design]\nkind = "sobol"\nsamples = 8\nseed = 1\n',
    )
    assert len(crossed) == 16
    for k in range(8):  # with the same samples
        first, second = crossed.point(k), crossed.point(k + 8)
        assert (first.pop("stroke"), second.pop("stroke")) == (0.06, 0.1)
        assert first == second
    cases = [crossed.case(k) for k in range(3)]  # plans and models are shared
    assert len({id(case.scene.robot) for case in cases}) == 1
    assert len({id(case.controller) for case in cases}) == 1


def test_what_each_input_changes() -> None:
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
        ("scene.gravity.2", -3.7): replace(scene, gravity=(0.0, 0.0, -3.7)),
    }
    gait = '[base]\nrobot = "kharagpur"\nduration = 1.0\ngait = {name = "tripod", stroke = 0.1}\n'
    for (name, value), wanted in expected.items():
        assert one(name, value, base=gait) == replace(base, scene=wanted), name


def test_what_inputs_change_of_a_gait() -> None:
    def gait(name: str, value: Any) -> hp.Gait:
        return one(name, value).controller.gait

    plain = gait("stroke", 0.14)
    for name in ("stroke", "cycle_time", "lift", "heading", "turn_rate"):
        assert gait(name, 0.05) == plain.with_changes(**{name: 0.05})
    assert gait("heading_deg", 90).heading == pytest.approx(math.pi / 2)
    assert gait("turn_rate_deg", -18).turn_rate == pytest.approx(-math.pi / 10)
    faster = gait("speed", 0.1)
    assert faster.speed == pytest.approx(0.1) and faster.stroke == plain.stroke
    both = study(
        '[[vary]]\ninput = "speed"\nvalues = [0.1]\n[[vary]]\ninput = "cycle_time"\nvalues = [2]\n'
    ).case(0)
    assert both.controller.gait.stroke == pytest.approx(0.1 * 0.5 * 2.0)
    wave = one("duty", 0.75, base='[base]\nrobot = "kharagpur"\ngait = "wave"\nduration = 1\n')
    assert wave.controller.gait.phases == hp.Gait.wave(0.75).phases


def test_a_gait_of_another_name_is_fitted() -> None:
    vary = '[[vary]]\ninput = "gait"\nvalues = ["wave", "tripod"]\n'
    plain = study(vary, base='[base]\nrobot = "athena"\nduration = 1.0\n')
    robot = plain.base.scene.robot
    for k, name in enumerate(("wave", "tripod")):
        assert plain.case(k).controller.gait == fit_gait(robot, name).gait
    kept = study(vary, base='[base]\nrobot = "athena"\nduration = 1\n[base.gait]\nstroke = 0.05\n')
    assert {kept.case(k).controller.gait.stroke for k in (0, 1)} == {0.05}


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
    held = one("voltage", 10.0, base=BASE + 'motor = "AX-12A"\n')
    assert held.scene.servos.motor == catalog.get("AX-12A").motor(10.0 / 12.0)
    for index in (0, 2):  # AX-12A takes 9 to 12 V
        with refused(ParameterError, "voltage", allowed=(9, 12)):
            of.case(index)


def test_a_slope_rises_ahead() -> None:
    """On a slope that rises along +x gravity pulls back, with its full size."""
    gravity = one("slope_deg", 30).scene.gravity
    np.testing.assert_allclose(gravity, [-9.81 / 2, 0.0, -9.81 * math.sqrt(0.75)], rtol=1e-12)
    assert one("slope", math.pi / 6).scene.gravity == gravity
    assert one("slope", 0.0).scene.gravity[2] == -9.81


def test_bumps() -> None:
    options = "wavelength = 0.3\nlength = 0.5\nflat_radius = 0.2"
    case = one("bumps", 0.01, options)
    wanted = random_bumps(
        case.scene, [0], amplitude=0.01, wavelength=0.3, length=0.5, flat_radius=0.2
    )[0]
    assert case.scene.terrain == wanted.terrain
    assert isinstance(one("bumps", 0.0).scene.terrain, hp.Flat)
    other = one("bumps", 0.01, options + "\n[[vary]]\ninput = 'bumps_seed'\nvalues = [1]")
    assert other.scene.terrain != wanted.terrain


def test_a_base_from_a_file(tmp_path: Path) -> None:
    case = hp.Case(hp.Scene(hp.load_robot("athena")), hp.HoldPosture(), duration=0.5, accuracy=1e-5)
    case.save(tmp_path / "stand.toml")
    vary = '[[vary]]\ninput = "mu"\nvalues = [0.7, 0.3]\n'
    (tmp_path / "s.toml").write_text(f'schema = 1\n[base]\ncase = "stand.toml"\n{vary}')
    of = load_sweep(tmp_path / "s.toml")
    assert of.case(1).accuracy == 1e-5 and of.case(1) != case
    held = SweepStudy.of_case(case, [{"input": "mu", "values": np.array([0.7, 0.3])}])
    assert held.case(1) == of.case(1)
    assert held.digest == of.digest
    assert pickle.loads(pickle.dumps(of)).case(1) == of.case(1)


def test_digest_of_a_study(tmp_path: Path) -> None:
    design = '[design]\nkind = "sobol"\nsamples = 8\n'
    plain = study(SAMPLED, design)
    same = SweepStudy.from_toml(
        f'name = "other"\nschema = 1\n{BASE.replace("1.0", "1")}{SAMPLED}{design}seed = 0\n'
    )
    assert same.digest == plain.digest
    others = [
        study(SAMPLED, design + "seed = 1\n"),
        study(SAMPLED.replace("0.9", "0.8"), design),
        study(SAMPLED, design, BASE.replace("kharagpur", "athena")),
    ]
    assert len({plain.digest, *(other.digest for other in others)}) == 4


def test_a_case_that_cannot_be_is_refused_by_itself() -> None:
    of = study('[[vary]]\ninput = "duty"\nvalues = [0.5, 0.3]\n')
    assert of.case(0).duration == 1.0
    with refused(hp.errors.GaitError, quantity="duty"):
        of.case(1)
    with refused(ParameterError, "index", 2):
        of.case(2)
    with refused(ParameterError, "TOML text"):  # SQLite would refuse it in the midst of a sweep
        SweepStudy.from_toml(f'schema = 1\nname = "a\ud800"\n{BASE}{SAMPLED}')


def test_the_studies_of_the_page_and_of_the_examples_load() -> None:
    root = Path(__file__).parents[1]
    page = (root / "docs/sweeps.md").read_text(encoding="utf-8")
    block = page.split("```toml\n")[1].split("```")[0]
    assert len(SweepStudy.from_toml(block)) == 3 * 256
    for name in (*INPUTS, *DISTRIBUTIONS, *KINDS, *BaseWalk.model_fields):
        assert f"`{name}`" in page, name
    for path in (root / "examples").glob("*.toml"):
        assert len(load_sweep(path)) > 0


def test_digests_of_cases_are_those_of_their_data() -> None:
    """The digest is that of the case's data as a whole, however its parts are put together."""

    def canonical(value: Any) -> Any:
        if isinstance(value, Mapping):
            return {str(key): canonical(item) for key, item in value.items()}
        if isinstance(value, list | tuple):
            return [canonical(item) for item in value]
        plain = isinstance(value, bool) or not isinstance(value, int | float)
        return value if plain else float(value).hex()

    of = study(
        SAMPLED + '[[vary]]\ninput = "bumps"\nvalues = [0.0, 0.005]\n',
        '[design]\nkind = "halton"\nsamples = 1\n',
    )
    for case in map(of.case, range(len(of))):
        data, how = case_to_dict(case), case.settings
        for key in ("source", "options"):
            data["scene"]["robot"].pop(key, None)
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
    """5 ms where steps adapt; a fixed step keeps its own samples, and what is given stays."""
    text = (
        'schema = 1\n[base]\nrobot = "kharagpur"\n{}\n[[vary]]\ninput = "payload"\nvalues = [0.1]'
    )
    for given, sample in {"": 5e-3, 'method = "ndf"': 5e-3, "sample = 1e-3": 1e-3}.items():
        base = SweepStudy.from_toml(text.format(f"duration = 5.0\n{given}")).base
        assert base.sample == sample and base.until is None
    assert SweepStudy.from_toml(text.format("")).base.until == "steady"
    for given in ("", "step = 1e-3", 'method = "rk4"\nstep = 1e-4'):
        assert SweepStudy.from_toml(text.format(given)).base.sample is None


HEAD = "schema = 1\n"
GRID = '[[vary]]\ninput = "stroke"\nvalues = [0.06, 0.1]\n'
SOBOL = '[design]\nkind = "sobol"\nsamples = 4\n'


def uncertain(text: str, name: str = "mu") -> str:
    return f'{HEAD}{BASE}[[vary]]\ninput = "{name}"\n{text}\n{SOBOL}'


def grid(text: str, base: str = BASE) -> str:
    return f"{HEAD}{base}[[vary]]\n{text}\n"


def walk(text: str) -> str:
    return f'{HEAD}[base]\nrobot = "athena"\n{text}\n{GRID}'


def sampled(design: str) -> str:
    return f"{HEAD}{BASE}{FRICTION}[design]\n{design}"


FRICTION = '[[vary]]\ninput = "mu"\ndistribution = "uniform"\nlow = 0.4\nhigh = 0.9\n'

BAD = {
    "bad syntax": ("schema = 1\nbase = [", "TOML text", "valid TOML"),
    "nothing varies": (HEAD + BASE, "vary", "[[vary]]"),
    "unknown motor of the base": (walk('motor = "AX-12"'), "base.motor", "mean 'AX-12A'"),
    "voltage of no motor": (walk('voltage = 11.1'), "base.voltage", "base.motor"),
    "text for a voltage": (walk('motor = "AX-12A"\nvoltage = "12"'), "base.voltage", "above 0 [V]"),
    "unknown link": (
        grid('input = "payload"\nvalues = [1]\nlink = "base_lnk"'),
        "vary[0].link", "mean 'base_link'",
    ),
    "a motor of several voltages": (
        grid('input = "motor"\nvalues = ["XL330-M288"]'), "vary[0].values[0]", "beside a voltage",
    ),
    "a voltage of no motor": (
        grid('input = "voltage"\nvalues = [11.1]'), "vary[0].input", "beside an input motor",
    ),
    "motors of prescribed motion": (
        grid('input = "motor"\nvalues = ["AX-12A"]', BASE + "prescribed = true\n"),
        "vary[0].input", "no motor acts",
    ),
    "gain of no servo": (walk('prescribed = true\nkp = 3.0'), "base.kp", "no servo acts"),
    "a number for a name": (grid('input = "gait"\nvalues = [3]'), "vary[0].values[0]", "a name"),
    "a value twice": (grid('input = "lift"\nvalues = [0.1, 0.1]'), "vary[0].values[1]", "once"),
    "seeds of no bumps": (grid('input = "bumps_seed"\nvalues = [1]'), "vary[0].input", "bumps"),
    "a place of two numbers": (
        grid('input = "payload"\nvalues = [0.1]\nposition = [0, 1]'), "vary[0].position", "three",
    ),
    "input twice": (f"{HEAD}{BASE}{GRID}{GRID}", "vary[1].input", "vary[0] varies it already"),
    "speed that follows": (
        grid('input = "speed"\nvalues = [0.1]\n[[vary]]\ninput = "cycle_time"\nvalues = [2]\n')
        + GRID, "vary[0].input", "it follows",
    ),
    "an end out of range": (
        uncertain('distribution = "uniform"\nlow = -0.1\nhigh = 1'), "vary[0].low", "at least 0",
    ),
    "truncated to nothing": (
        uncertain('distribution = "normal"\nmean = 0.7\ndeviation = 0.1\nlow = 3\nhigh = 4'),
        "vary[0].high", "lies between",
    ),
    "a mode outside": (
        uncertain('distribution = "triangular"\nlow = 0.1\nmode = 0.9\nhigh = 0.5'),
        "vary[0].mode", "to high",
    ),
    "names that are uniform": (
        uncertain('distribution = "uniform"\nlow = 0\nhigh = 1', "gait"),
        "vary[0].distribution", "choice",
    ),
    "no power of two": (sampled('kind = "sobol"\nsamples = 300'), "design.samples", "256 or 512"),
    "too many cases": (
        f"{HEAD}{BASE}{GRID}" + "".join(
            f'[[vary]]\ninput = "{name}"\nvalues = {[1 + k for k in range(300)]}\n'
            for name in ("mass", "trunk_mass", "contact_stiffness")
        ), "vary", "10000000 cases at most",
    ),
    "stiffness of no servo": (
        grid('input = "servo_stiffness"\nvalues = [2]', BASE + "prescribed = true\n"),
        "vary[0].input", "prescribed",
    ),
    "a path to nowhere": (
        grid('path = "scene.contact.normal.stifness"\nvalues = [1]'), "vary[0].path", "stiffness",
    ),
    "a path to a table": (
        grid('path = "scene.contact.friction"\nvalues = [1]'), "vary[0].path", "a table: kind, mu",
    ),
    "a path beyond a number": (
        grid('path = "scene.contact.friction.mu.x"\nvalues = [1]'), "vary[0].path", "ends at",
    ),
    "a number by name and by path": (
        grid('input = "mu"\nvalues = [1]\n[[vary]]\npath = "scene.contact.friction.mu"')
        + "values = [1]", "vary[1].path", "mu",
    ),
    "a schema of no number": (f"schema = true\n{BASE}{GRID}", "schema", "this release reads"),
    "an empty name": (f'{HEAD}name = " "\n{BASE}{GRID}', "name", "not empty"),
    "no design": (f"{HEAD}{BASE}{SAMPLED}", "design", "has a distribution"),
    "a design of a grid": (f"{HEAD}{BASE}{GRID}{SOBOL}", "design", "needs no design"),
    "no values": (grid('input = "mu"\nvalues = []'), "vary[0].values", "at least one value"),
    "two bases": (f'{HEAD}{BASE}case = "a.toml"\n{GRID}', "base.case", "not both"),
    "unknown robot": (
        f"{HEAD}{BASE}{GRID}".replace('kharagpur"', 'kharagpu"'), "base.robot", "mean 'kharagpur'",
    ),
    "an empty path": (grid('path = ""\nvalues = [1]'), "vary[0].path", "a path such as"),
}  # fmt: skip


@pytest.mark.parametrize("kind", BAD)
def test_a_bad_file_is_refused_by_field(kind: str, tmp_path: Path) -> None:
    text, name, says = BAD[kind]
    path = tmp_path / "study.toml"
    path.write_text(text)
    with pytest.raises(hp.errors.ParameterError) as caught:
        load_sweep(path)
    assert caught.value.name == name
    assert says in str(caught.value)


def test_a_base_that_cannot_be_read_or_has_no_gait_to_vary(tmp_path: Path) -> None:
    (tmp_path / "binary.toml").write_bytes(b"\x89HDF\xff\x00\x01")
    for name, reason in (("none", "no such file"), ("", "folder"), ("binary.toml", "decode")):
        with refused(ParameterError, "study file", about=(reason,)):
            load_sweep(tmp_path / name)
    scene = hp.Scene(hp.load_robot("kharagpur"))
    hp.Case(scene, hp.HoldPosture(), duration=1.0).save(tmp_path / "stand.toml")
    with refused(ParameterError, "vary[0].input", "stroke", about=("HoldPosture",)):
        SweepStudy.from_toml(f'{HEAD}[base]\ncase = "stand.toml"\n{GRID}', tmp_path)
