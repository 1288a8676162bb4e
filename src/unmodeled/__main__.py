"""``python -m unmodeled``."""

from unmodeled.cli import main

if __name__ == "__main__":
    main()
