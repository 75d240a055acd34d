"""Seeds drawn when tests run; they are printed and can be set to repeat a test."""

import os
import secrets

VARIABLE = "DRAKE_DRESS_TEST_SEED"


def drawn_seed(below: int = 2**32) -> int:
    """Returns the seed of the environment variable if it is set, else a new one.

    It is printed together with the setting that repeats the test; pytest shows this for failures.
    """
    given = os.environ.get(VARIABLE)
    seed = secrets.randbelow(below) if given is None else int(given)
    if not 0 <= seed < below:
        raise ValueError(f"{VARIABLE} is {seed}, expected 0 or more and less than {below}")
    print(f"seed {seed}: to run this again, set {VARIABLE}={seed}")
    return seed
