"""The drivetrain drawn, its mode shapes and energies."""
