"""Gear drivetrains as exudyn multibody systems, placed by geometry."""
