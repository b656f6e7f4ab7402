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
from hexapod_pin.commands.terminal import MISSED
from hexapod_pin.errors import MissingPackageError, SimulationInterrupted, UnknownNameError
from hexapod_pin.formulations.maximal import model as constraints
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
    "check", [*limit_checks.CHECKS, *flight_checks.CHECKS], ids=lambda check: check.name
)
def test_limits_and_flight(check) -> None:
    row = run(check)
    assert row.passed, row


def test_mujoco_has_the_same_equations_of_motion() -> None:
    pytest.importorskip("mujoco")
    row = run(mujoco_terms.MUJOCO_CHECK)
    assert row.passed, row


def test_without_mujoco_the_row_says_so(monkeypatch) -> None:
    monkeypatch.setattr(mujoco_terms, "find_spec", lambda name: None)
    row = run(mujoco_terms.MUJOCO_CHECK)
    assert row.verdict == "not run: mujoco is not installed" and not row.failed


def test_command_prints_a_table_and_succeeds(tmp_path) -> None:
    out = tmp_path / "verify.md"
    result = CliRunner().invoke(cli.app, ["verify", "--only", QUICK, "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert "4 pass, 0 FAIL" in result.output
    assert out.read_text().startswith("| case | what | method or source | error")


def test_command_fails_where_a_check_fails(monkeypatch, capsys) -> None:
    """The table is printed, the failed row named, and the exit status is 1."""
    wrong = Check("wrong", "one against two", lambda: 1.0, 1e-9)
    monkeypatch.setattr("hexapod_pin.validation.checks.registry.all_checks", lambda: [wrong])
    with pytest.raises(SystemExit) as stop:
        cli.main(["verify"])
    assert stop.value.code == MISSED
    printed = capsys.readouterr()
    assert "FAIL" in printed.out
    assert "one against two" in printed.err


def test_unknown_checks_are_refused() -> None:
    with refused(UnknownNameError, kind="check", name="hc99"):
        run_checks(names=["hc99"])


def test_a_check_that_breaks_or_gives_nan_has_failed() -> None:
    def breaks() -> float:
        raise np.linalg.LinAlgError("singular")

    broken = run(Check("a", "b", breaks, 1.0))
    blank = run(Check("c", "d", lambda: math.nan, 1.0))
    assert not broken.passed and "singular" in broken.note
    assert not blank.passed
    assert "0 pass, 2 FAIL" in summary([broken, blank])
    assert "singular" in result_table([broken, blank]).text()


def wrong_sign(monkeypatch) -> str:
    """Eq. 5 with the sign of its right side turned."""
    monkeypatch.setattr(impact, "required_velocity_change", lambda rows, v: rows @ v)
    return "pinocchio-impact"


def printed_sign(monkeypatch) -> str:
    """Eq. 5 as printed: +lambda, so that its multiplier is minus the impulse."""
    solve = impact.solve_kkt

    def printed(mass, right, rows, target):
        found = solve(mass, right, rows, target)
        return type(found)(**{**vars(found), "f": -found.f})

    monkeypatch.setattr(impact, "solve_kkt", printed)
    return "hc18"


def wrong_frame(monkeypatch) -> str:
    """Foot rows in the joint's own axes."""
    monkeypatch.setattr(model, "CONTACT_FRAME", "LOCAL")
    return "core-terms"


def no_drift(monkeypatch) -> str:
    """Eq. 3 without J' v."""
    drift = model.RigidModel.drift
    monkeypatch.setattr(model.RigidModel, "drift", lambda *args: 0.0 * drift(*args))
    return "pinocchio-motion"


def pulling_forces(monkeypatch) -> str:
    """Ground forces with their sign turned."""
    solve = DERIVATIVE.solve_kkt

    def turned(mass, right, rows, target):
        found = solve(mass, right, rows, target)
        return type(found)(**{**vars(found), "f": -found.f})

    monkeypatch.setattr(DERIVATIVE, "solve_kkt", turned)
    return "pinocchio-motion"


def sign_of_eq_3(monkeypatch) -> str:
    """S1's eq. 3, rows 2-3, with its sign turned."""
    right = constraints.gamma_rows_2_3
    monkeypatch.setattr(constraints, "gamma_rows_2_3", lambda i, j: -right(i, j))
    return "maximal-motion"


def lost_dots(monkeypatch) -> str:
    """S1's eq. 3, row 1, as it is printed: s where s' belongs."""
    monkeypatch.setattr(
        constraints,
        "gamma_row_1",
        lambda i, j: i.rate[:, :, JOINT_POINT] - j.rate[:, :, JOINT_POINT],
    )
    return "maximal-motion"


def wrong_inertia_axis(monkeypatch) -> str:
    """Moments of inertia left in the axes of the bodies."""
    monkeypatch.setattr(kinematics, "world_inertia", lambda turn, inertia: inertia)
    return "maximal-motion"


PLANTED = [
    wrong_sign, printed_sign, wrong_frame, no_drift, pulling_forces, sign_of_eq_3, lost_dots,
    wrong_inertia_axis,
]  # fmt: skip


@pytest.mark.parametrize("plant", PLANTED)
def test_a_planted_error_fails_its_check(plant, monkeypatch) -> None:
    """Without it, the same check passes; `QUICK` holds the others."""
    name = plant(monkeypatch)
    assert found(name).failed
    monkeypatch.undo()
    if name not in QUICK.split(","):
        assert _passes(name)


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
