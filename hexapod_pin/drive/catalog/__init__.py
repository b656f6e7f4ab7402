"""Catalogues of motors: data sheets as rows, the package's own and yours."""

from hexapod_pin.drive.catalog.catalog import Catalog
from hexapod_pin.drive.catalog.motor_record import MotorRecord
from hexapod_pin.drive.catalog.read import load_catalog

__all__ = ["Catalog", "MotorRecord", "load_catalog"]
