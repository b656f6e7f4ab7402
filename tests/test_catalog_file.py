"""A user's file of motors: units, and every fault of a file or a row."""

from __future__ import annotations

from pathlib import Path

import pytest
from refusals import ANY, refused

import hexapod_pin as hp
from hexapod_pin.errors import CatalogError

HEADER = "model,voltage_V,stall_torque_Nm,no_load_speed_rad_s,mass_kg"
GOOD = "A,12,1.5,6.0,0.05"


def _write(folder: Path, *lines: str) -> Path:
    path = folder / "motors.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_units_of_the_header(tmp_path: Path) -> None:
    """30 kgf cm are 2.942 N m, 45 rpm are 4.712 rad/s, 55 g are 0.055 kg."""
    path = _write(
        tmp_path,
        "model,voltage_V,stall_torque_kgf_cm,no_load_speed_rpm,mass_g,stall_current_mA,"
        "armature_gcm2,armature_source,price,currency,source,gear_ratio",
        'Mine,12,30,45,55,2700,123000,"measured, bench",14.9,EUR,"sheet, page 2",345',
    )
    (record,) = hp.load_catalog(path)
    assert record.stall_torque == pytest.approx(0.3 * 9.80665, rel=1e-12)
    assert record.no_load_speed == pytest.approx(1.5 * 3.141592653589793, rel=1e-12)
    assert (record.mass, record.stall_current) == (0.055, 2.7)
    assert record.armature == pytest.approx(0.0123, rel=1e-12)
    assert (record.price, record.currency) == (14.9, "EUR")
    assert record.armature_source == "measured, bench"
    assert record.assumed == record.flags == ()


def test_how_spreadsheets_write_files(tmp_path: Path) -> None:
    """Byte order mark, blank lines; computed columns are read over; empty cells are unknown."""
    path = tmp_path / "motors.csv"
    text = f"{HEADER},no_load_speed_rpm,kt_output_Nm_per_A_est\r\n\r\n{GOOD},57.3,bad\r\n,,,,,,\r\n"
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())
    (record,) = hp.load_catalog(path)
    assert (record.model, record.no_load_speed) == ("A", 6.0)
    assert record.flags == ("no stall current is known", "no source is known")
    (record,) = hp.load_catalog(_write(tmp_path, HEADER, "A,12,1.5,,"))
    assert (record.no_load_speed, record.mass) == (None, None)
    assert record.unusable is not None


BAD_ROWS = [
    ("A,12,-1.5,6,0.05", "stall_torque_Nm", -1.5, ("0",)),
    ("A,12,0,6,0.05", "stall_torque_Nm", 0.0, ("0",)),
    ("A,12,strong,6,0.05", "stall_torque_Nm", "strong", ()),
    ('A,12,"1,5",6,0.05', "stall_torque_Nm", "1,5", ("decimal",)),
    ("A,12,nan,6,0.05", "stall_torque_Nm", "nan", ("finite",)),
    ("A,12,1.5,inf,0.05", "no_load_speed_rad_s", "inf", ("finite",)),
    ("A,12,1.5,6,1e999", "mass_kg", "1e999", ("finite",)), ("A,,1.5,6,0.05", "voltage_V", "", ()),
    ("A,12,,6,0.05", "stall_torque_Nm", "", ()), (",12,1.5,6,0.05", "model", "", ()),
    ("A,12,1.5,6", "", "4 cells", ("5",)), ("A,12,1.5,6,0.05,7", "", "6 cells", ("5",)),
]  # fmt: skip


@pytest.mark.parametrize(("row", "column", "value", "about"), BAD_ROWS, ids=str)
def test_bad_row(tmp_path, row, column, value, about):
    """One message: file, line, column, value, what is allowed."""
    path = _write(tmp_path, HEADER, GOOD.replace("A", "B"), row)
    fault = {"line": 3, "column": column, "value": value}
    with refused(CatalogError, source=str(path), about=(str(path), "3", *about), **fault) as caught:
        hp.load_catalog(path)
    assert len(caught.value.faults) == 1


MORE = "voltage_min_V,voltage_max_V,rated_torque_mNm,armature_kgm2,armature_source,price,currency"
BAD_TOGETHER = [
    ("9,11,,,,,", "voltage_V", 12.0, ("voltage_min", "9", "voltage_max", "11")),
    ("13,,,,,,", "voltage_V", 12.0, ("voltage_min", "13")),
    (",,1600,,,,", "rated_torque_mNm", 1600.0, ("1.5",)), (",,,0.01,,,", "armature_source", "", ()),
    (",,,-0.01,me,,", "armature_kgm2", -0.01, ("0",)), (",,,,,10,", "currency", "", ()),
    (",,,,,-10,EUR", "price", -10.0, ("0",)),
]  # fmt: skip


