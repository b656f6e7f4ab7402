"""The body of `hexapod-pin verify`: run, print one table, say whether all agree."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hexapod_pin.commands.output_files import writable
from hexapod_pin.commands.progress import progress_bar
from hexapod_pin.errors import HexapodError, UnknownNameError
from hexapod_pin.validation.checks.check import Check, Row, all_checks, run_checks
from hexapod_pin.validation.checks.table import markdown, summary, table


class VerificationError(HexapodError):
    """Two formulations disagree; `rows` holds what was found."""

    def __init__(self, rows: Sequence[Row]) -> None:
        """Name the rows that failed."""
        self.rows = list(rows)
        failed = [row.what for row in rows if not row.passed and not row.skipped]
        super().__init__(f"{len(failed)} comparison(s) failed: {'; '.join(failed)}")


def verify(*, everything: bool = False, only: str | None = None, out: Path | None = None) -> str:
    """Run the comparisons and return their table.

    Args:
        everything: MuJoCo, where it is installed, and the hard cases too.
        only: names of checks, separated by commas; None runs all.
        out: Markdown file to write the table to.

    Raises:
        UnknownNameError: no such check.
        VerificationError: a comparison failed; the table is printed first.
    """
    import typer

    path = None if out is None else writable("--out", out)
    chosen = _chosen(all_checks(), only)
    with progress_bar("verifying") as progress:
        rows = run_checks(chosen, progress)
    if everything:
        from hexapod_pin.validation.checks.more import more_rows

        with progress_bar("hard cases") as progress:
            rows += more_rows(progress)
    typer.echo(table(rows))
    if path is not None:
        path.write_text(f"{markdown(rows)}\n{summary(rows)}\n", encoding="utf-8")
        typer.echo(f"wrote {path}")
    if any(not row.passed and not row.skipped for row in rows):
        raise VerificationError(rows)
    return summary(rows)


def _chosen(checks: Sequence[Check], only: str | None) -> list[Check]:
    if only is None:
        return list(checks)
    known = {check.name: check for check in checks}
    names = [name.strip() for name in only.split(",")]
    for name in names:
        if name not in known:
            raise UnknownNameError("check", name, list(known))
    return [known[name] for name in names]
