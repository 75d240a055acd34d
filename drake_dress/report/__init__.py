"""Results of a run: its log, its verdict, and HTML pages."""
