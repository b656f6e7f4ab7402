"""Catalogues of motors: the package's, what is estimated, derating; faults of a user's file."""

from __future__ import annotations

from pathlib import Path

import pytest
from refusals import ANY, refused

import hexapod_pin as hp
from hexapod_pin.drive.catalog import motor_record as armature
from hexapod_pin.errors import CatalogError, ParameterError, UnknownNameError

CATALOG = hp.load_catalog()


def test_rows_of_the_catalogue() -> None:
    record = CATALOG.get("ax-12a")
    assert (record.name, record.stall_torque) == ("AX-12A at 12 V", 1.5)
    assert record.no_load_speed == pytest.approx(59 * 2 * 3.14159265 / 60, rel=1e-5)
    assert (record.mass, record.gear_ratio, record.stall_current) == (0.0546, 254.0, 1.5)
    assert (record.price, record.rated_torque, record.winding_resistance) == (None, None, None)
    assert (len(CATALOG), len({record.name for record in CATALOG})) == (90, 90)
    assert all(record.source for record in CATALOG)
    assert all(r.armature_source for r in CATALOG if r.armature is not None)
    priced = [record for record in CATALOG if record.price is not None]
    assert all(r.currency == "USD" and r.price_date and r.price_source for r in priced)
    assert {name for r in CATALOG for name in r.buses} == {"TTL", "RS-485", "PWM", "CAN"}


def test_flaws_of_rows_are_reported() -> None:
    assert sum(any("inconsistent" in flag for flag in record.flags) for record in CATALOG) == 8
    worst = CATALOG.get("XC430-W150", 12.0)
    assert worst.implied_efficiency == pytest.approx(1.6 / 1.4 * 11.1003 / 12, rel=1e-12)
    assert "1.06" in worst.flags[0] and worst.unusable is None  # its line is as published
    lame = CATALOG.get("HerkuleX DRS-0201")
    assert {"no no-load speed is known", "no mass is known"} <= set(lame.flags) and lame.unusable
    with refused(ParameterError, "MotorRecord.no_load_speed", None):
        lame.motor()


def test_a_number_in_another_unit_is_refused() -> None:
    """The error names the likely unit; quasi-direct drives (37 and 45 N m/kg) pass."""
    for name, value, other, about in (
        ("stall_torque", 4100.0, {"mass": 0.082}, "4100 N mm"),
        ("no_load_speed", 110.0, {"stall_torque": 4.1}, "11.5 rad/s"),
    ):
        with refused(ParameterError, name, value, about=(about,)):
            hp.sizing.MotorRecord(model="M", voltage=12.0, **{name: value}, **other)
    for torque, mass in ((18.0, 0.485), (23.7, 0.53)):
        hp.sizing.MotorRecord(model="Q", voltage=24.0, stall_torque=torque, mass=mass)


def test_motor_is_the_line_of_the_row() -> None:
    record = CATALOG.get("XC430-W150", 12.0)
    other = record.model_copy(update={"stall_current": 100.0, "torque_constant": 1.0}).motor(0.8)
    assert (other.stall_torque, other.no_load_speed) == (record.stall_torque, record.no_load_speed)
    assert (other.voltage_ratio, other.torque_constant) == (0.8, 1.0)
    assert other.armature == pytest.approx(record.joint_armature, rel=1e-12)
    assert other.model_copy(update={"torque_constant": None}) == record.motor(0.8)


def test_armature_is_published_or_estimated() -> None:
    """Estimates have the time constants of rows with a published one (MX-64: 0.0123 kg m^2)."""
    record = CATALOG.get("MX-64", 12.0)
    assert record.assumed == () and "bam" in record.armature_source
    assert record.motor().rotor_inertia == pytest.approx(0.0123 / 200**2, rel=1e-12)
    times = {r.name: armature.mechanical_time(r) for r in CATALOG}
    coreless = (times["MX-64 at 12 V"] + times["MX-106 at 12 V"]) / 2
    assert pytest.approx(coreless, rel=0.03) == armature.CORELESS_TIME  # two digits are stated
    record = CATALOG.get("XM430-W350", 12.0)
    assert record.joint_armature == pytest.approx(0.014 * 4.1 / 4.8171, rel=1e-12)
    assert "14 ms" in record.assumed[0]


def test_names_and_voltages() -> None:
    assert CATALOG.get("xm430-w350 at 11.1 v").stall_torque == 3.8
    allowed, hint = (11.1, 12.0, 14.8), ("'XM430-W350 at 11.1 V'",)
    with refused(ParameterError, "voltage", 13.0, allowed=allowed, about=hint):
        CATALOG.get("XM430-W350", 13.0)
    assert CATALOG.usual("XM430-W350").voltage == 12.0
    assert CATALOG.usual("XM430-W350 at 14.8 V") is CATALOG.usual("XM430-W350", 14.8)
    with refused(UnknownNameError, kind="motor", name="AX-12B", known=CATALOG.models):
        CATALOG.get("AX-12B")
    record, ratio = CATALOG.supplied("XM430-W350", 13.0)
    assert (record.voltage, ratio) == (12.0, pytest.approx(13 / 12, rel=1e-15))
    with refused(ParameterError, "voltage", 7.4, allowed=(10.0, 14.8)):
        CATALOG.supplied("XM430-W350", 7.4)
    assert {row.voltage for row in CATALOG.at(24.0)} == {24.0}
    with refused(ParameterError, "voltage", 13.37, allowed=(12.0, 14.8, 24.0)):
        CATALOG.at(13.37)


