"""A user's file of motors: units, and every way in which a file or a row can be wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

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


def test_byte_order_mark_blank_lines_and_computed_columns(tmp_path: Path) -> None:
    """As a spreadsheet writes it; columns that follow from others are read over."""
    path = tmp_path / "motors.csv"
    text = f"{HEADER},no_load_speed_rpm,kt_output_Nm_per_A_est\r\n\r\n{GOOD},57.3,bad\r\n,,,,,,\r\n"
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())
    (record,) = hp.load_catalog(path)
    assert (record.model, record.no_load_speed) == ("A", 6.0)
    assert record.flags == ("no stall current is known", "no source is known")


def test_empty_cells_are_unknown(tmp_path: Path) -> None:
    (record,) = hp.load_catalog(_write(tmp_path, HEADER, "A,12,1.5,,"))
    assert (record.no_load_speed, record.mass) == (None, None)
    assert record.unusable is not None


BAD_ROWS = [
    ("A,12,-1.5,6,0.05", "stall_torque_Nm", -1.5, "greater than 0"),
    ("A,12,0,6,0.05", "stall_torque_Nm", 0.0, "greater than 0"),
    ("A,12,strong,6,0.05", "stall_torque_Nm", "strong", "a number"),
    ('A,12,"1,5",6,0.05', "stall_torque_Nm", "1,5", "decimal point"),
    ("A,12,nan,6,0.05", "stall_torque_Nm", "nan", "a finite number"),
    ("A,12,1.5,inf,0.05", "no_load_speed_rad_s", "inf", "a finite number"),
    ("A,12,1.5,6,1e999", "mass_kg", "1e999", "a finite number"),
    ("A,,1.5,6,0.05", "voltage_V", "", "Every row needs it"),
    ("A,12,,6,0.05", "stall_torque_Nm", "", "Every row needs it"),
    (",12,1.5,6,0.05", "model", "", "name of a motor"),
    ("A,12,1.5,6", "", "4 cells", "5 cells"),
    ("A,12,1.5,6,0.05,7", "", "6 cells", "5 cells"),
]


@pytest.mark.parametrize(("row", "column", "value", "text"), BAD_ROWS, ids=str)
def test_bad_row(tmp_path: Path, row: str, column: str, value: object, text: str) -> None:
    """One message: file, line, column, value, what is allowed."""
    path = _write(tmp_path, HEADER, GOOD.replace("A", "B"), row)
    with pytest.raises(CatalogError, match=text) as caught:
        hp.load_catalog(path)
    error = caught.value
    assert (error.line, error.column, error.value, len(error.faults)) == (3, column, value, 1)
    assert str(error).startswith(f"{path}: line 3, ")


MORE = "voltage_min_V,voltage_max_V,rated_torque_mNm,armature_kgm2,armature_source,price,currency"
BAD_TOGETHER = [
    ("9,11,,,,,", "voltage_V", 12.0, "from voltage_min 9 to voltage_max 11 V"),
    ("13,,,,,,", "voltage_V", 12.0, "from voltage_min 13"),
    (",,1600,,,,", "rated_torque_mNm", 1600.0, "at most the stall torque, 1.5 N m"),
    (",,,0.01,,,", "armature_source", "", "where the armature is from"),
    (",,,-0.01,me,,", "armature_kgm2", -0.01, "greater than or equal to 0"),
    (",,,,,10,", "currency", "", "the price's currency"),
    (",,,,,-10,EUR", "price", -10.0, "greater than or equal to 0"),
]


@pytest.mark.parametrize(("cells", "column", "value", "text"), BAD_TOGETHER, ids=str)
def test_columns_that_contradict(
    tmp_path: Path, cells: str, column: str, value: object, text: str
) -> None:
    """In the units of the file: 1600 mN m of a motor that stalls at 1.5 N m."""
    path = _write(tmp_path, f"{HEADER},{MORE}", f"{GOOD},{cells}")
    with pytest.raises(CatalogError, match=text) as caught:
        hp.load_catalog(path)
    assert (caught.value.line, caught.value.column) == (2, column)
    assert caught.value.value == (pytest.approx(value) if isinstance(value, float) else value)


def test_all_bad_rows_are_told_at_once(tmp_path: Path) -> None:
    """One message per row, and a name that stands twice names the first."""
    path = _write(tmp_path, HEADER, GOOD, "B,12,x,6,y", "a,12.0,2,6,1", "C,12,1,-6,1")
    with pytest.raises(CatalogError) as caught:
        hp.load_catalog(path)
    assert [fault.line for fault in caught.value.faults] == [3, 4, 5]
    lines = str(caught.value).splitlines()
    assert len(lines) == 3
    assert "Line 2 has it already" in lines[1]


BAD_HEADERS = [
    ("model,voltage_V,stall_torque_Nm,mass_kg", "no_load_speed_rad_s", "must be there, as no_load"),
    (HEADER.replace("_Nm", ""), "stall_torque", "with its unit: stall_torque_Nm or"),
    (HEADER.replace("_kg", "_lb"), "mass_lb", "with its unit: mass_kg or mass_g"),
    (f"{HEADER},makr", "makr", "Perhaps maker"),
    (f"{HEADER},shop", "shop", "Remarks go into `note`"),
    (f"{HEADER},mass_kg", "mass_kg", "there once"),
    (HEADER.replace(",", ";"), "", "semicolons.*separated by commas"),
    (HEADER.replace(",", "\t"), "", "tabs"),
]


@pytest.mark.parametrize(("header", "column", "text"), BAD_HEADERS, ids=str)
def test_bad_header(tmp_path: Path, header: str, column: str, text: str) -> None:
    with pytest.raises(CatalogError, match=text) as caught:
        hp.load_catalog(_write(tmp_path, header, GOOD))
    assert (caught.value.line, caught.value.column) == (1, column)


def test_two_units_must_agree(tmp_path: Path) -> None:
    """6 rad/s are 57.3 turns a minute, not 60."""
    path = _write(tmp_path, f"{HEADER},no_load_speed_rpm", f"{GOOD},60")
    with pytest.raises(CatalogError, match="what no_load_speed_rad_s says, 57.3"):
        hp.load_catalog(path)


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"", "it is empty"),
        (b"\n\n", "it is empty"),
        (HEADER.encode(), "at least one row"),
        (b"\x89PNG\r\n\x1a\n\x00\x00", "text in UTF-8"),
        (b"model\x00,voltage_V", "must be text"),
        (HEADER.encode() + b'\n"A,12', "comma-separated values"),
    ],
)
def test_file_that_is_none(tmp_path: Path, data: bytes, text: str) -> None:
    path = tmp_path / "motors.csv"
    path.write_bytes(data)
    with pytest.raises(CatalogError, match=text) as caught:
        hp.load_catalog(path)
    assert caught.value.source == str(path)


def test_file_that_is_not_there(tmp_path: Path) -> None:
    for path in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(CatalogError, match="a readable file"):
            hp.load_catalog(path)
