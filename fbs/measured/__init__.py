"""What is known of measured FRFs: their quality, their uncertainty, their axes."""
