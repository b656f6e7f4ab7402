"""Code of the pages on extending, run where a reader puts it; names that packages add."""

from __future__ import annotations

import inspect
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from textwrap import dedent
from types import ModuleType, SimpleNamespace
from typing import Any

import contact_formulas
import numpy as np
import pytest
import tomli_w
from numpy.testing import assert_allclose
from refusals import refused
from typer.testing import CliRunner

import hexapod_pin as hp
from hexapod_pin.commands.app import app
from hexapod_pin.commands.scene_options import read_terrain_option
from hexapod_pin.control import gait as gait_module
from hexapod_pin.control.registry import read_controller
from hexapod_pin.errors import ParameterError, UnknownNameError, UserCodeError
from hexapod_pin.ground.contact import friction, normal
from hexapod_pin.ground.terrain import read_terrain
from hexapod_pin.results import joint_budget, summary

ROOT = Path(__file__).parents[1]
NATIVE = ROOT / "hexapod_pin" / "native"
COMPILER = shutil.which(os.environ.get("CXX", "g++")) or shutil.which("c++")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="the laws are compiled")


def pieces(section: str, language: str) -> list[str]:
    """Return the blocks of a section in a language, in their order."""
    pages = (ROOT / "docs" / f"{name}.md" for name in ("extending", "extending_results"))
    text = "\n## \n".join(page.read_text(encoding="utf-8") for page in pages)
    part = text.partition(f"\n## {section}\n")[2].partition("\n## ")[0]
    return [dedent(one) for one in re.findall(rf"```{language}\n(.*?)```", part, re.DOTALL)]


def put(text: str, piece: str, before: str, *, indent: str = "") -> str:
    """Put a piece before the one place where a text stands."""
    assert text.count(before) == 1, before
    lines = "".join(indent + line for line in piece.splitlines(keepends=True))
    return text.replace(before, f"{lines}{before}")


def defined(module: ModuleType, piece: str, **more: Any) -> dict[str, Any]:
    """Return the names of a module after a piece of code was put at its end."""
    names = {**vars(module), **more}
    exec(compile(piece, "extending.md", "exec"), names)
    return names


