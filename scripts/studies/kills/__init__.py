"""Commands, sweeps and walks that are killed at random moments."""
