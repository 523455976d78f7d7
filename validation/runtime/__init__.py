"""What commands stand on: folders, workers, pieces on disk, interruptions, exit codes."""
