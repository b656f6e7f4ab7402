"""Print requested against delivered restitution of every law, as it stands in the documents."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from hexapod_pin.commands.contact_report import restitution_table


def main(argv: Sequence[str] | None = None) -> int:
    """Print the table. Return the exit status."""
    argparse.ArgumentParser(description=__doc__).parse_args(argv)
    print(restitution_table())
    return 0
