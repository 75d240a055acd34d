"""What a run leaves behind: its log, the verdict on it, and pages to look at."""
