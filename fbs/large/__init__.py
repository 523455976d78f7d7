"""Chains of many parts, sparse systems, Krylov subspaces."""
