"""Every pair of contact laws: cost, creep, energy."""
