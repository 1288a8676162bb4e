"""Configuration, metrics and the jobs that join data, learners and reports."""
