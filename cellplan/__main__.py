"""``python -m cellplan``."""

from cellplan.cli.main import main

if __name__ == "__main__":
    main()
