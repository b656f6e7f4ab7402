"""Names that installed packages add, with the template of examples/ as the package."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from refusals import refused
from typer.testing import CliRunner

import hexapod_pin as hp
from hexapod_pin.commands.app import app
from hexapod_pin.commands.scene_options import read_terrain_option
from hexapod_pin.control.registry import read_controller
from hexapod_pin.errors import ParameterError, UnknownNameError, UserCodeError
from hexapod_pin.ground.terrain import read_terrain

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

TEMPLATE = Path(__file__).parents[1] / "examples" / "plugin_template"


def install(folder: Path, name: str, groups: dict[str, dict[str, str]]) -> None:
    """Write the metadata that an installed package has."""
    info = folder / f"{name.replace('-', '_')}-0.1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 0.1.0\n")
    lines = []
    for group, entries in groups.items():
        lines += [f"[{group}]", *(f"{key} = {value}" for key, value in entries.items())]
    (info / "entry_points.txt").write_text("\n".join(lines))


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The template, installed as pip would: its module on the path, and its metadata."""
    project = tomllib.loads((TEMPLATE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    install(tmp_path, project["name"], project["entry-points"])
    monkeypatch.syspath_prepend(TEMPLATE)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "hexapod_pin_template", raising=False)
    return tmp_path


def test_names_of_a_package_are_those_of_the_package(installed: Path, tmp_path: Path) -> None:
    """In Python, in case files, in study files and on the command line."""
    robot = hp.load_robot("crawler")
    assert robot.total_mass == pytest.approx(1.0 + 6 * 0.24) and len(robot.legs) == 6
    assert hp.Contact.preset("wet-rubber").friction.limit == 0.35
    bob = read_controller({"kind": "bob", "amplitude": 0.2})
    data = tomllib.loads(hp.Case(hp.Scene(robot), bob, duration=0.2, accuracy=1e-2).to_toml())
    data["scene"]["robot"] = {"source": "crawler"}
    data["scene"]["terrain"] = {"kind": "crater", "depth": 0.03}
    data["scene"]["contact"] = {"preset": "wet-rubber"}
    case = hp.Case.from_toml(tomli_w.dumps(data))
    assert case.scene.contact.friction.limit == 0.35
    assert case.scene.terrain.height_at(0.0, 0.0) == pytest.approx(-0.03)
    trace = case.run()
    assert np.ptp(trace.q_ref[:, robot.joint_index("lf_femur_joint")]) > 0.05
    assert hp.load_case(trace).controller.amplitude == 0.2
    assert hp.Case.from_toml(case.to_toml()) == case
    study = hp.study.SweepStudy.from_toml(
        'schema = 1\n[base]\nrobot = "kharagpur"\ncontact = "wet-rubber"\nduration = 1.0\n'
        '[[vary]]\ninput = "payload"\nvalues = [0.0]\n'
    )
    assert study.base.scene.contact.friction.limit == 0.35
    ground = read_terrain_option("crater:depth=0.01,radius=1.0")
    assert ground is not None and ground.height_at(0.0, 0.0) == pytest.approx(-0.01)
    for command in (["contact", "wet-rubber"], ["check", "crawler"]):
        done = CliRunner().invoke(app, command)
        assert done.exit_code == 0, done.output


def test_a_name_of_nobody_is_refused_with_all_names(installed: Path) -> None:
    with refused(UnknownNameError) as robot:
        hp.load_robot("crawlerr")
    with refused(UnknownNameError) as contact:
        hp.Contact.preset("dry-rubber")
    with refused(ParameterError, "terrain.kind", "pit") as ground:
        read_terrain({"kind": "pit"})
    for caught, name in ((robot, "crawler"), (contact, "wet-rubber"), (ground, "crater")):
        assert name in str(caught.value)
    with refused(ParameterError, "--terrain", "crater:depth"):
        read_terrain_option("crater:depth")
    assert "hexapod_pin_template" not in sys.modules  # nothing of it was imported for this


BROKEN: tuple[tuple[str, str, Callable[[], object], str], ...] = (
    ("hexapod_pin.robots", "no_module_of_that_name:robot", lambda: hp.load_robot("odd"),
     "ModuleNotFoundError"),
    ("hexapod_pin.robots", "math:pi", lambda: hp.load_robot("odd"), "TypeError"),
    ("hexapod_pin.contacts", "math:no_such_name", lambda: hp.Contact.preset("odd"),
     "AttributeError"),
    ("hexapod_pin.terrains", "builtins:dict", lambda: read_terrain({"kind": "odd"}),
     "TypeError"),
    ("hexapod_pin.controllers", "no_module_of_that_name:odd",
     lambda: read_controller({"kind": "odd"}), "ModuleNotFoundError"),
)  # fmt: skip


@pytest.mark.parametrize(("group", "value", "call", "cause"), BROKEN)
def test_an_error_names_the_entry_point_and_its_package(
    group: str, value: str, call: Callable[[], object], cause: str,
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    install(tmp_path, "odd-package", {group: {"odd": value}})
    monkeypatch.syspath_prepend(tmp_path)
    with refused(UserCodeError) as caught:
        call()
    for part in (f"odd = '{value}'", group, "odd-package 0.1.0", cause):
        assert part in str(caught.value)


def test_entry_points_are_read_only_where_a_name_is_unknown() -> None:
    code = (
        "import sys, importlib.metadata as m\n"
        "own = m.entry_points\n"
        "def others(group): assert 'hexapod' not in group; return own(group=group)\n"
        "m.entry_points = others\n"
        "import hexapod_pin as hp\n"
        "hp.load_robot('kharagpur'); hp.Contact.preset('s1')\n"
        "from hexapod_pin.ground.terrain import read_terrain; read_terrain({'kind': 'flat'})\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_what_the_package_does_is_logged_and_nothing_is_printed(
    installed: Path, caplog: pytest.LogCaptureFixture, capsys: pytest.CaptureFixture[str]
) -> None:
    """Under "hexapod_pin": what was inferred, what was loaded, how the error was controlled."""
    quiet = (
        "import logging, hexapod_pin as hp\n"
        "from hexapod_pin.log import LOG\n"
        "LOG.warning('to nobody')\n"
    )
    done = subprocess.run([sys.executable, "-c", quiet], capture_output=True, check=True)
    assert done.stdout == done.stderr == b""
    plain = installed / "plain.urdf"
    text = hp.urdf_path("kharagpur").read_text(encoding="utf-8")
    plain.write_text(re.sub("<hexapod_pin.*</hexapod_pin>", "", text, flags=re.DOTALL))
    with caplog.at_level("DEBUG", logger="hexapod_pin"):
        hp.load_robot(plain)
        robot = hp.load_robot("crawler")
        walk = hp.KinematicControl(hp.Gait.tripod(stroke=0.04, cycle_time=0.4))
        hp.simulate(hp.Scene(robot), walk, duration=0.4, accuracy=1e-2, method="dop853")
    levels = {record.levelname for record in caplog.records}
    text = caplog.text
    assert levels == {"INFO", "DEBUG"} and {one.name for one in caplog.records} == {"hexapod_pin"}
    for part in ("entry point crawler", "plain.urdf: inferred: ", "refinement", "of the accuracy"):
        assert part in text, part
    assert capsys.readouterr() == ("", "")
