"""Names that installed packages add: robots, controllers, contacts and grounds.

A package lists them as entry points of four groups. They are read where a name is looked for that
the package does not have, and one is imported when it is used; docs/extending.md describes them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hexapod_pin.log import LOG
from hexapod_pin.user_code import UserCode

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

ROBOTS, CONTROLLERS = "hexapod_pin.robots", "hexapod_pin.controllers"
CONTACTS, TERRAINS = "hexapod_pin.contacts", "hexapod_pin.terrains"
"""The groups."""


def plugin(group: str, name: str) -> Any:
    """Return what an installed package has under a name; None where none has it.

    Of several packages that have it, the first by the name of the package counts.

    Raises:
        UserCodeError: the entry point cannot be loaded; it names the entry point and its package.
    """
    for entry in _entries(group):
        if entry.name == name:
            with UserCode(_described(entry)):
                found = entry.load()
            LOG.info("loaded %s", _described(entry))
            return found
    return None


def plugin_result(group: str, name: str, wanted: type | tuple[type, ...], **arguments: Any) -> Any:
    """Return what the function makes that an installed package has under a name.

    Args:
        group: one of the four.
        name: of the entry point. What it refers to may be the result itself.
        wanted: type of the result.
        arguments: of the function.

    Returns:
        The result; None where no package has the name.

    Raises:
        UserCodeError: the entry point cannot be loaded, its function raises, or the result is of
            another type; it names the entry point and its package.
        HexapodError: of the function, as it is.
    """
    found = plugin(group, name)
    if found is None or (isinstance(found, wanted) and not arguments):
        return found
    entry = next(one for one in _entries(group) if one.name == name)
    with UserCode(_described(entry)):
        result = found(**arguments)
        if not isinstance(result, wanted):
            kinds = " or a ".join(
                kind.__name__ for kind in (wanted if isinstance(wanted, tuple) else (wanted,))
            )
            raise TypeError(f"it gives a {type(result).__name__}, not a {kinds}")
    return result


def plugin_names(group: str) -> list[str]:
    """Return the names that installed packages add to a group, sorted; nothing is imported."""
    return sorted({entry.name for entry in _entries(group)})


def _entries(group: str) -> list[EntryPoint]:
    """Return the entry points of a group in the order of their packages' names."""
    from importlib.metadata import entry_points

    return sorted(entry_points(group=group), key=lambda one: (one.dist.name if one.dist else "",))


def _described(entry: EntryPoint) -> str:
    """Return an entry point as text: its name, what it refers to, group and package."""
    package = f" of package {entry.dist.name} {entry.dist.version}" if entry.dist else ""
    return f"entry point {entry.name} = {entry.value!r} in {entry.group!r}{package}"
