"""A drivetrain's parameters, its model file, and where its parts stand."""
