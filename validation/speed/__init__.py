"""The speed range: steady vibration and stability of a gearbox over the speed of its input."""
