"""Seeds that are drawn when tests run, printed, and can be given to run a test again."""

import os
import secrets

VARIABLE = "DRAKE_DRESS_TEST_SEED"


def drawn_seed(below: int = 2**32) -> int:
    """Returns a seed: that of the environment variable if it is set, else a new one.

    It is printed, with how to run the test again; pytest shows that where a test fails.
    """
    given = os.environ.get(VARIABLE)
    seed = secrets.randbelow(below) if given is None else int(given)
    if not 0 <= seed < below:
        raise ValueError(f"{VARIABLE} is {seed}, expected 0 or more and less than {below}")
    print(f"seed {seed}: to run this again, set {VARIABLE}={seed}")
    return seed
