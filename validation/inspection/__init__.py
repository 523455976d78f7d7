"""`crosscheck check` and `frf`: one model looked at."""
