"""The same robot, servos and held set-points in other engines, where they are installed."""
