"""`crosscheck truncate`: which modes each stage needs, guaranteed."""
