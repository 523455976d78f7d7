"""Records, their spectra, and FRFs estimated from them."""
