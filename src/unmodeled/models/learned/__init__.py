"""Learners: one contract, one file each."""
