"""Bad study files: each is refused with the place in the file, the value and what is allowed."""

from __future__ import annotations

from pathlib import Path

import pytest
from refusals import refused

import hexapod_pin as hp
from hexapod_pin.study.sweep import SweepStudy, load_sweep

HEAD = "schema = 1\n"
BASE = '[base]\nrobot = "kharagpur"\ngait = "tripod"\n'
GRID = '[[vary]]\ninput = "stroke"\nvalues = [0.06, 0.1]\n'
SOBOL = '[design]\nkind = "sobol"\nsamples = 4\n'


def uncertain(text: str, name: str = "mu") -> str:
    """A study of one input with a distribution."""
    return f'{HEAD}{BASE}[[vary]]\ninput = "{name}"\n{text}\n{SOBOL}'


def grid(text: str, base: str = BASE) -> str:
    """A study of one table [[vary]]."""
    return f"{HEAD}{base}[[vary]]\n{text}\n"


def walk(text: str) -> str:
    """A study of a walk with these keys and tables in its base."""
    return f'{HEAD}[base]\nrobot = "athena"\n{text}\n{GRID}'


def sampled(design: str) -> str:
    """A study of an uncertain input with these keys in its design."""
    return f"{HEAD}{BASE}{FRICTION}[design]\n{design}"


UNIFORM = 'distribution = "uniform"\nlow = 0.4\nhigh = 0.9'
FRICTION = f'[[vary]]\ninput = "mu"\n{UNIFORM}\n'

