"""The person: a body of capsules on articulated arms, its motions and their prediction."""
