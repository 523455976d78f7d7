"""Eigensolution, kinds of modes, their energy."""
