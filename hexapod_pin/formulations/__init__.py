"""The equations of motion in other forms than the core's: to be compared with it."""
