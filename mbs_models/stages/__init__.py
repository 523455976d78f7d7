"""The stage types: one module for each."""
