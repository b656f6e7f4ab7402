"""The parts of loading a robot: legs, feet, posture, provenance, Pinocchio's model."""
