"""The ways to a matrix or an FRF."""
