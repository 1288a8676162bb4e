"""The standing table of skill: every learner, field, volume and level of noise."""
