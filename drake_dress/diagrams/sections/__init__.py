"""The sections of a scenario as the values that the diagram's builders take: a module each."""
