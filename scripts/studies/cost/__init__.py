"""What a step, a walk or one evaluation costs, each beside its error."""
