"""Runs in time: what is simulated, estimated and reported."""
