"""`crosscheck reduce`: which reduction of a stage meets a tolerance with the fewest coordinates."""
