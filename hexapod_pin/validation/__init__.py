"""Evidence: hard cases with reference answers, comparisons of formulations, random extremes."""
