"""The papers' own equations beside the core's: `rigid` and `inverse` (S2), `maximal` (S1)."""
