"""Which effect is missing: scores, thresholds, classes, the loop."""
