"""Many characterisations: a grid, the engines that run it, the store that keeps it."""
