"""Code of the user's own that a command imports: a file with its controllers."""

from __future__ import annotations

import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from hexapod_pin.errors import ParameterError


def import_file(option: str, path: Path) -> None:
    """Import a Python file, with its own folder as the first place to import from.

    Raises:
        ParameterError: no such Python file, or it cannot be imported; names the option.
    """
    try:
        spec = spec_from_file_location(path.stem, path) if path.is_file() else None
    except (OSError, ValueError) as error:
        raise ParameterError(option, str(path), "the path of a Python file", str(error)) from error
    if spec is None or spec.loader is None:
        raise ParameterError(option, str(path), "an existing Python file (.py)")
    module = module_from_spec(spec)
    sys.modules.setdefault(path.stem, module)
    sys.path.insert(0, str(path.parent.resolve()))
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        reason = f"{type(error).__name__}: {error}"
        raise ParameterError(option, str(path), "a file that Python can import", reason) from error
