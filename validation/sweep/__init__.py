"""Parameters varied over many samples: FRFs, natural frequencies and metrics as a table."""
