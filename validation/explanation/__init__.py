"""`crosscheck explain`: which statement about the model would make two results equal."""
