"""What a drivetrain is made of: `part.Part`, and one module for each type of it."""
