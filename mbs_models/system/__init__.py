"""Multibody systems in exudyn: built, linearised, read back."""
