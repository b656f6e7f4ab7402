"""Every normal law with every friction law on every ground, in reduced form."""

from __future__ import annotations

import pytest
from studies.contact import contact_energy, contact_matrix


def test_matrix_walks_without_energy_gain(capsys: pytest.CaptureFixture[str]) -> None:
    """40 of the 520 walks, every law and ground among them: none fails at every step."""
    assert contact_matrix.main(["--every", "13"]) == 0
    assert "40 walks of 5 s" in capsys.readouterr().out


def test_energy_residual_falls_with_the_step_for_many_pairs(capsys):
    """Four pairs of laws, 2.4 s: the residual falls like the method's order, one."""
    assert contact_energy.main(["--every", "17", "--duration", "2.4"]) == 0
    assert "4 pairs" in capsys.readouterr().out
