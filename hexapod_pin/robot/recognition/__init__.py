"""Finding the robot in a URDF: its forward direction, legs, feet and standing posture."""
