"""S2's appendix: feet that stick to rigid ground, plastic impact, a walk of phases and impacts."""
