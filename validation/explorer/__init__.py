"""`crosscheck explore`: a page that computes FRFs in the browser."""
