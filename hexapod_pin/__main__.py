"""`python -m hexapod_pin` is `hexapod-pin`."""

from hexapod_pin.commands.app import main

if __name__ == "__main__":
    main()
