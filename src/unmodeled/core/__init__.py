"""Foundations without physics: parameters, frames, time, constants, seeds, errors, provenance."""
