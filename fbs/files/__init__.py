"""FRFs and records in files."""
