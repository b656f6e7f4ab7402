"""S2's study: one file of runs; its figures and its page are drawn from that file."""
