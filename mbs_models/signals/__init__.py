"""Signals a drivetrain is excited with: a force over time, known at any instant."""
