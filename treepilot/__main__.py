"""The command `treepilot`, also as `python -m treepilot`."""

from missions.cli.app import main

if __name__ == "__main__":
    main()
