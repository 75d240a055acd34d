"""What a station hears, whether it may be believed, and what follows if not."""
