"""Run the ``hwid`` command as ``python -m hwid_cli``."""

from hwid_cli.cli.main import main

if __name__ == "__main__":
    main()
