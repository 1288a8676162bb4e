"""Effects written once as symbols; accelerations, orbits and partials are compiled from them."""
