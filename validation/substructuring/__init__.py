"""`crosscheck couple`, `decouple`, `identify`: substructuring of FRFs from files."""
