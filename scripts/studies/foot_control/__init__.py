"""S1's foot control beside conventional control, on unknown ground, and gains that stand still."""
