"""Which learner to choose, and how sure: statistics over the runs of a sweep."""
