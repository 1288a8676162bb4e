"""Filters flown against simulated truth: scenarios, Monte-Carlo runs, tables."""