BAD = {
    "bad syntax": ("schema = 1\nbase = [", "TOML text", "valid TOML"),
    "empty file": ("", "schema", "schema = 1"),
    "unknown key": (f"{HEAD}seeds = 3\n{BASE}{GRID}", "seeds", "known: schema, name, base"),
    "schema of the future": (f"schema = 2\n{BASE}{GRID}", "schema", "1, which this release reads"),
    "schema as truth": (f"schema = true\n{BASE}{GRID}", "schema", "1, which this release reads"),
    "empty name": (f'{HEAD}name = " "\n{BASE}{GRID}', "name", "text that is not empty"),
    "no base": (HEAD + GRID, "base", "Write [base]"),
    "base is a number": (f"{HEAD}base = 3\n{GRID}", "base", "a table"),
    "nothing varies": (HEAD + BASE, "vary", "[[vary]]"),
    "vary is one table": (f'{HEAD}{BASE}[vary]\ninput = "lift"', "vary", "[[vary]]"),
    "case and robot": (
        f'{HEAD}[base]\ncase = "a.toml"\nrobot = "athena"\n{GRID}', "base.case", "not both",
    ),
    "neither case nor robot": (f'{HEAD}[base]\ngait = "wave"\n{GRID}', "base.case", "base.robot"),
    "unknown key of the base": (walk('giat = "wave"'), "base.giat", "mean 'gait'"),
    "key beside a case": (
        f'{HEAD}[base]\ncase = "a.toml"\nduration = 1.0\n{GRID}', "base.duration", "known: case",
    ),
    "robot not found": (
        f'{HEAD}[base]\nrobot = "karagpur"\n{GRID}', "base.robot", "mean 'kharagpur'",
    ),
    "unknown motor of the base": (walk('motor = "AX-12"'), "base.motor", "mean 'AX-12A'"),
    "voltage of no motor": (walk('voltage = 11.1'), "base.voltage", "base.motor"),
    "text for a voltage": (walk('motor = "AX-12A"\nvoltage = "12"'), "base.voltage", "above 0 [V]"),
    "unknown motor": (
        grid('input = "motor"\nvalues = ["AX-12A", "MX64"]'), "vary[0].values[1]", "mean 'MX-64",
    ),
    "unknown gait among others": (
        grid('input = "gait"\nvalues = ["wave", "tripd"]'), "vary[0].values[1]", "mean 'tripod'",
    ),
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
    "case not found": (f'{HEAD}[base]\ncase = "no.toml"\n{GRID}', "case file", "no such file"),
    "unknown gait": (walk('gait = "tripd"'), "base.gait", "mean 'tripod'"),
    "unknown field of a gait": (
        walk('[base.gait]\nstrok = 0.1'),
        "base.gait.strok", "mean 'stroke'",
    ),
    "a stroke out of range": (walk('[base.gait]\nstroke = -1'), "base.gait.stroke", "equal to 0"),
    "a friction out of range": (walk('mu = -1'), "base.mu", "equal to 0"),
    "an accuracy out of range": (walk('accuracy = 9'), "base.accuracy", "1e-12 to 0.1"),
    "text in a gait": (walk('[base.gait]\nstroke = "0.1"'), "base.gait.stroke", "a number"),
    "unknown contact": (walk('contact = "acurate"'), "base.contact", "mean 'accurate'"),
    "gain of no servo": (walk('prescribed = true\nkp = 3.0'), "base.kp", "no servo acts"),
    "text for the duration": (walk('duration = "5"'), "base.duration", "a float"),
    "unknown input": (grid('input = "paylaod"\nvalues = [1]'), "vary[0].input", "mean 'payload'"),
    "no input": (grid("values = [1]"), "vary[0].input", "path in its place"),
    "input and path": (
        grid('input = "lift"\npath = "a.b"\nvalues = [1]'), "vary[0].input", "only one",
    ),
    "empty values": (grid('input = "stroke"\nvalues = []'), "vary[0].values", "at least one"),
    "no values": (grid('input = "stroke"'), "vary[0].values", "a distribution"),
    "text for a number": (
        grid('input = "stroke"\nvalues = [0.1, "0.2"]'), "vary[0].values[1]", "a number",
    ),
    "a number for a name": (grid('input = "gait"\nvalues = [3]'), "vary[0].values[0]", "a name"),
    "not a number": (grid('input = "stroke"\nvalues = [nan]'), "vary[0].values[0]", "a number"),
    "infinity": (grid('input = "heading"\nvalues = [inf]'), "vary[0].values[0]", "finite"),
    "out of range": (grid('input = "duty"\nvalues = [0.5, 1.0]'), "vary[0].values[1]", "below 1"),
    "negative mass": (
        grid('input = "payload"\nvalues = [-0.1]'), "vary[0].values[0]", "at least 0 [kg]",
    ),
    "a slope upright": (
        grid('input = "slope_deg"\nvalues = [90]'), "vary[0].values[0]", "below 90 [deg]",
    ),
    "a value twice": (grid('input = "lift"\nvalues = [0.1, 0.1]'), "vary[0].values[1]", "once"),
    "seeds of no bumps": (grid('input = "bumps_seed"\nvalues = [1]'), "vary[0].input", "bumps"),
    "misspelt key": (grid('input = "stroke"\nvalus = [0.1]'), "vary[0].valus", "mean 'values'"),
    "a link that is none": (
        grid('input = "payload"\nvalues = [0.1]\nlink = 3'), "vary[0].link", "name of a link",
    ),
    "a place of two numbers": (
        grid('input = "payload"\nvalues = [0.1]\nposition = [0, 1]'), "vary[0].position", "three",
    ),
    "bumps of no length": (
        grid('input = "bumps"\nvalues = [0.1]\nwavelength = 0'), "vary[0].wavelength", "positive",
    ),
    "input twice": (f"{HEAD}{BASE}{GRID}{GRID}", "vary[1].input", "vary[0] varies it already"),
    "an angle twice": (
        grid('input = "slope"\nvalues = [0.1]\n[[vary]]\ninput = "slope_deg"\nvalues = [1]'),
        "vary[1].input", "vary[0]",
    ),
    "speed that follows": (
        grid('input = "speed"\nvalues = [0.1]\n[[vary]]\ninput = "cycle_time"\nvalues = [2]\n')
        + GRID, "vary[0].input", "it follows",
    ),
    "unknown distribution": (
        uncertain('distribution = "gauss"'), "vary[0].distribution", "uniform, normal",
    ),
    "low above high": (
        uncertain('distribution = "uniform"\nlow = 0.9\nhigh = 0.4'), "vary[0].high", "above low",
    ),
    "no high": (uncertain('distribution = "uniform"\nlow = 0.4'), "vary[0].high", "given"),
    "misspelt end": (
        uncertain('distribution = "uniform"\nlow = 0.4\nhihg = 1'), "vary[0].hihg", "mean 'high'",
    ),
    "text for an end": (
        uncertain('distribution = "uniform"\nlow = "0.4"\nhigh = 1'), "vary[0].low", "a float",
    ),
    "an end not a number": (
        uncertain('distribution = "uniform"\nlow = nan\nhigh = 1'), "vary[0].low", "finite",
    ),
    "an end out of range": (
        uncertain('distribution = "uniform"\nlow = -0.1\nhigh = 1'), "vary[0].low", "at least 0",
    ),
    "negative deviation": (
        uncertain('distribution = "normal"\nmean = 0.7\ndeviation = -0.1\nlow = 0'),
        "vary[0].deviation", "greater than 0",
    ),
    "a normal without its end": (
        uncertain('distribution = "normal"\nmean = 0.7\ndeviation = 0.1'),
        "vary[0].low", "no end of its own",
    ),
    "truncated to nothing": (
        uncertain('distribution = "normal"\nmean = 0.7\ndeviation = 0.1\nlow = 3\nhigh = 4'),
        "vary[0].high", "lies between",
    ),
    "a factor below one": (
        uncertain('distribution = "lognormal"\nmedian = 1\nfactor = 0.5', "mass"),
        "vary[0].factor", "greater than 1",
    ),
    "a mode outside": (
        uncertain('distribution = "triangular"\nlow = 0.1\nmode = 0.9\nhigh = 0.5'),
        "vary[0].mode", "to high",
    ),
    "names that are uniform": (
        uncertain('distribution = "uniform"\nlow = 0\nhigh = 1', "gait"),
        "vary[0].distribution", "choice",
    ),
    "a choice of none": (
        uncertain('distribution = "choice"\nvalues = []'), "vary[0].values", "at least one",
    ),
    "no design": (HEAD + BASE + FRICTION, "design", "vary[0] has a distribution"),
    "a design of a grid": (HEAD + BASE + GRID + SOBOL, "design", "no input has a distribution"),
    "unknown design": (sampled('kind = "sobl"\nsamples = 4'), "design.kind", "'sobol'"),
    "no power of two": (sampled('kind = "sobol"\nsamples = 300'), "design.samples", "256 or 512"),
    "one sample of Sobol's": (
        sampled('kind = "sobol-indices"\nsamples = 1'),
        "design.samples", "power of two",
    ),
    "no samples": (sampled('kind = "random"\nsamples = 0'), "design.samples", "1"),
    "negative seed": (
        sampled('kind = "random"\nsamples = 2\nseed = -1'),
        "design.seed", "greater than or equal to 0",
    ),
    "misspelt key of the design": (
        sampled('kind = "random"\nsample = 2'), "design.sample", "samples",
    ),
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
    "a path to a name": (
        grid('path = "scene.contact.friction.kind"\nvalues = [1]'), "vary[0].path", "'stick-slip'",
    ),
    "a path beyond a number": (
        grid('path = "scene.contact.friction.mu.x"\nvalues = [1]'), "vary[0].path", "ends at",
    ),
    "a path into the robot": (
        grid('path = "scene.robot.posture.0"\nvalues = [1]'), "vary[0].path", "contact, servo",
    ),
    "a path of a list": (grid('path = "scene.gravity.3"\nvalues = [1]'), "vary[0].path", "0, 1, 2"),
    "a number by name and by path": (
        grid('input = "mu"\nvalues = [1]\n[[vary]]\npath = "scene.contact.friction.mu"')
        + "values = [1]", "vary[1].path", "mu",
    ),
    "a stroke by name and by path": (
        grid('input = "speed"\nvalues = [1]\n[[vary]]\npath = "controller.gait.stroke"')
        + "values = [1]", "vary[1].path", "speed",
    ),
    "an empty path": (grid('path = ""\nvalues = [1]'), "vary[0].path", "a path such as"),
}  # fmt: skip


