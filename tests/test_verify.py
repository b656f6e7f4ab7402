"""`hexapod-pin verify`: what it finds, table, exit status, and planted errors it must see."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from typer.testing import CliRunner

from hexapod_pin.commands import app as cli
from hexapod_pin.errors import MissingPackageError, SimulationInterrupted, UnknownNameError
from hexapod_pin.formulations.maximal import model as kinematics
from hexapod_pin.formulations.maximal.bodies import parsed_robot
from hexapod_pin.formulations.maximal.model import JOINT_POINT
from hexapod_pin.formulations.rigid import contact_events as impact
from hexapod_pin.formulations.rigid import model
from hexapod_pin.validation.case_result import CaseResult
from hexapod_pin.validation.checks import (
    flight_checks,
    impact_checks,
    inverse_checks,
    limit_checks,
    maximal_checks,
    rigid_checks,
)
from hexapod_pin.validation.checks import registry as mujoco_terms
from hexapod_pin.validation.checks.registry import all_checks, run_checks
from hexapod_pin.validation.hard_case import Check, run_cases
from hexapod_pin.validation.tables import result_table, summary

DERIVATIVE = import_module("hexapod_pin.formulations.rigid.derivative")
CONTAINED = ("tripod-limit", "flight")  # by tripod-order and hc14b
CHECKED = [c for c in (*limit_checks.CHECKS, *flight_checks.CHECKS) if c.name not in CONTAINED]
NO_MUJOCO = "not run: mujoco is not installed"
DRIFT = model.RigidModel.drift
QUICK = "core-terms,hc15-tripods,hc18,pinocchio-impact"


def found(name: str) -> CaseResult:
    """Return the result of one check."""
    [result] = run_checks(names=[name])
    return result


def run(check: Check) -> CaseResult:
    """Return the result of a check."""
    [result] = run_cases([check])
    return result


def test_every_module_of_checks_is_found_and_names_are_unique() -> None:
    names = [check.name for check in all_checks()]
    own = (flight_checks, impact_checks, inverse_checks, limit_checks, maximal_checks, rigid_checks)
    assert {check.name for module in own for check in module.CHECKS} <= set(names)
    assert len(set(names)) == len(names)


@pytest.mark.parametrize(
    "check",
    [*CHECKED, mujoco_terms.MUJOCO_CHECK],
    ids=lambda check: check.name,
)
def test_limits_flight_and_mujoco(check) -> None:
    row = run(check)
    assert row.passed or row.verdict == NO_MUJOCO, row


def test_without_mujoco_the_row_says_so(monkeypatch) -> None:
    monkeypatch.setattr(mujoco_terms, "find_spec", lambda name: None)
    row = run(mujoco_terms.MUJOCO_CHECK)
    assert row.verdict == NO_MUJOCO and not row.failed


def test_command_prints_a_table_and_succeeds(tmp_path) -> None:
    out = tmp_path / "verify.md"
    result = CliRunner().invoke(cli.app, ["verify", "--only", QUICK, "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert "4 pass, 0 FAIL" in result.output
    assert out.read_text().startswith("| case | what | method or source | error")


def test_a_check_that_breaks_or_gives_nan_has_failed() -> None:
    def breaks() -> float:
        raise np.linalg.LinAlgError("singular")

    broken = run(Check("a", "b", breaks, 1.0))
    blank = run(Check("c", "d", lambda: math.nan, 1.0))
    assert not broken.passed and "singular" in broken.note
    assert not blank.passed
    assert "singular" in result_table([broken, blank]).text()
    assert "0 pass, 2 FAIL" in summary([broken, blank])
    with refused(UnknownNameError, kind="check", name="hc99"):
        run_checks(names=["hc99"])


def negated(function):
    """Return the function with its result's sign turned."""
    return lambda *args: -function(*args)


def turned_forces(module):
    """Return the module's solver with the forces' sign turned."""
    solve = module.solve_kkt

    def solve_kkt(*args):
        found = solve(*args)
        return type(found)(**{**vars(found), "f": -found.f})

    return solve_kkt


def lost_dots(i, j):
    """S1's eq. 3, row 1, as it is printed: s where s' belongs."""
    return i.rate[:, :, JOINT_POINT] - j.rate[:, :, JOINT_POINT]


PLANTED = {
    "eq. 5 with the sign of its right side turned":
        ("pinocchio-impact", impact, "required_velocity_change", lambda rows, v: rows @ v),
    "eq. 5 as printed, +lambda": ("hc18", impact, "solve_kkt", turned_forces(impact)),
    "foot rows in the joint's own axes": ("core-terms", model, "CONTACT_FRAME", "LOCAL"),
    "eq. 3 without J' v":
        ("pinocchio-motion", model.RigidModel, "drift", lambda *args: 0.0 * DRIFT(*args)),
    "pulling ground forces":
        ("pinocchio-motion", DERIVATIVE, "solve_kkt", turned_forces(DERIVATIVE)),
    "S1's eq. 3, rows 2-3, with its sign turned":
        ("maximal-motion", kinematics, "gamma_rows_2_3", negated(kinematics.gamma_rows_2_3)),
    "S1's eq. 3, row 1, as printed": ("maximal-motion", kinematics, "gamma_row_1", lost_dots),
    "inertia in the axes of the bodies":
        ("maximal-motion", kinematics, "world_inertia", lambda turn, inertia: inertia),
}  # fmt: skip


@pytest.mark.parametrize(("check", "place", "name", "wrong"), PLANTED.values(), ids=PLANTED)
def test_a_planted_error_fails_its_check(check, place, name, wrong, monkeypatch) -> None:
    """Without it, the same check passes; `QUICK` holds the others."""
    monkeypatch.setattr(place, name, wrong)
    assert found(check).failed
    monkeypatch.undo()
    if check not in QUICK.split(","):
        assert _passes(check)


@cache
def _passes(name: str) -> bool:
    return found(name).passed


def test_ctrl_c_writes_the_checks_that_are_done(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The first check is in the table and in the file; the status is that of Ctrl-C."""
    first = all_checks()[0]

    def stopping(names=None, everything=False, progress=None):
        stopper = replace(first, run=lambda: (_ for _ in ()).throw(KeyboardInterrupt))
        return run_cases([replace(first, run=lambda: 0.0), stopper], quick=True, progress=progress)

    monkeypatch.setattr("hexapod_pin.validation.checks.registry.run_checks", stopping)
    page = tmp_path / "page.md"
    result = CliRunner().invoke(cli.app, ["verify", "--out", str(page)])
    told = "interrupted; 1 of 2 cases are done"
    assert result.exit_code == 130 and told in result.output
    assert first.name in page.read_text("utf-8") and told in page.read_text("utf-8")


def test_ctrl_c_is_no_failed_check() -> None:
    """An interrupted simulation is an error of the package, but no finding."""
    first = all_checks()[0]

    def interrupted() -> float:
        raise SimulationInterrupted("interrupted", None)

    with pytest.raises(SimulationInterrupted) as stopped:
        run_cases([replace(first, run=interrupted)], quick=True)
    assert stopped.value.results == []


def test_maximal_coordinates_say_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without yourdfpy the formulation refuses, and its check is not run."""
    monkeypatch.setitem(sys.modules, "yourdfpy", None)
    with pytest.raises(MissingPackageError) as caught:
        parsed_robot("<robot/>")
    assert (caught.value.name, caught.value.extra) == ("yourdfpy", "formulations")
    [result] = run_checks(names=["maximal-motion"])
    assert result.kind == "not run" and "hexapod-pin[formulations]" in result.note