@pytest.mark.parametrize(("cells", "column", "value", "about"), BAD_TOGETHER, ids=str)
def test_columns_that_contradict(tmp_path, cells, column, value, about):
    """In the units of the file: 1600 mN m of a motor that stalls at 1.5 N m."""
    path = _write(tmp_path, f"{HEADER},{MORE}", f"{GOOD},{cells}")
    wanted = pytest.approx(value) if isinstance(value, float) else value
    fault = {"line": 2, "column": column, "value": wanted}
    with refused(CatalogError, source=str(path), about=about, **fault):
        hp.load_catalog(path)


def test_all_bad_rows_are_reported_at_once(tmp_path: Path) -> None:
    """One message per row, and a name that stands twice names the first."""
    path = _write(tmp_path, HEADER, GOOD, "B,12,x,6,y", "a,12.0,2,6,1", "C,12,1,-6,1")
    with refused(CatalogError, source=str(path)) as caught:
        hp.load_catalog(path)
    assert [fault.line for fault in caught.value.faults] == [3, 4, 5]
    assert len(str(caught.value).splitlines()) == 3
    twice = caught.value.faults[1]
    assert (twice.column, twice.value) == ("model", "a at 12 V")
    assert "2" in twice.hint.split()


BAD_HEADERS = [
    (
        "model,voltage_V,stall_torque_Nm,mass_kg",
        "no_load_speed_rad_s", "", ("no_load_speed_rpm", "no_load_speed_deg_s"),
    ),
    (HEADER.replace("_Nm", ""), "stall_torque", "stall_torque", ("stall_torque_Nm",)),
    (HEADER.replace("_kg", "_lb"), "mass_lb", "mass_lb", ("mass_kg", "mass_g")),
    (f"{HEADER},mass_kg", "mass_kg", "mass_kg", ()),
    (HEADER.replace(",", ";"), "", ANY, ("semicolons", "commas")),
    (HEADER.replace(",", "\t"), "", ANY, ("tabs",)),
]  # fmt: skip


@pytest.mark.parametrize(("header", "column", "value", "about"), BAD_HEADERS)
def test_bad_header(tmp_path, header, column, value, about):
    path = _write(tmp_path, header, GOOD)
    with refused(CatalogError, source=str(path), line=1, column=column, value=value, about=about):
        hp.load_catalog(path)


@pytest.mark.parametrize(
    ("column", "hinted"), [("makr", {"maker", "`note`"}), ("shop", {"`note`"})]
)
def test_unknown_column(tmp_path: Path, column: str, hinted: set[str]) -> None:
    """A similar name is shown where there is one."""
    path = _write(tmp_path, f"{HEADER},{column}", GOOD)
    with refused(CatalogError, source=str(path), line=1, column=column, value=column) as caught:
        hp.load_catalog(path)
    hint = caught.value.faults[0].hint
    assert {name for name in ("maker", "`note`") if name in hint} == hinted


def test_files_that_are_not_there_or_contradict_themselves(tmp_path: Path) -> None:
    """6 rad/s are 57.3 turns a minute, not 60."""
    path = _write(tmp_path, f"{HEADER},no_load_speed_rpm", f"{GOOD},60")
    with refused(
        CatalogError, source=str(path), line=2, column="no_load_speed_rpm", value=60.0,
        about=("no_load_speed_rad_s", "57.3"),
    ):  # fmt: skip
        hp.load_catalog(path)
    for path in (tmp_path / "none.csv", tmp_path):
        with refused(CatalogError, source=str(path), line=0, column="", value=str(path)):
            hp.load_catalog(path)


@pytest.mark.parametrize(
    ("data", "line", "value", "about"),
    [
        (b"", 1, "", ()), (b"\n\n", 1, "", ()), (HEADER.encode(), 1, "no rows", ()),
        (b"\x89PNG\r\n\x1a\n\x00\x00", 0, "byte 0", ("UTF-8",)),
        (b"model\x00,voltage_V", 0, "NUL bytes", ()),
        (HEADER.encode() + b'\n"A,12', 2, ANY, ("comma-separated",)),
    ],
)  # fmt: skip
def test_file_that_is_none(tmp_path, data, line, value, about):
    path = tmp_path / "motors.csv"
    path.write_bytes(data)
    with refused(CatalogError, source=str(path), line=line, column="", value=value, about=about):
        hp.load_catalog(path)
