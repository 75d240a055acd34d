"""Do tests notice when the program is changed? Mutants of central modules, and who catches them."""
