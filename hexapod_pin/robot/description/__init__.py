"""URDF files: reading, checking, and writing them from tables of dimensions."""
