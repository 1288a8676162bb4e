"""What the runs of a sweep show together: bands, fits, boundaries; numbers for figures."""
