"""Slow, obvious implementations and sourced numbers that the tests compare with."""
