"""Code of the user's own that a command imports: a file with its controllers."""

from __future__ import annotations

import sys
from importlib.machinery import PathFinder
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from hexapod_pin.errors import ParameterError
from hexapod_pin.stop_signals import is_stop
from hexapod_pin.user_file import TEXT_BYTES, read_bytes, reason_of, user_path

PYTHON = "an existing Python file (.py)"


def import_file(option: str, path: Path) -> None:
    """Import a Python file; its own folder becomes the last place to import from.

    The folder stays there: a controller may import its neighbours when it is called. It is the last
    one, so that no file in it stands in for a module of Python or of an installed package.

    Raises:
        ParameterError: no such Python file, or it cannot be imported, whatever it raises and also
            where it exits; names the option.
        FileConflictError: the command is going to write the file.
        KeyboardInterrupt: Ctrl-C while it is imported.
    """
    file = user_path(path)
    spec = spec_from_file_location(_name(file.stem), file) if file.suffix == ".py" else None
    if spec is None:
        raise ParameterError(option, str(path), PYTHON)
    try:
        content = read_bytes(file, TEXT_BYTES)
    except (OSError, ValueError) as error:
        raise ParameterError(option, str(path), PYTHON, reason_of(error)) from error
    module, places = module_from_spec(spec), list(sys.path)
    sys.modules[spec.name] = module
    sys.path.append(str(file.parent.resolve()))
    try:
        exec(compile(content, str(file), "exec"), vars(module))
    except BaseException as error:
        sys.modules.pop(spec.name, None)
        sys.path[:] = places
        if isinstance(error, KeyboardInterrupt) and is_stop(error):
            raise
        allowed = "a file that Python can import"
        raise ParameterError(option, str(path), allowed, _described(error)) from error


def _name(stem: str) -> str:
    """Return the name of a file's module: its own, or one that no other module has."""
    known = stem in sys.modules or stem in sys.stdlib_module_names
    if known or not stem.isidentifier() or PathFinder.find_spec(stem) is not None:
        return f"_imported_{stem}"
    return stem


def _described(error: BaseException) -> str:
    """Return type and text of an exception; its text may raise one itself."""
    kind = type(error).__name__
    try:
        return f"{kind}: {error}" if str(error) else kind
    except Exception:
        return kind
