"""What every page, table and file of numbers is made with."""
