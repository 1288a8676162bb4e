"""Kalman filters: pure functions on immutable states, batched over Monte-Carlo runs."""
