"""Repairs of units, masses and inertias: exact factors, closed forms of boxes, balls, cylinders."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from broken_urdfs import WHOLE, add, all_inertias, masses, moments, part, put, remove, repaired
from refusals import refused
from test_findings import ALONE

from hexapod_pin.errors import ParameterError
from hexapod_pin.robot.repair import RepairOptions
from hexapod_pin.robot.repair.inertias import nearest_possible
from hexapod_pin.robot.repair.rules import DENSITY

# units ------------------------------------------------------------------------------------------


def test_units_come_back_exactly() -> None:
    """Each slip is undone to the last digit that was written."""
    for change in (ALONE["grams"][0], ALONE["kg mm^2"][0], ALONE["g mm^2"][0], ALONE["g cm^2"][0],
                   ALONE["centres in mm"][0], ALONE["boxes in mm"][0],
                   ALONE["millimetres"][0]):  # fmt: skip
        file = repaired(change).file
        np.testing.assert_allclose(masses(file), masses(WHOLE), rtol=1e-11)
        for old, new in zip(WHOLE.links, file.links, strict=True):
            np.testing.assert_allclose(new.com, old.com, rtol=1e-11)
            if old.mass:
                np.testing.assert_allclose(new.moments, old.moments, rtol=1e-11)
        for a, b in zip(WHOLE.joints, file.joints, strict=True):
            np.testing.assert_allclose(b.xyz, a.xyz, rtol=1e-11)


def test_grams_and_millimetres_together() -> None:
    """SolidWorks in mm, g and g mm^2: three repairs, one robot."""
    done = repaired(ALONE["millimetres"][0], ALONE["grams"][0], all_inertias(1e9))
    np.testing.assert_allclose(masses(done.file), masses(WHOLE), rtol=1e-11)
    np.testing.assert_allclose(
        moments(done.file, "lf_tibia"), moments(WHOLE, "lf_tibia"), rtol=1e-11
    )
    assert {"g", "mm", "mm^2"} & set(re.findall(r"[\w^]+", " ".join(done.assumed)))


# masses and inertias ----------------------------------------------------------------------------


def test_a_missing_inertial_is_that_of_the_box() -> None:
    """coxa: 0.0835 x 0.045 x 0.045 m at x = 0.04175 m, density as assumed: closed form."""
    legs = ("lf", "lm", "lr", "rf", "rm", "rr")  # none is left with a mass
    done = repaired(*[remove(f"link {leg}_coxa/inertial") for leg in legs])
    link = done.file.link_by_name["rr_coxa"]
    mass = DENSITY * 0.0835 * 0.045**2
    assert link.mass == pytest.approx(mass, rel=1e-8)
    assert link.com == pytest.approx((0.04175, 0, 0), abs=1e-12)
    along, across = mass / 12 * 2 * 0.045**2, mass / 12 * (0.045**2 + 0.0835**2)
    assert link.moments == pytest.approx((along, across, across, 0, 0, 0), rel=1e-8, abs=1e-15)
    assert any("rr_coxa" in text and "430 kg/m^3" in text for text in done.assumed)
    own = done.file.root.find("hexapod_pin")
    assert own is not None
    assert set(done.assumed) <= {x.text for x in own.findall("assumed")}


def test_one_part_of_six_weighs_what_the_others_do() -> None:
    """A single coxa without a mass gets that of the other five; its inertia is that of its box."""
    for change in (put("link rr_coxa/inertial/mass", value="0"), remove("link rr_coxa/inertial")):
        done = repaired(change)
        link = done.file.link_by_name["rr_coxa"]
        assert link.mass == 0.15
        along, across = 0.15 / 12 * 2 * 0.045**2, 0.15 / 12 * (0.045**2 + 0.0835**2)
        assert link.moments[:3] == pytest.approx((along, across, across), rel=1e-8)
        assert any("rr_coxa" in text and "other legs" in text for text in done.assumed)
        np.testing.assert_allclose(masses(done.file), masses(WHOLE), rtol=1e-12)


def test_a_ball_and_a_turned_cylinder() -> None:
    """2/5 m r^2; m r^2/2 along the cylinder's axis, which rpy = (pi/2, 0, 0) turns to y."""
    ball = '<visual><geometry><sphere radius="0.03"/></geometry></visual>'
    rod = ('<visual><origin rpy="1.5707963267948966 0 0"/><geometry><cylinder radius="0.01" '
           'length="0.1"/></geometry></visual>')  # fmt: skip
    across = 1e-4 / 4 + 1e-2 / 12
    for shape, wanted in ((ball, (0.4 * 9e-4,) * 3), (rod, (across, 1e-4 / 2, across))):
        gone = [remove("link lf_coxa/inertial"), remove("link lf_coxa/visual")]
        link = repaired(*gone, add("link lf_coxa", shape)).file.link_by_name["lf_coxa"]
        assert np.array(link.moments[:3]) / link.mass == pytest.approx(np.array(wanted), rel=1e-7)


