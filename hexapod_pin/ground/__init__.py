"""Ground: its shape (`terrain`) and the contact laws between it and the feet (`contact`)."""

from hexapod_pin.ground import contact, terrain

__all__ = ["contact", "terrain"]
