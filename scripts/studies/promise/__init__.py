"""Whether the accuracy of a run is kept, on scenes that nobody tuned to."""
