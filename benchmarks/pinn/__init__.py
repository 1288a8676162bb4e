"""The published protocol of the physics-informed gravity networks, on our own code."""
