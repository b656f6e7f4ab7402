"""S1's foot control beside conventional control, and gains that stand still."""
