"""Mutation testing: do the tests notice changes of central modules?"""
