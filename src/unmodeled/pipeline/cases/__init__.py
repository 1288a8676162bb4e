"""Case files: a model, measurements, candidates."""
