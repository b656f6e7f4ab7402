"""Hard cases: what they try, how they run, what the answer is."""
