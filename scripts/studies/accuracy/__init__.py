"""What an accuracy promises, and how far a reference, a peak or a clock is right."""
