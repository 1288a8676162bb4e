"""Trajectories: bodies, initial conditions, propagation, noise, splits and readers."""
