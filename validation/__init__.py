"""Comparison of the routes, verdicts and reports."""
