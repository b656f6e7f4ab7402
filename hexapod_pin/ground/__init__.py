"""Ground: its shape (`terrain`) and the contact laws between it and the feet (`contact`)."""
