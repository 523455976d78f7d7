"""Gears that excite: varying meshes and their phases, operating points, and what they cause."""