@pytest.mark.parametrize("kind", BAD)
def test_a_bad_file_is_refused_by_field(kind: str, tmp_path: Path) -> None:
    """The error is typed, names the field as it stands in the file, and says what is allowed."""
    text, name, says = BAD[kind]
    path = tmp_path / "study.toml"
    path.write_text(text)
    with pytest.raises(hp.errors.ParameterError) as caught:
        load_sweep(path)
    assert caught.value.name == name
    assert says in str(caught.value)


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    """No file, a folder and a binary file are told from each other."""
    (tmp_path / "binary.toml").write_bytes(b"\x89HDF\xff\x00\x01")
    for name, reason in (("none", "no such file"), ("", "folder"), ("binary.toml", "decode")):
        with refused(hp.errors.ParameterError, "study file", about=(reason,)):
            load_sweep(tmp_path / name)


def test_a_stroke_of_a_robot_that_stands(tmp_path: Path) -> None:
    """A base that holds its posture has no gait to vary."""
    scene = hp.Scene(hp.load_robot("kharagpur"))
    hp.Case(scene, hp.HoldPosture(), duration=1.0).save(tmp_path / "stand.toml")
    with refused(hp.errors.ParameterError, "vary[0].input", "stroke", about=("HoldPosture",)):
        SweepStudy.from_toml(f'{HEAD}[base]\ncase = "stand.toml"\n{GRID}', tmp_path)
