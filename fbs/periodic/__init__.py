"""Systems whose springs vary periodically: steady states, extremes, stability."""
