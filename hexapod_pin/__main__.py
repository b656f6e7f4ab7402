"""`python -m hexapod_pin` is `hexapod-pin`."""

from hexapod_pin.cli import main

if __name__ == "__main__":
    main()
