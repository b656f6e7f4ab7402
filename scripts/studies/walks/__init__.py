"""Walks, motors and robots' files beside what they should give."""
