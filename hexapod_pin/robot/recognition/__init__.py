"""Finding the robot in a URDF: which way is forward, its legs, its feet, how it stands."""