def compiled(header: str, text: str, calls: str, folder: Path) -> np.ndarray:
    """Return the numbers that calls print with a changed header, a row each."""
    (folder / header).write_text(text, encoding="utf-8")
    program = f'#include <cstdio>\n#include "{header}"\nusing namespace hexapod;\nint main() {{\n'
    source = folder / "main.cpp"
    source.write_text(f"{program}{calls}return 0;\n}}\n", encoding="utf-8")
    command = [str(COMPILER), "-std=c++17", "-Wall", "-Werror", "-I.", "main.cpp", "-o", "main"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert not done.returncode, done.stderr
    printed = subprocess.run([folder / "main"], capture_output=True, text=True, check=True).stdout
    return np.array([line.split() for line in printed.splitlines()], dtype=float)


def set_fields(law: Any, kind: str) -> str:
    """Return C++ that makes the native law of a Python one, by what its `native` hands over."""
    given: dict[str, Any] = {}
    seen = SimpleNamespace(_native=lambda name, **fields: given.update(fields, kind=name))
    seen.__dict__.update(dict(law))
    type(law).native(seen)
    found = f"{kind}Law law;\nlaw.kind = {kind}Kind::{given.pop('kind')};\n"
    if kind == "Normal":
        given |= {"stiffness": law.stiffness, "exponent": law.exponent}
    return found + "".join(f"law.{name} = {value!r};\n" for name, value in given.items())


def second_formula(name: str, law: str, monkeypatch: pytest.MonkeyPatch, **laws: Any) -> Any:
    """Return a function of `contact_formulas` with the branch of the page, and its instance."""
    entry, branch = pieces(law, "python")[1:3]
    for one, cls in laws.items():
        monkeypatch.setattr(hp.contact, one, cls, raising=False)
    source = inspect.getsource(getattr(contact_formulas, name))
    before = "    else:\n" if name == "numpy_normal" else "    x, drop ="
    names = defined(contact_formulas, put(source, branch, before, indent="    "))
    (instance,) = eval(f"{{{entry}}}", names).values()
    return names[name], instance


@needs_compiler
def test_the_normal_law(tmp_path, monkeypatch):
    cls = defined(normal, pieces("A normal law", "python")[0])["Hardening"]
    formula, law = second_formula("numpy_normal", "A normal law", monkeypatch, Hardening=cls)
    head, force, energy, release = pieces("A normal law", "cpp")[:4]
    enum, _, field = (line for line in head.splitlines() if line.strip())
    text = (NATIVE / "laws" / "normal.hpp").read_text(encoding="utf-8")
    text, changed = re.subn(r"enum class NormalKind \{.*\};", enum, text)
    assert changed == 1
    text = put(text, f"{field}\n", "  double damping_depth = 1.0;")
    text = put(text, force, "    if (damping_follows_spring()) {\n      const double gain")
    text = put(text, energy, "    return depth > 0.0 ? spring_energy(stiffness")
    text = put(text, release, "    return kind == NormalKind::hunt_crossley ? dissipation > 0.0")
    points = [(d, r) for d in (1e-310, 1e-6, 1e-4, 3e-4) for r in (-0.5, -0.1, 0.0, 0.3)]
    calls = set_fields(law, "Normal") + "".join(
        f"{{ const NormalForce f = law({d!r}, {r!r}); std::printf("
        '"%.17g %.17g %.17g %.17g %.17g %d\\n", f.force, f.elastic, f.d_depth, f.d_rate, '
        f"law.energy({d!r}), law.can_release()); }}\n"
        for d, r in points
    )
    found = compiled("normal.hpp", text, calls, tmp_path)
    assert np.isfinite(found).all() and found[:, 5].all()
    for (depth, rate), row in zip(points[4:], found[4:], strict=True):
        expected = [
            formula(law, depth, rate), formula(law, depth, 0.0),
            np.imag(formula(law, depth + 1e-30j, rate)) / 1e-30,
            np.imag(formula(law, depth, rate + 1e-30j)) / 1e-30,
        ]  # fmt: skip
        assert_allclose(row[:4], expected, rtol=1e-12)
        nodes, weights = np.polynomial.legendre.leggauss(40)
        depths = 0.5 * depth * (nodes + 1.0)
        work = 0.5 * depth * weights @ [formula(law, one, 0.0) for one in depths]
        assert_allclose(row[4], work, rtol=1e-6)  # the square root of depth at 0


@needs_compiler
def test_the_friction_law(tmp_path, monkeypatch):
    section = "A friction law"
    cls = defined(friction, pieces(section, "python")[0])["RootCoulomb"]
    formula, law = second_formula("numpy_friction", section, monkeypatch, RootCoulomb=cls)
    case, steepness, function = pieces(section, "cpp")
    text = (NATIVE / "laws" / "friction.hpp").read_text(encoding="utf-8")
    text = text.replace("brown_mcphee, bristle }", "brown_mcphee, bristle, root_coulomb }")
    text = put(text, case, "      case FrictionKind::tanh_coulomb: return tanh_factor(")
    text = put(text, steepness, "      case FrictionKind::tanh_coulomb: return slip_slope;")
    text = put(text, function, "  static FrictionFactor from_values(")
    speeds = (0.0, 1e-4, 0.02, 0.5)
    calls = set_fields(law, "Friction") + "".join(
        f"{{ const FrictionFactor f = law({s!r}); std::printf("
        f'"%.17g %.17g %.17g\\n", f.ratio, f.tangent({s!r}), law.steepness()); }}\n'
        for s in speeds
    )
    for speed, row in zip(speeds, compiled("friction.hpp", text, calls, tmp_path), strict=True):
        slope = np.imag(formula(law, speed + 1e-30j)) / 1e-30
        ratio = formula(law, speed) / speed if speed else slope
        assert_allclose(row, [ratio, slope, 1.0 / law.speed], rtol=1e-12)
    creep = law._creep(0.35)
    assert_allclose(formula(law, creep), 0.35, rtol=1e-14)
    assert law.limit == law.mu and law._creep(law.mu) == np.inf


def test_the_integration_method():
    """What it calls is in the core, and its unit is that of a method of the core."""
    header, unit = pieces("An integration method", "cpp")
    for owner, file in (("flow", "methods/chart_flow.hpp"), ("plant", "plant/plant.hpp")):
        real = (NATIVE / file).read_text(encoding="utf-8")
        for name in set(re.findall(rf"\b{owner}\.(\w+)\(", header)):
            assert re.search(rf"\b{name}\(", real), name
    rk4 = (NATIVE / "methods" / "rk4.cpp").read_text(encoding="utf-8")
    assert unit.replace("heun", "rk4").replace("Heun", "RungeKutta4") == rk4
    (block,) = pieces("Logging", "python")
    exec(compile(block, "extending.md", "exec"), {})


def test_the_gait(monkeypatch):
    (constructor,) = pieces("A gait", "python")
    made = defined(gait_module, constructor)["sides"]
    monkeypatch.setattr(hp.Gait, "sides", made, raising=False)
    text = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
    found = re.search(r"`\((Gait\.sides\(\), \(.*?\), \d)\)`", text)
    assert found
    gait, typed, fewest = eval(f"({found[1]})", {"Gait": hp.Gait})
    legs: Mapping[str, float] = dict(
        zip(("lf", "lm", "lr", "rf", "rm", "rr"), gait.phases, strict=True)
    )
    placed = [(legs[leg] - legs["lf"]) % 1.0 for leg in ("lf", "rf", "lm", "rm", "lr", "rr")]
    assert_allclose(placed, typed, atol=1e-15)
    swings = [sum((t - phase) % 1.0 >= gait.duty for phase in gait.phases) for t in FRACTIONS]
    assert 6 - max(swings) == fewest
    hp.motion.WalkPlan(hp.load_robot("kharagpur"), gait)


FRACTIONS = (np.arange(600) + 0.5) / 600


def test_the_number_of_the_summary():
    field, take, term, name = pieces("A number of the summary", "cpp")
    totals, numbers = (
        (NATIVE / "run" / file).read_text(encoding="utf-8")
        for file in ("joint_totals.hpp", "summary_numbers.hpp")
    )
    places = {
        field: "  double limit_use = 0.0;",
        take: "    at_limit += other.at_limit,",
        term: "      sums.torque_square += weight * (size * size);\n",
    }
    for piece, before in places.items():
        totals = put(totals, piece, before)
    assert "weight = weight_[i], size = std::abs(e.torque)" in totals
    put(numbers, name, '  put("speed_rms", of_joints([&](const JointSums& s) { return rms(')
    (line,) = pieces("A number of the summary", "python")
    source = put(inspect.getsource(summary), line, "    at_limit: Array", indent="    ")
    names = defined(summary, source)
    known = names["schema"](names["Summary"])
    assert (known["torque_mean"].axes, known["torque_mean"].unit) == (("joint",), "N m")
    assert f'put("{next(iter(known.keys() - summary.schema(hp.Summary).keys()))}"' in name


def test_the_column_of_the_budget():
    """It is printed of a walk; a robot that stands has none."""
    section = "A column of the torque budget"
    of_joint, value, of_kind, total, column = pieces(section, "python")
    source = inspect.getsource(joint_budget)
    source = put(source, of_joint, "    # How far they may be off", indent="    ")
    source = put(source, value, "            torque_peak_error=_known(", indent=" " * 12)
    head, mark, rest = source.partition("class KindBudget:")
    rest = put(rest, of_kind, "    positive_energy: float  # of all joints", indent="    ")
    total, column = (piece.splitlines(keepends=True)[2] for piece in (total, column))
    rest = put(rest, total, "        **worsts,\n", indent="    ")
    rest = put(rest, column, ")\nHEADS = ")
    names = defined(joint_budget, head + mark + rest)
    scene = hp.Scene(hp.load_robot("kharagpur"))
    walk = hp.KinematicControl(hp.Gait.tripod(stroke=0.06, cycle_time=0.8))
    for control, cell in ((walk, r"[\d.]+"), (hp.HoldPosture(), "-")):
        trace = hp.simulate(scene, control, duration=3.0, method="implicit-euler", step=2e-3)
        budget = hp.torque_budget(trace)
        joints = names["summary_rows"](trace.summary)
        kinds = names["kind_rows"](joints)
        if budget.distance is not None:
            found = sum(row.work_per_metre for row in kinds)
            assert_allclose(found, budget.absolute_energy / budget.distance, rtol=1e-12)
        last = [line.split()[-1] for line in names["kind_lines"](kinds, "cycle") if "(x6)" in line]
        assert len(last) == 3 and all(re.fullmatch(cell, one) for one in last)


if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

TEMPLATE = Path(__file__).parents[1] / "examples" / "plugin_template"


def install(folder: Path, name: str, groups: dict[str, dict[str, str]]) -> None:
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
    ground = read_terrain_option("crater:depth=0.01,radius=1.0")
    assert ground is not None and ground.height_at(0.0, 0.0) == pytest.approx(-0.01)
    done = CliRunner().invoke(app, ["contact", "wet-rubber"])
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


def test_an_error_names_the_entry_point_and_its_package(installed: Path) -> None:
    rows: tuple[tuple[str, str, Callable[[], object], str], ...] = (
        ("robots", "none_such:robot", lambda: hp.load_robot("odd"), "ModuleNotFoundError"),
        ("contacts", "math:none_such", lambda: hp.Contact.preset("odd"), "AttributeError"),
        ("terrains", "builtins:dict", lambda: read_terrain({"kind": "odd"}), "TypeError"),
    )
    groups = {f"hexapod_pin.{group}": {"odd": value} for group, value, *_ in rows}
    install(installed, "odd-package", groups)
    for group, value, call, cause in rows:
        with refused(UserCodeError) as caught:
            call()
        for part in (f"odd = '{value}'", group, "odd-package 0.1.0", cause):
            assert part in str(caught.value)


def test_what_the_package_does_is_logged_and_nothing_is_printed(
    installed: Path, caplog: pytest.LogCaptureFixture, capsys: pytest.CaptureFixture[str]
) -> None:
    """Under "hexapod_pin": what was inferred, what was loaded, how the error was controlled."""
    quiet = "from hexapod_pin.log import LOG; LOG.warning('to nobody')"
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
