"""Two routes, a value, a tolerance: the verdicts, and what explains a disagreement."""
