"""Write urdf/kharagpur.urdf and urdf/athena.urdf from their tables, or check that they agree."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from hexapod_pin.atomic_file import write_atomically
from hexapod_pin.robot.description.paper_robots import PAPER_ROBOTS

FOLDER = Path(__file__).resolve().parent.parent / "urdf"


def main(argv: Sequence[str] | None = None) -> int:
    """Write the files; with --check compare only. Return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="exit 1 where file and table disagree")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="where the files are")
    options = parser.parse_args(argv)
    stale = [path for path in _paths(options.folder) if not _agrees(path)]
    if options.check:
        for path in stale:
            print(f"{path}: differs from its table; run scripts/build_urdf.py", file=sys.stderr)
        return 1 if stale else 0
    for path in _paths(options.folder):
        write_atomically(path, PAPER_ROBOTS[path.stem].urdf())
        print(f"wrote {path}")
    return 0


def _paths(folder: Path) -> list[Path]:
    """Return one path per table."""
    return [folder / f"{name}.urdf" for name in PAPER_ROBOTS]


def _agrees(path: Path) -> bool:
    """Say whether the file holds exactly what its table gives."""
    return path.exists() and path.read_text(encoding="utf-8") == PAPER_ROBOTS[path.stem].urdf()


if __name__ == "__main__":
    sys.exit(main())
