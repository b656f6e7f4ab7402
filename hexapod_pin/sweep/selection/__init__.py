"""Which motors carry a robot: walks with each motor's mass, inertia and torque-speed line."""