def test_mass_and_density_as_given() -> None:
    """--mass fills what is missing, else scales masses and inertias alike; --density is used."""
    gone = remove("link rr_coxa/inertial")
    rest = masses(WHOLE).sum() - 0.15
    filled = repaired(gone, mass=rest + 0.2).file
    assert filled.link_by_name["rr_coxa"].mass == pytest.approx(0.2, rel=1e-8)
    assert filled.link_by_name["lf_coxa"].mass == 0.15
    scaled = repaired(mass=2 * masses(WHOLE).sum()).file
    np.testing.assert_allclose(masses(scaled), 2 * masses(WHOLE), rtol=1e-11)
    np.testing.assert_allclose(
        moments(scaled, "lf_coxa"), 2 * moments(WHOLE, "lf_coxa"), rtol=1e-11
    )
    dense = repaired(gone, density=1000.0).file
    assert dense.link_by_name["rr_coxa"].mass == pytest.approx(1e3 * 0.0835 * 0.045**2, rel=1e-8)
    assert "--density is not used" in repaired(density=1000.0).notes[0]
    with refused(ParameterError, "RepairOptions.mass", -1.0):
        RepairOptions(mass=-1.0)


def test_a_robot_of_dummies_gets_masses_from_its_shapes() -> None:
    """18 links and a trunk of 1e-5 kg each: all from their boxes."""
    done = repaired(ALONE["dummies"][0])
    trunk = done.file.link_by_name["base_link"]
    assert trunk.mass == pytest.approx(DENSITY * 0.495 * 0.205 * 0.089, rel=1e-8)
    assert any("0.19 g is a dummy" in text for text in done.changes)
    assert repaired(ALONE["dummies"][0], mass=3.0).file.link_by_name[
        "lf_tibia"
    ].mass == pytest.approx(
        3.0 * 0.09879 * 0.03 * 0.02 / (0.495 * 0.205 * 0.089 + 6 * (BOXES + 4e-6 / 3 * math.pi)),
        rel=1e-7,
    )


COXA, FEMUR, TIBIA = (
    np.prod([float(x) for x in part(WHOLE.root, f"link lf_{name}/visual/geometry/box").get(
        "size", "").split()]) for name in ("coxa", "femur", "tibia"))  # fmt: skip
BOXES = COXA + FEMUR + TIBIA


def test_nearest_possible_inertia() -> None:
    """One moment too large by d: a third of d off it, and on each other (orthogonal projection)."""
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    low, high = np.array([1.0, 2.0, 6.0]), np.array([2.0, 3.0, 5.0])
    nearest = nearest_possible(turn @ np.diag(low) @ turn.T)
    np.testing.assert_allclose(nearest, turn @ np.diag(high) @ turn.T, atol=3e-5)  # FLATNESS
    possible = turn @ np.diag([3.0, 4.0, 5.0]) @ turn.T
    np.testing.assert_allclose(nearest_possible(possible), possible, rtol=1e-12, atol=1e-12)
    small, middle, large = np.linalg.eigvalsh(nearest_possible(np.diag([-1.0, 2.0, 2.0])))
    assert small > 0.0
    assert small + middle > large


def test_an_impossible_inertia_keeps_mass_and_centre() -> None:
    file = repaired(put("link rf_femur/inertial/inertia", izz="4e-4")).file
    old, new = WHOLE.link_by_name["rf_femur"], file.link_by_name["rf_femur"]
    assert (new.mass, new.com) == (old.mass, old.com)
    xx, yy, _ = old.moments[:3]
    excess = 4e-4 - xx - yy
    wanted = (xx + excess / 3, yy + excess / 3, 4e-4 - excess / 3)
    assert new.moments[:3] == pytest.approx(wanted, rel=1e-5)
