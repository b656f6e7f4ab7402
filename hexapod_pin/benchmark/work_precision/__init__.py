"""Error against cost of every method and engine on one task."""
