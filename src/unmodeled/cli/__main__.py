"""``python -m unmodeled.cli``."""

from unmodeled.cli import main

main()