def test_the_catalogue_is_written_and_shown(tmp_path: Path) -> None:
    page = (Path(__file__).parents[1] / "docs" / "motors.md").read_text(encoding="utf-8")
    assert page.endswith(f"\n\n{CATALOG.table()}\n")
    again = hp.load_catalog(CATALOG.save(tmp_path / "mine.csv"))
    assert again.records == CATALOG.records
    there = str(tmp_path / "none" / "mine.csv")
    with refused(CatalogError, source=there, line=0, column="", value=there):
        CATALOG.save(there)


# a user's file --------------------------------------------------------------------------------

HEADER = "model,voltage_V,stall_torque_Nm,no_load_speed_rad_s,mass_kg"
GOOD = "A,12,1.5,6.0,0.05"


def _write(folder: Path, *lines: str) -> Path:
    path = folder / "motors.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_units_of_the_header(tmp_path: Path) -> None:
    """30 kgf cm are 2.942 N m, 45 rpm are 4.712 rad/s; with a byte order mark, and an empty row."""
    path = _write(
        tmp_path,
        "\ufeffmodel,voltage_V,stall_torque_kgf_cm,no_load_speed_rpm,mass_g,stall_current_mA,"
        "armature_gcm2,armature_source,price,currency,source,gear_ratio",
        'Mine,12,30,45,55,2700,123000,"measured, bench",14.9,EUR,"sheet, page 2",345\n,,,,,,,,,,,',
    )
    (record,) = hp.load_catalog(path)
    assert record.stall_torque == pytest.approx(0.3 * 9.80665, rel=1e-12)
    assert record.no_load_speed == pytest.approx(1.5 * 3.141592653589793, rel=1e-12)
    assert (record.mass, record.stall_current) == (0.055, 2.7)
    assert record.armature == pytest.approx(0.0123, rel=1e-12)
    assert (record.price, record.currency) == (14.9, "EUR")
    assert record.armature_source == "measured, bench"
    assert record.assumed == record.flags == ()


MORE = (
    f"{HEADER},voltage_min_V,voltage_max_V,rated_torque_mNm,armature_kgm2,armature_source,"
    "price,currency,no_load_speed_rpm"
)
FAULTS = [  # the file, and line, column and value of its one fault with what its message says
    ((HEADER, "B,12,1.5,6,0.05", "A,12,-1.5,6,0.05"), 3, "stall_torque_Nm", -1.5, ("0",)),
    ((HEADER, 'A,12,"1,5",6,0.05'), 2, "stall_torque_Nm", "1,5", ("decimal",)),
    ((HEADER, "A,12,1.5,6,1e999"), 2, "mass_kg", "1e999", ("finite",)),
    ((HEADER, "A,12,1.5,6"), 2, "", "4 cells", ("5",)),
    ((MORE, f"{GOOD},9,11,,,,,,"), 2, "voltage_V", 12.0, ("voltage_min", "9", "voltage_max", "11")),
    ((MORE, f"{GOOD},,,1600,,,,,"), 2, "rated_torque_mNm", pytest.approx(1600.0), ("1.5",)),
    ((HEADER, "A,,1.5,6,0.05"), 2, "voltage_V", "", ()),
    ((HEADER, ",12,1.5,6,0.05"), 2, "model", "", ()),
    ((MORE, f"{GOOD},,,,0.01,,,,"), 2, "armature_source", "", ()),
    ((MORE, f"{GOOD},,,,,,10,,"), 2, "currency", "", ()),
    ((MORE, f"{GOOD},,,,,,,,60"), 2, "no_load_speed_rpm", 60.0, ("no_load_speed_rad_s", "57.3")),
    ((HEADER.replace(",mass_kg", ""), GOOD), 1, "mass_kg", "", ("mass_g",)),
    ((HEADER.replace("_kg", "_lb"), GOOD), 1, "mass_lb", "mass_lb", ("mass_kg", "mass_g")),
    ((f"{HEADER},mass_kg", GOOD), 1, "mass_kg", "mass_kg", ()),
    ((f"{HEADER},makr", GOOD), 1, "makr", "makr", ("Perhaps maker", "`note`")),
    ((HEADER.replace(",", ";"), GOOD), 1, "", ANY, ("semicolons", "commas")),
    ((HEADER,), 1, "", "no rows", ()),
    (("",), 1, "", "", ()),
    ((HEADER, '"A,12'), 2, "", ANY, ("comma-separated",)),
    (("model\0,voltage_V",), 0, "", "NUL bytes", ()),
]


@pytest.mark.parametrize(("lines", "line", "column", "value", "about"), FAULTS)
def test_bad_file(tmp_path, lines, line, column, value, about):
    path = _write(tmp_path, *lines)
    fault = {"source": str(path), "line": line, "column": column, "value": value}
    with refused(CatalogError, about=(str(path), *about), **fault) as caught:
        hp.load_catalog(path)
    assert len(caught.value.faults) == 1


def test_all_bad_rows_are_reported_at_once(tmp_path: Path) -> None:
    path = _write(tmp_path, HEADER, GOOD, "B,12,x,6,y", "a,12.0,2,6,1", "C,12,1,-6,1")
    with refused(CatalogError, source=str(path)) as caught:
        hp.load_catalog(path)
    assert [fault.line for fault in caught.value.faults] == [3, 4, 5]
    twice = caught.value.faults[1]
    assert (twice.column, twice.value) == ("model", "a at 12 V") and "2" in twice.hint.split()


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    picture = tmp_path / "motors.png"
    picture.write_bytes(b"\x89PNG\r\n\x1a\n\x00\x00")
    for path, value in ((tmp_path, str(tmp_path)), (picture, "byte 0")):
        with refused(CatalogError, source=str(path), line=0, column="", value=value):
            hp.load_catalog(path)
