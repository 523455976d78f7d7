"""`crosscheck run`: all routes of a drivetrain against each other."""
