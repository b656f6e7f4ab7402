"""Independent answers that the tests and studies compare the package with."""
