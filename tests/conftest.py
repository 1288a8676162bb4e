"""Settings of all tests."""

import hypothesis

# No test is timed: on a busy machine a deadline would fail what is right.
hypothesis.settings.register_profile("untimed", deadline=None)
hypothesis.settings.load_profile("untimed")
