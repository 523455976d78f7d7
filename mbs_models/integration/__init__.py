"""What integrating exudyn systems in time takes: integrators, sensors, stores, steady states."""
